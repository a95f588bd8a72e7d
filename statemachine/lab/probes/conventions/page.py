"""What each engine takes for granted, and which call does what: pages, and one to print."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Literal

from ....engines.measured import Measurement
from ....measures.text import display_unit, significant, versions_of
from ....show.blocks import Page, Table
from ....show.templates import PageContent, render
from . import CONCEPTS, Convention, Conventions, Phrasebook

_SHOWN_AS_ZERO = 1e-12


@dataclass(frozen=True)
class _Convention:
    """The answers to a question by engine, and why it matters (Markdown)."""

    answers: Table
    why: str


@dataclass(frozen=True)
class ConventionsPage(PageContent):
    """Content of the page of conventions.

    Attributes:
        result: What the engines take for granted.
        conventions: One for each question.
    """

    template = "conventions.md.j2"
    result: Conventions
    conventions: Sequence[_Convention]


@dataclass(frozen=True)
class _EnginePhrase:
    """What to type on an engine for a concept.

    Attributes:
        engine: Its name.
        concept: Its name.
        state: Whether what it should do happened.
        code: What is typed; "" where it was not asked.
        message: What happened instead; "" where it works.
    """

    engine: str
    concept: str
    state: Literal["works", "fails", "not asked"]
    code: str = ""
    message: str = ""


@dataclass(frozen=True)
class _Concept:
    """A concept, and what to type for it, engine by engine."""

    name: str
    phrases: Sequence[_EnginePhrase]


@dataclass(frozen=True)
class CallsPage(PageContent):
    """Content of the page of calls.

    Attributes:
        result: What was run on each engine.
        concepts: In the order in which a newcomer meets them.
    """

    template = "conventions_calls.md.j2"
    result: Phrasebook
    concepts: Sequence[_Concept]

    @property
    def total(self) -> int:
        """Return the number of calls that were run."""
        return sum(len(phrases) for phrases in self.result.engines.values())

    @property
    def wrong(self) -> list[_EnginePhrase]:
        """Return the calls that did not do what they should."""
        phrases = [phrase for concept in self.concepts for phrase in concept.phrases]
        return [phrase for phrase in phrases if phrase.state == "fails"]

    @property
    def right(self) -> int:
        """Return the number of calls that did what they should."""
        return self.total - len(self.wrong)

    @property
    def holds(self) -> bool:
        """Tell whether all did what they should."""
        return not self.wrong


def page(result: Conventions) -> Page:
    """Return one table for each question, and why it matters."""
    conventions = [
        _Convention(_table(answered), answered.question.why) for answered in result.questions
    ]
    return render(ConventionsPage(result, conventions))


def calls_page(result: Phrasebook) -> Page:
    """Return for each concept what to type on each engine, and whether all did what it should."""
    concepts = [_Concept(concept, _phrases_of(concept, result)) for concept in CONCEPTS]
    return render(CallsPage(result, concepts))


def _phrases_of(concept: str, result: Phrasebook) -> list[_EnginePhrase]:
    """Return what to type for a concept, engine by engine."""
    found: list[_EnginePhrase] = []
    for engine, calls in result.engines.items():
        call = next((call for call in calls if call.concept == concept), None)
        if call is None:
            found.append(_EnginePhrase(engine, concept, "not asked"))
        else:
            state = "works" if call.works else "fails"
            found.append(_EnginePhrase(engine, concept, state, call.code, call.fault))
    return found


def _table(answered: Convention) -> Table:
    """Return answers by engine, with a column for the parts of the question if it has any."""
    rows: list[tuple[str, str, str, str]] = []
    for engine, findings in answered.findings.items():
        if findings is None:
            rows.append((engine, "", "not asked", ""))
            continue
        for number, finding in enumerate(findings):
            name = "" if number else engine
            measured = ", ".join(_text(figure) for figure in finding.figures)
            rows.append((name, finding.of, finding.answer, measured))
    headers = ("engine", "of", "answer", "measured")
    has_parts = any(row[1] for row in rows)
    columns = [0, 1, 2, 3] if has_parts else [0, 2, 3]
    cells: list[list[str]] = []
    for row in rows:
        cells.append([row[column] for column in columns])
    title = f"{answered.name}: {answered.question.title}"
    words = frozenset(range(len(columns)))
    return Table([headers[column] for column in columns], cells, title, words=words)


def _text(figure: Measurement) -> str:
    """Return the name of a measurement and its values, in the unit that is read."""
    values = figure.value if isinstance(figure.value, tuple) else (figure.value,)
    factor, unit = display_unit(figure.unit)
    largest = max((abs(value) for value in values if not isinstance(value, str)), default=0.0)
    words: list[str] = []
    for value in values:
        if isinstance(value, str):
            words.append(value)
        elif abs(value) <= _SHOWN_AS_ZERO * largest:
            words.append("0")  # beside a large number, one that is only rounding is nothing
        else:
            digits = 3 if abs(factor * value) >= 1e-3 else 2
            words.append(significant(factor * value, digits))
    has_numbers = any(not isinstance(value, str) for value in values)
    between = " " if has_numbers else ", "
    shown = between.join(words) if words else "nothing"
    return f"{figure.name} {shown}{unit}".strip()


# With this library, concept by concept: a program, as the engines' own cells are.
CALLS_OF_THIS_LIBRARY = {
    "load": 'import statemachine as sm\nm = sm.load("so101/scene")\nd = sm.make_data(m)',
    "state": "d.qpos[0], d.qvel[0] = 0.4, 0",
    "command": "d.ctrl[0] = 1.0",
    "step": "sm.step(m, d)",
    "recompute": "sm.forward(m, d)",
    "read a site": 'tip = d.site_xpos[m.site_id("gripperframe")]',
    "reset": "sm.reset(m, d)",
    "save": "saved = sm.get_state(m, d)\nsm.step(m, d, 100)\nsm.set_state(m, d, saved)  # back",
    "many worlds": "worlds = [sm.make_data(m) for _ in range(3)]",
}
# What each lesson of the path shows, in a line.
REMINDERS = (
    ("nowhere", "make_data computes nothing: forward does, or step."),
    ("objects", "A Model never changes. A Data is everything that does."),
    ("state", "A joint's slots in qpos and in qvel differ: jnt_qposadr, jnt_dofadr."),
    ("forward", "data.qpos is the array itself; a copy is data.qpos.copy()."),
    ("forward", "A write changes nothing that is derived. forward recomputes it; no time passes."),
    ("forward", "step computes, then moves: what you read is of the state before. Call forward."),
    ("hold", "ctrl has your commands, one number an actuator: of a servo, an angle [rad]."),
    ("gravity", "ctrl = 0 is a command: a servo holds its joint at 0."),
    ("reset", "A keyframe has a time of its own."),
    ("replay", "The same state and the same commands give the same bits. They need not be true."),
    ("time", "Nothing waits. Count steps; do not compare times."),
)


def cheat_sheet(table: Phrasebook) -> str:
    """Return the page as Markdown, with a table in HTML.

    Args:
        table: The engines' own cells, as they were run; those that did not work are left out.
    """
    columns = {"statemachine": CALLS_OF_THIS_LIBRARY}
    for engine, phrases in table.engines.items():
        working = {phrase.concept: phrase.code for phrase in phrases if phrase.works}
        if working:
            columns[engine] = working
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *columns))
    rows: list[str] = []
    for concept in CONCEPTS:
        cells = [f"<th>{escape(concept)}</th>"]
        for column in columns.values():
            code = f"<pre>{escape(column[concept])}</pre>" if concept in column else ""
            cells.append(f"<td>{code}</td>")
        rows.append(f"<tr>{''.join(cells)}</tr>")
    versions = versions_of(table.versions)
    lines = "\n".join(f"- {text} (`lesson {lesson}`)" for lesson, text in REMINDERS)
    body = "\n".join(rows)
    return (
        "# Cheat sheet\n\n"
        f"*Every cell was run on {versions}.*\n\n"
        '<div class="cheat-sheet">\n<table>\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>\n</div>\n\n"
        f"## What to remember\n\n{lines}\n"
    )
