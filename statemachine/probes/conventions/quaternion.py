"""In which order the four numbers of a quaternion stand."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np

from ...installed import require
from ...interface import Array
from . import UNDECIDED, Figure, Finding, Findings, Question, closest
from ._bullet import load, world
from ._marked import MARKS, MJCF, URDF, in_pinocchio, in_pybullet

QUESTION = Question(
    "In which order do the four numbers of a quaternion stand?",
    "Four numbers in the wrong order are still a rotation, only another one: nothing complains. "
    "Do not test with a third of a turn about 1 1 1: its four numbers are the same.",
)
# A turn whose four numbers are all different: about (1, 2, 3), by 1 rad.
_ANGLE, _AXIS = 1.0, np.array([1.0, 2, 3]) / np.sqrt(14)
_NUMBERS = dict(zip("wxyz", (np.cos(_ANGLE / 2), *np.sin(_ANGLE / 2) * _AXIS), strict=True))


def _turned(point: Array) -> Array:
    """Rodrigues' formula: no quaternion in it."""
    cos, sin = np.cos(_ANGLE), np.sin(_ANGLE)
    along = _AXIS * _AXIS.dot(point) * (1 - cos)
    return point * cos + np.cross(_AXIS, point) * sin + along


def _order(place: Callable[[list[float]], tuple[Array, Array]]) -> Findings:
    """The order in which four numbers turn the marks as they should.

    Args:
        place: Writes four numbers into the engine; gives back the marks (3, 3) about the
            first of them, and the four numbers that the engine tells then.
    """
    should = np.array([_turned(mark) for mark in MARKS])
    written: dict[str, float] = {}
    told: dict[str, Array] = {}
    for order in map("".join, permutations("wxyz")):
        marks, told[order] = place([_NUMBERS[part] for part in order])
        written[order] = float(np.abs(marks - should).max())
    answer, off, following = closest(written)
    if answer != UNDECIDED:
        read, _, _ = closest(
            {
                order: float(np.abs(told[answer] - [_NUMBERS[part] for part in order]).max())
                for order in told
            }
        )
        answer = answer if read == answer else f"{answer} written, {read} read"
    return (
        Finding(answer, (Figure("off by", off, "m"), Figure("the next order", following, "m"))),
    )


def mujoco() -> Findings:
    """Four numbers into the qpos of a free joint."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF)
    data = mj.MjData(model)

    def place(four: list[float]) -> tuple[Array, Array]:
        data.qpos[3:] = four
        mj.mj_kinematics(model, data)
        return np.array(data.site_xpos), np.array(data.xquat[1])

    return _order(place)


def pybullet() -> Findings:
    """Four numbers into resetBasePositionAndOrientation."""
    with world() as (pb, client):
        body = load(pb, client, URDF)

        def place(four: list[float]) -> tuple[Array, Array]:
            pb.resetBasePositionAndOrientation(body, (0, 0, 0), four, client)
            marks = in_pybullet(pb, client, body)
            # Which point was put at 0 0 0 is another question.
            return marks - marks[0], np.array(pb.getBasePositionAndOrientation(body, client)[1])

        return _order(place)


def pinocchio() -> Findings:
    """Four numbers into the q of a free-flyer."""
    pin = require("pinocchio")
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    data = model.createData()

    def place(four: list[float]) -> tuple[Array, Array]:
        marks = in_pinocchio(pin, model, data, np.array([0, 0, 0, *four]))
        return marks, pin.SE3ToXYZQUAT(data.oMi[1])[3:]

    return _order(place)
