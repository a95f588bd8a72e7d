"""Which tests run which statement of the package, by coverage.py, and how long each takes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

from coverage import Coverage, CoverageData

from .draw import Site

# Figures that were frozen from this project or its models guard against change. They are not
# tests of what is true, so they must not hold the score up.
FROZEN = ("tests/test_reference.py", "tests/test_golden.py")
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


def environment(tree: Path) -> dict[str, str]:
    """Return the environment of tests in a copy: every process they start imports that copy."""
    return {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}


def measure(tree: Path, folder: Path) -> None:
    """Run all tests of a copy of the checkout, and write which line each of them runs."""
    folder.mkdir(parents=True)
    settings = folder / "coverage.ini"
    settings.write_text(_INI.format(tree=tree, folder=folder), "utf-8")
    watched = {"COVERAGE_PROCESS_START": str(settings), "MUTANTS_TIMES": str(folder / "times.json")}
    command = [sys.executable, "-m", "pytest", "-p", "tools.mutants.contexts", "-n", "auto"]
    subprocess.run(
        [*command, "--dist", "worksteal", *(f"--ignore={path}" for path in FROZEN)],
        cwd=tree,
        env={**environment(tree), **watched},
        check=False,  # a test that fails here is not used
    )
    measured = Coverage(config_file=str(settings))
    measured.combine([str(folder)])
    measured.save()


class Covered:
    """What `measure` wrote into a folder."""

    def __init__(self, folder: Path) -> None:
        self._data = CoverageData(str(folder / "data"))
        self._data.read()
        told = json.loads((folder / "times.json").read_text("utf-8"))
        failed = set(told["failed"])
        self._seconds: dict[str, float] = {
            test: seconds
            for test, seconds in told["seconds"].items()
            if test not in failed and not test.startswith(FROZEN)
        }
        self._fixtures: dict[str, float] = told["fixtures"]
        self._of_file: dict[str, list[str]] = defaultdict(list)
        for test in self._seconds:
            self._of_file[test.partition("::")[0]].append(test)

    def tests(self, site: Site, seconds: float) -> list[str]:
        """Return the tests that run the statement of a mutant.

        Those whose file is named after its room or module come first, then the quickest. What
        runs at import belongs to the tests of all functions of its module, and what a fixture
        runs to all tests of its file. The fixtures of a file take their time once.

        Args:
            site: Where the mutant stands.
            seconds: How long they may take in all; the first is always there [s].
        """
        by_line = self._data.contexts_by_lineno(site.mutant.file)
        lines = [line for line in site.lines if site.called] or list(by_line)
        found: set[str] = set()
        for context in {context for line in lines for context in by_line.get(line, [])}:
            test, _, stage = context.rpartition(" (")
            file = test.partition("::")[0]
            found.update(self._of_file[file] if stage == "setup)" else [test])
        rooms = set(site.mutant.file.removesuffix(".py").replace("/", "_").split("_")[1:])

        def order(test: str) -> tuple[bool, float, str]:
            file = test.partition("::")[0]
            own = rooms & set(file.removesuffix(".py").split("_")[1:])
            return not own, self._seconds[test] + self._fixtures.get(file, 0.0), test

        chosen: list[str] = []
        prepared: set[str] = set()
        for test in sorted(found & set(self._seconds), key=order):
            file = test.partition("::")[0]
            fixtures = 0.0 if file in prepared else self._fixtures.get(file, 0.0)
            if not chosen or self._seconds[test] + fixtures < seconds:
                seconds -= self._seconds[test] + fixtures
                prepared.add(file)
                chosen.append(test)
        return chosen
