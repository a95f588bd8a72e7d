"""Recorded calls as blocks: each line of a code, and under it what the engine was made to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, zip_longest
from typing import Literal

from ...engines import raw_engine_of
from ...engines.call_watch import CallWords
from ...interface import DERIVED
from ...measures.text import NO_NUMBER, few, grouped
from ...show.blocks import Block, Table, Text
from ...show.templates import PageContent, render_blocks
from .calls import Call, RecordedStatement, Recording

_NAMES_SHOWN = 8  # of what a call changed
_ROWS_SHOWN = 6  # of the calls on one thing, before those that changed nothing share one


@dataclass(frozen=True)
class _Answer:
    """What a line made an engine do.

    Attributes:
        label: The name of the backend with a colon; "" where it is the same of all.
        calls: Table of the calls; without rows if there was none.
        changed: What changed outside of calls.
        due: Each Data of which all that is derived is computed when it is read.
    """

    label: str
    calls: Table
    changed: tuple[str, ...]
    due: tuple[str, ...]

    @property
    def state(self) -> Literal["calls", "computed later", "changed", "nothing"]:
        """Return what there is to report."""
        if self.calls.rows:
            return "calls"
        if self.due:
            return "computed later"
        return "changed" if self.changed else "nothing"


@dataclass(frozen=True)
class _Statement:
    """A statement as it was typed, and what it made each engine do."""

    source: str
    answers: Sequence[_Answer]


@dataclass(frozen=True)
class _Ending:
    """A run that the library refused to go on with, and why."""

    label: str
    error: str


@dataclass(frozen=True)
class RecordedCalls(PageContent):
    """The recordings of one code on some backends.

    Attributes:
        engines: Names with versions.
        comparisons: What is compared around each call, by backend.
        statements: Of the code, those that did something.
        endings: Runs that ended early.
        legend: What the roles are that appear.
    """

    template = "calls.md.j2"
    engines: Sequence[str]
    comparisons: Sequence[str]
    statements: Sequence[_Statement]
    endings: Sequence[_Ending]
    legend: Sequence[str]
    no_change: str = NO_NUMBER


def recorded_calls(recordings: Mapping[str, Recording]) -> list[Block]:
    """Return blocks for the recordings of one code, by backend; its code may differ."""
    labels = {name: f"{name}: " if len(recordings) > 1 else "" for name in recordings}
    comparisons: list[str] = []
    endings: list[_Ending] = []
    legend: list[str] = []
    for name, recording in recordings.items():
        comparisons.append(f"{labels[name]}{_words(recording.engine).shown}")
        legend += _legend(recording)
        if recording.error:
            endings.append(_Ending(labels[name], recording.error))
    content = RecordedCalls(
        [f"{name} {recording.version}" for name, recording in recordings.items()],
        comparisons,
        _statements(recordings),
        endings,
        legend,
    )
    return render_blocks(content)


def not_asked(backend: str) -> Text:
    """Return what is said of a backend whose engine has no room that tells of its calls."""
    return Text(f"{backend}: not asked which of its own functions it ran.")


def _statements(recordings: Mapping[str, Recording]) -> list[_Statement]:
    """Return the statements of a code; imports that did nothing are left out."""
    shown: list[_Statement] = []
    for together in zip_longest(*(recording.statements for recording in recordings.values())):
        pairs = zip(recordings, together, strict=True)
        ran = {name: statement for name, statement in pairs if statement is not None}
        sources = list(dict.fromkeys(statement.source for statement in ran.values()))
        is_import = sources[0].startswith(("import ", "from "))
        did_something = any(statement.calls or statement.changed for statement in ran.values())
        if did_something or not is_import:
            shown.append(_Statement("\n".join(sources), _answers(ran)))
    return shown


def _answers(ran: Mapping[str, RecordedStatement]) -> list[_Answer]:
    """Return what a line made each engine do; once, if nothing and the same of all."""
    answers: list[_Answer] = []
    for name, statement in ran.items():
        calls = _calls_table(name, statement) if statement.calls else Table((), [])
        answers.append(_Answer(f"{name}: ", calls, tuple(statement.changed), tuple(statement.due)))
    first = answers[0]
    facts = {(answer.state, answer.changed, answer.due) for answer in answers}
    if first.state != "calls" and len(facts) == 1:
        return [_Answer("", first.calls, first.changed, first.due)]
    return answers


def _calls_table(engine: str, statement: RecordedStatement) -> Table:
    """Return the calls, those on one thing under its name; then what changed outside of them."""
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
    words = frozenset({0, 2})
    return Table((engine, "times", "changed"), rows, words=words, emphasis=frozenset(titles))


def _rows(calls: Sequence[Call]) -> list[tuple[str, str, str]]:
    """Return the calls on one thing; where they are many, those without effect in one row."""
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
        rows.append((f"  {len(idle)} others", f"{times:,}", f"{NO_NUMBER}: {names}"))
    return rows


def _names(changed: Sequence[str]) -> str:
    if not changed:
        return NO_NUMBER
    shown = _NAMES_SHOWN if len(changed) > _NAMES_SHOWN + 1 else len(changed)
    return few(changed, shown)


def _words(engine: str) -> CallWords:
    return raw_engine_of(engine).call_watch().words


def _legend(recording: Recording) -> list[str]:
    """Return what the roles are that appear, with what this run says of them."""
    words = _words(recording.engine)
    calls = [call for statement in recording.statements for call in statement.calls]
    legend: list[str] = []
    for role, text in words.roles.items():
        of_role = [call for call in calls if role in call.on]
        if of_role:
            legend.append(text.format(_times(of_role, words.step)))
    if words.note and calls:
        legend.append(words.note.format(_times(calls, "")))
    for engine, text in words.helpers.items():
        of_engine = [call for call in calls if call.engine == engine]
        if of_engine:
            legend.append(text.format(_times(of_engine, _words(engine).step)))
    return legend


def _times(calls: Sequence[Call], step: str) -> int:
    """Return how often functions were called whose name begins as that of a step does."""
    return sum(call.count for call in calls if call.function.startswith(step))
