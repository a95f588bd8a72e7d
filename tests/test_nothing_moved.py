"""A comparison in which nothing moves compares nothing: no ✓, and what to run instead."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from statemachine.lab.compare import Request, Side, compare
from statemachine.lab.compare.instead import instead_of
from statemachine.lab.questions import comparison as shown
from statemachine.lab.questions.convergence import page as limits
from statemachine.lab.questions.junit import junit
from statemachine.lab.questions.requests import causes, converge, gap
from statemachine.lab.questions.requests.gap import CompareRequest, CompareResult
from statemachine.lab.questions.requests.versions import (
    ReleasePair,
    VersionsRequest,
    VersionsResult,
)
from statemachine.lab.questions.versions import page as versions
from statemachine.lab.recordings import Rerun
from statemachine.lab.why import Explanation
from statemachine.lab.why import page as why
from statemachine.lab.why.verdict import Facts, GapVerdict, verdict_of

from .support.files import written
from .support.processes import Cli
from .support.small_models import model_of

# Balanced about its axis, along which no gravity acts. It is made of what `TURNED` is made of,
# turned about its middle.
ROTOR = """<mujoco><compiler angle="radian"/><worldbody><body name="rotor" pos="0 0 0.5">
  <inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.06 0.07"/>
  <joint name="spin" axis="1 0 0" range="-3 3" limited="true"/></body></worldbody></mujoco>"""
TURNED = ROTOR.replace('mass="2"', 'mass="2" quat="0.9 0 0 0.4358899"')
MOTOR = '<actuator><motor joint="spin" ctrlrange="-0.05 0.05" ctrllimited="true"/></actuator>'
# Its servo is told where it is already.
HELD = """<mujoco><worldbody><body name="disc" pos="0 0 0.5"><joint name="spin" axis="0 0 1"/>
  <geom type="cylinder" size="0.1 0.02" mass="1"/></body></worldbody>
  <actuator><position joint="spin" kp="5" ctrlrange="-1 1" ctrllimited="true"/></actuator>
  </mujoco>"""
# A box that stands on a floor.
STANDING = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 0.1"/>
  <body name="box" pos="0 0 0.04995"><freejoint/><geom type="box" size="0.05 0.05 0.05" mass="1"/>
  </body></worldbody></mujoco>"""
# An arm that a stiff servo holds level: it sags by 0.003°.
STIFF = """<mujoco><worldbody><body name="arm"><joint name="lift" axis="0 1 0" damping="20"/>
  <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="0.2"/></body></worldbody>
  <actuator><position joint="lift" kp="6000"/></actuator></mujoco>"""


def request(experiment: str, *files: Path) -> Request:
    """Return the same engine on both sides."""
    return Request((experiment,), sides=(Side(str(files[0])), Side(str(files[-1]))))


def compared(experiment: str, *files: Path) -> CompareResult:
    return gap.answer(CompareRequest(request(experiment, *files), uncertainty=None))


def explained(experiment: str, *files: Path) -> Explanation:
    asked = causes.ExplainRequest(request(experiment, *files), uncertainty=None, jobs=1)
    return causes.answer(asked)


@pytest.fixture
def rotors(tmp_path: Path) -> tuple[Path, Path]:
    return written(tmp_path / "left.xml", ROTOR), written(tmp_path / "right.xml", TURNED)


@pytest.fixture
def driven(tmp_path: Path) -> tuple[Path, Path]:
    """Return the same rotors with a motor."""
    left, right = (text.replace("</mujoco>", f"{MOTOR}</mujoco>") for text in (ROTOR, TURNED))
    return written(tmp_path / "driven.xml", left), written(tmp_path / "driven_too.xml", right)


