"""The process of one release of MuJoCo, run by the interpreter of that release's environment.

It needs NumPy and MuJoCo only, on Python 3.9 or later, and imports nothing of this package. A
message and its answer are two lengths, a header in JSON, and bytes; it ends with its input.
"""

from __future__ import annotations

import copy
import json
import os
import struct

import mujoco
import numpy as np

SIZES = struct.Struct("<QQ")
HUGE = 1e10
POSES = ("xpos", "xquat", "site_xpos", "site_xmat")
FORCES = ("qacc", "qfrc_bias", "qfrc_actuator", "qfrc_passive", "qfrc_constraint")
_KINDS = mujoco.mjtConstraint
KINDS = {"disable": mujoco.mjtDisableBit, "enable": mujoco.mjtEnableBit}
SPLIT = {"mjDSBL_PASSIVE": ("mjDSBL_SPRING", "mjDSBL_DAMPER")}  # flags that became two later
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


class ReleasedWorld:
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

    def advance(self, steps: int, fastest: float) -> int:
        """Take engine steps up to one after which a coordinate is beyond its bound; how many."""
        model, data = self.model, self.data
        qpos, qvel = data.qpos, data.qvel  # views of the engine's memory
        for k in range(1, steps + 1):
            mujoco.mj_step(model, data)
            if not (qpos.dot(qpos) < HUGE * HUGE and qvel.dot(qvel) < fastest * fastest):
                return k
        return steps

    def derived(self):
        """Every derived array, by name, then those of the contacts."""
        model, data = self.model, self.data
        arrays = {name: getattr(data, name) for name in POSES + FORCES}
        for part, kinds in PARTS.items():
            arrays[part] = np.zeros(model.nv)
            if data.nefc:
                rows = np.isin(data.efc_type, [int(kind) for kind in kinds])
                force = np.where(rows, data.efc_force, 0.0)
                mujoco.mj_mulJacTVec(model, data, arrays[part], force)
        force = np.zeros((data.ncon, 6))
        for k in range(data.ncon):
            mujoco.mj_contactForce(model, data, k, force[k])
        contacts = [data.contact[k] for k in range(data.ncon)]
        arrays["geom"] = np.array([(c.geom1, c.geom2) for c in contacts], float).reshape(-1, 2)
        arrays["dist"] = np.array([c.dist for c in contacts], float)
        arrays["pos"] = np.array([c.pos for c in contacts], float).reshape(-1, 3)
        arrays["frame"] = np.array([c.frame for c in contacts], float).reshape(-1, 3, 3)
        arrays["force"], arrays["torque"] = force[:, :3], force[:, 3:]
        return arrays


class Answerer:
    """The models and worlds of this process, by number, and what can be asked of them."""

    def __init__(self) -> None:
        self.things, self.number = {}, 0

    def keep(self, thing):
        """Its number."""
        self.number += 1
        self.things[self.number] = thing
        return self.number

    def load(self, job, _):
        """Compile a file; numeric fields of the compiled model that were asked for."""
        if job["text"]:
            model = mujoco.MjModel.from_xml_string(job["text"])
        else:
            model = mujoco.MjModel.from_xml_path(job["file"])
        if hasattr(mujoco.mjtDisableBit, "mjDSBL_AUTORESET"):
            model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        fields = {}
        for name in job["fields"]:
            holder, field = held(model, name)
            value = getattr(holder, field, None)
            if isinstance(value, (np.ndarray, int, float)):
                fields[name] = np.asarray(value, float)
        bits = {f"opt.{n}flags": flags_of(model, n) for n in KINDS}
        return {"model": self.keep(model), **bits}, fields

    def edit(self, job, content):
        """A copy of a model with other values in some fields."""
        model, start = copy.copy(self.things[job["model"]]), 0
        for name, size in job["edits"]:
            holder, field = held(model, name)
            now, value = getattr(holder, field), content[start : start + size]
            start += size
            if isinstance(now, np.ndarray):
                now[...] = value.reshape(now.shape)
            else:
                setattr(holder, field, type(now)(value[0]))
        for name, flags in job["flags"].items():
            holder, field = held(model, name)
            kinds = KINDS[field[: -len("flags")]].__members__
            whole = {old for old, new in SPLIT.items() if old in kinds and set(new) <= set(flags)}
            unknown = [f for f in flags if f not in kinds and not any(f in SPLIT[o] for o in whole)]
            if unknown:
                raise ValueError("it has no flag " + ", ".join(unknown))
            setattr(holder, field, sum(int(kinds[f]) for f in kinds if f in whole.union(flags)))
        return {"model": self.keep(model)}, {}

    def make(self, job, _):
        """A world of a model."""
        return {"world": self.keep(ReleasedWorld(self.things[job["model"]]))}, {}

    def run(self, job, content):
        """Place a state if one is given, take a command and steps; one more is kept in reserve."""
        world = self.things[job["world"]]
        nu = world.model.nu
        if len(content) > nu:
            world.place(content[nu:])
        world.data.ctrl[:] = content[:nu]
        taken = world.advance(job["steps"], job["fastest"])
        states = {"before": world.state()}
        if taken == job["steps"]:
            mujoco.mj_step(world.model, world.data)
            states["after"] = world.state()
        return {"taken": taken}, states

    def look(self, job, content):
        """What is derived: of a state and a command if they are given, else of the last step."""
        world = self.things[job["world"]]
        if len(content):
            nu = world.model.nu
            world.place(content[nu:])
            world.data.ctrl[:] = content[:nu]
            mujoco.mj_forward(world.model, world.data)
        return {}, world.derived()


def flags_of(model, kind):
    """Names of the flags of a model that are set; kind: "disable" or "enable"."""
    bits = getattr(model.opt, f"{kind}flags")
    members = KINDS[kind].__members__.items()
    return [name for name, bit in members if "BL_" in name and bits & int(bit)]  # not mjNDISABLE


def held(model, name):
    """Whose attribute a field is, and its name there: "opt.timestep", "body_mass"."""
    holder, _, field = name.rpartition(".")
    return (getattr(model, holder) if holder else model), field


def main() -> None:
    """Answer until there is nobody to ask."""
    source, out = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what an engine prints is no answer
    if hasattr(mujoco, "set_mju_user_warning"):  # else it writes a file where it runs
        mujoco.set_mju_user_warning(lambda text: None)
    server = Answerer()
    while True:
        lengths = source.read(SIZES.size)
        if len(lengths) < SIZES.size:
            return
        size, rest = SIZES.unpack(lengths)
        job = json.loads(source.read(size))
        content = np.frombuffer(source.read(rest))
        for number in job["free"]:  # models and worlds that nobody needs any more
            server.things.pop(number, None)
        try:
            answer, arrays = getattr(server, job["verb"])(job, content)
        except Exception as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            answer, arrays = {"error": reason, "kind": type(error).__name__}, {}
        answer = {**answer, "arrays": [(name, a.shape) for name, a in arrays.items()]}
        blob = b"".join(np.ascontiguousarray(a, float).tobytes() for a in arrays.values())
        head = json.dumps(answer).encode()
        out.write(SIZES.pack(len(head), len(blob)) + head + blob)
        out.flush()


if __name__ == "__main__":
    main()
