"""What the position and the six velocity numbers of a free body mean."""

from __future__ import annotations

from itertools import product

import numpy as np

from ...installed import require
from ...interface import Array
from . import Figure, Finding, Findings, Question, closest
from ._bullet import load, world
from ._marked import CENTRE, MARKS, MJCF, URDF, in_pinocchio, in_pybullet

QUESTION = Question(
    "What do the position and the six velocity numbers of a free body mean?",
    "Copied from one engine into another, the same numbers are another motion as soon as the "
    "body is turned, or its centre of mass is not at its origin.",
)
_PLACE = np.array([0.2, -0.1, 0.3])
_SIX = np.array([0.7, -0.4, 0.9, 0.5, -1.1, 0.8])
_FOUR = np.array([0.5, 0.1, -0.7, 0.5])  # some turn; which one is read from the marks
_FOUR = _FOUR / np.linalg.norm(_FOUR)
_SHORT = 1e-6  # the step [s]; the error of the difference quotient is of its order

_AXES, _POINTS = ("world", "body"), {"body origin": np.zeros(3), "centre of mass": CENTRE}
_PARTS = {
    "order": ("linear first", "angular first"),
    "linear": tuple(f"{axes} axes, {point}" for axes, point in product(_AXES, _POINTS)),
    "angular": tuple(f"{axes} axes" for axes in _AXES),
}


def _predicted(hypothesis: tuple[str, ...], before: Array) -> Array:
    """Velocities of the marks (3, 3) [m/s], were the six numbers what the hypothesis says."""
    order, linear, angular = hypothesis
    turn = _turn(before)
    halves = (_SIX[:3], _SIX[3:])
    v, w = halves if order == "linear first" else halves[::-1]
    v = turn @ v if linear.startswith("body") else v
    w = turn @ w if angular.startswith("body") else w
    point = _POINTS[linear.partition(" axes, ")[2]]
    return np.asarray(v + np.cross(w, (MARKS - point) @ turn.T), dtype=np.float64)


def _turn(marks: Array) -> Array:
    """The body's rotation (3, 3), from where its marks are."""
    x, y = marks[1:] - marks[0]
    return np.array((x, y, np.cross(x, y))).T


def _placed(marks: Array) -> Finding:
    """Which point of the body stands where it was put."""
    off = {
        name: float(np.abs(marks[0] + _turn(marks) @ point - _PLACE).max())
        for name, point in _POINTS.items()
    }
    answer, residual, following = closest(off)
    return Finding(
        answer, (Figure("off by", residual, "m"), Figure("else", following, "m")), "position"
    )


def _meaning(before: Array, after: Array) -> Findings:
    """What explains how the marks (3, 3) moved in one short step, part by part."""
    moved = (after - before) / _SHORT
    off = {
        hypothesis: float(np.abs(_predicted(hypothesis, before) - moved).max())
        for hypothesis in product(*_PARTS.values())
    }
    found = [_placed(before)]
    for k, (part, meanings) in enumerate(_PARTS.items()):
        best = {each: min(off[full] for full in off if full[k] == each) for each in meanings}
        answer, residual, following = closest(best)
        figures = (Figure("off by", residual, "m/s"), Figure("else", following, "m/s"))
        found.append(Finding(answer, figures, part))
    return tuple(found)


def mujoco() -> Findings:
    """Six numbers into the qvel of a free joint, and one short step."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF)
    model.opt.timestep = _SHORT
    data = mj.MjData(model)
    data.qpos[:], data.qvel[:] = (*_PLACE, *_FOUR), _SIX
    mj.mj_kinematics(model, data)
    before = np.array(data.site_xpos)
    mj.mj_step(model, data)
    mj.mj_kinematics(model, data)
    return _meaning(before, np.array(data.site_xpos))


def pybullet() -> Findings:
    """Three and three numbers into resetBaseVelocity, in this order, and one short step."""
    with world() as (pb, client):
        body = load(pb, client, URDF)
        pb.setTimeStep(_SHORT, client)
        pb.resetBasePositionAndOrientation(body, _PLACE.tolist(), _FOUR.tolist(), client)
        pb.resetBaseVelocity(body, _SIX[:3].tolist(), _SIX[3:].tolist(), client)
        before = in_pybullet(pb, client, body)
        pb.stepSimulation(client)
        return _meaning(before, in_pybullet(pb, client, body))


def pinocchio() -> Findings:
    """Six numbers, times a short time, into integrate."""
    pin = require("pinocchio")
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    data = model.createData()
    q = np.array([*_PLACE, *_FOUR])
    before = in_pinocchio(pin, model, data, q)
    return _meaning(before, in_pinocchio(pin, model, data, pin.integrate(model, q, _SIX * _SHORT)))
