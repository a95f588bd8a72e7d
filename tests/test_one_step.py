"""One step from the same state: the stage at which two sides part, and the joint or pair."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine import lab
from statemachine.errors import BadInputError, EngineWarning
from statemachine.lab.compare import rerun_of
from statemachine.lab.compare.one_step import RELATIVE, OneStep, StageGap, one_step
from statemachine.lab.compare.sides import Request
from statemachine.lab.compare.stages import STAGES
from statemachine.lab.questions.one_step import page
from statemachine.lab.questions.requests.one_step import OneStepRequest, OneStepResult
from statemachine.lab.recordings import Rerun
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.why import WhyRequest, explain
from statemachine.show.blocks import Code, Page, Table

from .support.claims import assert_has, refused
from .support.pages import blocks, shown
from .support.requirements import need_engine
from .support.small_models import LINKS_AND_BALL, TWO_LINKS, model_of

CHANGES = {
    "kinematics": ('pos="0.3 0 0"><joint', 'pos="0.303 0 0"><joint', "lower"),
    "mass matrix": ('size="0.02"', 'size="0.02" mass="0.5"', "elbow"),
    "actuator": ('kp="10"', 'kp="11"', "elbow"),
    "passive": ('name="shoulder" axis="0 1 0" damping="0.1"',
                'name="shoulder" axis="0 1 0" damping="0.2"', "shoulder"),
    "contacts found": ('name="floor" type="plane"', 'name="floor" pos="0 0 0.001" type="plane"',
                       "ball on floor"),
    "contact force": ('name="floor" type="plane"', 'name="floor" type="plane" solref="0.05 1"',
                      "ball on floor"),
    "other constraints": ('frictionloss="0.01"', 'frictionloss="0.02"', "elbow (dry friction)"),
    "velocity update": ('integrator="implicitfast"/>',
        'integrator="Euler"><flag eulerdamp="disable"/></option>', ""),
}  # fmt: skip


def rerun(model: sm.Model, seconds: float = 0.5) -> Rerun:
    return Rerun(model, lambda _: lambda _model, _data: (0.6, -0.9), seconds)


def stepped(folder: Path, text: str, **how: Any) -> OneStep:
    """Return the robot, and the same with another text."""
    one, two = model_of(folder, LINKS_AND_BALL, "one.xml"), model_of(folder, text, "two.xml")
    return one_step(rerun(one), two, **how)


def first(found: OneStep) -> str:
    return found.first.stage if found.first else ""


def gap_of(found: OneStep, name: str) -> StageGap:
    (gap,) = (gap for gap in found.stages if gap.stage == name)
    return gap


def page_of(found: OneStep, details: bool = False) -> Page:
    request = OneStepRequest(Request(("hold",), model="so101"))
    return page(OneStepResult(**vars(found), request=request), details)


def test_identical_sides_give_exactly_zero_in_every_stage(tmp_path: Path) -> None:
    found = stepped(tmp_path, LINKS_AND_BALL)
    assert [gap.stage for gap in found.stages] == list(STAGES)
    for gap in found.stages:
        assert_has(gap, worst=0.0, null=0.0, is_available=True)
    assert found.is_exact
    assert not found.spikes
    assert page_of(found).holds


def test_the_verdict_comes_first_and_the_next_command_last(tmp_path: Path) -> None:
    old, new, _ = CHANGES["passive"]
    written = page_of(stepped(tmp_path, LINKS_AND_BALL.replace(old, new, 1)))
    assert written.headline is not None
    assert not written.holds
    (code,) = blocks(written, Code)
    assert written.blocks[-1] is code
    assert code.lines == ["statemachine compare hold so101 --one-step --details"]


def test_details_have_a_row_for_every_stage(tmp_path: Path) -> None:
    old, new, _ = CHANGES["passive"]
    found = stepped(tmp_path, LINKS_AND_BALL.replace(old, new, 1))
    (worst,) = blocks(page_of(found), Table)
    stages = [row[0] for row in worst.rows]
    assert stages == [gap.stage for gap in found.differing][: len(stages)]
    everything = blocks(page_of(found, details=True), Table)[0]
    assert [row[0] for row in everything.rows] == list(STAGES)


@pytest.mark.parametrize("stage", CHANGES)
def test_a_change_shows_at_its_own_stage_first(stage: str, tmp_path: Path) -> None:
    old, new, where = CHANGES[stage]
    assert LINKS_AND_BALL.count(old) >= 1
    found = stepped(tmp_path, LINKS_AND_BALL.replace(old, new, 1))
    assert first(found) == stage
    assert where in found.first.where


def test_points_that_are_apart_are_no_depth(tmp_path: Path) -> None:
    """Within a margin MuJoCo pushes before anything touches; the shapes are the same."""
    found = stepped(tmp_path, LINKS_AND_BALL.replace('size="0.05"', 'size="0.05" margin="0.01"'))
    assert first(found) == "contact force"
    assert_has(gap_of(found, "contacts found"), worst=0.0, beyond=0)


def test_a_contact_shows_from_the_moment_at_which_it_begins(tmp_path: Path) -> None:
    old, new, _ = CHANGES["contact force"]
    found = stepped(tmp_path, LINKS_AND_BALL.replace(old, new))
    # The ball falls 0.15 m.
    assert found.first.first == pytest.approx((2 * 0.15 / 9.81) ** 0.5, abs=0.01)
    assert_has(found.spikes[0], stage="contact force", where="ball on floor")
    assert len({spike.at for spike in found.spikes}) == len(found.spikes)


def test_a_later_stage_leads_where_no_earlier_one_differs(tmp_path: Path) -> None:
    """Dry friction differs all the time, contacts from 0.17 s on: each has its own cause."""
    text = LINKS_AND_BALL
    for stage in ("contact force", "other constraints"):
        text = text.replace(*CHANGES[stage][:2])
    found = stepped(tmp_path, text)
    leads = {gap.stage: gap.first_count for gap in found.stages if gap.first_count}
    apart = leads["other constraints"]
    assert first(found) == "contact force"
    assert leads["contact force"] == gap_of(found, "contact force").beyond
    assert leads == {"contact force": found.moments - apart, "other constraints": apart}
    assert f"other constraints ({apart})" in " ".join(shown(page_of(found, True)).split())


def test_the_verdict_names_no_cause_that_why_contradicts() -> None:
    """A link 0.5 % heavier shows first in a step, and damping of three halves moves the arm."""
    hold, one = scenario("hold"), sm.load("so101")
    two = one.replace(damping=1.5 * one.dof_damping, mass=1.005 * one.body_mass)
    assert explain(WhyRequest(one, two, hold, jobs=1)).shares[0].name.startswith("damping")
    found = one_step(rerun_of(hold, one), two, moments=50)
    assert first(found) == "mass matrix"
    largest = max(found.differing, key=lambda gap: gap.worst if gap.unit == "N·m" else 0.0)
    assert largest.stage == "passive"
    (code,) = blocks(page_of(found), Code)
    assert code.lines[0].endswith("--one-step --details")


def test_joints_in_another_order_are_matched(tmp_path: Path) -> None:
    head, links, ball, tail = re.split(
        r'(?=<body name="(?:upper|ball)")|(?=</world)', LINKS_AND_BALL
    )
    assert stepped(tmp_path, head + ball + links + tail).first is None


def test_what_does_not_count_is_relative_to_the_scale(tmp_path: Path) -> None:
    stiffer = LINKS_AND_BALL.replace('kp="10"', 'kp="10.0001"')
    assert first(stepped(tmp_path, stiffer)) == "actuator"
    assert first(stepped(tmp_path, stiffer, relative=1e-3)) == ""
    assert RELATIVE == 1e-6


def test_moments_are_spread_over_the_run(tmp_path: Path) -> None:
    found = stepped(tmp_path, LINKS_AND_BALL, moments=20)
    assert_has(found, moments=20, every=5, until=pytest.approx(0.475))
    refused(
        (BadInputError, "one moment", lambda: stepped(tmp_path, LINKS_AND_BALL, moments=0)),
    )


def test_models_without_a_common_joint_are_refused(tmp_path: Path) -> None:
    refused((BadInputError, "no joint in common", lambda: stepped(tmp_path, "<mujoco/>")))


@pytest.fixture(
    scope="module",
    params=[("mujoco", "pybullet"), ("pybullet", "mujoco")],
    ids=lambda order: " and ".join(order),
)
def engines(request: pytest.FixtureRequest) -> Any:
    """Return one step of hold on both engines; the first of them leads."""
    need_engine("pybullet")
    hold = scenario("hold")
    one, two = (sm.load(hold.model, backend=name) for name in request.param)
    return one_step(rerun_of(hold, one, seconds=0.5), two)


def test_the_engines_differ_first_in_the_force_of_the_gripper_on_the_floor(engines: Any) -> None:
    """PyBullet pushes when the stud is 0.7 mm above the floor."""
    assert first(engines) == "contact force"
    assert engines.first.first == pytest.approx(0.27, abs=0.011)
    assert "gripper on floor" in engines.first.where


def test_the_engines_see_a_contact_in_the_same_depth(engines: Any) -> None:
    assert gap_of(engines, "contacts found").worst < 1e-6


def test_before_the_first_touch_all_stages_of_the_engines_are_alike(engines: Any) -> None:
    """But for rounding, mass matrices that each engine computes itself included."""
    began = engines.first.first or 0.0
    assert all((gap.first or 1.0) >= began for gap in engines.stages)


def test_all_stages_of_the_engines_are_compared(engines: Any) -> None:
    assert {gap.stage for gap in engines.stages if gap.is_available} == set(STAGES)
    assert any("by construction" in note for note in engines.notes)


@pytest.mark.usefixtures("bullet")
def test_the_null_shows_what_a_restore_forgets() -> None:
    """PyBullet's memory of contacts cannot be read: put back, it does not go on as it did."""
    box = scenario("box")
    side = rerun_of(box, sm.load(box.model, backend="pybullet"), seconds=0.3)
    found = {gap.stage: gap for gap in one_step(side, side.model, moments=20).stages}
    assert found["contact force"].null > 1e-3
    assert found["kinematics"].null == 0
    assert not any(gap.beyond for gap in found.values())


