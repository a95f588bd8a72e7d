"""What MotrixSim does with tiny models, as its own users load and step them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...backends.motrix.messages import is_panic
from ...interface import Array
from ...processes.stderr_capture import stderr_capture
from .. import samples
from ..measured import (
    ANGLE,
    AfterNan,
    Cell,
    LetGo,
    OneStep,
    Phrases,
    ReadTwice,
    Sliding,
    accelerated,
    near,
)
from ..samples import PENDULUM_MJCF, tip_at
from .pile import MotrixPile, floats, loaded

_SINGLE = 1e-6  # what single precision leaves of a number of size 1


def _marks(scene: Any, data: Any) -> Array:
    """Return the marks in the world (3, 3) [m]."""
    return np.array([site.get_position(data) for site in scene.sites], dtype=np.float64)


def quaternion(fours: Sequence[Sequence[float]]) -> list[tuple[Array, Array]]:
    """Measure the order of a quaternion: four numbers into the positions of a free body."""
    scene, data = loaded(samples.MARKED_MJCF)
    turned = []
    for four in fours:
        data.set_dof_pos(floats((0, 0, 0, *four)), scene)
        scene.forward_kinematic(data)
        read = np.array(scene.links[0].get_rotation(data), dtype=np.float64)
        turned.append((_marks(scene, data), read))
    return turned


def velocity(place: Array, four: Array, six: Array, seconds: float) -> tuple[Array, Array]:
    """Measure the frames of a velocity: six numbers into dof_vel of a free body, a short step."""
    scene, data = loaded(samples.MARKED_MJCF)
    scene.options.timestep = seconds
    data.set_dof_pos(floats((*place, *four)), scene)
    data.set_dof_vel(floats(six))
    scene.forward_kinematic(data)
    before = _marks(scene, data)
    scene.step(data)
    scene.forward_kinematic(data)
    return before, _marks(scene, data)


def gravity(steps: int) -> tuple[Array, Array]:
    """Measure gravity by default: a body in a model that states none, let go."""
    scene, data = loaded(
        '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    )
    scene.step_n(data, steps)
    seconds = steps * scene.options.timestep
    return np.array(scene.options.gravity, dtype=np.float64), data.dof_vel[:3] / seconds


def timestep() -> OneStep:
    """Measure the default timestep: a body at 1 m/s, one step; no attribute counts the time."""
    scene, data = loaded(samples.MARKED_MJCF)
    data.set_dof_vel(floats((1, 0, 0, 0, 0, 0)))
    scene.step(data)
    return (scene.options.timestep, float(data.dof_pos[0]), "", 0.0)


def actuation(seconds: float) -> list[LetGo]:
    """Measure motors by default: a joint without an actuator, and with one that is never written
    to.
    """
    runs: list[LetGo] = []
    for part, actuator in (
        ("no actuator", ""),
        ("a position actuator", '<actuator><position joint="j" kp="1000" kv="50"/></actuator>'),
    ):
        scene, data = loaded(samples.PENDULUM_MJCF % actuator)
        steps = round(seconds / scene.options.timestep)
        scene.step_n(data, steps)
        runs.append((part, float(data.dof_pos[0]), steps * scene.options.timestep, ()))
    return runs


def command(torque: float) -> dict[str, list[float]]:
    """Measure what a command does: a motor, without gravity."""
    scene, data = loaded(samples.PENDULUM_MJCF % '<actuator><motor joint="j"/></actuator>')
    scene.options.gravity = floats((0, 0, 0))
    data.actuator_ctrls = floats([torque])
    speeds = [float(data.dof_vel[0])]
    for _ in range(2):
        scene.step(data)
        speeds.append(float(data.dof_vel[0]))
    return {"actuator_ctrls": speeds}


def damping(seconds: float, fast: float) -> tuple[float, float]:
    """Measure damping by default: of a free body for a while, of a joint for a step."""
    scene, data = loaded(samples.MARKED_MJCF)
    data.set_dof_vel(floats((1, 0, 0, 0, 0, 0)))
    scene.step_n(data, round(seconds / scene.options.timestep))
    joint, turning = loaded(samples.PENDULUM_MJCF % "")
    joint.options.gravity = floats((0, 0, 0))
    turning.set_dof_vel(floats([fast]))
    joint.step(turning)
    return float(data.dof_vel[0]), float(turning.dof_vel[0])


def _tip_read(act: Callable[[Any, Any], object]) -> ReadTwice:
    """Return where the pendulum's tip is, after something was done to its joint."""
    scene, data = loaded(samples.PENDULUM_MJCF % "")
    scene.forward_kinematic(data)
    act(scene, data)
    return _tip_of(scene, data)


def _tip_of(scene: Any, data: Any) -> ReadTwice:
    """Return where the pendulum's tip is, as it is read and recomputed."""
    tip = scene.get_site("tip")
    reads: list[Array] = []
    for _ in range(2):
        reads.append(np.array(tip.get_position(data), dtype=np.float64))
        scene.forward_kinematic(data)
    return "the tip", reads[0], reads[1], samples.tip_at(float(data.dof_pos[0]))


def fresh(_deep: float) -> list[ReadTwice]:
    """Read of a SceneData that was made and nothing else; contacts are found in a step alone."""
    return [_tip_of(*loaded(samples.PENDULUM_MJCF % ""))]


