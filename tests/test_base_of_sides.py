"""A side whose file leaves its base open has that of the other, unless it is told one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from statemachine.interface.records import Defaults
from statemachine.lab.compare import Request, Side
from statemachine.lab.compare.agreement import compare
from statemachine.lab.compare.prepared_sides import prepare_sides
from statemachine.lab.compare.two_sides import run_sides
from statemachine.lab.runs.floating import base_of, free_joint_of_base
from statemachine.lab.why.causes import differences_of

from .support.legged import FLOATING, STANDING, mjcf, urdf, written
from .support.requirements import need_engine

STEP = {"timestep": 0.002}


def _request(*sides: Side, what: str = "fall", seconds: float = 0.1) -> Request:
    return Request((what,), sides=sides, seconds=seconds)


def _side(path: Path, engine: str = "mujoco", defaults: Defaults = "model", **options: str) -> Side:
    return Side(str(path), engine, defaults, {**STEP, **options})


@pytest.fixture
def files(tmp_path):
    return written(tmp_path, "robot.xml", mjcf()), written(tmp_path, "robot.urdf", urdf())


@pytest.mark.parametrize(
    ("engine", "defaults"), [("mujoco", "model"), ("pybullet", "model"), ("pybullet", "engine")]
)
@pytest.mark.parametrize("place", [0, 1])
def test_a_urdf_floats_where_the_other_does_and_starts_at_its_place(files, engine, defaults, place):
    need_engine(engine)
    sides = [_side(files[0]), _side(files[1], engine, defaults)]
    prepared = prepare_sides(_request(*(sides[::-1] if place == 0 else sides)))
    left, right = (rerun.start()[0] for rerun in prepared.reruns)
    assert left == pytest.approx(right, abs=1e-12)
    assert right[:7] == pytest.approx([0, 0, STANDING, 1, 0, 0, 0])
    assert prepared.bases.inherited_by == ("left", "right")[place]
    assert prepared.bases.left == prepared.bases.right == "free"


def test_a_urdf_takes_the_rotation_of_the_other_base_too(tmp_path):
    turned = (
        mjcf()
        .split("<keyframe>")[0]
        .replace(f'pos="0 0 {STANDING}"', f'pos="1 2 {STANDING}" quat="0.8 0.1 -0.2 0.5"')
    )
    left = written(tmp_path, "robot.xml", f"{turned}</mujoco>")
    right = written(tmp_path, "robot.urdf", urdf())
    prepared = prepare_sides(_request(_side(left), _side(right)))
    ours, theirs = (rerun.start()[0] for rerun in prepared.reruns)
    assert ours[3:7] == pytest.approx(np.array([0.8, 0.1, -0.2, 0.5]) / np.sqrt(0.94))
    assert theirs == pytest.approx(ours, abs=1e-12)


def test_a_side_that_is_told_its_base_keeps_it(files):
    prepared = prepare_sides(_request(_side(files[0]), _side(files[1], base="fixed")))
    assert (prepared.bases.left, prepared.bases.right) == ("free", "fixed")
    assert prepared.bases.differ
    assert not prepared.bases.inherited_by


def test_what_one_side_is_told_the_other_takes(files):
    prepared = prepare_sides(_request(_side(files[1], base="free"), _side(files[1])))
    assert prepared.bases.right == "free"
    assert prepared.bases.inherited_by == "right"


def test_a_file_that_says_its_base_keeps_it(tmp_path):
    floating = written(tmp_path, "floating.urdf", urdf(FLOATING))
    fixed = written(tmp_path, "fixed.xml", mjcf(""))
    prepared = prepare_sides(_request(_side(fixed), _side(floating)))
    assert (prepared.bases.left, prepared.bases.right) == ("fixed", "free")


@pytest.mark.usefixtures("bullet")
def test_of_a_urdf_that_pybullet_would_let_float_it_is_said_that_it_is_fixed(
    files: tuple[Path, Path],
) -> None:
    sides = _side(files[1]), _side(files[1], "pybullet", "engine")
    prepared = prepare_sides(_request(*sides))
    assert prepared.bases.right == "fixed"
    assert prepared.bases.floating_loader == "right"
    assert [note for note in prepared.notes if "base=free" in note]


@pytest.mark.usefixtures("bullet")
def test_a_fixed_base_that_was_asked_for_is_not_noted(files: tuple[Path, Path]) -> None:
    right = _side(files[1], "pybullet", "engine", base="fixed")
    assert not prepare_sides(_request(_side(files[1]), right)).bases.floating_loader


@pytest.mark.usefixtures("bullet")
def test_a_fixed_base_beside_an_mjcf_is_not_noted(files: tuple[Path, Path]) -> None:
    sides = _side(files[0]), _side(files[1], "pybullet", "engine")
    assert not prepare_sides(_request(*sides)).bases.floating_loader


def test_a_free_base_against_a_fixed_one_differs_whatever_else_agrees(files):
    run = run_sides(_request(_side(files[0]), _side(files[1], base="fixed")))
    comparison = compare(*run.traces)
    assert all(gap.verdict == "agrees" for gap in comparison.agreements)
    assert comparison.outcome == "differs"
    assert (comparison.bases.left, comparison.bases.right) == ("free", "fixed")
    assert not any("number 0" in line and "joint" in line for line in run.unmatched)


def test_the_base_is_one_difference_and_cannot_be_equalized(files):
    sides = _side(files[0]), _side(files[1], base="fixed")
    prepared = prepare_sides(_request(*sides))
    left, right = (rerun.model for rerun in prepared.reruns)
    assert prepared.matched is not None
    rows = differences_of(left, right, prepared.matched)
    (base,) = [row for row in rows if row.subject == "base"]
    assert (base.values[0].left, base.values[0].right) == ("free", "fixed")
    assert base.refused
    assert not [row for row in rows if row.subject == "extra joint"]


def test_bases_without_a_name_are_paired(files):
    prepared = prepare_sides(_request(_side(files[0]), _side(files[1])))
    joints = [
        (prepared.reruns[0].model.joint_names[left], prepared.reruns[1].model.joint_names[right])
        for left, right in prepared.matched.joints
    ]
    assert ("", "floating_base_joint") in joints


def test_the_joint_that_lets_a_base_float_is_that_which_carries_the_actuated_ones(tmp_path):
    box = '<body name="box" pos="2 0 1"><freejoint/><geom size="0.1"/></body>'
    text = mjcf().split("<keyframe>")[0].replace('<body name="trunk"', f'{box}<body name="trunk"')
    path = written(tmp_path, "scene.xml", f"{text}</mujoco>")
    model = Side(str(path)).load()
    joint = free_joint_of_base(model)
    assert model.body_names[model.jnt_bodyid[joint]] == "trunk"
    assert base_of(model) == "free"
    assert free_joint_of_base(Side(str(path), options={"base": "fixed"}).load()) is None
