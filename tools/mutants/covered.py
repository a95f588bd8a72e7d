"""Which tests run which statement of the package, by coverage.py, and how long each takes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

from coverage import Coverage, CoverageData

from .draw import Site

# Figures that were frozen from this project or its models guard against change. They are not
# tests of what is true, so they must not hold the score up.
FROZEN = ("tests/test_reference.py", "tests/test_golden.py")
# It interrupts threads of processes that coverage.py measures: a lock that this holds there is
# never given back.
HANGING = "tests/test_hand_over.py::test_an_interrupt_leaves_nothing_taken"
# What `make test` runs. The other tests take an hour under coverage.py, and few of them would fit
# into the time of a fault; what they alone notice counts as not noticed.
QUICK = "not slow"
OF_OWN_FILES = 10  # tests of a round
_INI = """\
[run]
source = {tree}/statemachine
data_file = {folder}/data
context = ${{PYTEST_CURRENT_TEST-}}
parallel = true
patch = _exit, fork
relative_files = true
disable_warnings = no-data-collected, module-not-imported, already-imported, couldnt-parse
"""


class Times(TypedDict):
    """What `contexts` writes.

    Attributes:
        seconds: Processor time of each test [s].
        fixtures: The most that setting up a test of a file took [s].
        unused: Tests that failed or were skipped.
    """

    seconds: dict[str, float]
    fixtures: dict[str, float]
    unused: list[str]


def environment(tree: Path) -> dict[str, str]:
    """Return the environment of tests in a copy: every process they start imports that copy."""
    return {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}


def measure(tree: Path, folder: Path, files: Sequence[str] = ()) -> None:
    """Run the quick tests of a copy of the checkout, and write which line each of them runs.

    Args:
        tree: The copy.
        folder: Where it is written. What stands there of other files stays.
        files: The files of tests that are run; all of them where none is named.
    """
    folder.mkdir(parents=True, exist_ok=True)
    settings, times = folder / "coverage.ini", folder / "times.json"
    before: Times | None = json.loads(times.read_text("utf-8")) if times.exists() else None
    settings.write_text(_INI.format(tree=tree, folder=folder), "utf-8")
    watched = {"COVERAGE_PROCESS_START": str(settings), "MUTANTS_TIMES": str(times)}
    command = [sys.executable, "-m", "pytest", "-p", "tools.mutants.contexts", "-n", "auto"]
    ignored = [f"--deselect={HANGING}", *(f"--ignore={path}" for path in FROZEN)]
    subprocess.run(
        [*command, "--dist", "loadfile", "-m", QUICK, *ignored, *files],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree), **watched},
        check=False,  # a test that fails here is not used
    )
    measured = Coverage(config_file=str(settings))
    measured.load()
    measured.combine([str(folder)])
    measured.save()
    if before is not None:
        now = json.loads(times.read_text("utf-8"))
        times.write_text(json.dumps(_renewed(before, now, files)), "utf-8")


def _renewed(before: Times, now: Times, files: Sequence[str]) -> Times:
    """Return the times of all tests, where those of some files were measured again."""
    gone = tuple(f"{file}::" for file in files)
    seconds = {test: took for test, took in before["seconds"].items() if not test.startswith(gone)}
    unused = [test for test in before["unused"] if not test.startswith(gone)]
    return {
        "seconds": seconds | now["seconds"],
        "fixtures": before["fixtures"] | now["fixtures"],
        "unused": unused + now["unused"],
    }


@dataclass(frozen=True)
class Chosen:
    """The tests by which a mutant is judged.

    Attributes:
        tests: Their names, in the order in which they are run.
        seconds: The processor time that they take in all [s].
        at_import: Whether the statement also runs before any test, so that only a process that
            starts with the fault has it.
    """

    tests: tuple[str, ...]
    seconds: float
    at_import: bool


def _file(test: str) -> str:
    return test.partition("::")[0]


class Covered:
    """What `measure` wrote into a folder."""

    def __init__(self, folder: Path) -> None:
        self._data = CoverageData(str(folder / "data"))
        self._data.read()
        told = json.loads((folder / "times.json").read_text("utf-8"))
        unused = set(told["unused"])
        self._seconds: dict[str, float] = {
            test: seconds
            for test, seconds in told["seconds"].items()
            if test not in unused and not test.startswith(FROZEN)
        }
        self._fixtures: dict[str, float] = told["fixtures"]
        self._by_line: dict[str, dict[int, list[str]]] = {}
        self._of_file: dict[str, list[str]] = defaultdict(list)
        for test in self._seconds:
            self._of_file[_file(test)].append(test)

    def _contexts(self, file: str) -> dict[int, list[str]]:
        """Return what ran each line of a module."""
        if file not in self._by_line:
            self._by_line[file] = self._data.contexts_by_lineno(file)
        return self._by_line[file]

    def _ordered(self, tests: Set[str], rooms: Set[str]) -> list[str]:
        """Return tests in rounds, in each of which come the next ones of each file."""

        def cost(test: str) -> tuple[float, str]:
            return self._seconds[test] + self._fixtures.get(_file(test), 0.0), test

        cases: Counter[str] = Counter()
        numbers: dict[str, int] = {}
        for test in sorted(tests, key=cost):
            function = test.partition("[")[0]
            numbers[test] = cases[function]
            cases[function] += 1
        count: Counter[str] = Counter()
        rounds: dict[str, int] = {}
        for test in sorted(tests, key=lambda test: (numbers[test], cost(test))):
            file = _file(test)
            words = file.removesuffix(".py").split("_")[1:]
            is_own = any(room in word for room in rooms for word in words)
            rounds[test] = count[file] // (OF_OWN_FILES if is_own else 1)
            count[file] += 1
        return sorted(tests, key=lambda test: (rounds[test], cost(test)))

    def chosen(self, site: Site, seconds: float, earlier: str = "") -> Chosen:
        """Return the tests that run the statement of a mutant.

        The quickest of each file come first, then the second ones: what many tests run is noticed
        by few of them, which are not alike. Of a file that is named after the room or the module
        of the mutant come ten at a time. What runs at import belongs to the tests of all
        functions of its module, and what a fixture runs to all tests of its file. The fixtures of
        a file take their time once.

        The test that noticed a fault before comes before all, whatever it takes: so no fault counts
        as lost because other tests have come before it.

        Args:
            site: Where the mutant stands.
            seconds: How long they may take in all; the first is always there [s].
            earlier: The test that noticed it before; "" for none.
        """
        by_line = self._contexts(site.mutant.file)
        lines = [line for line in site.lines if site.called] or list(by_line)
        contexts = {context for line in lines for context in by_line.get(line, [])}
        found: set[str] = set()
        for context in contexts:
            test, _, stage = context.rpartition(" (")
            found.update(self._of_file[_file(test)] if stage == "setup)" else [test])
        rooms = set(site.mutant.file.removesuffix(".py").replace("/", "_").split("_")[1:])
        by_file: dict[str, list[str]] = {}  # in the order of the first of each
        left = seconds
        ordered = self._ordered(found & set(self._seconds), rooms)
        if earlier in self._seconds:
            ordered = [earlier, *(test for test in ordered if test != earlier)]
        for test in ordered:
            file = _file(test)
            fixtures = 0.0 if file in by_file else self._fixtures.get(file, 0.0)
            if not by_file or self._seconds[test] + fixtures < left:
                left -= self._seconds[test] + fixtures
                by_file.setdefault(file, []).append(test)
        tests = tuple(test for same in by_file.values() for test in same)
        return Chosen(tests, seconds - left, not site.called or "" in contexts)
