"""What a student's tests are worth: which faults they caught, and what to add."""

from __future__ import annotations

from ..grading.mutants.run import Examination, Failure, MutantTrial
from ..measures.text import count
from ..page import Block, Page, Table, Text, Verdict

_WIDTH, _SHOWN = 30, 200  # characters of a test's name, and of what it said


def page(found: Examination) -> Page:
    """The examination as a page."""
    unhealthy: list[Block] = [
        Verdict("your tests fail on the healthy arm; no fault was tried", False),
        *(Text(_told(failure)) for failure in found.failures),
    ]
    return Page(
        f"The tests of {found.file}",
        f"{count(len(found.tests), 'test')}, on {found.backend} {found.engine_version}",
        unhealthy if found.failures else _trials(found),
    )


def _trials(found: Examination) -> list[Block]:
    table = Table(
        ("", "what is wrong", "caught by"),
        [(trial.mutant.name, trial.mutant.wrong, _catchers(trial)) for trial in found.trials],
        title="One fault at a time",
        words=frozenset({0, 1, 2}),
        emphasis=frozenset(k for k, trial in enumerate(found.trials) if not trial.caught),
    )
    hints = [Text(f"{mutant.name}: {mutant.hint}.") for mutant in found.survivors]
    idle = []
    if found.idle and len(found.trials) > 1:
        idle = [Text(f"Caught nothing here: {', '.join(found.idle)}.")]
    verdict = Verdict(
        f"{found.caught} of {count(len(found.trials), 'fault')} caught", not found.survivors
    )
    return [table, *hints, *idle, verdict]


def _catchers(trial: MutantTrial) -> str:
    """The first test that caught it, and how many others did."""
    if not trial.caught:
        return "nothing"
    first, *others = trial.caught_by
    more = f" +{len(others)}" if others else ""
    return _cut(first.test.removeprefix("test_"), _WIDTH - len(more)) + more


def _told(failure: Failure) -> str:
    return _cut(f"{failure.test}: {failure.why}", _SHOWN)


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
