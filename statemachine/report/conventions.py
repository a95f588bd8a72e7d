"""What each engine takes for granted, and which call does what, as pages."""

from __future__ import annotations

from itertools import chain

from ..engines.measured import Measurement
from ..measures.text import capital, reading, significant
from ..page import Block, Code, Page, Section, Table, Text, Verdict
from ..probes.conventions import Answered, Conventions
from ..probes.phrasebook import CONCEPTS, Phrasebook
from . import template
from .template import versions_of

_ZERO = 1e-12
_NOT_ASKED = "not asked"


def page(result: Conventions) -> Page:
    """One table for each question, and why it matters."""
    answers = [(_table(answered), Text(answered.question.why)) for answered in result.questions]
    return template.page(
        "conventions", engines=versions_of(result.versions), answers=list(chain(*answers))
    )


def calls_page(result: Phrasebook) -> Page:
    """For each concept what to type on each engine, and whether all of it did what it should."""
    calls = [(engine, call) for engine, those in result.engines.items() for call in those]
    wrong = [f"{engine}, {call.concept}: {call.said}" for engine, call in calls if not call.works]
    return template.page(
        "conventions_calls",
        engines=versions_of(result.versions),
        concepts=[_concept(concept, result) for concept in CONCEPTS],
        wrong=[Verdict(text, False) for text in wrong],
        holds=not wrong,
        right=len(calls) - len(wrong),
        total=len(calls),
    )


def _concept(concept: str, result: Phrasebook) -> Section:
    """What to type for a concept, engine by engine."""
    shown: list[Block] = []
    for engine, calls in result.engines.items():
        call = next((each for each in calls if each.concept == concept), None)
        state = f": {_NOT_ASKED}" if call is None else " ✓" if call.works else " ✗"
        shown.append(Text(f"{engine}{state}"))
        shown += [Code(call.code.splitlines())] if call else []
    return Section("", capital(concept), shown)


def _table(answered: Answered) -> Table:
    """Answers by engine, with a column for the parts of the question if it has any."""
    rows = []
    for engine, findings in answered.findings.items():
        for k, finding in enumerate(findings or ()):
            measured = ", ".join(_text(figure) for figure in finding.figures)
            rows.append(("" if k else engine, finding.of, finding.answer, measured))
        rows += [] if findings is not None else [(engine, "", _NOT_ASKED, "")]
    shown = [0, 1, 2, 3] if any(row[1] for row in rows) else [0, 2, 3]
    headers = ("engine", "of", "answer", "measured")
    return Table(
        [headers[k] for k in shown],
        [[row[k] for k in shown] for row in rows],
        f"{answered.name}: {answered.question.title}",
        frozenset(range(len(shown))),
    )


def _number(value: float) -> str:
    return significant(value, 3 if abs(value) >= 1e-3 else 2)


def _text(figure: Measurement) -> str:
    values = figure.value if isinstance(figure.value, tuple) else (figure.value,)
    numbers = [each for each in values if not isinstance(each, str)]
    most = max(map(abs, numbers), default=0.0)
    factor, unit = reading(figure.unit)
    words = [
        # Beside a large number, one that is only rounding is nothing.
        each if isinstance(each, str) else _number(factor * each if abs(each) > _ZERO * most else 0)
        for each in values
    ]
    shown = (" " if numbers else ", ").join(words) or "nothing"
    return f"{figure.name} {shown}{unit}".strip()
