"""What MuJoCo does with tiny models, as its own users load and step them.

Last comes a world in which something can be kept and forgotten: a pile of boxes, a driven joint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from operator import setitem
from typing import Any, ClassVar

import numpy as np

from ...installed import require
from ...interface import Array
from .. import samples
from ..measured import (
    ANGLE,
    TORQUE,
    Cell,
    LetGo,
    Measurement,
    OneStep,
    Phrases,
    ReadTwice,
    Sliding,
    accelerated,
    near,
)
from ..pile import PILE_MJCF, Pile, Save
from ..samples import PENDULUM_MJCF, acceleration, tip_at

mj: Any = require("mujoco")


def _loaded(text: str) -> tuple[Any, Any]:
    """Return a Model of an MJCF text and a fresh Data."""
    model = mj.MjModel.from_xml_string(text)
    return model, mj.MjData(model)


def quaternion(fours: Sequence[Sequence[float]]) -> list[tuple[Array, Array]]:
    """Measure which quaternion order qpos has: four numbers into the qpos of a free joint."""
    model, data = _loaded(samples.MARKED_MJCF)
    turned = []
    for four in fours:
        data.qpos[3:] = four
        mj.mj_kinematics(model, data)
        turned.append((np.array(data.site_xpos), np.array(data.xquat[1])))
    return turned


def velocity(place: Array, four: Array, six: Array, seconds: float) -> tuple[Array, Array]:
    """Measure the frames of qvel: six numbers into the qvel of a free joint, and one short step."""
    model, data = _loaded(samples.MARKED_MJCF)
    model.opt.timestep = seconds
    data.qpos[:], data.qvel[:] = (*place, *four), six
    mj.mj_kinematics(model, data)
    before = np.array(data.site_xpos)
    mj.mj_step(model, data)
    mj.mj_kinematics(model, data)
    return before, np.array(data.site_xpos)


def gravity(steps: int) -> tuple[Array, Array]:
    """Measure gravity by default: a body in a model that states none, let go."""
    model, data = _loaded(
        '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    )
    mj.mj_step(model, data, steps)
    return np.array(model.opt.gravity), data.qvel[:3] / data.time


def timestep() -> OneStep:
    """Measure the default timestep: a body at 1 m/s, one step."""
    model, data = _loaded(samples.MARKED_MJCF)
    data.qvel[0] = 1
    mj.mj_step(model, data)
    return (model.opt.timestep, float(data.qpos[0]), "data.time", float(data.time))


def actuation(seconds: float) -> list[LetGo]:
    """Measure motors by default: a joint without an actuator, and with one that is never written
    to.
    """
    runs = []
    for part, actuator in (
        ("no actuator", ""),
        ("a position actuator", '<actuator><position joint="j" kp="1000" kv="50"/></actuator>'),
    ):
        model, data = _loaded(samples.PENDULUM_MJCF % actuator)
        mj.mj_step(model, data, round(seconds / model.opt.timestep))
        torque = Measurement("it exerts", float(data.qfrc_actuator[0]), "N·m")
        runs.append((part, float(data.qpos[0]), data.time, (torque,) if actuator else ()))
    return runs


def command(torque: float) -> dict[str, list[float]]:
    """Measure what a command does: a motor, without gravity."""
    model, data = _loaded(samples.PENDULUM_MJCF % '<actuator><motor joint="j"/></actuator>')
    model.opt.gravity[:] = 0
    data.ctrl[0] = torque
    speeds = [float(data.qvel[0])]
    for _ in range(2):
        mj.mj_step(model, data)
        speeds.append(float(data.qvel[0]))
    return {"ctrl": speeds}


def damping(seconds: float, fast: float) -> tuple[float, float]:
    """Measure damping by default: of a free body for a while, of a joint for a step."""
    model, data = _loaded(samples.MARKED_MJCF)
    data.qvel[0] = 1
    mj.mj_step(model, data, round(seconds / model.opt.timestep))
    joint, turning = _loaded(samples.PENDULUM_MJCF % "")
    joint.opt.gravity[:] = 0
    turning.qvel[0] = fast
    mj.mj_step(joint, turning)
    return float(data.qvel[0]), float(turning.qvel[0])


def _tip_read(act: Callable[[Any, Any], object]) -> ReadTwice:
    """Return where the pendulum's tip is, after something was done to its joint."""
    model, data = _loaded(samples.PENDULUM_MJCF % "")
    mj.mj_forward(model, data)
    act(model, data)
    tip = np.array(data.site("tip").xpos)
    mj.mj_forward(model, data)
    return "the tip", tip, np.array(data.site("tip").xpos), samples.tip_at(data.qpos[0])


