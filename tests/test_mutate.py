"""`make mutate`: faults are put where they belong, found again, and judged by the tests."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from coverage import CoverageData

from mutants import __main__ as run
from mutants.covered import Covered
from mutants.draw import Mutant, Site, all_sites, find, sites

from .conftest import ROOT

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
    for line in (
        "LIMIT = 4",
        "= 0.55)",
        "        pass\n",
        "(x + 1 <= LIMIT)",
        "f(-x, x)",
        "f(x, (x))",
    ):
        assert any(line in text for text in texts), line
    for text in texts:
        compile(text, "arm.py", "exec")


def test_a_fault_is_found_where_its_code_went(tmp_path: Path) -> None:
    mutants = [site.mutant for site in sites(_module(tmp_path), tmp_path)]
    (tmp_path / "statemachine" / "arm.py").unlink()
    _module(tmp_path, "moved.py", SOURCE.replace("LIMIT:", "LIMIT + 1:"))
    standing = {site.mutant.code: [site] for site in all_sites(tmp_path)}
    found = {mutant: find(mutant, standing) for mutant in mutants}
    gone = {mutant.statement for mutant, site in found.items() if site is None}
    assert gone == {"LIMIT = 3", "if x + 1 < LIMIT:"}  # short, without a function; and changed
    assert {site.mutant.file for site in found.values() if site} == {"statemachine/moved.py"}


def test_every_fault_of_the_list_still_compiles() -> None:
    rows = json.loads(run.RESULTS.read_text("utf-8"))
    assert len(rows) == 300
    standing: dict[tuple[str, str, int, str], list[Site]] = {}
    for site in all_sites(ROOT):
        standing.setdefault(site.mutant.code, []).append(site)
    fields = Mutant.__dataclass_fields__
    mutants = [Mutant(**{name: row[name] for name in fields}) for row in rows]
    found = [site for mutant in mutants if (site := find(mutant, standing))]
    assert found
    for site in found:
        compile(site.source(ROOT), site.mutant.file, "exec")


def test_tests_are_chosen_by_line_room_and_time(tmp_path: Path) -> None:
    data = CoverageData(str(tmp_path / "data"))
    for context, line in (
        ("tests/test_arm.py::slow (call)", 8),
        ("tests/test_other.py::quick (call)", 8),
        ("tests/test_other.py::elsewhere (call)", 9),
        ("tests/test_other.py::fails (call)", 8),
        ("tests/test_page.py::first (setup)", 8),
        ("tests/test_golden.py::frozen (call)", 8),
    ):
        data.set_context(context)
        data.add_lines({"statemachine/arm.py": [line]})
    data.write()
    seconds = {"tests/test_arm.py::slow": 5, "tests/test_other.py::quick": 1}
    seconds |= {f"tests/test_other.py::{name}": 1 for name in ("elsewhere", "fails")}
    seconds |= {f"tests/test_page.py::{name}": 2 for name in ("first", "second")}
    seconds |= {"tests/test_golden.py::frozen": 1}
    fixtures = {"tests/test_page.py": 40.0}
    times = {"seconds": seconds, "fixtures": fixtures, "failed": ["tests/test_other.py::fails"]}
    (tmp_path / "times.json").write_text(json.dumps(times), "utf-8")
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
    (tree / "tests").mkdir()
    test = "from statemachine.count import count\n\ndef test_count():\n    assert count(3) < 1\n"
    (tree / "tests" / "test_count.py").write_text(test, "utf-8")
    monkeypatch.setattr(run, "SECONDS", 15)
    outcomes = {}
    for site in sites(file, tree):
        tests = ["tests/test_count.py::test_count"]
        outcomes[site.mutant.kind, site.mutant.statement] = run._tried(site, tests, tree)
    assert outcomes["comparison", "while n > 0:"] == ("survived", "")  # one more turn
    assert outcomes["number", "while n > 0:"] == ("killed", "tests/test_count.py::test_count")
    assert outcomes["sign", "n = n - 1"] == ("timed out", "")
    assert file.read_text("utf-8") == source
    outside = replace(next(sites(file, tree)), called=True)
    assert run._tried(outside, [], tree) == ("not covered", "")
