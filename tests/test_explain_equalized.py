"""Causes that are equalized: the right's motion is the left's then, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from statemachine.lab.why import Explanation

from .support.claims import assert_has
from .support.explained import (
    ALONE,
    ARM,
    HOME,
    balls,
    changed,
    explained,
    hills,
    mesh,
    shares,
    with_changes,
)
from .support.known_causes import (
    CORE,
    EASILY_MISSED,
    EQUIVALENT,
    LED,
    OTHER_SHAPES,
    SAME,
    Sides,
    said_otherwise,
    with_actuators_swapped,
)

SMALL, LARGE, COARSE = {"size": 0.05}, {"size": 0.055}, {"corners": 30}
BALL = {"quantity": "ball"}


# Two sides whose two balls share meshes, and the causes, by what is special.
BOTH = ["shape of ball_shape", "shape of again_shape"]
SHARED_MESHES: dict[str, Callable[[], tuple[str, str, list[str]]]] = {
    "one mesh for both, which is another": lambda: (
        balls("m", "m", m=SMALL),
        balls("m", "m", m=LARGE),
        ["shape of ball_shape, again_shape"],
    ),
    "two files of one mesh are the same as one": lambda: (
        balls("m", "n", m=SMALL, n=SMALL),
        balls("m", "m", m=LARGE),
        ["shape of ball_shape, again_shape"],
    ),
    # Whatever its size: each geom can take it up.
    "the right has the left's mesh, too": lambda: (
        balls("m", "n", m=SMALL, n=COARSE),
        balls("n", "n", m=SMALL, n=COARSE),
        ["shape of ball_shape"],
    ),
    "each has the other's mesh": lambda: (
        balls("m", "n", m=SMALL, n=COARSE),
        balls("n", "m", m=SMALL, n=COARSE),
        BOTH,
    ),
    "one could take up the mesh into which another's is copied": lambda: (
        balls("m", "k", m=SMALL, k={"size": 0.06}),
        balls("n", "m", n=LARGE, m=SMALL),
        BOTH,
    ),
}


# Two sides of meshes or height fields that cannot be equalized, by words of the reason.
REFUSED: dict[str, Sides] = {
    "number of vertices": lambda: (mesh(), mesh(corners=30)),
    "rows or columns": lambda: (hills(), hills(points=11)),
    "another geom": lambda: (
        balls("m", "k", m=SMALL, k={"noise": 2e-3}, n=LARGE), balls("n", "n", n=LARGE)
    ),
    "has this mesh": lambda: (
        balls("m", "n", m=SMALL, k={"noise": 2e-3}, n=LARGE), balls("n", "n", n=LARGE)
    ),
}  # fmt: skip


@pytest.mark.parametrize("reason", REFUSED)
def test_what_cannot_be_equalized_has_a_note_with_the_reason(reason: str, tmp_path: Path) -> None:
    found = explained(tmp_path, *REFUSED[reason](), scenario=HOME, quantity="ball", seconds=0.4)
    assert found.shares
    assert all(reason in share.note for share in found.shares)
    assert not found.verdict.holds


@pytest.mark.parametrize("other", ["margin", "exclude"])
def test_a_pair_that_is_taken_away_is_as_its_geoms_are_then(other: str, tmp_path: Path) -> None:
    """Its geoms have another margin, or do not touch by themselves, until that is equalized."""
    right = changed(ARM, ALONE["pair"], ALONE[other])
    found = explained(tmp_path, ARM, right, scenario=HOME, quantity="ball position")
    assert_has(found, equalized_gap=0.0, method="all sets")
    alone = {row.name: row.alone for row in found.shares}
    # Without its pair the ball falls through the floor, from which it is excluded.
    assert ((alone["extra pair of pair 0"] or 0.0) < -1) == (other == "exclude")


HOME_LEAVE = replace(HOME, controller=lambda _model, _seed: lambda _model, _data: None)
STAY = replace(HOME_LEAVE, keyframe=None)
BALL_SPRING = ('stiffness="0.1"', 'stiffness="0.3"')

BY_NUMBER = replace(HOME, controller=lambda _model, _seed: lambda _model, _data: [0.8, -0.5])
# As in a run of two sides: what the left was told last holds, and each begins with its own.
TOLD_ONCE = replace(
    HOME, controller=lambda _m, _s: lambda _model, data: [0.8, -0.5] if data.time < 0.1 else None
)
PUSHED = ARM.replace(
    "</actuator>", '<general name="push" site="tip" gear="0 0 0 0 1 0" gainprm="1"/></actuator>'
).replace('ctrl="0 0"', 'ctrl="0 0 0.1"')
OTHER_CTRL = with_changes(
    ARM, [('0.6 0 0.2 1 0 0 0  0" ctrl="0 0"', '0.6 0 0.2 1 0 0 0  0" ctrl="0.3 0"')]
)


def _arm_and(name: str) -> tuple[str, str]:
    return ARM, said_otherwise(name)


# Two sides that move alike, and what is asked of them.
ALIKE: dict[str, tuple[Sides, dict[str, Any]]] = {
    **{name: (partial(_arm_and, name), {}) for name in SAME},
    **{name: (sides, BALL) for name, sides in EQUIVALENT.items()},
    "names that are given": (
        lambda: (
            ARM,
            ARM.replace('"elbow"', '"e"').replace('"shoulder"', '"s"').replace("_shape", "_s"),
        ),
        {"scenario": BY_NUMBER, "names": {"elbow": "e", "shoulder": "s"}},
    ),
    "a site that is found by its place": (lambda: (PUSHED, PUSHED.replace('"tip"', '"end"')), {}),
    "no command after a while": (
        lambda: (ARM, ARM.replace('kp="20"', 'kp="20.0"')), {"scenario": TOLD_ONCE}
    ),
    "a start that is the left's": (
        lambda: (OTHER_CTRL, ARM[: ARM.index("<keyframe>")] + "</mujoco>"),
        {"scenario": HOME_LEAVE},
    ),
    "a mocap body and a cord": (lambda: (LED, LED), {"scenario": HOME_LEAVE}),
    "a mocap body, a cord and another site": (
        lambda: (LED, with_changes(LED, [(CORE, '<site name="first"/>' + CORE)])),
        {"scenario": HOME_LEAVE},
    ),
    "a mocap body, a cord and a colour": (
        lambda: (LED, with_changes(LED, [('name="side"', 'name="side" rgba="1 0 0 1"')])),
        {"scenario": HOME_LEAVE},
    ),
}  # fmt: skip
# An order matters to who reads or writes by number.
ORDERS = {"permuted actuators": ["order of ctrl"], "permuted bodies": ["order of qpos"]}


@pytest.mark.parametrize("name", ALIKE)
def test_another_way_of_saying_it_is_no_difference(name: str, tmp_path: Path) -> None:
    sides, how = ALIKE[name]
    found = explained(tmp_path, *sides(), **{"scenario": HOME, "seconds": 0.4, **how})
    assert [each.name for each in found.shares] == ORDERS.get(name, [])
    assert_has(found.verdict, holds=True, divides=False)


Row = tuple[str, str, list[str], dict[str, Any]]


def _easily_missed(name: str) -> Row:
    both, other, cause, *quantity = EASILY_MISSED[name]
    left = with_changes(LED, both)
    # A delay shows only where the command changes.
    how: dict[str, Any] = {"scenario": HOME if "delay" in name else HOME_LEAVE}
    if quantity:
        how["quantity"] = quantity[0]
    return left, with_changes(left, other), [cause], how


def _of_one_shape(name: str) -> Row:
    sides, cause = OTHER_SHAPES[name]
    return *sides(), [cause], BALL


def _of_shared_meshes(name: str) -> Row:
    left, right, causes = SHARED_MESHES[name]()
    return left, right, causes, BALL


# A joint more, or an equality that holds one of them.
SEVERAL = with_changes(
    LED,
    [('<site name="low"',
      '<joint name="twist" axis="1 0 0" damping="0.1"/><site name="low"')],
)  # fmt: skip
HELD = with_changes(LED, [("<equality>", '<equality><joint joint1="shoulder" joint2="elbow"/>')])
ANOTHER_ZERO = [('name="elbow" axis', 'name="elbow" ref="0.2" axis')]
# A ball joint, which is not among the hinges.
HIP = with_changes(
    ARM,
    [
        ('<body name="weight"',
         '<body pos="1 0 1"><joint name="hip" type="ball" stiffness="0.1"/>'
         '<geom type="capsule" size="0.02" fromto="0 0 0 0.1 0 -0.2" mass="0.3"/></body>'
         '<body name="weight"'),
        ('0 0.2 1 0 0 0  0"', '0 0.2 1 0 0 0  1 0 0 0  0"'),
    ],
)  # fmt: skip
SHORT = with_changes(ARM, [('range="-2 2"', 'range="-.3 .3"')])  # the motion reaches its ends
ASLEEP = with_changes(ARM, [('implicitfast"/>', 'implicitfast"><flag sleep="enable"/></option>')])
# A floating body falls onto a table that was moved: the table moved, not the robot.
TABLE = with_changes(
    ARM,
    [('<body name="ball"',
      '<body name="table" pos="0.6 0 0.05"><geom name="top" type="box" size=".03 .03 .05"/></body>'
      '<body name="ball"')],
)  # fmt: skip
TENDON = (
    '<tendon><fixed name="band" stiffness="5" springlength="0.1">'
    '<joint joint="elbow" coef="{}"/></fixed></tendon><actuator>'
)
# Two sides, their causes, and what is asked of them.
EQUALIZED: dict[str, Callable[[], Row]] = {
    **{name: partial(_easily_missed, name) for name in EASILY_MISSED},
    **{name: partial(_of_shared_meshes, name) for name in SHARED_MESHES},
    **{name: partial(_of_one_shape, name) for name in OTHER_SHAPES},
    "another zero of one of several joints": lambda: (
        SEVERAL, with_changes(SEVERAL, ANOTHER_ZERO), ["zero of lower", "start"], {"scenario": STAY}
    ),
    "another zero of a joint that an equality holds": lambda: (
        HELD, with_changes(HELD, ANOTHER_ZERO), ["zero of lower", "start"], {"scenario": STAY}
    ),
    "a spring beside the hinges": lambda: (
        HIP, with_changes(HIP, [('stiffness="40"', 'stiffness="50"')]), ["spring of spring"], {}
    ),
    "a spring of a ball joint": lambda: (
        HIP, with_changes(HIP, [BALL_SPRING]), ["spring of hip"], {}
    ),
    "what sleeps from the start": lambda: (
        ASLEEP,
        with_changes(ASLEEP, [('<body name="ball"', '<body name="ball" sleep="init"')]),
        ["sleep policy of ball"],
        BALL,
    ),
    "what is fixed elsewhere": lambda: (
        TABLE, TABLE.replace('pos="0.6 0 0.05"', 'pos="0.64 0 0.05"'), ["place of top"], BALL
    ),
    "the coefficient of a fixed tendon": lambda: (
        ARM.replace("<actuator>", TENDON.format(1)), ARM.replace("<actuator>", TENDON.format(1.5)),
        ["coefficients of band"],
        {},
    ),
    "how a floating body turns": lambda: (
        ARM,
        ARM.replace('name="ball_shape"', 'name="ball_shape" pos="0.001 0 0"'),
        ["place of ball_shape"],
        {"scenario": HOME_LEAVE, "quantity": "ball, rotation"},
    ),
    "other actuators for who writes by number": lambda: (
        ARM, with_actuators_swapped(ARM), ["order of ctrl"], {"scenario": BY_NUMBER}
    ),
    "limits off": lambda: (
        SHORT,
        with_changes(
            SHORT, [('implicitfast"/>', 'implicitfast"><flag limit="disable"/></option>')]
        ),
        ["limit"],
        {},
    ),
    "no command on either side": lambda: (
        ARM, OTHER_CTRL, ["ctrl of the start"], {"scenario": HOME_LEAVE}
    ),
}  # fmt: skip


# A weld is turned round; else the bits are the same.
ROUNDING = {"a weld the other way round": 1e-15}


@dataclass(frozen=True)
class Equalized:
    """Two sides with known causes, and what was found.

    Attributes:
        name: What is special about the sides.
        causes: The causes that are to be found.
        explanation: What was found.
    """

    name: str
    causes: list[str]
    explanation: Explanation


@pytest.fixture(scope="module", params=EQUALIZED)
def equalized(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Equalized:
    """Each pair with causes that are easily missed or hard to equalize."""
    left, right, causes, how = EQUALIZED[request.param]()
    # A cord that leaves its pulley, and what sleeps until it is touched, hang on a last bit.
    how = {"scenario": HOME, "uncertain": None, "seconds": 0.5, **how}
    found = explained(tmp_path_factory.mktemp("pair"), left, right, **how)
    return Equalized(request.param, causes, found)


def test_all_causes_are_found_and_no_other(equalized: Equalized) -> None:
    told = shares(equalized.explanation)
    assert sorted(told) == sorted(equalized.causes)
    assert len(told) > 1 or told[equalized.causes[0]] == pytest.approx(1.0)
    assert equalized.explanation.verdict.holds


def test_no_gap_is_left_where_they_are_equalized(equalized: Equalized) -> None:
    found = equalized.explanation
    assert found.gap > 100 * found.negligible
    assert found.equalized_gap == pytest.approx(0.0, abs=ROUNDING.get(equalized.name, 0.0))


@pytest.mark.parametrize("equalized", ["how a floating body turns"], indirect=True)
def test_a_gap_of_a_rotation_is_an_angle(equalized: Equalized) -> None:
    assert equalized.explanation.unit == "rad"
