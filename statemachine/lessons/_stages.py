"""Which call changes which array, and of which moment it is what a step leaves behind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..engines import room
from ..interface import INPUTS, Array, Data, Model, forward, make_data, step
from ..measures import largest
from ..measures.text import count, millimetres, short_time
from ..page import Block, Heading, Pipeline, Table, Text, Traces, Verdict
from ..probes import conventions
from ..runs.commands import hold_ctrl
from ..runs.drive import Progress
from ..runs.provenance import Provenance, provenance
from ._robot import ReadPlace, is_of_the_arm, read_derived, read_stored, the_tip
from ._words import alike, sentence, where

_STORED = (*INPUTS, "time")
_MOMENTS = ("xpos", "site_xpos", "contacts", "qacc")  # shown of what a step leaves behind
_COLUMN = 44  # characters

Look = dict[str, bytes]  # the bytes of every array of a Data, and of its time


@dataclass(frozen=True)
class OwnAnswer:
    """What an engine itself does, asked of it alone: a question, a part of it, the answer."""

    question: str
    part: str
    answer: str


@dataclass(frozen=True)
class Changes:
    """One array, and whether its bytes changed: by a write to qpos, by forward, by step.

    forward and step are called in two Data, each right after the same write.
    """

    name: str
    stored: bool
    write: bool
    forward: bool
    step: bool


@dataclass(frozen=True, eq=False)
class Stages:
    """What each call changes, and of which moment derived values are after a step.

    Attributes:
        changes: Each array of a Data; empty if that was not asked for.
        same: Derived arrays that the step computed with the bits of the forward.
        time: (n,) of the state that each step started from [s]; n is 0 if it was not asked
            how far behind a step leaves what is derived.
        lag: (n,) distance [m] between the fingertip that a step leaves in `site_xpos`, or the
            body in `xpos`, and the one that `forward` computes right after it.
        of_before: For each derived array, after how many of the n steps it was bit
            for bit what `forward` had computed before the step.
        of_after: And after how many it was what `forward` computes after it.
        site: Name of the fingertip: a site, or a body where there are none.
        neither: Whether the model's integrator leaves what is derived from a stage of its own.
    """

    changes: tuple[Changes, ...]
    same: tuple[str, ...]
    time: Array
    lag: Array
    of_before: dict[str, int]
    of_after: dict[str, int]
    site: str
    neither: bool
    provenance: Provenance


def own_answers(model: Model, question: str) -> tuple[OwnAnswer, ...]:
    """A convention of the engine behind a Model that emulates some of the contract."""
    if not room(model.backend).emulated:  # the interface is the engine's own
        return ()
    return tuple(
        OwnAnswer(question, finding.of, finding.answer)
        for finding in conventions.ask(question, model.backend) or ()
    )


def look_at(data: Data) -> Look:
    """The bytes of every array of a Data, and of its time."""
    return read_stored(data) | read_derived(data)


def find_stages(
    model: Model,
    tip: ReadPlace,
    place: int,
    value: float,
    forwarded: Sequence[Look],
    steps: int,
    progress: Progress,
) -> Stages:
    """Compare a step with a forward after the same write; then moments under a command.

    Args:
        model: Of the lesson.
        tip: What is read.
        place: What was written in qpos; value: what was written there [rad or m].
        value: See place.
        forwarded: Looks at a Data: before the write, after it, and after a forward. None at
            all if it is not asked which arrays change.
        steps: How many steps to compare moments over; 0 for none.
        progress: Told the fraction that is done.
    """
    changes: tuple[Changes, ...] = ()
    same: tuple[str, ...] = ()
    if forwarded:
        stepped = _stepped(model, place, value)
        changes = tuple(_changes(name, forwarded, stepped) for name in stepped[0])
        derived = [name for name in stepped[0] if name not in _STORED]
        same = tuple(name for name in derived if forwarded[-1][name] == stepped[-1][name])
    times: list[float] = []
    lags: list[float] = []
    of_before: dict[str, int] = {}
    of_after: dict[str, int] = {}
    if steps:
        with make_data(model) as data:
            if model.nu:
                data.ctrl = hold_ctrl(model)
            forward(model, data)
            fresh = read_derived(data)
            of_before, of_after = dict.fromkeys(fresh, 0), dict.fromkeys(fresh, 0)
            for k in range(steps):
                times.append(data.time)
                step(model, data)
                left, at = read_derived(data), tip.read(data)
                forward(model, data)
                now = read_derived(data)
                lags.append(float(np.linalg.norm(tip.read(data) - at)))
                for name in fresh:
                    of_before[name] += left[name] == fresh[name]
                    of_after[name] += left[name] == now[name]
                fresh = now
                if k % 50 == 0:
                    progress(k / steps)
    stale = model.capabilities.behaviours["stale after a step"]
    return Stages(
        changes=changes,
        same=same,
        time=np.array(times),
        lag=np.array(lags),
        of_before=of_before,
        of_after=of_after,
        site=tip.name,
        neither=stale.support == "unsupported",
        provenance=provenance(model),
    )


def _stepped(model: Model, place: int, value: float) -> list[Look]:
    """Looks at a Data: before the write, after it, and after a step."""
    with make_data(model) as data:
        forward(model, data)
        looks = [look_at(data)]
        data.qpos[place] = value
        looks.append(look_at(data))
        step(model, data)
        return [*looks, look_at(data)]


def _changes(name: str, forwarded: Sequence[Look], stepped: Sequence[Look]) -> Changes:
    start, written, computed = (look[name] for look in forwarded)
    _, before, after = (look[name] for look in stepped)
    return Changes(name, name in _STORED, start != written, written != computed, before != after)


def arrays_section(
    results: Mapping[str, Stages], answers: Mapping[str, Sequence[OwnAnswer]]
) -> list[Block]:
    """Arrays whose bytes a write, forward and step changed, in groups that behave alike.

    Args:
        results: By backend.
        answers: What each engine itself does after a write.
    """
    blocks: list[Block] = [Heading("Which arrays does each call change?")]
    for prefix, one in alike(results, lambda each: each.changes):
        groups: dict[tuple[bool, ...], list[str]] = {}
        for each in one.changes:
            key = (each.stored, each.write, each.forward, each.step)
            groups.setdefault(key, []).append(each.name)
        blocks.append(
            Table(
                ("", "a write", "forward", "step"),
                [
                    (_list(members, stored), *("changes" if flag else "–" for flag in flags))
                    for (stored, *flags), members in groups.items()
                ],
                title=f"{prefix}Whose bytes change, after a write to qpos[…] and then one call",
                words=frozenset({0, 1, 2, 3}),
            )
        )
    for name, stages in results.items():
        derived = [each.name for each in stages.changes if not each.stored]
        other = [each for each in derived if each not in stages.same]
        text = f"step computed {len(derived) - len(other)} of {len(derived)} derived arrays with "
        text += "the same bits as forward"
        blocks.append(
            Verdict(
                f"{where(results, name)}from the written state {text}"
                + (f", not {', '.join(other)}" if other else "; then it integrated"),
                {"xpos", "xquat", "site_xpos", "site_xmat"} <= set(stages.same),
            )
        )
    first = next(iter(results.values()))
    stored = [each.name for each in first.changes if each.stored]
    computed = [each.name for each in first.changes if not each.stored and each.forward]
    moved = [each.name for each in first.changes if each.stored and each.step]
    blocks.append(
        Pipeline(
            "What forward and step cover, as found by comparing bytes",
            (("stored", stored), ("derived", computed), ("integrated", moved)),
            (("forward", 0, 1), ("step", 0, 2)),
        )
    )
    return blocks + _itself(answers)


def _list(names: list[str], stored: bool) -> str:
    lines = ["stored: " if stored else "derived: "]
    for name in names:
        if len(lines[-1]) + len(name) > _COLUMN:
            lines.append("  ")
        lines[-1] += name + ("" if name == names[-1] else ", ")
    return "\n".join(line.rstrip() for line in lines)


def lag_section(
    results: Mapping[str, Stages], answers: Mapping[str, Sequence[OwnAnswer]]
) -> list[Block]:
    """To which moment belongs what a step leaves behind.

    Args:
        results: By backend.
        answers: What each engine itself does after a step.
    """
    steps = len(next(iter(results.values())).lag)
    blocks: list[Block] = [
        Heading("After a step, of which moment is what you read?"),
        Text(
            "step computes first and moves afterwards. A command moves the "
            f"{'arm' if is_of_the_arm(results) else 'robot'} for {count(steps, 'step')}; after "
            "each, what the step left is compared with what forward says before and after it, bit "
            "by bit."
        ),
        Table(
            (
                "after a step",
                *(
                    f"{where(results, name)}{moment}"
                    for name in results
                    for moment in ("before it", "after it")
                ),
            ),
            [
                (
                    name,
                    *(
                        str(table.get(name, "–"))
                        for stages in results.values()
                        for table in (stages.of_before, stages.of_after)
                    ),
                )
                for name in _MOMENTS
            ],
            title=f"Of {count(steps, 'step')}: how often that of the state before it, and after it",
        ),
        Text("(What did not change in a step, as an empty list of contacts, is of both.)"),
    ]
    for name, stages in results.items():
        lag, row = largest(stages.lag)
        if lag == 0:
            blocks.append(sentence(results, name, f"{stages.site} did not move in this run."))
            continue
        # Contacts of step and forward may be found with another memory of what touched before.
        moved = "site_xpos" if stages.of_after["site_xpos"] < steps else "xpos"
        left = [moved] + ["contacts"] * (stages.of_before["contacts"] == steps)
        if stages.of_after["contacts"] == steps:  # there were none
            left = [moved]
        if stages.neither:
            text = f"after a step {moved} is neither of the state before it nor of the one after: "
            text += "an integrator of several stages, as this RK4, leaves those of its last one."
            blocks.append(sentence(results, name, text))
            continue
        blocks.append(
            Verdict(
                f"{where(results, name)}after each step {' and '.join(left)} "
                f"{'are' if len(left) > 1 else 'is'} of the state before it: "
                f"{the_tip(stages.site)} is {millimetres(lag)} behind at worst (in the step from "
                f"{short_time(stages.time[row])}). Drawings in which step delivers the next "
                "state's xpos and contacts are wrong: call forward before you read",
                all(stages.of_before[each] == steps > stages.of_after[each] for each in left),
            )
        )
    blocks.append(
        Traces(
            "How far site_xpos is behind after each step",
            "time [s]",
            "distance [mm]",
            {
                name: (stages.time.tolist(), (stages.lag * 1e3).tolist())
                for name, stages in results.items()
            },
        )
    )
    return blocks + _itself(answers)


def _itself(answers: Mapping[str, Sequence[OwnAnswer]]) -> list[Block]:
    """What each engine does without us, where some of this is emulated."""
    return [
        Table(
            ("after", "what", "is"),
            [(f"a {each.question}", each.part, each.answer) for each in asked],
            title=f"{name} itself, without us (statemachine conventions {asked[0].question})",
            words=frozenset({0, 1, 2}),
        )
        for name, asked in answers.items()
        if asked
    ]
