"""What a student's tests are worth: which faults they caught, and what to add."""

from __future__ import annotations

from ..grading.mutants.run import Examination, MutantTrial
from ..measures.text import count
from ..page import Page, Table, Text
from . import template

_WIDTH, _SHOWN = 30, 200  # characters of a test's name, and of what it said


def page(found: Examination) -> Page:
    """The examination as a page."""
    trials = Table.of(
        found.trials,
        {
            "fault": lambda trial: trial.mutant.name,
            "what is wrong": lambda trial: trial.mutant.wrong,
            "caught by": _catchers,
        },
        "One fault at a time",
        words={"what is wrong", "caught by"},
        emphasis=lambda trial: not trial.caught,
    )
    failures, hints = found.failures, [(m.name, m.hint) for m in found.survivors]
    idle = found.idle and len(found.trials) > 1 and not failures
    return template.page(
        "mutants",
        file=found.file,
        tests=count(len(found.tests), "test"),
        backend=found.backend,
        version=found.engine_version,
        trials=None if failures else trials,
        hints=[] if failures else [Text(f"{name}: {hint}.") for name, hint in hints],
        idle=", ".join(found.idle) if idle else None,
        healthy=None if failures else not hints,
        caught=found.caught,
        faults=count(len(found.trials), "fault"),
        unhealthy=False if failures else None,
        failures=[Text(_cut(f"{each.test}: {each.why}", _SHOWN)) for each in failures],
    )


def _catchers(trial: MutantTrial) -> str:
    """The first test that caught it, and how many others did."""
    if not trial.caught:
        return "nothing"
    first, *others = trial.caught_by
    more = f" +{len(others)}" if others else ""
    return _cut(first.test.removeprefix("test_"), _WIDTH - len(more)) + more


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
