"""`make mutate`: faults are put where they belong, found again, and judged by the tests."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from coverage import CoverageData

from tools.mutants import __main__ as run
from tools.mutants.covered import Covered
from tools.mutants.draw import Site, all_sites, by_code, find, sites
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
    times = {"seconds": seconds, "fixtures": fixtures, "failed": ["tests/test_other.py::fails"]}
    written(tmp_path / "times.json", json.dumps(times))
    found = list(sites(_module(tmp_path), tmp_path))
    inside = next(site for site in found if site.lines == range(8, 9))
    covered = Covered(tmp_path)
    names = [test.partition("::")[2] for test in covered.tests(inside, 60)]
    assert names == ["slow", "quick", "first", "second"]
    assert len(covered.tests(inside, 6.5)) == len(covered.tests(inside, 40)) == 2
    assert len(covered.tests(next(site for site in found if not site.called), 60)) == 5


@pytest.mark.slow
def test_a_fault_is_killed_survives_or_runs_out_of_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tree = tmp_path / "tree"
    source = "def count(n):\n    while n > 0:\n        n = n - 1\n    return n\n"
    file = _module(tree, "count.py", source)
    text = "from statemachine.count import count\n\ndef test_count():\n    assert count(3) < 1\n"
    written_all(tree, {"tests/test_count.py": text})
    monkeypatch.setattr(run, "SECONDS", 30)
    test = "tests/test_count.py::test_count"
    outcomes = {
        (site.mutant.kind, site.mutant.statement): run.outcome_of(site, [test], tree)
        for site in sites(file, tree)
    }
    assert outcomes["comparison", "while n > 0:"] == ("survived", "")  # one more turn
    assert outcomes["number", "while n > 0:"] == ("killed", test)
    assert outcomes["sign", "n = n - 1"] == ("timed out", "")
    assert file.read_text("utf-8") == source
    outside = replace(next(sites(file, tree)), called=True)
    assert run.outcome_of(outside, [], tree) == ("not covered", "")
