"""Recorded calls as a page's blocks: each line of the code, and under it the engine's words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby, zip_longest

from ..engines import room
from ..engines.call_watch import CallWords
from ..interface import DERIVED
from ..measures.text import NONE, few
from ..page import Block, Code, Table, Text
from ..probes.calls import Call, CallRecording, Statement
from . import template

_NAMES_SHOWN = 8  # of what a call changed
_ROWS_SHOWN = 6  # of the calls on one thing, before those that changed nothing share one


def blocks(recordings: Mapping[str, CallRecording]) -> list[Block]:
    """Blocks for the recordings of one code, by engine; the code's backend may differ."""
    several = len(recordings) > 1
    prefix = {name: f"{name}: " if several else "" for name in recordings}
    looks = [f"{prefix[name]}{_words(each.engine).shown}" for name, each in recordings.items()]
    statements: list[Block] = []
    for together in zip_longest(*(each.statements for each in recordings.values())):
        pairs = zip(recordings, together, strict=True)
        ran = {name: statement for name, statement in pairs if statement is not None}
        first = next(iter(ran.values()))
        if first.source.startswith(("import ", "from ")) and not any(
            each.calls or each.changed for each in ran.values()
        ):
            continue
        sources = dict.fromkeys(each.source for each in ran.values())
        statements.append(Code([line for source in sources for line in source.splitlines()]))
        statements += _answers(ran)
    return template.blocks(
        "calls",
        engines=" and ".join(f"{name} {each.version}" for name, each in recordings.items()),
        none=NONE,
        looks="; ".join(looks),
        statements=statements,
        ended=[
            Text(f"{prefix[name]}The run ended there: {recording.error}")
            for name, recording in recordings.items()
            if recording.error
        ],
        legend=list(_legend(recordings)),
    )


def not_asked(backend: str) -> Text:
    """What is said of a backend whose engine has no room that tells of its calls."""
    return Text(f"{backend}: not asked which of its own functions it ran.")


def _answers(ran: Mapping[str, Statement]) -> Iterator[Block]:
    """What a line made each engine do; once, if nothing and the same of all."""
    silent = {name: _unheard(each) for name, each in ran.items() if not each.calls}
    if len(silent) == len(ran) and len(set(silent.values())) == 1:
        yield Text(next(iter(silent.values())))
        return
    for name, statement in ran.items():
        yield Text(f"{name}: {silent[name]}") if name in silent else _table(name, statement)


def _unheard(statement: Statement) -> str:
    if statement.due:
        written = f" Changed: {', '.join(statement.changed)}." if statement.changed else ""
        return (
            f"No call yet.{written} All that is derived of {' and '.join(statement.due)} now "
            "belongs to this moment: it is computed when it is read."
        )
    if statement.changed:
        return f"No call. Changed: {', '.join(statement.changed)}, and nothing else."
    return "No call. Nothing changed."


def _table(engine: str, statement: Statement) -> Table:
    rows: list[tuple[str, str, str]] = []
    titles: set[int] = set()
    for (owner, on), group in groupby(statement.calls, key=lambda call: (call.engine, call.on)):
        titles.add(len(rows))
        of = "" if owner == engine else f"{owner}: "
        rows.append((f"{of}{on or 'no object'}", "", ""))
        rows += _rows(list(group))
    if statement.changed:
        computed = [each for each in statement.changed if each.rpartition(".")[2] in DERIVED]
        others = [each for each in statement.changed if each not in computed]
        for title, names in (
            ("outside these calls", others),
            ("computed because it was read", computed),
        ):
            if names:
                titles.add(len(rows))
                rows.append((title, "", ", ".join(names)))
    return Table(
        (engine, "times", "changed"),
        rows,
        words=frozenset({0, 2}),
        emphasis=frozenset(titles),
    )


def _rows(calls: Sequence[Call]) -> Iterator[tuple[str, str, str]]:
    """The calls on one thing; where they are many, those without effect in one row."""
    idle = [call for call in calls if not call.changed]
    together = len(calls) > _ROWS_SHOWN and len(idle) > 1
    for call in calls:
        if call.changed or not together:
            yield f"  {call.function}", f"{call.count:,}", _names(call.changed)
    if together:
        names = ", ".join(call.function for call in idle)
        yield (
            f"  {len(idle)} others",
            f"{sum(call.count for call in idle):,}",
            f"{NONE}: {names}",
        )


def _names(changed: Sequence[str]) -> str:
    shown = _NAMES_SHOWN if len(changed) > _NAMES_SHOWN + 1 else len(changed)
    return few(changed, shown) or NONE


def _words(engine: str) -> CallWords:
    return room(engine).call_watch().words


def _legend(recordings: Mapping[str, CallRecording]) -> Iterator[Text]:
    """What the roles are that appear, with what this run says of them."""
    for recording in recordings.values():
        words = _words(recording.engine)
        calls = [call for statement in recording.statements for call in statement.calls]
        for role, text in words.roles.items():
            own = [call for call in calls if role in call.on]
            if own:
                yield Text(text.format(_times(_steps(own, words.step))))
        if words.note:
            yield Text(words.note)
        for engine, text in words.helpers.items():
            own = [call for call in calls if call.engine == engine]
            if own:
                yield Text(text.format(_times(_steps(own, _words(engine).step), "called")))


def _steps(calls: Sequence[Call], name: str) -> int:
    return sum(call.count for call in calls if call.function.startswith(name))


def _times(count: int, verb: str = "stepped") -> str:
    return {0: f"never {verb}", 1: f"{verb} once"}.get(count, f"{verb} {count:,} times")
