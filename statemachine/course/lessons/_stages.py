"""Which call changes which array, and of which moment it is what a step leaves behind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...engines import raw_engine_of
from ...interface import INPUTS, Array, Data, Model, forward, make_data, step
from ...lab.probes import conventions
from ...lab.runs.drive import Progress
from ...lab.runs.readings import Tip, read_derived, read_stored
from ...lab.runs.usual_commands import hold_ctrl
from ...measures import largest
from ...measures.text import grouped
from ...show.blocks import Block, Table
from ...show.labels import TableLabels
from ...show.pictures import Traces

_STORED = (*INPUTS, "time")
_MOMENTS = ("xpos", "site_xpos", "contacts", "qacc")  # shown of what a step leaves behind


@dataclass(frozen=True)
class OwnAnswer:
    """What an engine does itself, without this interface.

    Attributes:
        question: Its name among those of `statemachine conventions`.
        part: What part of the question it answers.
        answer: In words.
    """

    question: str
    part: str
    answer: str


def own_answers(model: Model, question: str) -> list[OwnAnswer]:
    """Ask the engine behind a Model, alone, if its backend emulates some of the contract."""
    if not raw_engine_of(model.backend).emulated:  # the interface is the engine's own
        return []
    findings = conventions.ask(question, model.backend)
    if findings is None:
        return []
    return [OwnAnswer(question, finding.of, finding.answer) for finding in findings]


@dataclass(frozen=True)
class ArrayChange:
    """An array of a Data, and what changed its bytes.

    forward and step are called in two Data, each right after the same write to qpos.

    Attributes:
        name: Of the array.
        stored: Whether it is stored; otherwise it is derived.
        write: Whether the write changed it.
        forward: Whether forward changed it.
        step: Whether step changed it.
        same: Whether forward and step left the same bits in it.
    """

    name: str
    stored: bool
    write: bool
    forward: bool
    step: bool
    same: bool


@dataclass(frozen=True)
class _Readings:
    """The bytes of each array of a Data, read at three moments of a run.

    Attributes:
        start: After a first forward.
        written: After a write to qpos.
        called: After the call that follows.
    """

    start: dict[str, bytes]
    written: dict[str, bytes]
    called: dict[str, bytes]

    def write_changes(self, name: str) -> bool:
        """Tell whether the write changed an array."""
        return self.start[name] != self.written[name]

    def call_changes(self, name: str) -> bool:
        """Tell whether the call changed an array."""
        return self.written[name] != self.called[name]


def changes_by_call(model: Model, place: int, value: float) -> list[ArrayChange]:
    """Compare the bytes of each array of a Data before and after a write, forward and step.

    Args:
        model: Of the lesson.
        place: Index in qpos that is written.
        value: What is written there [rad or m].
    """
    by_forward = _read_around(forward, model, place, value)
    by_step = _read_around(step, model, place, value)
    return [_change_of(name, by_forward, by_step) for name in by_forward.start]


def _change_of(name: str, by_forward: _Readings, by_step: _Readings) -> ArrayChange:
    """Compare the bytes of an array before and after a write, forward and step."""
    return ArrayChange(
        name=name,
        stored=name in _STORED,
        write=by_forward.write_changes(name),
        forward=by_forward.call_changes(name),
        step=by_step.call_changes(name),
        same=by_forward.called[name] == by_step.called[name],
    )


def _read_around(
    call: Callable[[Model, Data], None], model: Model, place: int, value: float
) -> _Readings:
    """Read every array of a new Data before a write to qpos, after it, and after a call."""

    def read(data: Data) -> dict[str, bytes]:
        return read_stored(data) | read_derived(data)

    with make_data(model) as data:
        forward(model, data)
        start = read(data)
        data.qpos[place] = value
        written = read(data)
        call(model, data)
        return _Readings(start, written, called=read(data))


@dataclass(frozen=True)
class Lag:
    """How far what a step leaves in a Data is behind the state that the step ends in.

    Attributes:
        time: (n,) of the state that each step started from [s].
        distance: (n,) between the fingertip that a step leaves, and the one that `forward`
            computes right after it [m].
        of_before: For each derived array, after how many of the steps it was bit for bit what
            `forward` had computed before the step.
        of_after: The same for what `forward` computes after it.
        array: Where the fingertip is read: `site_xpos`, or `xpos` of a body.
        neither: Whether the model's integrator leaves what is derived from a stage of its own.
    """

    time: Array
    distance: Array
    of_before: dict[str, int]
    of_after: dict[str, int]
    array: str
    neither: bool


def lag_of_steps(model: Model, tip: Tip, steps: int, progress: Progress) -> Lag:
    """Compare what each step of a command leaves with a forward before it and one after it."""
    times: list[float] = []
    distances: list[float] = []
    of_before, of_after = Counter[str](), Counter[str]()
    with make_data(model) as data:
        if model.nu:
            data.ctrl = hold_ctrl(model)
        forward(model, data)
        before = read_derived(data)
        for k in range(steps):
            times.append(data.time)
            step(model, data)
            left, place = read_derived(data), tip.read(data)
            forward(model, data)
            after = read_derived(data)
            distances.append(float(np.linalg.norm(tip.read(data) - place)))
            of_before.update({name: left[name] == before[name] for name in left})
            of_after.update({name: left[name] == after[name] for name in left})
            before = after
            if k % 50 == 0:
                progress(k / steps)
    stale_after_step = model.capabilities.behaviours["stale after a step"]
    return Lag(
        time=np.array(times),
        distance=np.array(distances),
        of_before=dict(of_before),
        of_after=dict(of_after),
        array=tip.array,
        neither=stale_after_step.support == "unsupported",
    )


@dataclass(frozen=True)
class ChangeCounts:
    """How many derived arrays `step` computes as `forward` does.

    Attributes:
        derived: Number of derived arrays.
        same: Number of those in which both leave the same bits.
        places_are_same: Whether those of places and orientations are among them.
    """

    derived: int
    same: int
    places_are_same: bool


def counts_of(changes: Sequence[ArrayChange]) -> ChangeCounts:
    """Return how many derived arrays `step` computes as `forward` does."""
    derived = [change for change in changes if not change.stored]
    same = {change.name for change in derived if change.same}
    places_are_same = {"xpos", "xquat", "site_xpos", "site_xmat"} <= same
    return ChangeCounts(len(derived), len(same), places_are_same)


@dataclass(frozen=True)
class WorstLag:
    """The step that leaves the fingertip farthest behind.

    Attributes:
        steps: Number of all steps.
        array: Where the fingertip is read.
        of_before: Whether that array belongs to the state before the step, after each step.
        behind: How far the fingertip is behind after the worst step [m].
        at: When that step begins [s].
        is_behind: Whether it is behind at all, and belongs to a moment.
    """

    steps: int
    array: str
    of_before: bool
    behind: float
    at: float
    is_behind: bool


def worst_lag_of(lag: Lag) -> WorstLag:
    """Return the step that leaves the fingertip farthest behind."""
    steps = len(lag.time)
    behind, worst = largest(lag.distance)
    of_before = lag.of_before[lag.array] == steps > lag.of_after[lag.array]
    is_behind = behind > 0 and not lag.neither
    return WorstLag(steps, lag.array, of_before, behind, float(lag.time[worst]), is_behind)


def change_tables(results: Mapping[str, Sequence[ArrayChange]], say: TableLabels) -> list[Table]:
    """Show the arrays that a write, forward and step changed, in groups that behave alike."""
    engines_by_rows = grouped((_change_rows(changes), name) for name, changes in results.items())
    return [
        Table(
            (", ".join(engines), "a write", "forward", "step"),
            rows,
            title=say("changes"),
            words=frozenset({0, 1, 2, 3}),
        )
        for rows, engines in engines_by_rows.items()
    ]


def _change_rows(changes: Sequence[ArrayChange]) -> tuple[tuple[str, ...], ...]:
    """Return a row for each group of arrays that behave alike."""
    groups = grouped(((c.stored, c.write, c.forward, c.step), c.name) for c in changes)
    rows: list[tuple[str, ...]] = []
    for (stored, *changed), names in groups.items():
        kind = "stored" if stored else "derived"
        cells = ["changes" if flag else "–" for flag in changed]
        rows.append((f"{kind}: {', '.join(names)}", *cells))
    return tuple(rows)


def lag_tables(lags: Mapping[str, Lag], say: TableLabels) -> list[Block]:
    """Show to which moment belongs what a step leaves behind, by backend."""
    headers = ["array"]
    for name in lags:
        headers += [f"{name}: before it", f"{name}: after it"]
    rows: list[list[str]] = []
    for array in _MOMENTS:
        row = [array]
        for lag in lags.values():
            row += [str(lag.of_before.get(array, "–")), str(lag.of_after.get(array, "–"))]
        rows.append(row)
    curves = {
        name: (lag.time.tolist(), (lag.distance * 1e3).tolist()) for name, lag in lags.items()
    }
    return [
        Table(headers, rows, say("moments")),
        Traces(say("behind"), "time [s]", "distance [mm]", curves),
    ]


def own_tables(
    results: Mapping[str, Sequence[OwnAnswer]], question: str, say: TableLabels
) -> list[Table]:
    """Show what each engine does without us, where some of this is emulated."""
    tables: list[Table] = []
    for name, answers in results.items():
        asked = [answer for answer in answers if answer.question == question]
        if asked:
            tables.append(
                Table(
                    ("after", "what", "is"),
                    [(f"a {question}", answer.part, answer.answer) for answer in asked],
                    title=say("itself", engine=name, question=question),
                    words=frozenset({0, 1, 2}),
                )
            )
    return tables
