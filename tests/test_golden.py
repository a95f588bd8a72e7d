"""The arm against golden data of the public reference model, from outside this project."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.lab.runs.robot import ARM_TARGET

from .support.golden import angles, columns
from .support.motions import opened, path
from .support.rendering import overlaps_of_silhouettes

Golden = Callable[[str], np.ndarray]


def test_the_fingertip_is_where_the_public_model_has_it_at_200_poses(
    mujoco_arm: sm.Model, golden: Golden
) -> None:
    table = golden("golden_fk")
    assert len(table) == 200
    tip = mujoco_arm.site_id("gripperframe")
    positions = columns(table, "x_m", "y_m", "z_m")
    matrices = columns(table, *(f"R{i}{j}" for i in range(3) for j in range(3)))
    for qpos, position, matrix in zip(angles(table), positions, matrices, strict=True):
        with opened(mujoco_arm, qpos=qpos, derived=True) as (_, data):
            assert np.abs(data.site_xpos[tip] - position).max() < 1e-12
            assert np.abs(data.site_xmat[tip] - matrix).max() < 1e-12


def test_the_witness_has_the_fingertip_where_the_public_model_has_it(
    golden: Golden, pinocchio: None
) -> None:
    table = golden("golden_fk")
    tips = sm.Kinematics("so101").poses(angles(table), "gripperframe").pos
    assert np.abs(tips - columns(table, "x_m", "y_m", "z_m")).max() < 1e-12


def test_an_arm_that_is_held_moves_as_the_public_model(
    mujoco_scene: sm.Model, golden: Golden
) -> None:
    assert np.abs(path(mujoco_scene, 800) - angles(golden("golden_gravity_on"))).max() < 1e-6


def test_an_arm_that_falls_moves_as_the_public_model(
    mujoco_scene: sm.Model, golden: Golden
) -> None:
    expected = angles(golden("golden_gravity_off"))
    run = path(mujoco_scene.replace(actuation=False), 800)
    assert np.abs(np.degrees(run - expected)).max() < 0.0018
    lift = np.degrees(run[200::200, 1]).round(2)
    assert lift.tolist() == [23.88, 23.89, 23.90, 23.92]


def test_hold_until_and_after_its_first_contact(mujoco_scene: sm.Model, golden: Golden) -> None:
    table = golden("golden_hold")
    expected = angles(table)
    run = path(mujoco_scene, 400, ctrl=ARM_TARGET)
    first = int(np.flatnonzero(table["ncon"])[0])
    assert first == 56
    gaps = np.abs(run - expected).max(axis=1)
    assert gaps[:first].max() < 1e-12
    # From there on it depends on the shape of the jaw, which is ours.
    assert np.degrees(gaps.max()) < 0.0146
    assert np.degrees(gaps[-1]) < 0.0006


def test_figures_are_the_public_models(menagerie: Path) -> None:
    ours = sm.load("so101").raw
    public = sm.load("so101", menagerie=menagerie).raw
    for name in (
        "body_pos", "body_quat", "body_mass", "body_ipos", "body_iquat", "body_inertia",
        "jnt_range", "jnt_axis", "dof_armature", "dof_damping", "dof_frictionloss",
        "actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange", "actuator_forcerange",
        "site_pos", "site_quat",
    ):  # fmt: skip
        assert np.abs(getattr(ours, name) - getattr(public, name)).max() < 1e-15, name
    assert [ours.body(i).name for i in range(9)] == [public.body(i).name for i in range(9)]
    for name in ("timestep", "integrator", "cone", "impratio", "iterations", "ls_iterations"):
        assert getattr(ours.opt, name) == getattr(public.opt, name), name


def test_keyframe_pickup_is_the_public_one(mujoco_box: sm.Model, menagerie: Path) -> None:
    public = sm.load("so101/scene_box", menagerie=menagerie)
    frame, reference = mujoco_box.keyframes[1], public.keyframes[0]
    assert frame.name == reference.name == "pickup"
    assert frame.time == reference.time
    for part in ("qpos", "qvel", "ctrl"):
        assert np.abs(getattr(frame, part) - getattr(reference, part)).max() < 1e-7, part
    for part in ("body_mass", "body_inertia"):
        gap = getattr(mujoco_box.raw, part)[-1] - getattr(public.raw, part)[-1]
        assert np.abs(gap).max() < 1e-6, part


@pytest.mark.slow
def test_the_arm_looks_like_an_so101(mujoco_arm: sm.Model, menagerie: Path, tmp_path: Path) -> None:
    public = menagerie / "robotstudio_so101" / "so101.xml"
    overlaps = overlaps_of_silhouettes(mujoco_arm, public, tmp_path)
    assert len(overlaps) == 8
    assert overlaps.min() > 0.93
    assert overlaps.mean() > 0.96
