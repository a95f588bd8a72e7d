"""A release of MuJoCo, as `child_server` asks it, in the Python of that release's environment.

It needs NumPy and MuJoCo only, on Python 3.9 or later, and imports nothing of this package: it runs
the file beside it.
"""

from __future__ import annotations

import copy
import os
import runpy
import tempfile

import mujoco
import numpy as np


def _beside(name):
    """Run a file that lies beside this one, and return what it defines."""
    return runpy.run_path(os.path.join(os.path.dirname(os.path.abspath(__file__)), name))


_parts = _beside("release_parts.py")
PARTS, contact_arrays = _parts["PARTS"], _parts["contact_arrays"]
constraint_part, owner_of_field = _parts["constraint_part"], _parts["owner_of_field"]

HUGE = 1e10
POSES = ("xpos", "xquat", "site_xpos", "site_xmat")
FORCES = ("qacc", "qfrc_bias", "qfrc_actuator", "qfrc_passive", "qfrc_constraint")
# Kinds of elements, as the arrays of their names call them.
NAMED = ("body", "jnt", "geom", "site", "tendon", "eq", "actuator", "key")
# What a state is, by prefix and name.
STATE = ("", "qpos"), ("", "qvel"), ("qacc_", "warmstart"), ("", "act")
KINDS = {"disable": mujoco.mjtDisableBit, "enable": mujoco.mjtEnableBit}
SPLIT = {"mjDSBL_PASSIVE": ("mjDSBL_SPRING", "mjDSBL_DAMPER")}  # flags that became two later
_ALL = mujoco.mjtWarning
ALARMS = [int(kind) for kind in (_ALL.mjWARN_BADQPOS, _ALL.mjWARN_BADQVEL, _ALL.mjWARN_BADQACC)]


class Simulation:
    """One MjData, and how its State is put and read."""

    unavailable = ()

    def __init__(self, model) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        parts = {name: getattr(self.data, f"{prefix}{name}").ravel() for prefix, name in STATE}
        self.parts = [part for part in parts.values() if len(part)]  # of its own memory
        self.cuts = np.cumsum([len(part) for part in self.parts])[:-1]
        self.alarms = memoryview(self.data.warning.number)[ALARMS[0] : ALARMS[-1] + 1]
        self.memory = [(name, len(parts[name])) for _, name in STATE[2:] if len(parts[name])]
        self.kept_memory = [name for name, _ in self.memory]

    def place(self, vector) -> None:
        """Take qpos, qvel and the memory, so that nothing of before is left."""
        mujoco.mj_resetData(self.model, self.data)
        for part, values in zip(self.parts, np.split(vector, self.cuts)):  # noqa: B905
            part[:] = values

    def state(self):
        """Return the state in one row."""
        return np.concatenate(self.parts)

    def command(self, ctrl) -> None:
        """Take a command: ctrl, then where mocap bodies are."""
        data, nu = self.data, self.model.nu
        self.commands, data.ctrl[:] = ctrl, ctrl[:nu]
        data.mocap_pos.flat, data.mocap_quat.flat = np.split(ctrl[nu:], [3 * self.model.nmocap])

    def advance(self, steps: int, fastest: float) -> int:
        """Take engine steps up to one after which a coordinate is beyond its bound; how many.

        All at once; if they end beyond it, or the engine has warned, again one by one. A release
        that begins anew by itself has warned: then qpos is NaN, as nobody may go on from there.
        """
        model, data = self.model, self.data
        if steps > 1:
            start = self.state()
            mujoco.mj_step(model, data, steps)
            if self._near(fastest) and not self.warned():
                return steps
            self.place(start)
            self.command(self.commands)
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
        """Tell whether the engine has found a number bad since a state was placed."""
        return any(self.alarms)

    def forward(self) -> None:
        """Derive of the present."""
        mujoco.mj_forward(self.model, self.data)

    def derived(self, _vector):
        """Return every derived array, by name, then those of the contacts."""
        model, data = self.model, self.data
        arrays = {name: getattr(data, name) for name in POSES + FORCES}
        arrays.update({part: constraint_part(model, data, part) for part in PARTS})
        arrays.update(contact_arrays(model, data))
        return arrays


