"""What each engine takes for granted, and which call does what, as pages."""

from __future__ import annotations

from collections.abc import Mapping

from ..engines.measured import Measurement
from ..measures.text import capital, reading, significant
from ..page import Block, Code, Page, Section, Table, Text, Verdict
from ..probes.conventions import Answered, Conventions
from ..probes.phrasebook import CONCEPTS, Phrasebook

_ZERO = 1e-12
_NOT_ASKED = "not asked"


def page(result: Conventions) -> Page:
    """One table for each question, and why it matters."""
    blocks: list[Block] = [
        Text(
            "The engines themselves were asked, each question on a small model made for it. The "
            "lessons ask this project's backends instead, which make every engine keep one "
            "contract. So an answer here may differ from what a lesson shows on the same engine."
        )
    ]
    for answered in result.questions:
        blocks += [_table(answered), Text(answered.question.why)]
    return Page("What the engines take for granted", _origin(result.versions), blocks)


def calls_page(result: Phrasebook) -> Page:
    """For each concept what to type on each engine, and whether all of it did what it should."""
    blocks: list[Block] = []
    for concept in CONCEPTS:
        shown: list[Block] = []
        for engine, calls in result.engines.items():
            call = next((each for each in calls if each.concept == concept), None)
            if call is None:
                shown.append(Text(f"{engine}: {_NOT_ASKED}"))
                continue
            shown += [Text(f"{engine} {'✓' if call.works else '✗'}"), Code(call.code.splitlines())]
        blocks.append(Section("", capital(concept), shown))
    every = [(engine, call) for engine, calls in result.engines.items() for call in calls]
    wrong = [(engine, call) for engine, call in every if not call.works]
    blocks += [Verdict(f"{engine}, {call.concept}: {call.said}", False) for engine, call in wrong]
    count = f"{len(every) - len(wrong)} of {len(every)} calls ran"
    blocks.append(Verdict(f"{count}, and what they should do happened", not wrong))
    return Page("Which call does what", _origin(result.versions), blocks)


def _origin(versions: Mapping[str, str]) -> str:
    return ", ".join(f"{engine} {version}".strip() for engine, version in versions.items())


def _table(answered: Answered) -> Table:
    parts = any(finding.of for each in answered.findings.values() for finding in each or ())
    rows = []
    for engine, findings in answered.findings.items():
        if findings is None:
            rows.append((engine, *([""] if parts else []), _NOT_ASKED, ""))
            continue
        for k, finding in enumerate(findings):
            measured = ", ".join(_text(figure) for figure in finding.figures)
            part = (finding.of,) if parts else ()
            rows.append(("" if k else engine, *part, finding.answer, measured))
    headers = ("", *([""] if parts else []), "answer", "measured")
    return Table(
        headers, rows, f"{answered.name}: {answered.question.title}", frozenset(range(len(headers)))
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
