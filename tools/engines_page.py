"""Write what is computed of docs/engines.md: what each installed engine does, and what it costs.

    python -m tools.engines_page

What stands before and after the two marks is written by hand: what was measured once of engines
that are not installed. `tests/test_engines_page.py` holds the rest, but for the times.
"""

from __future__ import annotations

import datetime
import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import statemachine as sm
from statemachine.atomic_files import replace_text
from statemachine.backends import backend_names
from statemachine.course.notebook import block_as_markdown
from statemachine.errors import EngineWarning
from statemachine.installed import available
from statemachine.interface.records import BEHAVIOURS
from statemachine.lab.probes.conventions import Conventions, probe
from statemachine.lab.runs.usual_commands import hold_ctrl
from statemachine.measures.text import versions_of
from statemachine.show.blocks import Table

from .validate_table import no_picture

TARGET = Path(__file__).parent.parent / "docs" / "engines.md"
START = "<!-- What follows is made by `python -m tools.engines_page`. -->"
END = "<!-- What was made by `python -m tools.engines_page` ends here. -->"
STEPS = 400
REPEATS = 7  # of which the shortest time counts


@dataclass(frozen=True)
class StepCost:
    """What a step of the arm costs through this library, `hold` commanded.

    Attributes:
        backend: The engine.
        free: Time of a step without contacts [µs].
        floor: Time of a step on the floor [µs].
    """

    backend: str
    free: float
    floor: float


def step_costs(backends: Sequence[str]) -> list[StepCost]:
    """Measure a step of the arm on each backend; backends take turns, and the shortest counts."""
    shortest: dict[tuple[str, bool], float] = {}
    for _ in range(REPEATS):
        for backend in backends:
            for contacts in (False, True):
                model = sm.load("so101", backend=backend).replace(contacts=contacts)
                data = sm.make_data(model)
                data.ctrl[:] = hold_ctrl(model)
                start = time.perf_counter()
                sm.step(model, data, STEPS)
                seconds = time.perf_counter() - start
                key = backend, contacts
                shortest[key] = min(shortest.get(key, seconds), seconds)
    return [
        StepCost(
            backend,
            shortest[backend, False] / STEPS * 1e6,
            shortest[backend, True] / STEPS * 1e6,
        )
        for backend in backends
    ]


def cost_table(costs: Sequence[StepCost]) -> Table:
    """Return a row for each backend, with its time relative to the first one's."""
    headers = ("backend", "without contacts, µs", "on the floor, µs", "on the floor, relative")
    rows = [
        (
            cost.backend,
            f"{cost.free:.0f}",
            f"{cost.floor:.0f}",
            f"{cost.floor / costs[0].floor:.1f}",
        )
        for cost in costs
    ]
    return Table(headers, rows, words=frozenset({0}))


def answer_table(conventions: Conventions) -> Table:
    """Return a row for each question, a column for each engine."""
    engines = tuple(conventions.versions)
    rows: list[tuple[str, ...]] = []
    for convention in conventions.questions:
        cells = [convention.name]
        for engine in engines:
            parts: list[str] = []
            for finding in convention.findings[engine] or ():
                parts.append(f"{finding.of}: {finding.answer}" if finding.of else finding.answer)
            cells.append("; ".join(parts) or "not asked")
        rows.append(tuple(cells))
    return Table(("question", *engines), rows, words=frozenset(range(len(engines) + 1)))


def support_table(backends: Sequence[str]) -> Table:
    """Return a row for each promise of the interface, a column for each backend."""
    supports: list[Mapping[str, str]] = []
    for backend in backends:
        behaviours = sm.load("so101", backend=backend).capabilities.behaviours
        supports.append({name: behaviour.support for name, behaviour in behaviours.items()})
    rows = [(name, *(support[name] for support in supports)) for name in BEHAVIOURS]
    return Table(("promise", *backends), rows, words=frozenset(range(len(backends) + 1)))


def computed_part(conventions: Conventions, backends: Sequence[str], date: str) -> str:
    """Return what stands between the marks.

    Args:
        conventions: What the engines take for granted.
        backends: Those whose support and cost are shown.
        date: When the times are measured.
    """
    tables = {
        "What they do": answer_table(conventions),
        "What this library promises of them": support_table(backends),
        f"What a step of the arm costs (measured on {date})": cost_table(step_costs(backends)),
    }
    parts = [START, f"*{versions_of(conventions.versions)}*"]
    for title, table in tables.items():
        parts += [f"## {title}", block_as_markdown(table, no_picture)]
    return "\n\n".join([*parts, END])


def document(text: str, computed: str) -> str:
    """Return the page.

    Args:
        text: The page as it is; what stands outside of the marks stays.
        computed: What stands between them, marks included.
    """
    return f"{text.partition(START)[0]}{computed}{text.partition(END)[2]}"


def main() -> int:
    """Ask the engines, and write the page; the exit code."""
    warnings.simplefilter("ignore", EngineWarning)  # what an engine ignores of the arm's file
    date = datetime.datetime.now(datetime.UTC).date().isoformat()
    computed = computed_part(probe(available()[0]), backend_names(), date)
    replace_text(TARGET, document(TARGET.read_text("utf-8"), computed))
    return 0


if __name__ == "__main__":
    sys.exit(main())
