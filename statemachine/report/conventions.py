"""What each engine takes for granted, and which call does what: pages, and one to print."""

from __future__ import annotations

from html import escape
from itertools import chain

from ..engines.measured import Measurement
from ..measures.text import capital, reading, significant
from ..page import Block, Code, Figures, Page, Section, Table, Text, Verdict
from ..probes.phrasebook import CONCEPTS
from . import template
from .template import versions_of

_ZERO = 1e-12
_NOT_ASKED = "not asked"


def page(result: Figures) -> Page:
    """One table for each question, and why it matters."""
    answers = [(_table(answered), Text(answered.question.why)) for answered in result.questions]
    return template.page(
        "conventions", engines=versions_of(result.versions), answers=list(chain(*answers))
    )


def calls_page(result: Figures) -> Page:
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


def _concept(concept: str, result: Figures) -> Section:
    """What to type for a concept, engine by engine."""
    shown: list[Block] = []
    for engine, calls in result.engines.items():
        call = next((call for call in calls if call.concept == concept), None)
        state = f": {_NOT_ASKED}" if call is None else " ✓" if call.works else " ✗"
        shown.append(Text(f"{engine}{state}"))
        shown += [Code(call.code.splitlines())] if call else []
    return Section("", capital(concept), shown)


def _table(answered: Figures) -> Table:
    """Answers by engine, with a column for the parts of the question if it has any."""
    rows = []
    for engine, findings in answered.findings.items():
        for k, finding in enumerate(findings or []):
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


def _text(figure: Measurement) -> str:
    values = figure.value if isinstance(figure.value, tuple) else (figure.value,)
    numbers = [value for value in values if not isinstance(value, str)]
    most = max(map(abs, numbers), default=0.0)
    factor, unit = reading(figure.unit)
    # Beside a large number, one that is only rounding is nothing.
    scaled = [v if isinstance(v, str) else factor * v * (abs(v) > _ZERO * most) for v in values]
    words = [
        v if isinstance(v, str) else significant(v, 3 if abs(v) >= 1e-3 else 2) for v in scaled
    ]
    shown = (" " if numbers else ", ").join(words) or "nothing"
    return f"{figure.name} {shown}{unit}".strip()


# With this library, concept by concept: a program, as the engines' own cells are.
OURS = {
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
REMEMBER = (
    ("objects", "A Model never changes. A Data is everything that does."),
    ("state", "A joint's slots in qpos and in qvel differ: jnt_qposadr, jnt_dofadr."),
    ("write", "data.qpos is the array itself; a copy is data.qpos.copy()."),
    ("forward", "A write changes nothing that is derived. forward recomputes it; no time passes."),
    ("forward", "step computes, then moves: what it leaves is of the state before. Call forward."),
    ("hold", "ctrl is the only wire in: one number for each actuator."),
    ("gravity", "ctrl = 0 is a command: a servo holds its joint at 0."),
    ("reset", "A keyframe has a time of its own."),
    ("replay", "The same state and the same commands give the same bits. That is not truth."),
    ("time", "Nothing waits. Count steps; do not compare times."),
)


def cheat_sheet(table: Figures) -> str:
    """The page as Markdown, with a table in HTML.

    Args:
        table: The engines' own cells, as they were run; those that did not work are left out.
    """
    cells = {
        engine: {phrase.concept: phrase.code for phrase in phrases if phrase.works}
        for engine, phrases in table.engines.items()
    }
    columns = {"statemachine": OURS} | {name: codes for name, codes in cells.items() if codes}
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *columns))
    rows = []
    for concept in CONCEPTS:
        row = "".join(
            f"<td><pre>{escape(column[concept])}</pre></td>" if concept in column else "<td></td>"
            for column in columns.values()
        )
        rows.append(f"<tr><th>{escape(concept)}</th>{row}</tr>")
    versions = versions_of(table.versions)
    lines = "\n".join(f"- {text} (`lesson {lesson}`)" for lesson, text in REMEMBER)
    body = "\n".join(rows)
    return (
        "# Cheat sheet\n\n"
        f"*Every cell was run on {versions}.*\n\n"
        '<table class="cheat-sheet">\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>\n\n"
        f"## What to remember\n\n{lines}\n"
    )
