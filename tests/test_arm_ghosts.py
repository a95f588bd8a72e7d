"""A recorded arm and its model as two traces, and as a page that draws both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from statemachine import lab, load
from statemachine.interface import Model
from statemachine.lab.compare import Comparison
from statemachine.lab.identification import ghosts
from statemachine.lab.identification.arm_report import compared_arms
from statemachine.lab.identification.results import IdentificationResult, RecordingResult

from .support.arm_recordings import FPS, identification_result, recording, recording_result
from .support.browser import browser
from .support.requirements import need_engine


@pytest.fixture(scope="module")
def arm() -> Model:
    need_engine("mujoco")
    return load("so101")


def test_a_trace_has_the_angles_that_were_measured(arm: Model) -> None:
    recorded = recording()
    trace = ghosts.trace_of_angles(arm, recorded, recorded.state, "the arm")
    np.testing.assert_array_equal(trace.qpos, recorded.state)
    np.testing.assert_allclose(trace.time, np.arange(len(recorded.state)) / FPS)
    np.testing.assert_array_equal(trace.ctrl, recorded.action)


def test_bodies_are_where_the_angles_put_them(arm: Model) -> None:
    """The tip turns about the vertical axis of the pan by as much as the pan turns."""
    recorded = recording()
    angles = np.zeros_like(recorded.state)
    angles[:, 0] = np.linspace(0.0, 0.5, len(angles))
    tip, _ = ghosts.trace_of_angles(arm, recorded, angles, "the arm").site("gripperframe")
    shoulder = ghosts.trace_of_angles(arm, recorded, angles, "the arm")["xpos"][:, 2]
    way = (tip - shoulder)[:, :2]
    headings = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    np.testing.assert_allclose(np.abs(headings - headings[0]), angles[:, 0], atol=1e-9)


def test_a_stiff_arm_follows_its_commands(arm: Model) -> None:
    recorded = recording(seconds=2.0)
    angles = ghosts.simulated_angles(arm, recorded, {})
    late = np.abs(angles - recorded.action)[30:].max()
    assert 0.0 < late < 0.05


def test_fitted_figures_are_those_that_are_played(arm: Model) -> None:
    """A servo of no gain leaves its joint where it was."""
    recorded = recording()
    angles = ghosts.simulated_angles(arm, recorded, {("kp", "shoulder_pan"): 1.0})
    assert np.ptp(angles[:, 0]) < 0.05 < np.ptp(angles[:, 1])


def test_a_delay_of_a_frame_is_a_shift_by_a_frame(arm: Model) -> None:
    recorded = recording()
    plain = ghosts.simulated_angles(arm, recorded, {})
    late = ghosts.simulated_angles(arm, recorded, {("delay", None): 1.0 / FPS})
    np.testing.assert_allclose(late[5:], plain[4:-1], atol=1e-3)


@pytest.mark.parametrize(
    ("result", "names"),
    [
        (recording_result, (ghosts.MEASURED, ghosts.AS_IT_IS)),
        (identification_result, (ghosts.MEASURED, ghosts.FITTED)),
    ],
)
def test_both_arms_are_named(result: object, names: tuple[str, str]) -> None:
    need_engine("mujoco")
    made: RecordingResult | IdentificationResult = result()  # pyright: ignore
    traces = ghosts.traces_of(made)
    assert tuple(trace.header.experiment for trace in traces) == names


def test_a_fit_is_shown_on_what_was_not_fitted() -> None:
    need_engine("mujoco")
    result = identification_result()
    held_out = result.recordings.held_out
    assert held_out is not None
    measured, _ = ghosts.traces_of(result)
    np.testing.assert_array_equal(measured.qpos, held_out.state)


@pytest.mark.slow
def test_a_page_draws_one_arm_solid_and_one_as_a_ghost(tmp_path: Path) -> None:
    need_engine("mujoco")
    file = lab.write(identification_result(), tmp_path / "arm.html")
    with browser() as tab:
        tab.goto(file.as_uri())
        assert tab.locator("#stage canvas, canvas").count() >= 1
        assert "the fitted model" in tab.inner_text("body")
        tab.nothing_wrong()


def test_a_fitted_arm_agrees_within_what_measuring_makes(arm: Model) -> None:
    frames, result = recording(), identification_result()
    measured = ghosts.trace_of_angles(arm, frames, frames.state, "measured")
    off = ghosts.trace_of_angles(arm, frames, frames.state + 3.0 * result.floor, "off")
    farther = ghosts.trace_of_angles(arm, frames, frames.state + 5.0 * result.floor, "farther")
    assert _verdicts(compared_arms(result, measured, off)) == {"agrees"}
    assert _verdicts(compared_arms(result, measured, farther)) == {"differs"}
    assert _verdicts(compared_arms(recording_result(), measured, off)) == {"differs"}


def _verdicts(comparison: Comparison) -> set[str]:
    return {each.verdict for each in comparison.agreements if each.kind == "joint"}