def _contact_read(height: float, act: Callable[[Any, Any], object]) -> ReadTwice:
    """Return how deep a ball is in the floor, after something was done to it at a height [m]."""
    model, data = _loaded(samples.BALL)
    data.qpos[2] = height
    mj.mj_forward(model, data)
    act(model, data)
    depths = []
    for _ in range(2):
        depths.append(max((-float(contact.dist) for contact in data.contact), default=0.0))
        mj.mj_forward(model, data)
    return "the contact", *depths, max(samples.RADIUS - float(data.qpos[2]), 0.0)


def write(angle: float, deep: float) -> list[ReadTwice]:
    """Write qpos of a pendulum, then of a ball that is put into the floor."""
    down = samples.RADIUS - deep
    return [
        _tip_read(lambda _, data: setitem(data.qpos, 0, angle)),
        _contact_read(1.0, lambda _, data: setitem(data.qpos, 2, down)),
    ]


def step(speed: float, deep: float) -> list[ReadTwice]:
    """Measure which state derived values belong to: of a moving pendulum, and of a ball that
    leaves the floor.
    """

    def step_at(model: Any, data: Any, dof: int) -> None:
        data.qvel[dof] = speed
        mj.mj_step(model, data)

    return [
        _tip_read(partial(step_at, dof=0)),
        _contact_read(samples.RADIUS - deep, partial(step_at, dof=2)),
    ]


def joints() -> dict[str, list[str]]:
    """Measure the order of joints: their ids, from a URDF and from an MJCF."""
    names = {}
    for form, text in (("URDF", samples.TREE_URDF), ("MJCF", samples.TREE_MJCF)):
        model, _ = _loaded(text)
        name = partial(mj.mj_id2name, model, mj.mjtObj.mjOBJ_JOINT)
        names[form] = [name(joint) for joint in range(model.njnt)]
    return names


def friction() -> dict[str, Sliding]:
    """Measure friction: a block on a floor, with elliptic cones, which are the same in every
    direction.
    """

    def speed(block: float, ground: float, lean: float, priority: int = 0) -> float:
        x, y, z = samples.BLOCK
        model, data = _loaded(
            f'<mujoco><option gravity="0 0 {-samples.SLOPE_GRAVITY}" cone="elliptic"/><worldbody>'
            f'<geom type="plane" size="9 9 1" friction="{ground}"/>'
            f'<body pos="0 0 {z}"><freejoint/><geom type="box" size="{x} {y} {z}" '
            f'friction="{block}" priority="{priority}"/></body></worldbody></mujoco>'
        )
        mj.mj_step(model, data, round(samples.REST / model.opt.timestep))
        model.opt.gravity[0] = lean * samples.SLOPE_GRAVITY
        mj.mj_step(model, data, round(samples.PULL / model.opt.timestep))
        return float(data.qvel[0])

    return {"equal priority": speed, "the block has priority": partial(speed, priority=1)}


def _owner(scene: MujocoPile, field: str) -> Any:
    """Return the owner of a field: the Data, or the options of the Model."""
    return scene.data if hasattr(scene.data, field) else scene.model.opt


def _write(scene: MujocoPile, value: float, field: str) -> None:
    """Write one value into every number of a field."""
    owner = _owner(scene, field)
    setattr(owner, field, 0 * getattr(owner, field) + value)


def _read(scene: MujocoPile, field: str) -> float:
    """Return the value of all numbers of a field; NaN if they differ."""
    values = np.ravel(getattr(_owner(scene, field), field))
    return float(values[0]) if (values == values[0]).all() else np.nan


# What decides the future, by where the engine has it; the last two belong to the Model.
_FIELDS = {
    "time": "time",
    "qpos": "qpos",
    "qvel": "qvel",
    "ctrl": "ctrl",
    "applied forces": "xfrc_applied",
    "warm start": "qacc_warmstart",
    "gravity": "gravity",
    "timestep": "timestep",
}


def _components(*parts: str) -> Save:
    """Return a way to save by components of mjtState."""
    spec = sum(int(getattr(mj.mjtState, f"mjSTATE_{part}")) for part in parts)

    @contextmanager
    def save(scene: Any) -> Iterator[Callable[[Any], object]]:
        state = np.empty(mj.mj_stateSize(scene.model, spec))
        mj.mj_getState(scene.model, scene.data, state, spec)
        yield lambda other: mj.mj_setState(other.model, other.data, state, spec)

    return save


