"""Write docs/validate.md: every case of `statemachine validate`, on every engine.

    python -m tools.validate_table

A table has a row for each outcome of a case; engines and integrators that agree in what is shown
share one. `tests/test_validate_table.py` holds it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from statemachine.atomic_files import replace_text
from statemachine.cli.common import TerminalReporter
from statemachine.course.notebook import block_as_markdown
from statemachine.lab.validate.battery import CaseResult, ValidateRequest, ValidateResult, answer
from statemachine.lab.validate.cases import GROUPS
from statemachine.lab.validate.page import error_of_row, order_text
from statemachine.lab.validate.variants import OWN
from statemachine.lab.validate.verdict import CaseMeasurement
from statemachine.measures.text import display_unit, milliseconds
from statemachine.show.blocks import Table

BACKENDS = ("mujoco", "pybullet", "pybullet:engine", "motrix")
TIMESTEP = 0.002  # [s] at which the error is shown: the one that MuJoCo starts with
TARGET = Path(__file__).parent.parent / "docs" / "validate.md"
MARK = "<!-- What follows is made by `python -m tools.validate_table`. -->"
_HEADERS = ("case", "engine and integrator", "error at 2 ms", "order", "verdict", "cause")
_CELL = re.compile(r"(?<!\\)\|")
_FIGURE = re.compile(r"(-?[0-9.]+(?:e-?[0-9]+)?) ?(.*)")
_NONE = "–"
_AT = " at "  # between an error and its timestep


@dataclass(frozen=True)
class TableRow:
    """A row of the table.

    Attributes:
        case: Name of the case.
        ways: The engines, each with its integrators, or alone for all that it has.
        error: Its error at 2 ms, as it is read; or the largest, with its timestep, where that is
            wrong and the one at 2 ms is not.
        order: With which power of the timestep the error vanishes; a dash where it does not.
        verdict: How the engines do.
        cause: What the error comes from.
    """

    case: str
    ways: str
    error: str
    order: str
    verdict: str
    cause: str

    @property
    def cells(self) -> tuple[str, ...]:
        """What stands in the columns."""
        return (self.case, self.ways, self.error, self.order, self.verdict, self.cause)

    def is_of(self, backend: str, integrator: str) -> bool:
        """Tell whether the row is of an engine with an integrator."""
        for part in self.ways.split("; "):
            name, _, integrators = part.partition(" ")
            if name == backend and (not integrators or integrator in integrators.split(", ")):
                return True
        return False

    def error_in(self, unit: str) -> float | None:
        """Return the error that is shown; None where there is none.

        Args:
            unit: SI unit of the error; "" for a ratio.
        """
        match = _FIGURE.fullmatch(self.error.partition(_AT)[0])
        if match is None:
            return None
        number = float(match[1])
        if unit == "" and match[2] == "%":
            return number / 100.0
        return number / display_unit(unit)[0]


def measurement_shown(result: CaseResult) -> CaseMeasurement | None:
    """Return what is shown of a result; None if it was refused.

    It is that at 2 ms; of a result that is wrong at other timesteps alone, the largest error.
    """
    for measurement in result.measurements:
        if measurement.timestep == TIMESTEP:
            is_right = measurement.error is not None and (
                abs(measurement.error) <= result.case.tolerance
            )
            if result.verdict == "wrong" and is_right:
                return max(result.measurements, key=_size)
            return measurement
    return None


def _size(measurement: CaseMeasurement) -> float:
    return 0.0 if measurement.error is None else abs(measurement.error)


def _error_shown(result: CaseResult) -> str:
    """Return the error that is shown, with its timestep where that is not 2 ms."""
    measurement = measurement_shown(result)
    if measurement is None or result.verdict in ("exact", "refused", "diverges"):
        return _NONE
    error = error_of_row(result, measurement.error)
    if measurement.timestep == TIMESTEP:
        return error
    return f"{error}{_AT}{milliseconds(measurement.timestep)}"


def rows_of(results: Sequence[CaseResult]) -> list[TableRow]:
    """Return the rows of the results of one case; results that look the same share one."""
    merged: dict[tuple[str, ...], list[CaseResult]] = {}
    for result in results:
        error = _error_shown(result)
        cause = _NONE if result.cause in (None, "none") else str(result.cause)
        key = (error, order_text(result), result.verdict, cause)
        merged.setdefault(key, []).append(result)
    integrators: dict[str, int] = {}
    for result in results:
        integrators[result.backend] = integrators.get(result.backend, 0) + 1
    rows: list[TableRow] = []
    for (error, order, verdict, cause), alike in merged.items():
        ways = _joined(alike, integrators)
        rows.append(TableRow(results[0].name, ways, error, order, verdict, cause))
    return rows


def _joined(results: Sequence[CaseResult], integrators: Mapping[str, int]) -> str:
    """Return engines with their integrators: "mujoco Euler, RK4; pybullet".

    Args:
        results: Of which engines and integrators.
        integrators: How many an engine has, by backend.
    """
    names: dict[str, list[str]] = {}
    for result in results:
        names.setdefault(result.backend, []).append(result.integrator)
    parts: list[str] = []
    for backend, ways in names.items():
        has_all = len(ways) == integrators[backend] or ways == [OWN]
        parts.append(backend if has_all else f"{backend} {', '.join(ways)}")
    return "; ".join(parts)


def document(result: ValidateResult, text: str) -> str:
    """Return the page.

    Args:
        result: Of all cases and engines.
        text: The page as it is; what stands above the mark stays.
    """
    versions = ", ".join(f"{name} ({version})" for name, version in result.versions.items())
    parts = [f"{text.partition(MARK)[0]}{MARK}", f"*{versions}*"]
    for group in GROUPS:
        rows: list[tuple[str, ...]] = []
        names = dict.fromkeys(row.name for row in result.results if row.group == group)
        for name in names:
            of_case = [row for row in result.results if row.name == name]
            rows += [row.cells for row in rows_of(of_case)]
        parts.append(f"## {group.capitalize()}")
        parts.append(
            block_as_markdown(Table(_HEADERS, rows, words=frozenset({0, 1, 4, 5})), no_picture)
        )
    return "\n\n".join(parts) + "\n"


def no_picture(_picture: object) -> str:
    """Return nothing: these tables have no pictures beside them."""
    return ""


def rows_in(page: str) -> list[TableRow]:
    """Return the rows of the tables of a page."""
    rows: list[TableRow] = []
    for line in page.splitlines():
        cells = [cell.strip() for cell in _CELL.split(line)[1:-1]]
        is_table = len(cells) == len(_HEADERS) and cells != list(_HEADERS)
        if is_table and not cells[0].startswith(":--"):
            rows.append(TableRow(*cells))
    return rows


def main() -> int:
    """Run the battery, and write the page; the exit code."""
    result = answer(ValidateRequest(backends=BACKENDS), TerminalReporter())
    replace_text(TARGET, document(result, TARGET.read_text("utf-8")))
    return 0 if result.holds else 1


if __name__ == "__main__":
    sys.exit(main())
