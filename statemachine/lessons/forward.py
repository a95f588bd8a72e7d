"""Stored, derived, integrated: what forward and step recompute, and of which moment it is."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..comparison import largest
from ..comparison.text import count, millimetres, short_time, vector
from ..experiments import forward
from ..page import Page, Pipeline, Question, Table, Text, Traces, Verdict
from ._words import differences, emulation, itself, page_of, sentence, typed, where
from .records import Session

_WHEN = ("before it", "after it")
_MOMENTS = ("xpos", "site_xpos", "contacts", "qacc")  # shown of what a step leaves behind


def run(play: Any, options: Mapping[str, Any], progress: Any) -> forward.Forward:
    """Four readings."""
    model = play.model
    play()
    return forward.run(
        model,
        joint=options["joint"],
        value=options["value"],
        site=options["site"],
        seconds=options["seconds"],
        progress=progress,
    )


def code(model: Any, options: Mapping[str, Any], load: str) -> str:
    """The four readings."""
    return f"""\
import statemachine as sm

model = {load}
tip = model.site_id({options["site"]!r})
slot = model.jnt_qposadr[model.joint_id({options["joint"]!r})]
data = sm.make_data(model)
print(1, data.site_xpos[tip].round(4))
sm.forward(model, data)
print(2, data.site_xpos[tip].round(4))
data.qpos[slot] = {options["value"]:g}
print(3, data.site_xpos[tip].round(4))
sm.forward(model, data)
print(4, data.site_xpos[tip].round(4))
"""


def page(results: Mapping[str, forward.Forward], session: Session) -> Page:
    """The readings, which are equal, what each call changes, and of which moment it is."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text("A fresh arm. Where is its fingertip, and who works that out, and when?"),
        *typed(
            session,
            Question(
                f"two of the four readings of {first.stages.site} are equal. Which?",
                ("1 and 2", "2 and 3", "3 and 4", "2 and 4"),
                _CHOICES.get(first.equal),
                "The write changed qpos at once, and nothing that is derived from it.",
            ),
        ),
        Text(
            "qpos, qvel, ctrl and time are stored. Where the fingertip is (site_xpos), where the "
            "bodies are (xpos), what touches what, which forces act (qfrc_…): that is derived "
            "from them, and nothing derived is computed until you ask. A write to qpos marks "
            "nothing as out of date; what you read keeps saying what it said before. "
            "forward recomputes all of it, and takes no time. step does the same, and then "
            "integrates: it makes the next qpos and qvel."
        ),
    ]
    if not any(first.readings[0].fingertip):
        blocks.append(
            Text(
                "So the first reading is no place at all: nothing had been computed yet, and the "
                "memory was still empty."
            )
        )
    twins = {index for result in results.values() for pair in result.equal for index in pair}
    several = len(results) > 1
    headers = [f"{name} [m]" for name in results] if several else ["fingertip [m]"]
    digits = 3 if several else 4  # so that two columns fit
    blocks.append(
        Table(
            ("", "after", *headers, "data.time"),
            [
                (
                    str(i + 1),
                    reading.after,
                    *(vector(r.readings[i].fingertip, digits) for r in results.values()),
                    f"{reading.time:g} s",
                )
                for i, reading in enumerate(first.readings)
            ],
            title="The fingertip, read four times",
            words=frozenset({0, 1}),
            emphasis=frozenset(twins),
        )
    )
    for name, result in results.items():
        blocks.append(
            Verdict(
                f"{where(results, name)}readings 2 and 3 are equal bit by bit: the write changed "
                "nothing that is derived",
                (1, 2) in result.equal,
            )
        )
        moved = millimetres(result.moved, 1)
        if result.moved:
            text = f"the second forward moved the fingertip by {moved}"
        else:
            text = (
                f"the second forward moved the fingertip by {moved}: {result.joint} was there "
                "already, or does not carry it"
            )
        blocks.append(sentence(results, name, f"{text}."))
        unmoved = all(reading.time == result.readings[0].time for reading in result.readings)
        blocks.append(
            Verdict(f"{where(results, name)}data.time is the same in all four readings", unmoved)
        )
        if result.deepest > _INSIDE:
            blocks.append(
                sentence(
                    results,
                    name,
                    "nobody checks whether a robot could be where you write it: forward finds "
                    f"{count(result.contacts, 'contact')} now, the worst "
                    f"{millimetres(result.deepest, 1)} inside each other.",
                )
            )
    blocks += emulation(results, "zeros when fresh", "stale after a write", "stale after a step")
    for name, result in results.items():
        blocks += itself(name, result.itself)
    blocks += _what_changes(results)
    blocks += _moments(results)
    rows = [(f"fingertip, reading {i + 1}", _apart(i)) for i in range(len(first.readings))]
    blocks += differences(results, rows)
    return page_of("Stored, derived, integrated", results, blocks)