class MujocoPile(Pile):
    """A Model and a Data."""

    quantities: ClassVar = {
        name: (partial(_write, field=field), partial(_read, field=field))
        for name, field in _FIELDS.items()
    }
    resets: ClassVar = {"mj_resetData": lambda scene: mj.mj_resetData(scene.model, scene.data)}
    ways_to_save: ClassVar = {
        "qpos and qvel copied": _components("QPOS", "QVEL"),
        "mjSTATE_FULLPHYSICS": _components("FULLPHYSICS"),
        "mjSTATE_INTEGRATION": _components("INTEGRATION"),
    }

    def __init__(self) -> None:
        self.model, self.data = _loaded(PILE_MJCF)

    @classmethod
    @contextmanager
    def fresh(cls) -> Iterator[MujocoPile]:
        yield cls()

    @property
    def timestep(self) -> float:
        return self.model.opt.timestep

    def bodies(self) -> int:
        return self.model.nbody

    def run(self, steps: int) -> Array:
        trace = []
        for _ in range(steps):
            mj.mj_step(self.model, self.data)
            trace.append(np.array(self.data.qpos))
        return np.array(trace)


reset, save, future = MujocoPile.reset, MujocoPile.save, MujocoPile.future


# MuJoCo: a Model, a Data, and functions that take both.


def _accelerates(n: Any, torque: float) -> bool:
    """Tell whether the engine computes with the state, and with the command."""
    n.mujoco.mj_forward(n.m, n.d)
    return near(n.d.qacc[0], acceleration(ANGLE, torque), 1e-9)


def _stepped(n: Any) -> bool:
    h = n.m.opt.timestep
    return n.d.time == h and near((n.d.qpos[0], n.d.qvel[0]), accelerated(h), 1e-12)


def _was_reset(n: Any) -> bool:
    return n.d.time == n.d.qpos[0] == n.d.qvel[0] == n.d.ctrl[0] == 0


def _restored(n: Any) -> bool:
    """Tell whether a restored state has the same future, from where a hundred steps lead."""
    back = _was_reset(n)
    n.mujoco.mj_step(n.m, n.d, 100)
    away = abs(n.d.qpos[0])
    n.mujoco.mj_setState(n.m, n.d, n.saved, n.part)
    return back and away > 0.1 and _was_reset(n)


def _apart(n: Any) -> bool:
    n.mujoco.mj_step(n.m, n.worlds[1])
    return [world.time for world in n.worlds] == [0, n.m.opt.timestep, 0]


def _is_loaded(n: Any) -> bool:
    return n.m.nq == n.m.nu == 1 and n.d.time == 0


def _read_tip(n: Any) -> bool:
    return near(n.tip, tip_at(n.d.qpos[0]), 1e-12)


def _recomputed(n: Any) -> bool:
    """Tell whether the tip is of now, and no time passed."""
    is_of_now = near(n.d.site("tip").xpos, tip_at(n.d.qpos[0]), 1e-12)
    return n.d.time == n.m.opt.timestep and is_of_now


_CELLS = {
    "load": Cell(
        "import mujoco\n"
        "import numpy as np\n"
        "m = mujoco.MjModel.from_xml_path(file)\n"
        "d = mujoco.MjData(m)",
        _is_loaded,
    ),
    "state": Cell(f"d.qpos[0], d.qvel[0] = {ANGLE}, 0", partial(_accelerates, torque=0.0)),
    "command": Cell(f"d.ctrl[0] = {TORQUE}", partial(_accelerates, torque=TORQUE)),
    "step": Cell("mujoco.mj_step(m, d)", _stepped),
    "recompute": Cell(
        "mujoco.mj_forward(m, d)",
        _recomputed,
    ),
    "read a site": Cell('tip = d.site("tip").xpos', _read_tip),
    "reset": Cell("mujoco.mj_resetData(m, d)", _was_reset),
    "save": Cell(
        "part = mujoco.mjtState.mjSTATE_INTEGRATION\n"
        "saved = np.empty(mujoco.mj_stateSize(m, part))\n"
        "mujoco.mj_getState(m, d, saved, part)\n"
        "mujoco.mj_step(m, d, 100)\n"
        "mujoco.mj_setState(m, d, saved, part)  # back",
        _restored,
    ),
    "many worlds": Cell("worlds = [mujoco.MjData(m) for _ in range(3)]", _apart),
}
phrases = partial(
    Phrases,
    ("arm.xml", PENDULUM_MJCF % '<actuator><motor joint="j"/></actuator>'),
    _CELLS,
)
