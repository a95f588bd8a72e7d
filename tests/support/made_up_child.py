"""A made-up engine in a Python of its own: MuJoCo, of which little is told.

It is the template for an engine of yours that cannot be installed beside this package: the
functions and the class that `statemachine/backends/served/child_server.py` asks for. `load`
below is for this side: the Python and this file make a backend.
"""

from __future__ import annotations

import numpy as np

UNAVAILABLE = ("qfrc_contact", "qfrc_friction", "qfrc_limit", "qfrc_equality", "contacts")
TOLD = (
    *("xpos", "xquat", "site_xpos", "site_xmat", "qacc"),
    *("qfrc_bias", "qfrc_actuator", "qfrc_passive", "qfrc_constraint"),
)


def load(file, text, names):
    """Read a file; those of its numbers that this engine has."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text) if text else mujoco.MjModel.from_xml_path(file)
    known = [name for name in names if hasattr(*place_of(model, name))]
    return (
        model,
        {"version": f"made up on {mujoco.__version__}"},
        {name: np.asarray(getattr(*place_of(model, name))) for name in known},
    )


def edit(model, edits, flags):
    """Make a model with other numbers; it has no flags."""
    for name, values in edits.items():
        place, field = place_of(model, name)
        now = getattr(place, field)
        setattr(place, field, np.reshape(values, np.shape(now)).astype(np.asarray(now).dtype))


def place_of(model, name):
    """Return the attribute that holds a number."""
    place, _, field = name.rpartition(".")
    return (model.opt if place else model), field


class Simulation:
    """One simulation."""

    unavailable = UNAVAILABLE

    def __init__(self, model):
        import mujoco

        self.engine, self.model, self.data = mujoco, model, mujoco.MjData(model)
        self.memory, self.kept_memory = [("warmstart", model.nv)], ["warmstart"]

    def place(self, vector):
        data, nq, nv = self.data, self.model.nq, self.model.nv
        self.engine.mj_resetData(self.model, data)
        data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = np.split(vector, [nq, nq + nv])

    def state(self):
        return np.concatenate([self.data.qpos, self.data.qvel, self.data.qacc_warmstart])

    def command(self, ctrl):
        data, nu = self.data, len(self.data.ctrl)
        data.ctrl[:] = ctrl[:nu]
        data.mocap_pos.flat, data.mocap_quat.flat = np.split(ctrl[nu:], [data.mocap_pos.size])

    def advance(self, steps, fastest):
        for k in range(1, steps + 1):
            self.engine.mj_step(self.model, self.data)
            if not (np.abs(self.data.qpos) < 1e10).all() or not (
                np.linalg.norm(self.data.qvel) < fastest
            ):
                return k
        return steps

    def forward(self):
        self.engine.mj_forward(self.model, self.data)

    def derived(self, _vector):
        return {name: getattr(self.data, name) for name in TOLD}
