"""What the pages of a recorded arm say, from made-up results with figures as of a real one."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from statemachine.engines.description.file_changes import UnwrittenChange
from statemachine.lab.identification.identification_page import IdentificationPage, page
from statemachine.lab.identification.parameter_texts import half_width_text
from statemachine.lab.identification.recording_page import RecordingPage, gap_table
from statemachine.lab.identification.results import (
    Hypothesis,
    IdentificationResult,
    RecordingResult,
)
from statemachine.lab.identification.units_page import UnitsPart
from statemachine.lab.identification.written_page import WrittenPart
from statemachine.lab.recordings.arm_recording import ArmRecordings
from statemachine.lab.why.rewriting import RewrittenFile
from statemachine.show.blocks import Headline, Table
from statemachine.show.first_screen import LINES, lines_of

from .support.arm_recordings import (
    gap,
    identification_result,
    recording_result,
    units,
    with_verdicts,
)
from .support.pages import blocks, shown
from .support.requirements import need_engine
from .support.screens import wide_lines


@pytest.fixture(scope="module")
def recorded() -> RecordingResult:
    need_engine("mujoco")
    return recording_result()


@pytest.fixture(scope="module")
def fitted() -> IdentificationResult:
    need_engine("mujoco")
    return identification_result()


def content(result: IdentificationResult) -> IdentificationPage:
    """Return what the first screen of a result may name."""
    return IdentificationPage(result, 6, 1, (), ())


def headline(result: RecordingResult | IdentificationResult) -> Headline:
    found = result.page().headline
    assert found is not None
    return found


# A recording and the model as it is.


@pytest.mark.parametrize(
    ("robot", "told"), [("my_own_arm", "my_own_arm"), ("so100_follower", ""), ("", "")]
)
def test_a_robot_that_is_no_so_arm_is_told(
    recorded: RecordingResult, robot: str, told: str
) -> None:
    recordings = of_robot(recorded.recordings, robot)
    assert RecordingPage(replace(recorded, recordings=recordings), ()).other_robot == told


def test_with_another_robot_the_first_screen_stays_one(fitted: IdentificationResult) -> None:
    recordings = of_robot(fitted.recordings, "my_own_arm")
    screen = replace(fitted, recordings=recordings).page()
    assert "my_own_arm" in shown(screen)
    assert lines_of(screen) <= LINES


def of_robot(recordings: ArmRecordings, robot: str) -> ArmRecordings:
    """Return recordings of a data set of a robot."""
    return replace(recordings, fitted=replace(recordings.fitted, robot=robot))


def test_the_model_is_nearer_where_its_gap_is_smaller_than_that_of_the_commands(
    recorded: RecordingResult,
) -> None:
    assert RecordingPage(recorded, ()).is_nearer
    assert math.degrees(RecordingPage(recorded, ()).difference) == pytest.approx(0.54)
    assert headline(recorded).holds


def test_a_model_that_is_no_nearer_than_the_commands_says_no(recorded: RecordingResult) -> None:
    far = replace(recorded.gap, model=recorded.gap.commanded)
    assert not headline(replace(recorded, gap=far)).holds


def test_the_verdict_has_both_gaps_in_degrees(recorded: RecordingResult) -> None:
    assert "0.54°" in headline(recorded).lead
    assert "3.40°" in headline(recorded).lead
    assert "3.94°" in headline(recorded).lead


def test_each_joint_and_all_of_them_have_a_row() -> None:
    rows = gap_table(gap(fitted=False)).rows
    assert [row[0] for row in rows][-2:] == ["gripper", "all joints"]
    assert rows[-1][1:] == ["3.94°", "3.40°"]


def test_a_fit_has_a_column_of_its_own() -> None:
    assert gap_table(gap(fitted=True)).rows[-1][1:] == ["3.94°", "3.40°", "1.08°"]


def test_joints_of_one_unit_and_source_are_grouped() -> None:
    groups = UnitsPart(units(), has_table=False).groups
    assert [len(group.units) for group in groups] == [5, 1]
    assert groups[0].spans == ["194°", "337°"]
    assert groups[1].spans == ["110°"]


def test_a_zero_is_told_where_it_is_not_that_of_the_model() -> None:
    groups = UnitsPart(units(), has_table=False).groups
    assert groups[0].zeros == []
    assert groups[1].zeros == ["-9.7°"]


def test_details_have_what_the_numbers_of_each_joint_mean(recorded: RecordingResult) -> None:
    (table, _) = blocks(recorded.page(details=True), Table)
    assert len(table.rows) == 6
    assert list(table.rows[0]) == [
        *("shoulder_pan", "-100 to 100", "1.120°", "0.0°", "2548", "0.09", "quantum")
    ]


def test_the_next_command_asks_why(recorded: RecordingResult) -> None:
    command = RecordingPage(recorded, ()).next_command
    assert command == "statemachine compare 'lerobot:data/pushes#3' so101 --why"


def test_the_next_command_keeps_what_was_asked(recorded: RecordingResult) -> None:
    asked = replace(recorded.request, calibration="c.json", names={"a": "b"}, seconds=5.0, seed=2)
    command = RecordingPage(replace(recorded, request=asked), ()).next_command
    words = command.replace("\\\n", " ").split()
    assert words[4:] == [
        *("--calibration", "c.json", "--map", "a=b", "--seconds", "5", "--seed", "2", "--why")
    ]


# What a recording tells.


def test_the_first_sentence_has_the_gaps_on_what_was_not_fitted(
    fitted: IdentificationResult,
) -> None:
    lead = headline(fitted).lead
    first = lead.partition(". ")[0]
    assert "episode 4" in first
    assert [first.index(text) for text in ("3.40°", "1.08°", "3.94°")] == sorted(
        first.index(text) for text in ("3.40°", "1.08°", "3.94°")
    )


def test_a_last_third_is_called_so(fitted: IdentificationResult) -> None:
    third = replace(fitted, gap=gap(fitted=True, part="last third"))
    assert content(third).is_last_third


@pytest.mark.parametrize(
    ("at_floor", "holds", "expected"),
    [(True, True, True), (True, False, False), (False, False, False)],
)
def test_it_holds_where_the_residual_is_at_the_floor_and_elsewhere_too(
    fitted: IdentificationResult, at_floor: bool, holds: bool, expected: bool
) -> None:
    result = replace(fitted, at_floor=at_floor, holds=holds)
    assert headline(result).holds is expected


def test_causes_stand_in_for_each_other_where_alone_they_take_away_more(
    fitted: IdentificationResult,
) -> None:
    assert [share.cause for share in content(fitted).standing_in] == ["gains", "delay"]


def test_causes_do_not_stand_in_where_alone_they_take_away_what_they_do_together(
    fitted: IdentificationResult,
) -> None:
    shares = tuple(replace(share, alone=share.share) for share in fitted.shares)
    assert content(replace(fitted, shares=shares)).standing_in == []


def test_the_largest_cause_comes_first(fitted: IdentificationResult) -> None:
    assert [share.cause for share in content(fitted).large][:2] == ["gains", "delay"]


def test_a_reading_that_fits_better_is_told(fitted: IdentificationResult) -> None:
    sign, other = fitted.hypotheses
    better = replace(fitted, hypotheses=(replace(sign, verdict="fits better"), other))
    assert [each.name for each in content(better).better] == ["the sign of elbow_flex"]


def test_no_reading_that_fits_worse_is_told(fitted: IdentificationResult) -> None:
    assert content(fitted).better == []


def with_play(fitted: IdentificationResult) -> IdentificationResult:
    """Return a result in which play of two joints fits better, and of one it cannot be told."""
    said = {"elbow_flex": "fits better", "wrist_flex": "fits better", "gripper": "cannot tell"}
    tried = [
        Hypothesis(f"play of {joint}", math.radians(0.06), 30.0, verdict, math.radians(0.31))  # pyright: ignore[reportArgumentType]
        for joint, verdict in said.items()
    ]
    return replace(fitted, hypotheses=(*fitted.hypotheses, *tried))


def test_what_the_model_lacks_is_told_with_its_size_and_is_no_other_reading(
    fitted: IdentificationResult,
) -> None:
    play = content(with_play(fitted))
    assert play.lacking == ["play of elbow_flex (0.31°)", "play of wrist_flex (0.31°)"]
    assert play.better == []


def test_play_is_on_the_first_screen_which_stays_one(fitted: IdentificationResult) -> None:
    first = page(with_play(fitted))
    assert "play of wrist_flex" in shown(first)
    assert lines_of(first) <= LINES
    assert not wide_lines(shown(page(with_play(fitted), details=True)).splitlines())


def test_only_joints_of_which_something_is_determined_have_a_row(
    fitted: IdentificationResult,
) -> None:
    table = content(fitted).by_joint
    assert list(table.headers) == [
        *("fitted", "kp, N·m/rad", "viscous, N·m·s/rad", "friction, N·m")
    ]
    assert [row[0] for row in table.rows] == ["shoulder_lift", "elbow_flex", "the model"]
    assert table.rows[0][1] == "8.50 ± 2 %"
    assert table.rows[-1][1:] == ["998", "3.33", "0.0520"]


def test_what_is_not_determined_of_such_a_joint_is_a_question_mark(
    fitted: IdentificationResult,
) -> None:
    parameters = with_verdicts(
        fitted.parameters,
        lambda p: p.verdict == "determined" and (p.kind, p.joint) != ("kp", "elbow_flex"),
    )
    part = content(replace(fitted, parameters=parameters))
    assert part.by_joint.rows[1][:2] == ["elbow_flex", "?"]
    assert part.mark == " (?)"


def test_a_table_without_a_question_mark_needs_no_key_to_it(fitted: IdentificationResult) -> None:
    assert content(fitted).undetermined
    assert content(fitted).mark == ""


def test_delay_and_payload_are_told_in_the_units_that_people_use(
    fitted: IdentificationResult,
) -> None:
    assert content(fitted).of_arm == [
        "delay 106.0 ms (103.9 to 108.1)",
        "payload 60.0 g (58.8 to 61.2)",
    ]


def test_above_the_floor_the_reading_that_fits_best_is_in_the_verdict(
    fitted: IdentificationResult,
) -> None:
    sign, other = fitted.hypotheses[:2]
    best = replace(sign, verdict="fits better", residual=0.5 * other.residual)
    second = replace(other, verdict="fits better")
    result = replace(fitted, at_floor=False, hypotheses=(second, best))
    assert content(result).likely == best
    assert content(result).better == [second]
    assert best.name in headline(result).lead


def test_a_written_file_that_lacks_figures_is_told_to_be_farther(
    fitted: IdentificationResult,
) -> None:
    rewritten = RewrittenFile("a.xml", "so101.xml", (), (), 0.1, 0.2, "joints", "rad")
    far, near = (
        WrittenPart(replace(fitted, rewritten=rewritten), replace(rewritten, gap=gap), False)
        for gap in (2.0 * (fitted.gap.fitted or 0.0), fitted.gap.fitted)
    )
    assert (far.is_farther, near.is_farther) == (True, False)
    assert far.unchanged == len(content(fitted).undetermined)


def test_a_written_file_takes_no_joint_from_the_first_screen(
    fitted: IdentificationResult,
) -> None:
    """What was not written for one reason is one row."""
    joints = ("shoulder_lift", "elbow_flex", "wrist_flex")
    refused = tuple(UnwrittenChange(f"offset of {joint}", "calibrated") for joint in joints)
    rewritten = RewrittenFile("a.xml", "so101.xml", (), refused, 0.01, 0.2, "joints", "rad")
    (row,) = WrittenPart(fitted, rewritten, True).unwritten
    assert len(row.names) == len(joints)
    tables = [
        blocks(page(result), Table)[-1] for result in (fitted, replace(fitted, rewritten=rewritten))
    ]
    assert tables[0].rows == tables[1].rows


def test_reasons_are_counted_where_there_are_several(fitted: IdentificationResult) -> None:
    assert content(fitted).reasons == ["too little information"]
    told, *others = fitted.parameters
    lacking = replace(others[-1], reasons=("starts disagree",))
    both = replace(fitted, parameters=(told, *others[:-1], lacking))
    assert content(both).reasons == ["too little information 24", "starts disagree 1"]


def test_the_motion_that_tells_the_most_is_named(fitted: IdentificationResult) -> None:
    (motion,) = content(fitted).motions
    assert motion.motion == "a slow chirp of shoulder_lift"
    assert len(motion.names) == 24


def test_a_recording_may_determine_nothing(fitted: IdentificationResult) -> None:
    nothing = with_verdicts(fitted.parameters, lambda _: False)
    shown_content = content(replace(fitted, parameters=nothing, at_floor=False))
    assert shown_content.none_determined
    assert shown_content.by_joint.rows == []


def test_no_motion_tells_what_none_was_found_for(fitted: IdentificationResult) -> None:
    from statemachine.lab.identification.unknown import undeterminable

    changed = tuple(
        replace(each, motion="") if each.kind == "offset" and each.joint == "gripper" else each
        for each in fitted.parameters
    )
    assert undeterminable(changed) == ["offset of gripper"]


def test_details_have_both_tables_of_parameters(fitted: IdentificationResult) -> None:
    titles = {table.title: table for table in blocks(fitted.page(details=True), Table)}
    assert len(titles["What this recording determines"].rows) == 8
    assert len(titles["What this recording cannot tell"].rows) == 24


def test_a_wide_interval_is_seen_to_be_wide(fitted: IdentificationResult) -> None:
    kp = next(each for each in fitted.parameters if each.verdict == "determined")
    wide = replace(kp, fitted=36.0, low=14.0, high=58.0)
    assert half_width_text(wide) == "61 %"


def test_what_the_model_has_none_of_has_an_interval_in_its_unit(
    fitted: IdentificationResult,
) -> None:
    delay = next(each for each in fitted.parameters if each.kind == "delay")
    assert half_width_text(replace(delay, low=0.030, high=0.032)) == "1.0"


def test_a_determined_figure_says_how_many_times_that_of_the_model_it_is(
    fitted: IdentificationResult,
) -> None:
    titles = {table.title: table for table in blocks(fitted.page(details=True), Table)}
    rows = {row[0]: list(row[1:]) for row in titles["What this recording determines"].rows}
    assert rows["kp of elbow_flex"] == ["998", "8.50 N·m/rad", "8.33 to 8.67", "×0.0085"]
    assert rows["delay"][-1] == "–"


@pytest.mark.parametrize(
    ("determined", "at_floor"),
    [("none", False), ("none", True), ("some", True), ("all", True)],
)
def test_the_first_screen_has_24_lines_of_80_columns(
    fitted: IdentificationResult, determined: str, at_floor: bool
) -> None:
    verdicts = {
        "none": with_verdicts(fitted.parameters, lambda _: False),
        "some": fitted.parameters,
        "all": with_verdicts(fitted.parameters, lambda _: True),
    }
    result = replace(fitted, at_floor=at_floor, parameters=verdicts[determined])
    assert lines_of(page(result)) <= LINES
    assert not wide_lines(shown(page(result)).splitlines())


@pytest.mark.parametrize("details", [False, True])
def test_the_page_of_a_recording_is_80_columns_wide(
    recorded: RecordingResult, details: bool
) -> None:
    assert not wide_lines(shown(recorded.page(details)).splitlines())


def test_details_are_80_columns_wide(fitted: IdentificationResult) -> None:
    assert not wide_lines(shown(page(fitted, details=True)).splitlines())
