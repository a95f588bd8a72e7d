"""What each engine takes for granted, and which call does what: pages, and one to print.

And recorded calls as blocks: each line of a code, and under it what the engine was made to do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from itertools import chain, groupby, zip_longest

from ..engines import room
from ..engines.call_watch import CallWords
from ..engines.measured import Measurement
from ..interface import DERIVED
from ..measures.text import NONE, capital, few, grouped, reading, significant
from ..page import Block, Code, Page, Section, Table, Text, Verdict
from ..probes.calls import Call, RecordedStatement, Recording
from ..probes.conventions import CONCEPTS, Convention, Conventions, Phrasebook
from . import template
from .template import if_true, versions_of

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
        call = next((call for call in calls if call.concept == concept), None)
        state = f": {_NOT_ASKED}" if call is None else " ✓" if call.works else " ✗"
        shown.append(Text(f"{engine}{state}"))
        shown += [Code(call.code.splitlines())] if call else []
    return Section("", capital(concept), shown)


def _table(answered: Convention) -> Table:
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
    ("forward", "step computes, then moves: what you read is of the state before. Call forward."),
    ("hold", "ctrl has your commands, one number an actuator: of a servo, an angle [rad]."),
    ("gravity", "ctrl = 0 is a command: a servo holds its joint at 0."),
    ("reset", "A keyframe has a time of its own."),
    ("replay", "The same state and the same commands give the same bits. They need not be true."),
    ("time", "Nothing waits. Count steps; do not compare times."),
)


def cheat_sheet(table: Phrasebook) -> str:
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


_NAMES_SHOWN = 8  # of what a call changed
_ROWS_SHOWN = 6  # of the calls on one thing, before those that changed nothing share one


def recorded_calls(recordings: Mapping[str, Recording]) -> list[Block]:
    """Blocks for the recordings of one code, by engine; the code's backend may differ."""
    prefix = {name: f"{name}: " if len(recordings) > 1 else "" for name in recordings}
    looks = [
        f"{prefix[name]}{_words(recording.engine).shown}" for name, recording in recordings.items()
    ]
    ended = {name: recording.error for name, recording in recordings.items() if recording.error}
    statements: list[Block] = []
    for together in zip_longest(*(recording.statements for recording in recordings.values())):
        pairs = zip(recordings, together, strict=True)
        ran = {name: statement for name, statement in pairs if statement is not None}
        sources = dict.fromkeys(statement.source for statement in ran.values())
        is_import = next(iter(sources)).startswith(("import ", "from "))
        if not is_import or any(statement.calls or statement.changed for statement in ran.values()):
            statements.append(Code([line for source in sources for line in source.splitlines()]))
            statements += _answers(ran)
    return template.blocks(
        "calls",
        engines=" and ".join(
            f"{name} {recording.version}" for name, recording in recordings.items()
        ),
        none=NONE,
        looks="; ".join(looks),
        statements=statements,
        ended=[Text(f"{prefix[name]}The run ended there: {why}") for name, why in ended.items()],
        legend=[text for recording in recordings.values() for text in _legend(recording)],
    )


def not_asked(backend: str) -> Text:
    """What is said of a backend whose engine has no room that tells of its calls."""
    return Text(f"{backend}: not asked which of its own functions it ran.")


def _answers(ran: Mapping[str, RecordedStatement]) -> list[Block]:
    """What a line made each engine do; once, if nothing and the same of all."""
    silent = {name: _unheard(statement) for name, statement in ran.items() if not statement.calls}
    if len(silent) == len(ran) and len({*silent.values()}) == 1:
        return [Text(next(iter(silent.values())))]
    return [
        Text(f"{name}: {silent[name]}") if name in silent else _calls_table(name, statement)
        for name, statement in ran.items()
    ]


def _unheard(statement: RecordedStatement) -> str:
    """What a line did that ran nothing of the engine."""
    changed = ", ".join(statement.changed) or None
    (text,) = template.texts(
        "calls_unheard",
        later=" and ".join(statement.due) or None,
        written=changed if statement.due else None,
        changed=None if statement.due else changed,
        nothing=if_true(not statement.due and not changed),
    )
    return text


def _calls_table(engine: str, statement: RecordedStatement) -> Table:
    """The calls, those on one thing under its name; then what changed outside of them."""
    rows: list[tuple[str, str, str]] = []
    titles: set[int] = set()
    for (owner, on), calls in groupby(statement.calls, key=lambda call: (call.engine, call.on)):
        of = "" if owner == engine else f"{owner}: "
        titles.add(len(rows))
        rows += [(f"{of}{on or 'no model, no data'}", "", ""), *_rows(list(calls))]
    changed = grouped((name.rpartition(".")[2] in DERIVED, name) for name in statement.changed)
    others = {"changed outside these calls": False, "computed because it was read": True}
    for title, derived in others.items():
        if derived in changed:
            titles.add(len(rows))
            rows.append((title, "", ", ".join(changed[derived])))
    return Table(
        (engine, "times", "changed"),
        rows,
        words=frozenset({0, 2}),
        emphasis=frozenset(titles),
    )


def _rows(calls: Sequence[Call]) -> list[tuple[str, str, str]]:
    """The calls on one thing; where they are many, those without effect in one row."""
    idle = [call for call in calls if not call.changed]
    if len(calls) <= _ROWS_SHOWN or len(idle) < 2:
        idle = []
    rows = [
        (f"  {call.function}", f"{call.count:,}", _names(call.changed))
        for call in calls
        if call not in idle
    ]
    if idle:
        names = ", ".join(call.function for call in idle)
        times = sum(call.count for call in idle)
        rows.append((f"  {len(idle)} others", f"{times:,}", f"{NONE}: {names}"))
    return rows


def _names(changed: Sequence[str]) -> str:
    shown = _NAMES_SHOWN if len(changed) > _NAMES_SHOWN + 1 else len(changed)
    return few(changed, shown) or NONE


def _words(engine: str) -> CallWords:
    return room(engine).call_watch().words


def _legend(recording: Recording) -> list[Text]:
    """What the roles are that appear, with what this run says of them."""
    words = _words(recording.engine)
    calls = [call for statement in recording.statements for call in statement.calls]
    legend = [
        (text, words.step, [call for call in calls if role in call.on])
        for role, text in words.roles.items()
    ]
    legend.append((words.note, "", calls if words.note else []))
    legend += [
        (text, _words(engine).step, [call for call in calls if call.engine == engine])
        for engine, text in words.helpers.items()
    ]
    return [
        Text(text.format(sum(call.count for call in own if call.function.startswith(step))))
        for text, step, own in legend
        if own
    ]