_CHOICES: dict[tuple[tuple[int, int], ...], int] = {
    ((0, 1),): 0,
    ((1, 2),): 1,
    ((2, 3),): 2,
    ((1, 3),): 3,
}


def _what_changes(results: Mapping[str, forward.Forward]) -> list[Any]:
    """Arrays whose bytes a write, forward and step changed, in groups that behave alike."""
    blocks: list[Any] = []
    first = next(iter(results.values())).stages
    alike = {result.stages.changes: [] for result in results.values()}
    for name, result in results.items():
        alike[result.stages.changes].append(name)
    for changes, names in alike.items():
        groups: dict[tuple[bool, ...], list[str]] = {}
        for each in changes:
            key = (each.stored, each.write, each.forward, each.step)
            groups.setdefault(key, []).append(each.name)
        prefix = f"{', '.join(names)}: " if len(results) > 1 else ""
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
    for name, result in results.items():
        derived = [each.name for each in result.stages.changes if not each.stored]
        other = [each for each in derived if each not in result.stages.same]
        text = f"step computed {len(derived) - len(other)} of {len(derived)} derived arrays with "
        text += "the same bits as forward"
        blocks.append(
            Verdict(
                f"{where(results, name)}from the written state {text}"
                + (f", not {', '.join(other)}" if other else "; then it integrated"),
                {"xpos", "xquat", "site_xpos", "site_xmat"} <= set(result.stages.same),
            )
        )
    stored = [each.name for each in first.changes if each.stored]
    derived = [each.name for each in first.changes if not each.stored and each.forward]
    moved = [each.name for each in first.changes if each.stored and each.step]
    blocks.append(
        Pipeline(
            "What forward and step cover, as found by comparing bytes",
            (("stored", stored), ("derived", derived), ("integrated", moved)),
            (("forward", 0, 1), ("step", 0, 2)),
        )
    )
    return blocks


def _list(names: list[str], stored: bool) -> str:
    lines = ["stored: " if stored else "derived: "]
    for name in names:
        if len(lines[-1]) + len(name) > _COLUMN:
            lines.append("  ")
        lines[-1] += name + ("" if name == names[-1] else ", ")
    return "\n".join(line.rstrip() for line in lines)


_COLUMN = 44
_INSIDE = 1e-3  # metres; less is how engines press things together


def _moments(results: Mapping[str, forward.Forward]) -> list[Any]:
    """To which moment belongs what a step leaves behind."""
    first = next(iter(results.values())).stages
    steps = len(first.lag)
    blocks: list[Any] = [
        Text(
            "And after a step, of which moment is what you read? step computes first and moves "
            f"afterwards. A command moves the arm for {count(steps, 'step')}; after each, what "
            "the step left is compared with what forward says before and after it, bit by bit."
        ),
        Table(
            (
                "after a step",
                *(
                    f"{where(results, name)}{m}"
                    for name in results
                    for m in ("before it", "after it")
                ),
            ),
            [
                (
                    name,
                    *(
                        str(table.get(name, "–"))
                        for result in results.values()
                        for table in (result.stages.of_before, result.stages.of_after)
                    ),
                )
                for name in _MOMENTS
            ],
            title=f"Of {count(steps, 'step')}: how often that of the state before it, and after it",
        ),
        Text("(What did not change in a step, as an empty list of contacts, is of both.)"),
    ]
    for name, result in results.items():
        stages = result.stages
        lag, row = largest(stages.lag)
        if lag == 0:
            blocks.append(sentence(results, name, f"{stages.site} did not move in this run."))
            continue
        # Contacts of step and forward may be found with another memory of what touched before.
        left = ["site_xpos"] + ["contacts"] * (stages.of_before["contacts"] == steps)
        blocks.append(
            Verdict(
                f"{where(results, name)}after each step {' and '.join(left)} "
                f"{'are' if len(left) > 1 else 'is'} of the state before it: the fingertip is "
                f"{millimetres(lag)} behind at worst (in the step from "
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
                name: (result.stages.time.tolist(), (result.stages.lag * 1e3).tolist())
                for name, result in results.items()
            },
        )
    )
    return blocks


def _apart(reading: int) -> Callable[[Any, Any], str]:
    def say(one: forward.Forward, two: forward.Forward) -> str:
        return (
            f"{math.dist(one.readings[reading].fingertip, two.readings[reading].fingertip):.1e} m"
        )

    return say
