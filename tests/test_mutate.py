"""`make mutate`: faults are put where they belong, found again, and judged by the tests."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from coverage import CoverageData

pytest.importorskip("resource", reason="mutants are tried where processes can be forked")
from tools.mutants import __main__ as run
from tools.mutants import places
from tools.mutants.contexts import pytest_collection_modifyitems
from tools.mutants.covered import Chosen, Covered
from tools.mutants.draw import Site, all_sites, by_code, find, sites
from tools.mutants.places import Place
from tools.mutants.renew import NOT_TRIED, Row, renewed

from .support.claims import assert_in
from .support.files import written, written_all
from .support.requirements import ROOT

SOURCE = '''"""A module."""
LIMIT = 3


class Arm:
    def near(self, x: float = 0.5) -> bool:
        self.log(x)
        if x + 1 < LIMIT:
            return max(x, 2) > f(x, -x)
        return "a" + str(x) in "b"
'''


def _module(folder: Path, name: str = "arm.py", source: str = SOURCE) -> Path:
    file = folder / "statemachine" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    (file.parent / "__init__.py").touch()
    file.write_text(source, "utf-8")
    return file


def test_each_kind_of_fault_is_put_in_its_place(tmp_path: Path) -> None:
    found = list(sites(_module(tmp_path), tmp_path))
    assert Counter(site.mutant.kind for site in found) == {
        "number": 4, "comparison": 3, "sign": 2, "dropped call": 1, "swapped arguments": 1,
    }  # fmt: skip
    texts = {site.source(tmp_path).decode() for site in found}
    assert len(texts) == len(found)
    lines = ("LIMIT = 4", "= 0.55)", "        pass\n", "(x + 1 <= LIMIT)", "f(-x, x)", "f(x, (x))")
    assert_in("\0".join(texts), *lines)
    for text in texts:
        compile(text, "arm.py", "exec")


def test_a_fault_is_found_where_its_code_went(tmp_path: Path) -> None:
    mutants = [site.mutant for site in sites(_module(tmp_path), tmp_path)]
    (tmp_path / "statemachine" / "arm.py").unlink()
    _module(tmp_path, "moved.py", SOURCE.replace("LIMIT:", "LIMIT + 1:"))
    standing = by_code(all_sites(tmp_path))
    found = [(mutant.statement, find(mutant, standing)) for mutant in mutants]
    gone = {statement for statement, site in found if site is None}
    assert gone == {"LIMIT = 3", "if x + 1 < LIMIT:"}  # short, without a function; and changed
    assert {site.mutant.file for _, site in found if site} == {"statemachine/moved.py"}


@pytest.fixture(scope="module")
def sites_of_list() -> list[Site]:
    """Return every fault that the modules of the list allow."""
    files = {ROOT / row.mutant.file for row in run.read()}
    return [site for file in files if file.exists() for site in sites(file, ROOT)]


@pytest.mark.slow
def test_every_fault_of_the_list_stands_in_its_file_in_one_place(
    sites_of_list: list[Site],
) -> None:
    mutants = [row.mutant for row in run.read()]
    assert len(set(mutants)) == len(mutants) == 300
    places = Counter(site.mutant for site in sites_of_list)
    elsewhere = [str(mutant) for mutant in mutants if places[mutant] != 1]
    assert elsewhere == [], "python -m tools.mutants --renew brings the list up to date"


@pytest.mark.slow
def test_every_fault_of_the_list_makes_another_module(sites_of_list: list[Site]) -> None:
    mutants = {row.mutant for row in run.read()}
    for site in sites_of_list:
        if site.mutant in mutants:
            faulty = compile(site.source(ROOT), "module", "exec")
            assert faulty != compile((ROOT / site.mutant.file).read_bytes(), "module", "exec")


# The list is brought up to date


def _rows(folder: Path) -> list[Row]:
    return [Row(site.mutant, "killed", "tests/test_arm.py::near") for site in all_sites(folder)]


def test_a_list_that_is_up_to_date_stays_as_it_is(tmp_path: Path) -> None:
    _module(tmp_path)
    rows = _rows(tmp_path)
    assert set(renewed(rows, all_sites(tmp_path), 0)) == set(rows)


def test_a_fault_keeps_its_result_where_its_module_went(tmp_path: Path) -> None:
    file = _module(tmp_path)
    rows = [row for row in _rows(tmp_path) if row.mutant.function == "near"]
    file.rename(file.with_name("moved.py"))
    now = renewed(rows, all_sites(tmp_path), 0)
    assert {row.mutant.file for row in now} == {"statemachine/moved.py"}
    assert {row.result for row in now} == {"killed"}
    assert {row.mutant.code for row in now} == {row.mutant.code for row in rows}


def test_a_fault_is_the_same_in_what_its_statement_has_become_and_is_not_tried(
    tmp_path: Path,
) -> None:
    _module(tmp_path)
    [row] = [row for row in _rows(tmp_path) if row.mutant.becomes == "(x + 1 <= LIMIT)"]
    _module(tmp_path, source=SOURCE.replace("if x + 1 < LIMIT:", "if near or x + 1 < LIMIT:"))
    [now] = renewed([row], all_sites(tmp_path), 0)
    statement = "if near or x + 1 < LIMIT:"
    assert (now.mutant.statement, now.mutant.becomes) == (statement, "(x + 1 <= LIMIT)")
    assert (now.result, now.test) == (NOT_TRIED, "")


def test_another_fault_is_drawn_where_the_code_is_gone(tmp_path: Path) -> None:
    _module(tmp_path)
    rows = [row for row in _rows(tmp_path) if row.mutant.kind == "comparison"]
    _module(tmp_path, source="def far(y: int) -> int:\n    note(y)\n    return y - 7 + 3\n")
    standing = {site.mutant for site in all_sites(tmp_path)}
    drawn = [renewed(rows, all_sites(tmp_path), seed) for seed in (0, 0, 1)]
    assert drawn[0] == drawn[1]
    for now in drawn:
        assert len({row.mutant for row in now} & standing) == len(rows) == 3
        assert {row.result for row in now} == {NOT_TRIED}


def test_a_fault_that_stands_twice_is_not_in_the_list(tmp_path: Path) -> None:
    _module(tmp_path)
    [row] = [row for row in _rows(tmp_path) if row.mutant.kind == "dropped call"]
    _module(tmp_path, source=SOURCE.replace("self.log(x)", "self.log(x)\n        self.log(x)"))
    [now] = renewed([row], all_sites(tmp_path), 0)
    assert now.mutant.kind != "dropped call"


def test_tests_are_chosen_by_line_room_and_time(tmp_path: Path) -> None:
    data = CoverageData(str(tmp_path / "data"))
    seconds = {"tests/test_page.py::second": 2}
    for test, phase, line, took in (
        ("tests/test_arm.py::slow", "call", 8, 5),
        ("tests/test_other.py::quick", "call", 8, 1),
        ("tests/test_other.py::elsewhere", "call", 9, 1),
        ("tests/test_other.py::fails", "call", 8, 1),
        ("tests/test_page.py::first", "setup", 8, 2),
        ("tests/test_golden.py::frozen", "call", 8, 1),
    ):
        data.set_context(f"{test} ({phase})")
        data.add_lines({"statemachine/arm.py": [line]})
        seconds[test] = took
    data.write()
    fixtures = {"tests/test_page.py": 40.0}
    times = {"seconds": seconds, "fixtures": fixtures, "unused": ["tests/test_other.py::fails"]}
    written(tmp_path / "times.json", json.dumps(times))
    found = list(sites(_module(tmp_path), tmp_path))
    inside = next(site for site in found if site.lines == range(8, 9))
    covered = Covered(tmp_path)
    names = [test.partition("::")[2] for test in covered.chosen(inside, 60).tests]
    assert names == ["quick", "slow", "first", "second"]
    assert len(covered.chosen(inside, 6.5).tests) == len(covered.chosen(inside, 40).tests) == 2
    outside = next(site for site in found if not site.called)
    assert len(covered.chosen(outside, 60).tests) == 5


def _covered(folder: Path, contexts: dict[str, int], seconds: dict[str, float]) -> Covered:
    """Return what is measured where each context runs one line of arm.py."""
    data = CoverageData(str(folder / "data"))
    for context, line in contexts.items():
        data.set_context(context)
        data.add_lines({"statemachine/arm.py": [line]})
    data.write()
    times = {"seconds": seconds, "fixtures": {}, "unused": []}
    written(folder / "times.json", json.dumps(times))
    return Covered(folder)


def test_the_tests_of_a_file_are_run_one_after_the_other(tmp_path: Path) -> None:
    seconds = {"tests/test_a.py::x": 1.0, "tests/test_b.py::x": 2.0, "tests/test_a.py::y": 3.0}
    covered = _covered(tmp_path, {f"{test} (call)": 8 for test in seconds}, seconds)
    [site, *_] = [site for site in sites(_module(tmp_path), tmp_path) if 8 in site.lines]
    chosen = covered.chosen(site, 60)
    assert chosen.tests == ("tests/test_a.py::x", "tests/test_a.py::y", "tests/test_b.py::x")
    assert chosen.seconds == 6


def test_a_case_of_each_test_comes_before_the_second_of_one(tmp_path: Path) -> None:
    seconds = {f"tests/test_a.py::{name}": 1.0 for name in ("x[1]", "x[2]", "x[3]", "y")}
    covered = _covered(tmp_path, {f"{test} (call)": 8 for test in seconds}, seconds)
    [site, *_] = [site for site in sites(_module(tmp_path), tmp_path) if 8 in site.lines]
    names = [test.partition("::")[2] for test in covered.chosen(site, 2.5).tests]
    assert names == ["x[1]", "y"]


@pytest.mark.parametrize("earlier", ["tests/test_a.py::last", "tests/test_b.py::of_another_line"])
def test_the_test_that_noticed_a_fault_before_comes_first_whatever_it_takes(
    tmp_path: Path, earlier: str
) -> None:
    seconds = {"tests/test_a.py::first": 1.0, "tests/test_a.py::last": 9.0}
    contexts = {f"{test} (call)": 8 for test in seconds}
    covered = _covered(tmp_path, contexts, seconds | {"tests/test_b.py::of_another_line": 9.0})
    [site, *_] = [site for site in sites(_module(tmp_path), tmp_path) if 8 in site.lines]
    assert covered.chosen(site, 2.5).tests == ("tests/test_a.py::first",)
    assert covered.chosen(site, 2.5, earlier).tests[0] == earlier
    assert covered.chosen(site, 2.5, "tests/test_a.py::gone").tests == ("tests/test_a.py::first",)


@pytest.mark.parametrize(("context", "is_at_import"), [("", True), ("tests/t.py::x (call)", False)])
def test_a_statement_that_no_test_runs_is_one_of_the_import(
    tmp_path: Path, context: str, is_at_import: bool
) -> None:
    covered = _covered(tmp_path, {context: 8}, {"tests/t.py::x": 1})
    [site, *_] = [site for site in sites(_module(tmp_path), tmp_path) if 8 in site.lines]
    assert covered.chosen(site, 60).at_import is is_at_import


def test_a_case_of_each_test_is_measured_before_the_second_of_one() -> None:
    names = ["a.py::x[1]", "a.py::x[2]", "a.py::y", "a.py::x[3]", "a.py::z[1]", "b.py::x[1]"]
    items: Any = [Mock(nodeid=name) for name in names]
    pytest_collection_modifyitems(items)
    ordered = ["a.py::x[1]", "a.py::y", "a.py::z[1]", "a.py::x[2]", "a.py::x[3]", "b.py::x[1]"]
    assert [item.nodeid for item in items] == ordered


# A fault is tried

_COUNT = """\
LEAST = 0


