"""A release of MuJoCo, as `_child_server` asks it, in the Python of that release's environment.

It needs NumPy and MuJoCo only, on Python 3.9 or later, and imports nothing of this package. What is
the same in every release the other modules take from here.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np

HUGE = 1e10
POSES = ("xpos", "xquat", "site_xpos", "site_xmat")
FORCES = ("qacc", "qfrc_bias", "qfrc_actuator", "qfrc_passive", "qfrc_constraint")
_KINDS = mujoco.mjtConstraint
KINDS = {"disable": mujoco.mjtDisableBit, "enable": mujoco.mjtEnableBit}
SPLIT = {"mjDSBL_PASSIVE": ("mjDSBL_SPRING", "mjDSBL_DAMPER")}  # flags that became two later
_ALL = mujoco.mjtWarning
ALARMS = (_ALL.mjWARN_BADQPOS, _ALL.mjWARN_BADQVEL, _ALL.mjWARN_BADQACC)
PARTS = {
    "qfrc_contact": (
        _KINDS.mjCNSTR_CONTACT_FRICTIONLESS,
        _KINDS.mjCNSTR_CONTACT_PYRAMIDAL,
        _KINDS.mjCNSTR_CONTACT_ELLIPTIC,
    ),
    "qfrc_friction": (_KINDS.mjCNSTR_FRICTION_DOF, _KINDS.mjCNSTR_FRICTION_TENDON),
    "qfrc_limit": (_KINDS.mjCNSTR_LIMIT_JOINT, _KINDS.mjCNSTR_LIMIT_TENDON),
    "qfrc_equality": (_KINDS.mjCNSTR_EQUALITY,),
}


class Simulation:
    """One MjData, and how its State is put and read."""

    def __init__(self, model) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        self.sizes = [model.nq, model.nv, model.nv, model.na]

    def place(self, vector) -> None:
        """Take qpos, qvel, the warm start and act, so that nothing of before is left."""
        mujoco.mj_resetData(self.model, self.data)
        parts = np.split(vector, np.cumsum(self.sizes)[:-1])
        for name, part in zip(("qpos", "qvel", "qacc_warmstart", "act"), parts):  # noqa: B905
            getattr(self.data, name)[:] = part

    def state(self):
        """The same four, in a row."""
        data = self.data
        return np.concatenate([data.qpos, data.qvel, data.qacc_warmstart, data.act])

    def command(self, ctrl) -> None:
        """Take a command."""
        self.data.ctrl[:] = ctrl

    def advance(self, steps: int, fastest: float) -> int:
        """Take engine steps up to one after which a coordinate is beyond its bound; how many.

        All at once; if they end beyond it, or the engine has warned, again one by one. A release
        that begins anew by itself has warned: then qpos is NaN, as nobody may go on from there.
        """
        model, data = self.model, self.data
        if steps > 1:
            start, ctrl = self.state(), data.ctrl.copy()
            mujoco.mj_step(model, data, steps)
            if self._near(fastest) and not self.warned():
                return steps
            self.place(start)
            self.command(ctrl)
        for k in range(1, steps + 1):
            mujoco.mj_step(model, data)
            if self.warned():
                data.qpos[:] = np.nan
            if not self._near(fastest):
                return k
        return steps

    def _near(self, fastest: float) -> bool:
        qpos, qvel = self.data.qpos, self.data.qvel
        return bool(qpos.dot(qpos) < HUGE * HUGE and qvel.dot(qvel) < fastest * fastest)

    def warned(self) -> bool:
        """Whether the engine has found a number bad since a state was placed."""
        return any(self.data.warning[int(kind)].number for kind in ALARMS)

    def forward(self) -> None:
        """Derive of the present."""
        mujoco.mj_forward(self.model, self.data)

    def derived(self):
        """Every derived array, by name, then those of the contacts."""
        model, data = self.model, self.data
        arrays = {name: getattr(data, name) for name in POSES + FORCES}
        arrays.update({part: constraint_part(model, data, part) for part in PARTS})
        arrays.update(contact_arrays(model, data))
        return arrays


def contact_arrays(model, data):
    """Arrays of the contacts, by name; the forces are along the axes of each."""
    listed, force = data.contact, np.zeros((data.ncon, 6))
    for k in range(data.ncon):
        mujoco.mj_contactForce(model, data, k, force[k])
    return {
        "geom": np.array(listed.geom, dtype=np.int64).reshape(-1, 2),
        "dist": np.array(listed.dist),
        "pos": np.array(listed.pos).reshape(-1, 3),
        "frame": np.array(listed.frame).reshape(-1, 3, 3),
        "force": force[:, :3],
        "torque": force[:, 3:],
    }


def constraint_part(model, data, part):
    """The forces (nv,) of the rows of constraints that make up one of `PARTS`."""
    total = np.zeros(model.nv)
    if data.nefc:
        rows = np.isin(data.efc_type, [int(kind) for kind in PARTS[part]])
        mujoco.mj_mulJacTVec(model, data, total, np.where(rows, data.efc_force, 0.0))
    return total


def load(file, text, names):
    """Compile a file; its flags, and the numeric fields that this release has of those names."""
    if hasattr(mujoco, "set_mju_user_warning"):  # else it writes a file where it runs
        mujoco.set_mju_user_warning(lambda text: None)
    kind = mujoco.MjModel
    model = kind.from_xml_string(text) if text else kind.from_xml_path(file)
    if hasattr(mujoco.mjtDisableBit, "mjDSBL_AUTORESET"):
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    fields = {}
    for name in names:
        holder, field = held(model, name)
        value = getattr(holder, field, None)
        if isinstance(value, (np.ndarray, int, float)):
            fields[name] = np.asarray(value, float)
    memory = [("warmstart", model.nv)] + [("act", model.na)] * bool(model.na)
    flags = {f"opt.{kind}flags": flags_of(model, kind) for kind in KINDS}
    return model, {"version": mujoco.__version__, "memory": memory, "flags": flags}, fields


def edit(model, edits, flags):
    """A copy of a model with other values in some fields, and these flags."""
    model = copy.copy(model)
    for name, value in edits.items():
        holder, field = held(model, name)
        now = getattr(holder, field)
        if isinstance(now, np.ndarray):
            now[...] = value.reshape(now.shape)
        else:
            setattr(holder, field, type(now)(value))
    for name, wanted in flags.items():
        holder, field = held(model, name)
        kinds = KINDS[field[: -len("flags")]].__members__
        merged = {old for old, new in SPLIT.items() if old in kinds and set(new) <= set(wanted)}
        unknown = [f for f in wanted if f not in kinds and not any(f in SPLIT[o] for o in merged)]
        if unknown:
            raise ValueError("it has no flag " + ", ".join(unknown))
        setattr(holder, field, sum(int(kinds[f]) for f in kinds if f in merged.union(wanted)))
    return model


def flags_of(model, kind):
    """Names of the flags of a model that are set; kind: "disable" or "enable"."""
    bits = getattr(model.opt, f"{kind}flags")
    members = KINDS[kind].__members__.items()
    return [name for name, bit in members if "BL_" in name and bits & int(bit)]  # not mjNDISABLE


def held(model, name):
    """Whose attribute a field is, and its name there: "opt.timestep", "body_mass"."""
    holder, _, field = name.rpartition(".")
    return (getattr(model, holder) if holder else model), field