def inertia(text: str) -> float:
    """Return the inertia about the joint, from MuJoCo itself."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((1, 1))
    mujoco.mj_fullM(model, data, full)
    return float(full[0, 0])


def test_rotors_of_other_inertia_at_rest_were_not_compared(rotors: tuple[Path, Path]) -> None:
    assert inertia(TURNED) > 1.5 * inertia(ROTOR)
    comparison = compared("fall", *rotors).comparison
    assert comparison.outcome == "nothing moved"
    assert not comparison.agrees
    motion = comparison.motion
    assert (motion.angle, motion.length, motion.energy) == (0.0, None, 0.0)
    assert motion.seconds == pytest.approx(2.0)
    assert not motion.is_compared


def test_waves_tell_the_rotors_apart(driven: tuple[Path, Path]) -> None:
    assert compared("waves", *driven).comparison.outcome == "differs"


def test_what_is_named_instead_does_move_it(driven: tuple[Path, Path]) -> None:
    result = compared("fall", *driven)
    assert result.comparison.outcome == "nothing moved"
    assert result.instead is not None
    assert result.instead.experiment == "waves"
    again = compared(result.instead.experiment, driven[0])
    assert again.comparison.motion.moved
    assert again.comparison.outcome == "agrees"
    assert again.instead is None


def test_without_actuators_it_says_what_is_missing(rotors: tuple[Path, Path]) -> None:
    instead = compared("fall", *rotors).instead
    assert instead is not None
    assert (instead.experiment, instead.has_actuators) == ("", False)


def test_gravity_is_named_where_nothing_can_be_commanded(tmp_path: Path) -> None:
    text = STANDING.replace("0.04995", "0.4")
    assert instead_of(model_of(tmp_path, text), "fall").experiment == "gravity"


@pytest.mark.parametrize("experiment", ["fall", "gravity"])
def test_the_line_names_waves_and_the_page_does_not_hold(
    experiment: str, driven: tuple[Path, Path]
) -> None:
    page = shown.page(compared(experiment, *driven))
    assert not page.holds
    assert page.headline is not None
    assert "waves" in page.headline.text
    assert "0°" in page.headline.text


def test_why_has_no_cause_of_no_motion(rotors: tuple[Path, Path]) -> None:
    found = explained("fall", *rotors)
    assert found.shares  # the inertia differs
    assert found.verdict == GapVerdict((), "nothing moved", holds=False, divides=False)
    assert not why.page(found).holds


def test_why_names_what_moves_them(driven: tuple[Path, Path]) -> None:
    found = explained("fall", *driven)
    assert found.instead is not None
    assert found.instead.experiment == "waves"
    cause = explained("waves", *driven)
    assert cause.motion.moved
    assert cause.verdict.answer == "cause"
    assert cause.verdict.holds


def test_files_that_are_the_same_move_alike_only_where_they_move(tmp_path: Path) -> None:
    file = written(tmp_path / "stiff.xml", STIFF)
    found = explained("droop", file)
    assert found.motion.moved
    assert found.verdict.answer == "rounding"
    assert found.verdict.holds


@pytest.mark.parametrize("state", ["rounding", "within", "beyond"])
def test_a_gap_that_is_there_is_one_whatever_moves(state: str) -> None:
    """Only what is no gap is said to be none because nothing moved."""
    still = verdict_of(Facts(state, True, False, False, moved=False))  # type: ignore[arg-type]
    assert (still.answer == "nothing moved") == (state == "rounding")


def test_converge_says_nothing_of_a_rest(rotors: tuple[Path, Path]) -> None:
    found = converge.answer(converge.ConvergeRequest(request("fall", *rotors)))
    assert found.is_still
    assert not limits(found).holds


def test_a_body_that_stands_is_compared_by_what_it_presses_with(tmp_path: Path) -> None:
    one = written(tmp_path / "one.xml", STANDING)
    found = compared("gravity", one).comparison
    assert not found.motion.moved
    assert found.motion.loaded
    assert found.motion.force == pytest.approx(9.81, rel=0.05)
    assert found.outcome == "agrees"
    heavier = written(tmp_path / "two.xml", STANDING.replace('mass="1"', 'mass="1.2"'))
    assert compared("gravity", one, heavier).comparison.outcome == "differs"


def test_a_sag_below_the_tolerance_is_compared_by_its_energy(tmp_path: Path) -> None:
    one = written(tmp_path / "one.xml", STIFF)
    found = compared("droop", one).comparison
    assert found.motion.angle is not None
    assert 0 < found.motion.angle < 2 * np.pi / 4096
    assert (found.motion.moved, found.motion.loaded, found.outcome) == (False, True, "agrees")
    heavier = written(tmp_path / "two.xml", STIFF.replace('mass="0.2"', 'mass="0.3"'))
    assert compared("droop", one, heavier).comparison.outcome == "differs"


def test_a_servo_that_is_where_it_is_told_to_be_holds_nothing(tmp_path: Path) -> None:
    """`droop` on a disc about the vertical: nothing acts. `hold` sends it elsewhere."""
    file = written(tmp_path / "held.xml", HELD)
    assert compared("droop", file).comparison.outcome == "nothing moved"
    assert compared("hold", file).comparison.outcome == "agrees"


def test_a_tolerance_as_wide_as_the_motion_is_still_a_comparison(tmp_path: Path) -> None:
    file = written(tmp_path / "held.xml", HELD)
    asked = CompareRequest(request("hold", file), tolerances={"joint": 3.0}, uncertainty=None)
    assert gap.answer(asked).comparison.outcome == "agrees"


def test_a_gap_where_nothing_moved_is_a_difference(tmp_path: Path) -> None:
    """Both rest, in two places: that is no agreement that nobody tested."""
    left = Rerun(model_of(tmp_path, HELD), lambda _: None, 0.2).record()
    right = Rerun(model_of(tmp_path, HELD), lambda _: lambda _model, _data: (0.3,), 0.2,
                  qpos=np.array([0.3])).record()  # fmt: skip
    assert compare(left, right).outcome == "differs"


def test_ci_fails_where_nothing_was_compared(rotors: tuple[Path, Path]) -> None:
    (suite,) = ElementTree.fromstring(junit([compared("fall", *rotors).comparison]))
    (failure,) = suite.findall("testcase[failure]")
    assert failure.get("name") == "motion"
    assert suite.get("failures") == "1"


def test_releases_that_move_nothing_are_not_the_same(rotors: tuple[Path, Path]) -> None:
    comparison = compared("fall", rotors[0]).comparison
    asked = VersionsRequest(Request(("fall",), model=str(rotors[0])), "3.3.7")
    pair = ReleasePair("3.3.7", "4.0.0", ("mujoco==3.3.7", "mujoco"), comparison, ())
    assert not versions(VersionsResult(asked, (pair,))).holds


def test_the_command_ends_with_1_and_json_says_why(rotors: tuple[Path, Path], here: Cli) -> None:
    said = json.loads(here("compare", "fall", *rotors, "--no-chaos", "--json", code=1).stdout)
    assert said["comparison"]["outcome"] == "nothing moved"
    assert said["comparison"]["motion"]["moved"] is False
    assert said["instead"]["has_actuators"] is False
    cause = json.loads(here("compare", "fall", *rotors, "--why", "--json", code=1).stdout)
    assert cause["verdict"]["answer"] == "nothing moved"
    assert cause["motion"]["moved"] is False


@pytest.mark.usefixtures("bullet")
def test_rest_on_two_engines_is_rest(tmp_path: Path) -> None:
    file = str(written(tmp_path / "left.xml", ROTOR))
    sides = (Side(file), Side(file, "pybullet"))
    asked = CompareRequest(Request(("fall",), sides=sides), uncertainty=None)
    assert gap.answer(asked).comparison.outcome == "nothing moved"


@pytest.mark.parametrize("name", ["hold", "gravity", "droop", "fall", "waves"])
def test_every_experiment_compares_the_arm(name: str) -> None:
    """`droop` moves it by less than its tolerance, 0.05°: there the energy is compared."""
    sides = Side("so101/scene"), Side("so101/scene")
    asked = CompareRequest(Request((name,), sides=sides, seconds=0.3), uncertainty=None)
    comparison = gap.answer(asked).comparison
    assert comparison.motion.moved == (name != "droop")
    assert comparison.outcome == "agrees"
