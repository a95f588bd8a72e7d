"""The page of `compare --why`: the verdict first, on one screen, and everything under --details."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from statemachine.engines.description.file_changes import AttributeChange, UnwrittenChange
from statemachine.lab.compare import Request, Side
from statemachine.lab.compare.typed_command import TypedCommand, typed_command
from statemachine.lab.questions.requests.causes import ExplainRequest, answer
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.why import Explanation, Share
from statemachine.lab.why.answer_page import CauseSentence, sentence_of
from statemachine.lab.why.apart_page import ApartSentence
from statemachine.lab.why.changes_page import WhyChanges
from statemachine.lab.why.locate import Localisation
from statemachine.lab.why.page import WhyPage, page
from statemachine.lab.why.rewriting import RewrittenFile
from statemachine.lab.why.table_page import is_noisy, summary_table
from statemachine.measures.text import percent
from statemachine.show.blocks import Code, Section, Table, Verdict
from statemachine.show.first_screen import COLUMNS, LINES

from .support.explained import ALONE, ARM, changed, explained, with_changes
from .support.files import written
from .support.pages import blocks, shown

COMMAND = TypedCommand(("statemachine", "compare", "waves", "left.xml", "right.xml"), ("--why",))


def chain(joints: int, damping: float) -> str:
    """Return a chain of links that hang, each joint with another damping and a long name."""
    text, end = "", ""
    for number in range(joints):
        text += (
            f'<body pos="0 0 -0.1"><joint name="a_joint_whose_name_is_long_{number}" axis="0 1 0" '
            f'damping="{damping * (1 + number):.3f}"/><geom size="0.02" mass="0.1"/>'
        )
        end += "</body>"
    return (
        '<mujoco><option integrator="implicitfast"/><worldbody>'
        f'<body pos="0 0 2"><joint name="root" axis="1 0 0"/><geom size="0.02"/>{text}{end}</body>'
        "</worldbody></mujoco>"
    )


@pytest.fixture(scope="module")
def gains(tmp_path_factory: pytest.TempPathFactory) -> Explanation:
    """Return one cause that explains the gap."""
    folder = tmp_path_factory.mktemp("gains")
    return explained(folder, ARM, changed(ARM, ALONE["gains"]), uncertain=None, jobs=1)


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Explanation:
    """Return an explanation with twelve causes of long names."""
    folder = tmp_path_factory.mktemp("many")
    fall = replace(scenario("fall"), seconds=0.4)
    left, right = chain(12, 0.01), chain(12, 0.012)
    return explained(folder, left, right, scenario=fall, uncertain=None, jobs=1)


def assert_one_screen(result: Explanation) -> None:
    lines = shown(page(result)).splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= COLUMNS


def test_twelve_causes_with_long_names_fit_on_one_screen(many: Explanation) -> None:
    assert len(many.shares) >= 12
    assert_one_screen(replace(many, command=COMMAND))
    (table,) = blocks(page(many), Table)
    assert 2 <= len(table.rows) <= 9
    assert table.rows[-1][0] == f"{len(many.shares) - len(table.rows) + 1} more"


def test_the_largest_shares_come_first_and_the_rest_is_counted_with_its_share(
    many: Explanation,
) -> None:
    table = summary_table(many, 3)
    largest = sorted((abs(row.share or 0.0) for row in many.shares), reverse=True)
    told = [getattr(row[3], "share", None) for row in table.rows]
    assert [abs(share or 0.0) for share in told[:3]] == pytest.approx(largest[:3])
    assert len(table.rows) == 4


def test_what_was_localised_has_a_row_by_its_share(many: Explanation) -> None:
    contacts = Localisation("contacts", "no contacts", None, 2.0, None, 0.0, False)
    table = summary_table(replace(many, found_in=(contacts,)), 3)
    assert [row[0] for row in table.rows].index("Contacts (localised)") == 0
    assert table.rows[0][3] == percent(2.0)


@pytest.mark.parametrize(("floor", "is_so"), [(0.05, False), (0.5, True)])
def test_a_floor_is_spoken_of_above_a_hundredth_of_the_gap(
    gains: Explanation, floor: float, is_so: bool
) -> None:
    assert is_noisy(replace(gains, gap=10.0, floor=floor)) is is_so


def test_the_page_begins_with_the_verdict_and_ends_with_what_to_type(gains: Explanation) -> None:
    result = replace(gains, command=COMMAND)
    first = page(result)
    assert first.origin == ""
    assert first.headline is not None
    assert "kp" in first.headline.lead
    assert "right.xml, line 31" in first.headline.lead
    assert first.headline.holds is gains.verdict.holds is True
    assert not blocks(first, Verdict)
    assert shown(first)[0] == "✓"
    assert isinstance(first.blocks[-1], Code)
    assert first.blocks[-1].lines[0].startswith("statemachine compare waves left.xml")


def test_details_have_every_cause_and_the_first_screen_too(many: Explanation) -> None:
    whole = page(many, details=True)
    text = shown(whole)
    assert page(many).headline == whole.headline
    rows = [row for table in blocks(whole, Table) for row in table.rows]
    rows += [
        row
        for section in blocks(whole, Section)
        for table in section.blocks
        if isinstance(table, Table)
        for row in table.rows
    ]
    for share in many.shares:
        if abs(share.share or 0.0) >= 1e-3:
            assert any(share.name.lower() in row[0].lower() for row in rows), share.name
    assert max(map(len, text.splitlines())) <= COLUMNS


@pytest.mark.parametrize(
    ("change", "advice"),
    [
        ({}, "details"),
        ({"shares": "written"}, "write"),
        ({"unexplained": 0.5, "explained": 0.5}, "files"),
        ({"floor": 1.0}, "chance"),
        ({"negligible": 10.0}, "details"),
    ],
)
def test_what_is_advised_follows_from_the_verdict(
    gains: Explanation, change: dict[str, object], advice: str
) -> None:
    facts = dict(change)
    if facts.get("shares") == "written":
        new = AttributeChange("right.xml", 31, "<position> shoulder", "kp", "24", "20")
        facts["shares"] = tuple(replace(row, changes=(new,)) for row in gains.shares)
    result = replace(gains, command=COMMAND, draws=8, **facts)  # type: ignore[arg-type]
    assert WhyPage(result, 8, ()).advice == advice
    assert_one_screen(result)


def test_two_equal_files_are_said_to_be_equal_and_nothing_else(tmp_path: Path) -> None:
    result = explained(tmp_path, ARM, ARM, uncertain=None, jobs=1)
    content = WhyPage(result, 8, ())
    assert ApartSentence(result).nothing_differs
    assert ApartSentence(result).gap is None
    assert content.conclusion == "no gap"
    assert not blocks(page(result), Table)


def test_what_an_experiment_switches_off_is_missed_by_nobody(tmp_path: Path) -> None:
    bare = ARM[: ARM.index("<actuator>")] + "</mujoco>"
    gravity = replace(scenario("gravity"), seconds=0.3, keyframe=None)
    for experiment, missing in ((gravity, ()), (replace(gravity, options={}), ("actuators",))):
        result = explained(tmp_path, ARM, bare, scenario=experiment, uncertain=None, jobs=1)
        assert tuple(part for _, part in result.missing) == missing


def test_what_is_paired_by_its_place_has_a_row_each_and_no_paragraph(tmp_path: Path) -> None:
    other = ARM.replace('"shoulder"', '"first"').replace('"elbow"', '"second"')
    waves = replace(scenario("waves"), seconds=0.3, keyframe=None)
    result = explained(tmp_path, ARM, other, scenario=waves, uncertain=None, jobs=1)
    names = {(pair.kind, pair.left, pair.right) for pair in result.renamed}
    assert {("joint", "shoulder", "first"), ("joint", "elbow", "second")} <= names
    assert not any("taken for" in note for note in result.notes)
    details = blocks(page(result, details=True), Table)
    assert len(result.renamed) in [len(table.rows) for table in details]
    assert not blocks(page(result), Table)


def test_what_several_elements_have_alike_is_one_row(tmp_path: Path) -> None:
    text = with_changes(ARM, [('<geom density="0"/>', '<geom density="0" friction="0.4"/>')])
    result = explained(tmp_path, ARM, text, quantity="ball", uncertain=None, jobs=1)
    (share,) = [row for row in result.shares if row.name.startswith("friction")]
    assert len(share.values) > 1
    rows = [row for row in summary_table(result, 8).rows if row[0].startswith("Friction")]
    assert len(rows) == 1


def test_changes_are_told_in_the_form_of_the_file(tmp_path: Path) -> None:
    left = written(tmp_path / "left.xml", ARM)
    right = written(tmp_path / "right.xml", changed(ARM, ALONE["gains"]))
    run = Request(("waves",), sides=(Side(str(left)), Side(str(right))), seconds=0.3)
    result = answer(ExplainRequest(run, uncertainty=None, jobs=1))
    (change,) = WhyChanges(result).in_file
    assert (change.line, change.old_text, change.new_text) == (31, 'kp="24"', 'kp="20"')
    assert result.right_file == "right.xml"
    assert result.command is not None
    assert result.command.words[-2:] == ("--seconds", "0.3")
    assert result.command.question == ("--why", "--no-chaos")


def test_what_was_not_written_is_told_on_the_first_screen(gains: Explanation) -> None:
    refusals = tuple(UnwrittenChange(f"cause {k}", "no room " * 4) for k in range(30))
    rewritten = RewrittenFile("fixed.xml", "right.xml", (), refusals, 1e-9, 0.1, "joints", "rad")
    result = replace(gains, command=COMMAND, rewritten=rewritten)
    assert_one_screen(result)
    assert "cause 0:" in shown(page(result))
    assert "cause 29" in shown(page(result, details=True))


@pytest.mark.parametrize(
    "words",
    [
        ("statemachine", "compare", "f.py:walk", "a.xml"),
        ("statemachine", "compare", "f.py:walk", "--every", "10ms", "a.xml"),
    ],
)
def test_a_command_has_one_period_and_all_its_other_words(words: tuple[str, ...]) -> None:
    command = TypedCommand(words).calling_every("5ms")
    assert command.words[-2:] == ("--every", "5ms")
    assert command.words[:-2] == ("statemachine", "compare", "f.py:walk", "a.xml")


@pytest.mark.parametrize("width", [10, 60])
def test_a_long_command_goes_on_in_further_lines_and_no_line_is_too_long(width: int) -> None:
    command = TypedCommand(("statemachine", "compare", "waves", *["m" * width + ".xml"] * 4))
    lines = command.lines("--why").splitlines()
    assert len(lines) > 1 or width == 10
    assert max(map(len, lines)) <= 76
    assert " ".join(line.removesuffix("\\").strip() for line in lines).count(".xml") == 4


def test_a_path_that_is_longer_than_a_line_is_not_cut() -> None:
    command = TypedCommand(("statemachine", "compare", "waves", "f" * 90, "b.xml"))
    assert command.lines("--why").split("\n")[1] == "  " + "f" * 90 + " \\"


def test_the_command_has_what_was_asked_of_both_sides() -> None:
    sides = Side("a.xml", options={"timestep": 0.001}), Side("b.xml", "pybullet", "engine")
    run = Request(("walk.py:policy",), sides=sides, every=5, names={"j": "k"}, seed=3)
    assert typed_command(run).words == (
        *("statemachine", "compare", "walk.py:policy", "a.xml", "timestep=0.001"),
        *("b.xml@pybullet:engine", "--seed", "3", "--every", "5", "--map", "j=k"),
    )


def test_a_cause_without_a_value_is_told_by_its_name(gains: Explanation) -> None:
    share = Share("extra shape of box", (), None, "geom", share=1.0, alone=1.0, last=1.0)
    headline = page(replace(gains, shares=(share,))).headline
    assert headline is not None
    assert headline.lead.casefold().startswith(f"{share.name}: 100.0 %")


def test_an_answer_that_is_not_complete_is_marked_as_none(gains: Explanation) -> None:
    ended = replace(gains, ended_by="time limit", method="alone and last")
    assert page(gains).holds
    assert not page(ended).holds
    assert shown(page(ended))[0] == "✗"


def test_what_nobody_can_type_is_a_call_of_python(gains: Explanation) -> None:
    def swing(model: object, data: object) -> None:
        """Command nothing."""

    run = Request((swing,), sides=(Side("a.xml"), Side("b.xml")))
    assert typed_command(run, ("--why",)).lines("--why").startswith("lab.why(")
    assert not blocks(page(gains), Code)


@pytest.mark.parametrize(("alone", "last", "interacts"), [(0.73, 1.18, True), (0.95, 1.0, False)])
def test_a_cause_that_acts_with_others_says_what_it_takes_away_alone(
    alone: float, last: float, interacts: bool
) -> None:
    cause = CauseSentence(
        wording="values", heading="damping", element="elbow", left="1", right="2", place=None,
        option="", part=0.953, gap="30.1 mm", alone=alone, last=last,
    )  # fmt: skip
    assert cause.interacts == interacts
    assert (f"{percent(alone)} alone" in sentence_of(cause)) == interacts
