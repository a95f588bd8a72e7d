"""Which actuators of two files are one: by their names, and where they have none."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

import statemachine as sm
from statemachine.lab.compare.matching import match_models

from .support.files import written
from .support.requirements import need_engine

ARM = """
<mujoco><worldbody><body name="b"><joint name="j" axis="0 1 0"/>
<geom size=".1" pos=".2 0 0" mass="{mass}"/><site name="tip" pos=".2 0 0"/></body></worldbody>
<actuator>{actuators}</actuator></mujoco>
"""
UP = '<general site="tip" gear="0 0 1 0 0 0"/>'
ACROSS = '<general site="tip" gear="0 1 0 0 0 0"/>'
OF_THE_JOINT = '<motor joint="j"/>'


def _motors(names: str) -> str:
    """Return motors of the joint, each by its letter."""
    return "".join(f'<motor name="{name}" joint="j"/>' for name in names)


def _pairs(
    folder: Path, left: str, right: str, names: Mapping[str, str] | None = None
) -> tuple[tuple[int, int], ...]:
    need_engine("mujoco")
    one = sm.load(written(folder / "left.xml", ARM.format(mass=1.0, actuators=left)))
    two = sm.load(written(folder / "right.xml", ARM.format(mass=1.2, actuators=right)))
    return match_models(one, two, names).actuators


@pytest.mark.parametrize(
    ("left", "right", "pairs"),
    [
        (UP, UP, ((0, 0),)),
        (UP + ACROSS, UP + ACROSS, ((0, 0), (1, 1))),
        (OF_THE_JOINT + UP, UP + OF_THE_JOINT, ((0, 1), (1, 0))),
    ],
    ids=["one", "two", "beside one of a joint"],
)
def test_as_many_on_both_sides_are_paired_in_their_order(
    tmp_path: Path, left: str, right: str, pairs: tuple[tuple[int, int], ...]
) -> None:
    assert _pairs(tmp_path, left, right) == pairs


def test_those_of_one_name_are_a_pair_whatever_joint_is_theirs(tmp_path: Path) -> None:
    assert _pairs(tmp_path, _motors("abc"), _motors("bca")) == ((0, 2), (1, 0), (2, 1))


def test_a_name_that_is_another_one_on_the_right_is_that_one(tmp_path: Path) -> None:
    assert _pairs(tmp_path, _motors("ab"), _motors("xy"), {"a": "y"}) == ((0, 1), (1, 0))


def test_where_one_side_has_more_none_is_taken_for_another(tmp_path: Path) -> None:
    assert _pairs(tmp_path, UP, UP + ACROSS) == ()
