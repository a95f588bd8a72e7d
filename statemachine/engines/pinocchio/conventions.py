"""What Pinocchio computes of tiny models; it has no step, and its Data no state."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from .. import samples
from ..measured import (
    ANGLE,
    TORQUE,
    Absent,
    AfterNan,
    Cell,
    LetGo,
    Measurement,
    Phrases,
    ReadTwice,
    accelerated,
    near,
)
from ..samples import PENDULUM_URDF, acceleration, tip_at

pin: Any = require("pinocchio")


def names_with(pin: Any, *words: str) -> tuple[str, ...]:
    """Return public names of Pinocchio's, and of its Data's, that have one of the words in them."""
    found: list[str] = []
    for name in (*vars(pin), *vars(pin.Data)):
        if name[0] != "_" and any(word in name.lower() for word in words):
            found.append(name)
    return tuple(sorted(found))


def _marks(model: Any, data: Any, q: Array) -> Array:
    """Return the marks in the world (3, 3) [m]."""
    pin.framesForwardKinematics(model, data, q)
    frames = [model.getFrameId(f"mark{k}") for k in range(len(samples.MARKS))]
    return np.array([data.oMf[frame].translation for frame in frames])


def _free_body() -> tuple[Any, Any]:
    """Return a Model of the marked body on a free-flyer, and a Data."""
    model = pin.buildModelFromXML(samples.MARKED_URDF, pin.JointModelFreeFlyer())
    return model, model.createData()


def _absent(*words: str, part: str = "", figures: tuple[Measurement, ...] = ()) -> Absent:
    return Absent(words, names_with(pin, *words), part, figures)


def quaternion(fours: Sequence[Sequence[float]]) -> list[tuple[Array, Array]]:
    """Measure the order of a quaternion: four numbers into the q of a free-flyer."""
    model, data = _free_body()
    return [
        (
            _marks(model, data, np.array([0, 0, 0, *four])),
            np.array(pin.SE3ToXYZQUAT(data.oMi[1])[3:]),
        )
        for four in fours
    ]


def velocity(place: Array, four: Array, six: Array, seconds: float) -> tuple[Array, Array]:
    """Measure the frames of a velocity: six numbers, times a short time, into integrate."""
    model, data = _free_body()
    q = np.array([*place, *four])
    before = _marks(model, data, q)
    return before, _marks(model, data, pin.integrate(model, q, six * seconds))


def gravity(_steps: int) -> tuple[Array, Array]:
    """Measure gravity by default: the acceleration of a free body on which nothing else acts."""
    model, data = _free_body()
    still = np.zeros(model.nv)
    # At a pose without turn the body's axes are the world's.
    fall = pin.aba(model, data, pin.neutral(model), still, still)
    return np.array(model.gravity.linear), np.array(fall[:3])


def timestep() -> Absent:
    """Tell whether there is a step at all; integrate takes the time from its caller."""
    model, _ = _free_body()
    q, v = pin.neutral(model), np.zeros(model.nv)
    v[0] = 1
    moved = float(pin.integrate(model, q, v)[0] - q[0])
    given = Measurement("integrate at 1 m/s moves by", f"{moved:g} m")
    return _absent("step", "simul", part="one step", figures=(given,))


def actuation(_seconds: float) -> list[LetGo]:
    """Measure motors by default: the acceleration at zero torque, as nothing else could act."""
    model = pin.buildModelFromXML(samples.PENDULUM_URDF)
    rest = np.zeros(model.nv)
    started = float(pin.aba(model, model.createData(), pin.neutral(model), rest, rest)[0])
    return [("aba at zero torque", started, None, ())]


def _no_step(*_given: float) -> Absent:
    """Tell whether there is a step at all; a torque is an argument of each call."""
    return _absent("step", "simul")


command = damping = step = friction = _no_step


def fresh(_deep: float) -> list[ReadTwice]:
    """Read of a Data that was handed to no function; it has no contacts."""
    model = pin.buildModelFromXML(samples.PENDULUM_URDF)
    data, tip = model.createData(), model.getFrameId("tip")
    read = np.array(data.oMf[tip].translation)
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    return [("the tip", read, np.array(data.oMf[tip].translation), samples.tip_at(0.0))]


def invalid(_angle: float) -> list[AfterNan]:
    """Give NaN to integrate: there is no step."""
    model = pin.buildModelFromXML(samples.PENDULUM_URDF)
    moved = pin.integrate(model, np.array([np.nan]), np.zeros(1))
    return [AfterNan("integrate", float(moved[0]), "")]


def write(angle: float, _deep: float) -> list[ReadTwice]:
    """Measure what a write changes: another q, handed to one function after the other."""
    model = pin.buildModelFromXML(samples.PENDULUM_URDF)
    data, tip = model.createData(), model.getFrameId("tip")
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    q = np.array([angle])
    reads = {"the tip": np.array(data.oMf[tip].translation)}
    pin.forwardKinematics(model, data, q)
    reads["the tip, after forwardKinematics"] = np.array(data.oMf[tip].translation)
    pin.updateFramePlacements(model, data)
    now, true = np.array(data.oMf[tip].translation), samples.tip_at(angle)
    return [(part, read, now, true) for part, read in reads.items()]


def joints() -> dict[str, list[str]]:
    """Measure the order of joints: those after the universe, from a URDF and from an MJCF."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "tree.xml"  # of an MJCF it takes files only
        file.write_text(samples.TREE_MJCF, encoding="utf-8")
        models = {
            "URDF": pin.buildModelFromXML(samples.TREE_URDF),
            "MJCF": pin.buildModelFromMJCF(str(file)),
        }
    return {form: list(model.names)[1:] for form, model in models.items()}