def invalid(angle: float) -> list[AfterNan]:
    """Write NaN into the position of a pendulum; a panic of Rust is no Exception of Python."""
    scene, data = loaded(samples.PENDULUM_MJCF % "")
    data.set_dof_pos(floats([angle]), scene)
    scene.step(data)
    said = ""
    with stderr_capture():
        try:
            data.set_dof_pos(floats([np.nan]), scene)
            scene.step(data)
        except BaseException as error:
            if not is_panic(error):
                raise
            said = type(error).__name__
    return [AfterNan("", float(data.dof_pos[0]), said)]


def write(angle: float, deep: float) -> list[ReadTwice]:
    """Write positions of a pendulum; contacts are found in a step alone."""
    return [_tip_read(lambda scene, data: data.set_dof_pos(floats([angle]), scene))]


def step(speed: float, deep: float) -> list[ReadTwice]:
    """Measure which state derived values belong to: of a moving pendulum."""

    def swing(scene: Any, data: Any) -> None:
        data.set_dof_vel(floats([speed]))
        scene.step(data)

    return [_tip_read(swing)]


def joints() -> dict[str, list[str]]:
    """Measure the order of joints, from an MJCF."""
    scene, _ = loaded(samples.TREE_MJCF)
    return {"MJCF": list(scene.joint_names)}


def friction() -> dict[str, Sliding]:
    """Measure friction: a block on a floor."""

    def speed(block: float, ground: float, lean: float) -> float:
        x, y, z = samples.BLOCK
        scene, data = loaded(
            f'<mujoco><option gravity="0 0 {-samples.SLOPE_GRAVITY}"/><worldbody>'
            f'<geom type="plane" size="9 9 1" friction="{ground}"/>'
            f'<body pos="0 0 {z}"><freejoint/><geom type="box" size="{x} {y} {z}" '
            f'friction="{block}"/></body></worldbody></mujoco>'
        )
        length = scene.options.timestep
        scene.step_n(data, round(samples.REST / length))
        scene.options.gravity = floats([lean * samples.SLOPE_GRAVITY, 0, -samples.SLOPE_GRAVITY])
        scene.step_n(data, round(samples.PULL / length))
        return float(data.dof_vel[0])

    return {"": speed}


reset, save, future = MotrixPile.reset, MotrixPile.save, MotrixPile.future


# MotrixSim: a SceneModel, a SceneData, and methods of the one that take the other.


def _is_loaded(n: Any) -> bool:
    return n.m.num_dof_pos == n.m.num_actuators == 1 and n.d.dof_pos[0] == 0


def _moves(n: Any, torque: float) -> bool:
    """Tell whether the engine computes with the state and the command, which a step shows."""
    n.m.step(n.d)
    h = n.m.options.timestep
    return near(n.d.dof_vel[0], h * samples.acceleration(ANGLE, torque), _SINGLE)


def _stepped(n: Any) -> bool:
    h = n.m.options.timestep
    return near((n.d.dof_pos[0], n.d.dof_vel[0]), accelerated(h), _SINGLE)


def _read_tip(n: Any) -> bool:
    return near(n.tip, tip_at(float(n.d.dof_pos[0])), _SINGLE)


def _recomputed(n: Any) -> bool:
    """Tell whether the tip is of now."""
    tip = n.m.get_site("tip").get_position(n.d)
    return _stepped(n) and near(tip, tip_at(float(n.d.dof_pos[0])), _SINGLE)


def _was_reset(n: Any) -> bool:
    return n.d.dof_pos[0] == n.d.dof_vel[0] == n.d.actuator_ctrls[0] == 0


def _restored(n: Any) -> bool:
    """Tell whether a restored state is there, from where a hundred steps lead."""
    return n.d.dof_pos[0] == n.saved[0][0] and n.d.dof_vel[0] == n.saved[1][0]


def _apart(n: Any) -> bool:
    n.worlds[1].set_dof_pos(floats([1.0]), n.m)
    return [float(world.dof_pos[0]) for world in n.worlds] == [0, 1, 0]


_CELLS = {
    "load": Cell(
        "import motrixsim\n"
        "import numpy as np\n"
        "m = motrixsim.load_model(file)\n"
        "d = motrixsim.SceneData(m)",
        _is_loaded,
    ),
    "state": Cell(
        f"d.set_dof_pos(np.float32([{ANGLE}]), m)\nd.set_dof_vel(np.float32([0]))",
        partial(_moves, torque=0.0),
    ),
    "command": Cell("d.actuator_ctrls = np.float32([1.0])", partial(_moves, torque=1.0)),
    "step": Cell("m.step(d)", _stepped),
    "recompute": Cell("m.forward_kinematic(d)  # poses; contacts need a step", _recomputed),
    "read a site": Cell('tip = m.get_site("tip").get_position(d)', _read_tip),
    "reset": Cell("d.reset(m)", _was_reset),
    "save": Cell(
        "saved = d.dof_pos, d.dof_vel  # copies; not what its solver starts from\n"
        "m.step_n(d, 100)\n"
        "d.set_dof_pos(saved[0], m)\n"
        "d.set_dof_vel(saved[1])  # back",
        _restored,
    ),
    "many worlds": Cell("worlds = [motrixsim.SceneData(m) for _ in range(3)]", _apart),
}
phrases = partial(
    Phrases,
    ("arm.xml", PENDULUM_MJCF % '<actuator><motor joint="j"/></actuator>'),
    _CELLS,
)
