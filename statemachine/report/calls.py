"""Recorded calls as a page's blocks: each line of the code, and under it the engine's words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, zip_longest

from ..engines import room
from ..engines.call_watch import CallWords
from ..interface import DERIVED
from ..measures.text import NONE, few, grouped
from ..page import Block, Code, Figures, Table, Text
from . import template
from .template import if_true

_NAMES_SHOWN = 8  # of what a call changed
_ROWS_SHOWN = 6  # of the calls on one thing, before those that changed nothing share one


def blocks(recordings: Mapping[str, Figures]) -> list[Block]:
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


def _answers(ran: Mapping[str, Figures]) -> list[Block]:
    """What a line made each engine do; once, if nothing and the same of all."""
    silent = {name: _unheard(statement) for name, statement in ran.items() if not statement.calls}
    if len(silent) == len(ran) and len({*silent.values()}) == 1:
        return [Text(next(iter(silent.values())))]
    return [
        Text(f"{name}: {silent[name]}") if name in silent else _table(name, statement)
        for name, statement in ran.items()
    ]


def _unheard(statement: Figures) -> str:
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


def _table(engine: str, statement: Figures) -> Table:
    """The calls, those on one thing under its name; then what changed outside of them."""
    rows: list[tuple[str, str, str]] = []
    titles: set[int] = set()
    for (owner, on), calls in groupby(statement.calls, key=lambda call: (call.engine, call.on)):
        of = "" if owner == engine else f"{owner}: "
        titles.add(len(rows))
        rows += [(f"{of}{on or 'no object'}", "", ""), *_rows(list(calls))]
    changed = grouped((name.rpartition(".")[2] in DERIVED, name) for name in statement.changed)
    others = {"outside these calls": False, "computed because it was read": True}
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


def _rows(calls: Sequence[Figures]) -> list[tuple[str, str, str]]:
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


def _legend(recording: Figures) -> list[Text]:
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