@pytest.mark.usefixtures("bullet")
def test_an_engine_that_does_not_tell_a_stage_is_not_guessed_at() -> None:
    fall = scenario("fall")
    fresh = sm.load(fall.model, backend="pybullet", defaults="engine")
    one, two = (rerun_of(fall, side, seconds=0.2) for side in (sm.load(fall.model), fresh))
    found = {gap.stage: gap for gap in one_step(one, two.model, moments=10).stages}
    assert found["passive"].reason
    assert not found["passive"].is_available
    # It has no rotors, which the model's motors have.
    assert (found["mass matrix"].beyond, found["kinematics"].beyond) == (10, 0)


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize("order", [("mujoco", "pybullet"), ("pybullet", "mujoco")])
def test_one_step_starts_the_second_file_with_the_activations_of_the_first(
    order: tuple[str, str], tmp_path: Path
) -> None:
    """They act on; the second file has its actuators in another order, one of another kind."""
    drives = [
        '<general name="a" joint="shoulder" dyntype="filter" dynprm="0.2" gainprm="3"/>',
        '<general name="b" joint="elbow" dyntype="integrator" gainprm="5"/>',
    ]
    one, two = (
        model_of(
            tmp_path, TWO_LINKS.format(mass=0.3, drives="".join(rows), keys=""), name, backend=b
        )
        for name, b, rows in zip(("one.xml", "two.xml"), order, (drives, drives[::-1]), strict=True)
    )
    assert one_step(rerun(one), two).first is None


@pytest.fixture(scope="module")
def motrix_steps() -> OneStepResult:
    """Steps of the arm that touches its floor, on MuJoCo and on MotrixSim."""
    need_engine("motrix")
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        return lab.one_step(backends=("mujoco", "motrix"), what="hold", seconds=0.4)


def test_single_precision_is_no_difference_of_a_stage(motrix_steps: OneStepResult) -> None:
    """MotrixSim finds the same contacts to 5e-8 m, and makes other forces of them."""
    assert motrix_steps.first is not None
    assert motrix_steps.first.stage == "contact force"


def test_what_the_velocity_changes_by_is_not_compared_with_an_acceleration(
    motrix_steps: OneStepResult,
) -> None:
    gaps = {gap.stage: gap for gap in motrix_steps.stages}
    assert not gaps["acceleration"].is_available
    assert gaps["velocity update"].is_available
