"""A class at a glance: counts, common mistakes, what was not judged; on the page, JSON, HTML."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import pytest

from statemachine.course.grading.alike import AlikeGroup, AlikePair
from statemachine.course.grading.class_page import (
    class_page,
    class_table,
    mistakes_table,
    remarks_table,
)
from statemachine.course.grading.class_table import NOTHING, ClassEntry, rows_of
from statemachine.course.grading.exercise import LOOK
from statemachine.course.grading.judges import JUDGES, Judgement
from statemachine.course.grading.overview import (
    ClassResult,
    FunctionCount,
    Mistake,
    Unjudged,
    class_result,
)
from statemachine.show.as_json import dumps
from statemachine.show.blocks import Section, Table, Verdict
from statemachine.show.html import report

from .support.claims import assert_in
from .support.pages import blocks, shown

GRAVITY, STATE, FORWARD, REPLAY = JUDGES
RIGHT = "all is well"


def _judgement(function: str, said: str) -> Judgement:
    """Return a judgement: right, not written, not judged ("? why"), or wrong with remarks."""
    if said == RIGHT:
        return Judgement(function, True, True, (RIGHT,))
    if said == "":
        return Judgement(function, False, False, ("not written yet. TODO",))
    if said.startswith("? "):
        return Judgement(function, True, False, (said.removeprefix("? "),), judged=False)
    return Judgement(function, True, False, tuple(said.split(" | ")))


def _entry(name: str, *said: str, refusal: str = "", student: str = "") -> ClassEntry:
    functions = tuple(map(_judgement, JUDGES, said)) if said else ()
    return ClassEntry(name, "", functions, refusal, "mujoco", student=student)


# What was wrong of each student's.
ANN_S = "reading 2: 4.5 mm away"
BOB_S = "reading 3: 27 mm away"
CY_S = "line 7: NameError (in `x = y`)"
DEE_S = "line 12: NameError (in `a`)"
EVE_S = "reading 2: 1 mm away"

ENTRIES = (
    _entry("ann", RIGHT, RIGHT, ANN_S, "ctrl[2] was written | nan at 1 s"),
    _entry("bob", RIGHT, "", BOB_S, RIGHT),
    _entry("cy", *([CY_S] * 4)),
    _entry("dee", *([DEE_S] * 4)),
    _entry("eve", "? it reads bob/a.py", "? it reads bob/a.py", EVE_S, RIGHT),
    _entry("fay", refusal="a notebook"),
    _entry("gus", refusal="a notebook"),
    _entry("hal", refusal=NOTHING, student=""),
)
GROUP = AlikeGroup(("ann", "bob"), 0.957, 1.0, 57, is_short=True, is_solution=False)


@pytest.fixture
def result() -> ClassResult:
    """What came of a small class."""
    return class_result(ENTRIES, (GROUP,), ("notes.txt",))


def test_right_and_wrong_are_counted_for_each_function(result: ClassResult) -> None:
    assert result.functions == (
        FunctionCount(GRAVITY, right=2, wrong=2, not_written=1, not_judged=3),
        FunctionCount(STATE, right=1, wrong=2, not_written=2, not_judged=3),
        FunctionCount(FORWARD, right=0, wrong=5, not_written=1, not_judged=2),
        FunctionCount(REPLAY, right=2, wrong=3, not_written=1, not_judged=2),
    )


def test_remarks_that_differ_in_figures_are_one_mistake(result: ClassResult) -> None:
    assert result.mistakes == (
        Mistake("reading …: … mm away", (FORWARD,), ("ann", "bob", "eve")),
        Mistake("line …: NameError (in …)", tuple(JUDGES), ("cy", "dee")),
        Mistake("ctrl[2] was written", (REPLAY,), ("ann",)),
        Mistake("nan at 1 s", (REPLAY,), ("ann",)),
    )
    assert [mistake.count for mistake in result.mistakes] == [3, 2, 1, 1]


def test_a_figure_that_all_have_is_shown() -> None:
    said = ("0.8 rad, 3 mm", "0.8 rad, 5 mm")
    entries = [_entry(f"{k}", text, RIGHT, RIGHT, RIGHT) for k, text in enumerate(said)]
    (mistake,) = class_result(entries).mistakes
    assert mistake.remark.partition(",") == ("0.8 rad", ",", " … mm")


def test_one_student_with_a_mistake_in_four_functions_is_one_student() -> None:
    said = [f"no function {name}" for name in JUDGES]
    (mistake,) = class_result([_entry("ann", *said)]).mistakes
    assert (mistake.remark, mistake.count) == ("no function …", 1)
    assert mistake.functions == tuple(JUDGES)


def test_five_mistakes_are_shown_and_only_of_several_students() -> None:
    mistakes = [Mistake(f"m{k}", (STATE,), ("a", "b", "c")[: 4 - k // 2]) for k in range(8)]
    rows = mistakes_table(mistakes).rows
    assert [row[2] for row in rows] == ["m0", "m1", "m2", "m3", "m4"]
    assert [row[0] for row in mistakes_table(mistakes[5:]).rows] == ["2"]
    assert rows[0] == ["3", "state", "m0", "a, b, c"]


def test_why_something_was_not_judged_is_told_once(result: ClassResult) -> None:
    assert result.unjudged == (
        Unjudged("it reads bob/a.py", ("eve",)),
        Unjudged("a notebook", ("fay", "gus")),
    )
    assert not result.complete
    page = class_page(result)
    assert [verdict.holds for verdict in blocks(page, Verdict)] == [False, False]
    for reason in ("it reads bob/a.py", "a notebook"):
        assert shown(page).count(reason) == 1


def test_a_remark_is_a_row_for_each_student_and_function_uncut() -> None:
    long = "x" * 500
    entries = [*ENTRIES, _entry("ida", long, f"wrong | {LOOK}: a.txt", RIGHT, "a | b")]
    rows = remarks_table(entries).rows
    assert rows == [
        ["ann", "forward", ANN_S],
        ["ann", "replay", "ctrl[2] was written; nan at 1 s"],
        ["bob", "state", "not written"],
        ["bob", "forward", BOB_S],
        ["cy", "file", CY_S],
        ["dee", "file", DEE_S],
        ["eve", "forward", EVE_S],
        ["hal", "file", NOTHING],
        ["ida", "gravity", long],
        ["ida", "state", "wrong"],
        ["ida", "replay", "a; b"],
    ]


def test_what_somebody_should_look_at_is_no_mistake() -> None:
    entry = _entry("ida", f"wrong | {LOOK}: it reads a.txt", RIGHT, RIGHT, RIGHT)
    assert [mistake.remark for mistake in class_result([entry]).mistakes] == ["wrong"]
    assert shown(class_page(class_result([entry]))).count("it reads a.txt") == 1


def test_with_a_roster_files_of_nobody_on_it_are_not_counted() -> None:
    entries = [
        _entry("x1.py", "bad", RIGHT, RIGHT, RIGHT, student="Ann"),
        _entry("x2.py", "bad", RIGHT, RIGHT, RIGHT),
    ]
    result = class_result(entries)
    assert result.functions[0].wrong == 1
    assert result.mistakes[0].students == ("Ann",)


def test_a_group_is_named_with_the_range_of_its_likeness(result: ClassResult) -> None:
    text = " ".join(shown(class_page(result)).split())
    assert_in(text, "95 to 100%", "ann, bob.")


def test_a_group_of_short_functions_is_no_sign_of_copying(result: ClassResult) -> None:
    text = " ".join(shown(class_page(result)).split())
    assert "short functions" in text
    assert "solution" not in text


def test_a_group_that_is_like_the_solution_says_so() -> None:
    same = replace(GROUP, least=1.0, is_short=False, is_solution=True)
    text = " ".join(shown(class_page(class_result(ENTRIES, (same,)))).split())
    assert_in(text, "100%", "ann, bob", "solution")
    assert "short functions" not in text


def test_almost_the_same_is_not_called_the_same() -> None:
    group = replace(GROUP, least=0.9999, most=0.9999)
    assert "alike, 99%" in shown(class_page(class_result(ENTRIES, (group,))))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (
            ("functions", 0),
            {"function": GRAVITY, "right": 2, "wrong": 2, "not_written": 1, "not_judged": 3},
        ),
        (("mistakes", 1, "count"), 2),
        (("alike", 0, "students"), ["ann", "bob"]),
        (("unjudged", 1), {"reason": "a notebook", "students": ["fay", "gus"]}),
        (("ignored",), ["notes.txt"]),
        (("complete",), False),
        (("entries", 0, "name"), "ann"),
    ],
    ids=lambda path: "-".join(map(str, path)) if isinstance(path, tuple) else "",
)
def test_each_part_of_a_result_is_in_the_json(
    path: tuple[str | int, ...], value: Any, result: ClassResult
) -> None:
    part = json.loads(dumps(result))
    for key in path:
        part = part[key]
    assert part == value


def test_the_answer_and_the_table_are_first(result: ClassResult) -> None:
    page = class_page(result)
    assert page.headline is not None
    assert page.headline.lead.startswith("0 of 8")
    assert isinstance(page.blocks[0], Table)
    assert page.blocks[0].headers[0] == "file"


def test_the_tables_are_of_students_functions_and_mistakes(result: ClassResult) -> None:
    tables = blocks(class_page(result), Table)
    assert [table.headers[-1] for table in tables] == ["replay", "not judged ?", "who"]


def test_the_remarks_are_folded_at_the_end(result: ClassResult) -> None:
    last = class_page(result).blocks[-1]
    assert isinstance(last, Section)
    (table,) = [block for block in last.blocks if isinstance(block, Table)]
    assert [list(row) for row in table.rows] == remarks_table(result.entries).rows


def test_the_html_of_a_class_has_mistakes_and_remarks(result: ClassResult) -> None:
    html = report(class_page(result)).replace("\u00a0", " ")
    assert_in(html, result.mistakes[0].remark, remarks_table(result.entries).rows[0][-1], "eve")


def test_a_row_of_the_class_leads_to_the_remarks_on_its_student(result: ClassResult) -> None:
    html = report(class_page(result))
    _, table, *rest = re.split(r"<tbody>", html)
    links = dict(re.findall(r'<a href="#([\w-]+)">([^<]+)</a>', table.partition("</tbody>")[0]))
    named = dict(re.findall(r'<th scope="row" id="([\w-]+)">([^<]+)</th>', rest[-1]))
    with_remarks = {remark.text for entry in result.counted for remark in entry.remarks}
    assert with_remarks
    assert links == named
    expected = {entry.label for entry in result.counted if entry.label in rest[-1]}
    assert set(links.values()) == expected


def test_a_row_of_the_class_fits_80_columns(result: ClassResult) -> None:
    entry = _entry("a" * 30, RIGHT, RIGHT, RIGHT, RIGHT)
    page = class_page(class_result([replace(entry, nearest="b", likeness=0.5)]))
    (line,) = [line for line in shown(page).splitlines() if line.startswith("a" * 30)]
    assert line.split() == ["a" * 30, "4/4", "✓", "✓", "✓", "✓"]


def test_a_mistake_in_both_runs_is_one() -> None:
    said = [f"servos {word}: 2 rad" for word in ("on", "off")]
    entries = [_entry(name, " | ".join(said), RIGHT, RIGHT, RIGHT) for name in ("ann", "bob")]
    (mistake,) = class_result(entries).mistakes
    assert (mistake.remark.partition(":")[0], mistake.count) == ("servos …", 2)


def test_remarks_that_the_same_students_got_on_a_function_are_a_line() -> None:
    names = ("ann", "bob")
    entries = [_entry(name, RIGHT, "time is 6 | no box | no base", RIGHT, "x") for name in names]
    mistakes = class_result(entries).mistakes
    assert [mistake.remark for mistake in mistakes] == ["time is 6", "x"]
    assert mistakes[0].others == ("no box", "no base")
    first, second = (row[2] for row in mistakes_table(mistakes).rows)
    assert_in(first, "time is 6", "2 other")
    assert second == "x"


def test_the_same_remark_on_several_functions_is_a_row() -> None:
    rows = remarks_table([_entry("ann", "no step", RIGHT, "no step", "no step | no step")]).rows
    assert rows == [["ann", "gravity, forward, replay", "no step"]]


def test_a_function_without_a_verdict_leaves_those_of_the_others() -> None:
    entry = _entry("ann", "? it sleeps", RIGHT, RIGHT, RIGHT)
    (row,) = class_table([entry], {}).rows
    assert row[:2] == ["ann", "3/4 ?"]
    head, cells = rows_of([entry])
    assert dict(zip(head, cells, strict=True))["right"] == 3


def test_a_file_without_any_verdict_has_no_number() -> None:
    entries = [_entry("ann", *["? it sleeps"] * 4), _entry("bob", refusal="a notebook")]
    assert [row[1] for row in class_table(entries, {}).rows] == ["?", "?"]
    for _, right, *_more in list(rows_of(entries))[1:]:
        assert right == ""


def test_files_of_nobody_on_the_roster_stand_below_a_heading() -> None:
    entries = [
        _entry("x1.py", RIGHT, RIGHT, RIGHT, RIGHT, student="Ann"),
        _entry("x2.py", RIGHT, RIGHT, RIGHT, RIGHT),
    ]
    page = class_page(class_result(entries))
    (section,) = [each for each in blocks(page, Section) if each.name == "strangers"]
    assert [row[0] for table in blocks(page, Table)[:1] for row in table.rows] == ["Ann"]
    (strangers,) = [block for block in section.blocks if isinstance(block, Table)]
    assert [row[0] for row in strangers.rows] == ["x2.py"]


def test_without_a_roster_nobody_is_a_stranger(result: ClassResult) -> None:
    assert result.strangers == ()
    assert not [each for each in blocks(class_page(result), Section) if each.name == "strangers"]


def test_whom_one_is_most_like_is_told_from_85_percent_on() -> None:
    entry = _entry("ann", RIGHT, RIGHT, RIGHT, RIGHT)
    cells = []
    for likeness in (0.849, 0.85):
        table = class_table([replace(entry, nearest="b", likeness=likeness)], {})
        cells.append("most like" in table.headers)
    assert cells == [False, True]


def test_nearly_alike_is_told_without_a_group() -> None:
    pairs = (AlikePair(("ann", "bob"), 0.8999),)
    text = " ".join(shown(class_page(class_result(ENTRIES, nearly_alike=pairs))).split())
    assert_in(text, "89%", "ann, bob")