def reset() -> Absent:
    """Tell whether there is anything of the name; its Data has no state to go back to."""
    return _absent("reset")


def save(*_given: object) -> float:
    """Tell whether its Data holds a state: whether anything of its past shows in what comes out."""
    model = pin.buildModelFromXML(samples.PENDULUM_URDF)
    used, new = model.createData(), model.createData()
    q = pin.neutral(model)
    v, torque = np.full(model.nv, 0.3), np.full(model.nv, 0.1)
    pin.aba(model, used, pin.integrate(model, q, v), 2 * v, 5 * torque)
    first, second = (np.array(pin.aba(model, data, q, v, torque)) for data in (used, new))
    return float(np.abs(first - second).max())


future = save  # whether a used Data computes anything else than a new one, of the same q and v


# Pinocchio: a Model, functions of q and v, and a Data that holds what they computed last.

_STEP = 0.002  # s; whatever its user likes


def _accelerates(n: Any, torque: Any, expected: float) -> bool:
    return near(n.pin.aba(n.m, n.d, n.q, n.v, torque), acceleration(ANGLE, expected), 1e-6)


def _stepped(n: Any) -> bool:
    return not names_with(n.pin, "step", "simul") and near(
        (n.q[0], n.v[0]), accelerated(_STEP), 1e-8
    )


def _tip_at(n: Any, data: Any, angle: float) -> bool:
    return near(data.oMf[n.m.getFrameId("tip")].translation, tip_at(angle), 1e-12)


def _was_reset(n: Any) -> bool:
    n.pin.framesForwardKinematics(n.m, n.d, n.q)
    return not names_with(n.pin, "reset") and _tip_at(n, n.d, 0.0) and not n.v.any()


def _apart(n: Any) -> bool:
    worlds = dict(zip((0.1, 0.2, 0.3), n.worlds, strict=True))
    for angle, data in worlds.items():
        n.pin.framesForwardKinematics(n.m, data, np.array([angle]))
    return all(_tip_at(n, data, angle) for angle, data in worlds.items())


def _is_loaded(n: Any) -> bool:
    return n.m.nq == n.m.nv == 1 and n.m.existFrame("tip")


def _takes_state(n: Any) -> bool:
    """Tell whether functions take it."""
    return _accelerates(n, np.zeros(1), 0.0)


def _takes_torque(n: Any) -> bool:
    return not names_with(n.pin, "actuat", "motor") and _accelerates(n, n.tau, TORQUE)


def _recomputed(n: Any) -> bool:
    return _stepped(n) and _tip_at(n, n.d, n.q[0])


def _read_tip(n: Any) -> bool:
    return near(n.tip, tip_at(n.q[0]), 1e-12)


def _saved(n: Any) -> bool:
    """Tell whether it is as it was kept."""
    return _was_reset(n) and n.saved[0][0] == n.saved[1][0] == 0


_CELLS = {
    "load": Cell(
        "import numpy as np\n"
        "import pinocchio as pin\n"
        "m = pin.buildModelFromUrdf(file)\n"
        "d = m.createData()",
        _is_loaded,
    ),
    "state": Cell(
        f"q, v = np.array([{ANGLE}]), np.zeros(1)",
        _takes_state,
    ),
    "command": Cell(
        f"tau = np.array([{TORQUE}])  # a torque; no actuators",
        _takes_torque,
    ),
    "step": Cell(
        "a = pin.aba(m, d, q, v, tau)  # no step: integrate it yourself\n"
        f"v = v + {_STEP} * a\n"
        f"q = pin.integrate(m, q, {_STEP} * v)",
        _stepped,
    ),
    "recompute": Cell(
        "pin.forwardKinematics(m, d, q, v)  # joints\n"
        "pin.updateFramePlacements(m, d)    # and frames",
        _recomputed,
    ),
    "read a site": Cell(
        'tip = d.oMf[m.getFrameId("tip")].translation',
        _read_tip,
    ),
    "reset": Cell("q, v = pin.neutral(m), np.zeros(m.nv)  # no reset", _was_reset),
    "save": Cell(
        "saved = q.copy(), v.copy()  # they are yours\n"
        "q = pin.integrate(m, q, np.ones(m.nv))\n"
        "q, v = saved  # back",
        _saved,
    ),
    "many worlds": Cell("worlds = [m.createData() for _ in range(3)]", _apart),
}
phrases = partial(Phrases, ("arm.urdf", PENDULUM_URDF), _CELLS)