def count(n):
    while n > LEAST:
        n = n - 1
    return n
"""
_TESTS = """\
import time

from statemachine import count


def test_count():
    assert count.count(3) == 0


def test_even():
    assert count.count(2) == 0


def test_least():
    assert count.LEAST == 0


def test_waits():
    time.sleep(2.5)
    assert count.count(1) == 0


def test_fails():
    assert count.count(1) == 7
"""


class _Count:
    """A small package with its tests, and a place where its faults are tried.

    Attributes:
        file: Its module.
        place: The place.
    """

    def __init__(self, tree: Path) -> None:
        self.file = _module(tree, "count.py", _COUNT)
        copied = "tools/__init__.py", "tools/mutants/__init__.py", "tools/mutants/session.py"
        files = {name: (ROOT / name).read_text("utf-8") for name in copied}
        written_all(tree, {"tests/test_count.py": _TESTS, **files})
        self.place = Place(tree)
        self._sites = list(sites(self.file, tree))

    def outcome(
        self, kind: str, statement: str, *tests: str, at_import: bool = False
    ) -> tuple[str, str]:
        """Return what becomes of a fault, and the name of the function that noticed it."""
        wanted = kind, statement
        [site] = [
            site for site in self._sites if (site.mutant.kind, site.mutant.statement) == wanted
        ]
        named = tuple(f"tests/test_count.py::{test}" for test in tests)
        result, test = self.place.outcome(site, Chosen(named, 0.0, at_import))
        return result, test.rpartition("::")[2]


@pytest.fixture(scope="module")
def counting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[_Count]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(places, "PROCESSOR", 2.0)
        count = _Count(tmp_path_factory.mktemp("mutants") / "tree")
        with count.place:
            yield count


@pytest.mark.slow
def test_a_fault_that_a_test_notices_is_killed(counting: _Count) -> None:
    outcome = counting.outcome("number", "n = n - 1", "test_least", "test_count")
    assert outcome == ("killed", "test_count")


@pytest.mark.slow
def test_a_fault_that_no_test_notices_survives(counting: _Count) -> None:
    assert counting.outcome("number", "n = n - 1", "test_even") == ("survived", "")


@pytest.mark.slow
def test_a_fault_is_out_of_the_module_when_it_was_tried(counting: _Count) -> None:
    counting.outcome("sign", "n = n - 1", "test_least")
    assert counting.file.read_text("utf-8") == _COUNT


@pytest.mark.slow
def test_a_fault_that_loops_is_ended_by_its_processor_time(counting: _Count) -> None:
    assert counting.outcome("sign", "n = n - 1", "test_count") == ("timed out", "")


@pytest.mark.slow
def test_a_test_that_waits_longer_than_its_processor_time_is_not_ended(counting: _Count) -> None:
    outcome = counting.outcome("comparison", "while n > LEAST:", "test_waits")
    assert outcome == ("killed", "test_waits")


@pytest.mark.slow
def test_a_fault_that_waits_for_ever_is_ended_by_the_clock(
    counting: _Count, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(places, "CLOCK", 0.5)
    outcome = counting.outcome("comparison", "while n > LEAST:", "test_waits")
    assert outcome == ("timed out", "")


@pytest.mark.slow
def test_a_fault_of_an_import_is_noticed_by_a_process_that_starts_with_it(
    counting: _Count,
) -> None:
    outcome = counting.outcome("number", "LEAST = 0", "test_least", at_import=True)
    assert outcome == ("killed", "test_least")


@pytest.mark.slow
def test_a_test_that_fails_without_the_fault_has_noticed_nothing(counting: _Count) -> None:
    tests = "test_fails", "test_least"
    assert counting.outcome("number", "n = n - 1", *tests) == ("survived", "")


@pytest.mark.slow
def test_a_fault_that_no_test_runs_is_not_covered(counting: _Count) -> None:
    assert counting.outcome("number", "n = n - 1") == ("not covered", "")


# What is written


@pytest.fixture
def pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder into which the score is written."""
    for name, file in (("HERE", ""), ("RESULTS", "results.json"), ("SECOND", "second.json")):
        monkeypatch.setattr(run, name, tmp_path / file)
    return tmp_path


