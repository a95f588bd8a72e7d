"""Recorded calls as a page's blocks: each line of the code, and under it the engine's words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby, zip_longest

from ..interface import DERIVED
from ..page import Block, Code, Table, Text
from ..probes.calls import Call, Recording, Statement

_MOST_NAMES = 8  # of what a call changed
_MOST_ROWS = 6  # of the calls on one thing, before those that changed nothing share one
_NOTHING = "–"
# What the recorder looks at.
_SHOWN = {
    "mujoco": "the arrays, counts and options of MjData and MjModel",
    "pybullet": "what its getters tell without computing anything anew",
}
_NO_OBJECT = "no object"


def blocks(recordings: Mapping[str, Recording]) -> list[Block]:
    """Blocks for the recordings of one code, by engine; the code's backend may differ."""
    found: list[Block] = [_heading(recordings)]
    for statements in zip_longest(*(each.statements for each in recordings.values())):
        ran = {
            name: statement
            for name, statement in zip(recordings, statements, strict=True)
            if statement is not None
        }
        first = next(iter(ran.values()))
        if first.source.startswith(("import ", "from ")) and not any(
            each.calls or each.changed for each in ran.values()
        ):
            continue
        sources = dict.fromkeys(each.source for each in ran.values())
        found.append(Code([line for source in sources for line in source.splitlines()]))
        found += _answers(ran)
    for name, recording in recordings.items():
        if recording.error:
            found.append(Text(f"{_prefix(name, recordings)}The run ended there: {recording.error}"))
    return [*found, *_legend(recordings)]


def _prefix(name: str, recordings: Mapping[str, Recording]) -> str:
    return f"{name}: " if len(recordings) > 1 else ""


def _heading(recordings: Mapping[str, Recording]) -> Text:
    engines = " and ".join(f"{name} {each.version}" for name, each in recordings.items())
    looks = "; ".join(
        f"{_prefix(name, recordings)}{_SHOWN.get(name, 'what the recorder sees of it')}"
        for name in recordings
    )
    return Text(
        f"The engine's own words, recorded from this run on {engines}: under each line, the "
        "functions of the engine that it made run, how often, and what differed after a call, "
        f"bit by bit ({_NOTHING} is nothing that shows there). Looked at, before and after each "
        f"call: {looks}. Looking takes time: what the code prints of the clock is not the engine's."
    )


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
        rows.append((_title(owner, on, engine), "", ""))
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


def _title(owner: str, on: str, engine: str) -> str:
    where = on or _NO_OBJECT
    return where if owner == engine else f"{owner}: {where}"


def _rows(calls: Sequence[Call]) -> Iterator[tuple[str, str, str]]:
    """The calls on one thing; where they are many, those without effect in one row."""
    idle = [call for call in calls if not call.changed]
    together = len(calls) > _MOST_ROWS and len(idle) > 1
    for call in calls:
        if call.changed or not together:
            yield f"  {call.function}", f"{call.count:,}", _names(call.changed)
    if together:
        names = ", ".join(call.function for call in idle)
        yield (
            f"  {len(idle)} others",
            f"{sum(call.count for call in idle):,}",
            f"{_NOTHING}: {names}",
        )


def _names(changed: Sequence[str]) -> str:
    if len(changed) <= _MOST_NAMES + 1:
        return ", ".join(changed) or _NOTHING
    return f"{', '.join(changed[:_MOST_NAMES])} and {len(changed) - _MOST_NAMES} more"


def _legend(recordings: Mapping[str, Recording]) -> Iterator[Text]:
    """What the roles are that appear, with what this run says of them."""
    calls = [
        call
        for recording in recordings.values()
        for statement in recording.statements
        for call in statement.calls
    ]
    stepped = {
        role: sum(
            call.count for call in calls if role in call.on and call.function == "stepSimulation"
        )
        for role in ("the still copy", "the look-ahead")
    }
    if any("the still copy" in call.on for call in calls):
        yield Text(
            "The still copy is the robot with its true inertias, in a world of its own; the one "
            "that is stepped carries extra inertia for its servos. The interface asks the copy for "
            "poses, the mass matrix and the bias. In this run it was "
            f"{_times(stepped['the still copy'])}."
        )
    if any("the look-ahead" in call.on for call in calls):
        yield Text(
            "The look-ahead is another copy. It is put where your data is and takes one step, so "
            "that contacts and forces can be read after forward and no time passes in yours. In "
            f"this run it was {_times(stepped['the look-ahead'])}."
        )
    if "pybullet" in recordings:
        yield Text(
            "On pybullet a Data's arrays are the interface's own: it copies between them and the "
            "engine's hidden world, which is outside the engine's functions."
        )
    helpers = [
        call
        for name, recording in recordings.items()
        for statement in recording.statements
        for call in statement.calls
        if call.engine != name
    ]
    if helpers:
        steps = sum(call.count for call in helpers if call.function.startswith("mj_step"))
        yield Text(
            "On pybullet the interface uses MuJoCo as a library: its parser reads the model's "
            "file, and it solves small linear systems. Its own step was "
            f"{_times(steps, 'called')} there."
        )


def _times(count: int, verb: str = "stepped") -> str:
    return {0: f"never {verb}", 1: f"{verb} once"}.get(count, f"{verb} {count:,} times")