def load(file, text, names, read=None):
    """Compile a file; its flags, and the numeric fields that this release has of those names."""
    model = compiled(file, text, read)
    if hasattr(mujoco.mjtDisableBit, "mjDSBL_AUTORESET"):
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    fields = {}
    for name in names:
        holder, field = owner_of_field(model, name)
        value = getattr(holder, field, None)
        if isinstance(value, (np.ndarray, int, float)):
            fields[name] = np.asarray(value, float)
    flags = {f"opt.{kind}flags": flags_of(model, kind) for kind in KINDS}
    facts = {"version": mujoco.__version__, "flags": flags, "names": names_of(model)}
    return model, facts, fields


def compiled(file, text, read=None):
    """Compile a file, or its text where that is not empty, or the file with options of reading."""
    if hasattr(mujoco, "set_mju_user_warning"):  # else it writes a file where it runs
        mujoco.set_mju_user_warning(lambda text: None)
    if read is not None:
        return spec_with_options(file, read).compile()
    make = mujoco.MjModel.from_xml_string if text else mujoco.MjModel.from_xml_path
    return make(text or file)


def written(file, text, read=None):
    """Return as MJCF what this release reads in a file, or in its text."""
    if read is not None:
        spec = spec_with_options(file, read)
        spec.compile()
        return spec.to_xml()
    model = compiled(file, text)  # anew: what is written is what was compiled last
    with tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "read.xml")
        mujoco.mj_saveLastXML(name, model)
        with open(name, encoding="utf-8") as lines:
            return lines.read()


def names_of(model):
    """Return the names of the elements of a model, by kind; "" of one without a name."""
    names = {}
    for kind in NAMED:
        starts = getattr(model, "name_" + kind + "adr").tolist()
        ends = [model.names.index(b"\0", start) for start in starts]
        texts = [model.names[start:end] for start, end in zip(starts, ends)]  # noqa: B905
        names[kind] = [text.decode(errors="replace") for text in texts]
    return names


def spec_with_options(file, read):
    """Return the spec of a file that is read with options."""
    return _beside("release_options.py")["spec_with_options"](file, **read)


def edit(model, edits, flags):
    """Write other values into some fields of a model, and these flags.

    Raises:
        ValueError: The release has no such flag.
    """
    for name, value in edits.items():
        holder, field = owner_of_field(model, name)
        now = getattr(holder, field)
        if isinstance(now, np.ndarray):
            now[...] = value.reshape(now.shape)
        else:
            setattr(holder, field, type(now)(value))
    if "dof_M0" in edits:  # constants follow; the mean, which 3.3 scales with, stays in 4.0
        other = copy.copy(model)
        mujoco.mj_setConst(other, mujoco.MjData(other))
        model.stat.meaninertia = other.stat.meaninertia
        model.flexedge_invweight0[:] = other.flexedge_invweight0
    for name, wanted in flags.items():
        holder, field = owner_of_field(model, name)
        kinds = KINDS[field[: -len("flags")]].__members__
        merged = {old for old, new in SPLIT.items() if old in kinds and set(new) <= set(wanted)}
        parts = {part for old in merged for part in SPLIT[old]}  # which are one flag here
        unknown = [flag for flag in wanted if flag not in kinds and flag not in parts]
        if unknown:
            raise ValueError("it has no flag " + ", ".join(unknown))
        setattr(holder, field, sum(int(kinds[f]) for f in kinds if f in merged.union(wanted)))


def flags_of(model, kind):
    """Return the names of the flags of a model that are set, by kind: "disable" or "enable"."""
    bits = getattr(model.opt, f"{kind}flags")
    members = KINDS[kind].__members__.items()
    return [name for name, bit in members if "BL_" in name and bits & int(bit)]  # not mjNDISABLE