def _judged(folder: Path) -> list[Row]:
    """Return two faults, of which one was noticed."""
    one, two, *_ = (site.mutant for site in sites(_module(folder), folder))
    return [Row(one, "killed", "tests/test_arm.py::near"), Row(two, "survived", "", "Equal.")]


def test_what_was_written_is_read(pages: Path) -> None:
    rows = _judged(pages)
    run.write(rows)
    assert run.read() == rows


def test_the_score_is_of_what_was_tried(pages: Path) -> None:
    rows = _judged(pages)
    run.write([*rows, *(Row(row.mutant, NOT_TRIED, "") for row in rows)])
    [line] = [line for line in (pages / "SCORE.md").read_text().splitlines() if "**all**" in line]
    assert [cell.strip() for cell in line.split("|")[2:-1]] == [
        "4", "1", "1", "0", "0", "0", "2", "50%",
    ]  # fmt: skip


def test_what_a_reader_found_stands_beside_a_survivor(pages: Path) -> None:
    run.write(_judged(pages))
    [line] = [line for line in (pages / "SCORE.md").read_text().splitlines() if line[:2] == "- "]
    assert line.endswith(". Equal.")


def test_another_draw_stands_beside_the_list_and_leaves_it(pages: Path) -> None:
    rows = _judged(pages)
    run.write(rows)
    run.write_second(rows[:1], 77)
    assert run.read() == rows
    scores = [line for line in (pages / "SCORE.md").read_text().splitlines() if "**all**" in line]
    assert [line.split("|")[-2].strip() for line in scores] == ["50%", "100%"]
    told = json.loads((pages / "second.json").read_text("utf-8"))
    assert (told["seed"], len(told["mutants"])) == (77, 1)
