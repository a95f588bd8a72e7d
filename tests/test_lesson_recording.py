"""The lesson on a recording: delay or gains, what each fit leaves, and what cannot be told."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import lab
from statemachine.course.lessons import LESSONS
from statemachine.course.lessons.recording import READINGS, RecordingLessonResult, ToldFigure
from statemachine.course.lessons.recording_page import ASKED, contents
from statemachine.course.lessons.session import LessonRun, page_of_lesson
from statemachine.errors import BadInputError, MissingEngineError
from statemachine.lab.recordings.arm_source import read_arm_recordings
from statemachine.lab.recordings.synthetic_truth import synthetic_truth
from statemachine.show.blocks import Page, Question, Table, Verdict

from .support.pages import blocks, lesson_result, need_engines_of
from .support.processes import Cli

pytestmark = pytest.mark.slow  # the lesson fits for some eight seconds of the processor


@cache
def _lesson() -> RecordingLessonResult:
    return lesson_result("recording", sm.load("so101"))


@pytest.fixture
def result() -> RecordingLessonResult:
    need_engines_of("recording")
    return _lesson()


NOWHERE: Any = None  # what the page shows beside its figures


def _page(result: Any) -> Page:
    run = LessonRun(result=result, code="", printed="", arm=True)
    return page_of_lesson(LESSONS["recording"], {"mujoco": run})


def _rights(result: Any) -> list[int | None]:
    return [question.right for question in blocks(_page(result), Question)]


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.square(errors).mean()))


# What is measured.


def test_the_program_s_angles_are_compared_with_the_measured_ones(
    result: RecordingLessonResult,
) -> None:
    recording = read_arm_recordings("lerobot:synthetic", sm.load("so101"), None, {}).fitted
    assert np.array_equal(result.measured, recording.state)
    gap = lab.recording("lerobot:synthetic", "so101").gap
    assert (result.commanded, result.here) == pytest.approx((gap.commanded, gap.model))
    # The program steps by implicitfast, the fits by Euler without the error of a step.
    assert _rms(result.typed - recording.state) == pytest.approx(result.here, rel=0.05)


def test_delay_and_gains_each_take_most_of_the_gap_away_and_stand_in_for_each_other(
    result: RecordingLessonResult,
) -> None:
    assert tuple(reading.causes for reading in result.readings) == READINGS
    delay, gains, both, whole = (reading.taken for reading in result.readings)
    assert delay > 0.6
    assert gains > 0.6
    assert max(delay, gains) < both < whole
    assert delay + gains > 1.2 * both


def test_what_is_left_elsewhere_is_not_what_was_fitted(result: RecordingLessonResult) -> None:
    for reading in result.readings:
        assert reading.here != reading.elsewhere
        assert reading.elsewhere == pytest.approx(reading.here, rel=0.25)
        assert reading.taken == pytest.approx(1.0 - reading.elsewhere / result.elsewhere)


def test_the_shares_add_up_to_what_both_take_away(result: RecordingLessonResult) -> None:
    alone = {reading.causes: reading.taken for reading in result.readings}
    together = alone["delay", "gains"]
    delay, gains = result.shares["delay"], result.shares["gains"]
    assert delay is not None
    assert gains is not None
    assert delay + gains == pytest.approx(together)
    assert delay == pytest.approx((alone["delay",] + together - alone["gains",]) / 2.0)


def test_the_delay_alone_is_taken_for_the_gains_too(result: RecordingLessonResult) -> None:
    assert result.reading("delay").delay > 1.5 * synthetic_truth().delay


def test_with_everything_fitted_only_noise_is_left(result: RecordingLessonResult) -> None:
    assert result.at_floor
    assert np.degrees(result.readings[-1].here) == pytest.approx(0.056, abs=0.003)


def test_figures_are_near_the_truth_with_everything_fitted(result: RecordingLessonResult) -> None:
    assert result.figure("delay").fitted == pytest.approx(synthetic_truth().delay, abs=0.0015)
    for figure in result.figures:
        if figure.kind == "kp":
            assert figure.fitted == pytest.approx(figure.truth, rel=0.08)


def test_gravity_does_not_see_the_vertical_axis(result: RecordingLessonResult) -> None:
    pan = result.figure("offset", "shoulder_pan")
    assert pan.posterior_by_prior == pytest.approx(1.0, abs=1e-6)
    assert pan.fitted == pytest.approx(0.0, abs=1e-6)
    assert result.figure("offset", "shoulder_lift").posterior_by_prior < 0.3


def test_the_truth_is_that_of_each_figure(result: RecordingLessonResult) -> None:
    truth = synthetic_truth()
    place = truth.joints.index("elbow_flex")
    assert result.figure("kp", "elbow_flex").truth == truth.kp[place]
    assert result.figure("friction", "elbow_flex").truth == truth.frictionloss[place]
    assert result.figure("armature", "elbow_flex").truth == truth.armature[place]
    assert result.figure("viscous", "elbow_flex").truth == truth.viscous[place]
    assert result.figure("offset", "elbow_flex").truth == truth.offset[place]
    assert result.figure("payload").truth == truth.payload


# What the page says.


def _with_taken(result: RecordingLessonResult, delay: float, gains: float) -> Any:
    first, second, *others = result.readings
    return replace(
        result,
        readings=(replace(first, taken=delay), replace(second, taken=gains), *others),
    )


@pytest.mark.parametrize(
    ("delay", "gains", "right"), [(0.7, 0.2, 0), (0.2, 0.7, 1), (0.7, 0.8, 2), (0.1, 0.2, None)]
)
def test_the_right_choice_is_what_takes_most_away(
    delay: float, gains: float, right: int | None, result: RecordingLessonResult
) -> None:
    assert _rights(_with_taken(result, delay, gains))[0] == right


def _with_information(result: RecordingLessonResult, place: int) -> Any:
    """As if one of the choices were the only one that cannot be told."""

    def changed(figure: ToldFigure) -> ToldFigure:
        choices = [(kind, joint) for kind, joint in ASKED]
        if (figure.kind, figure.joint) not in choices:
            return figure
        is_untold = choices.index((figure.kind, figure.joint)) == place
        return replace(figure, posterior_by_prior=0.9 if is_untold else 0.01)

    return replace(result, figures=tuple(map(changed, result.figures)))


@pytest.mark.parametrize("place", range(len(ASKED)))
def test_the_right_choice_is_what_the_recording_tells_least_of(
    place: int, result: RecordingLessonResult
) -> None:
    assert _rights(_with_information(result, place))[1] == place


def test_where_everything_is_told_no_choice_is_right(result: RecordingLessonResult) -> None:
    assert _rights(_with_information(result, -1))[1] is None


def test_the_page_holds_and_has_a_row_for_each_reading(result: RecordingLessonResult) -> None:
    page = _page(result)
    assert page.holds
    assert _rights(result) == [2, 2]
    readings, figures = blocks(page, Table)
    assert len(readings.rows) == len(READINGS) + 1
    assert figures.rows[0][0] == "delay"


def test_a_sum_of_parts_that_is_no_more_than_the_whole_is_not_called_standing_in(
    result: RecordingLessonResult,
) -> None:
    apart = _with_taken(result, 0.3, 0.3)
    assert len(blocks(_page(apart), Verdict)) == len(blocks(_page(result), Verdict)) - 1


@pytest.mark.parametrize(("missed", "too_narrow"), [(0, False), (4, False), (5, True)])
def test_intervals_are_too_narrow_where_more_miss_than_by_chance(
    missed: int, too_narrow: bool, result: RecordingLessonResult
) -> None:
    figures = [replace(figure, truth=figure.fitted) for figure in result.figures]
    for place in range(missed):
        figures[place] = replace(figures[place], truth=figures[place].high + 1.0)
    shown = replace(result, figures=tuple(figures))
    [content] = contents({"mujoco": shown}, NOWHERE).values()
    assert (len(figures), content.expected) == (32, 30)
    assert content.is_too_narrow == too_narrow


def test_an_axis_that_is_told_makes_no_claim_that_it_is_not(result: RecordingLessonResult) -> None:
    told = _with_information(result, 0)
    assert len(blocks(_page(told), Verdict)) == len(blocks(_page(result), Verdict)) - 1


# What is refused.


def test_a_robot_that_is_no_so101_is_refused() -> None:
    with pytest.raises(BadInputError, match="compare lerobot:DIR"):
        lesson_result("recording", sm.load("tumbling"))


@pytest.mark.parametrize("module", ["pyarrow.parquet", "scipy.optimize"])
def test_without_an_extra_a_line_says_what_to_install(
    module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    need_engines_of("recording")
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, module.partition(".")[0], None)
    with pytest.raises(MissingEngineError, match=r"pip install.*\["):
        lesson_result("recording", sm.load("so101"))


@pytest.mark.slow
def test_the_lesson_is_shown_without_questions(here: Cli) -> None:
    need_engines_of("recording")
    shown = here("lesson", "recording", "--no-questions", code=0).stdout
    assert "lerobot:synthetic so101 --why" in " ".join(shown.split())
    assert "✗" not in shown


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_program_runs_on_pybullet_and_fits_on_mujoco() -> None:
    need_engines_of("recording")
    there = lesson_result("recording", sm.load("so101", backend="pybullet"))
    assert there.readings[0].taken == _lesson().readings[0].taken
    assert not np.array_equal(there.typed, _lesson().typed)
