"""The same start and the same commands, twice: the same bits, or how far apart?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..engines import room
from ..engines.records import WayBack
from ..errors import UnsupportedError, check_name
from ..interface import Array, Ints, JointType, Model, get_state
from ..interface.checks import as_count
from ..measures import largest
from ..measures.text import count, degrees, millimetres, vector
from ..page import Page, Question, Table, Text, Verdict
from ..runs.drive import Progress, part_of
from ..runs.provenance import Provenance, provenance
from ..runs.robot import command, is_the_arm
from ._broken import BREAKS, BROKEN, Broken, Paths, course, growth, in_short, traces
from ._robot import is_of_the_arm
from ._ways import of_its_own, through_us, ways_back
from ._words import differences, page_of, sentence, typed, where
from .records import Session
from .session import CodeRun


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """Two runs from the keyframe, compared.

    With a way to break them, the second run differs: "extra-step" takes one step more before
    the count begins, "late-ctrl" writes the command one step late.
    """
    if options["break"] is not None:
        check_name("way to break a replay", options["break"], BREAKS)
    steps = as_count(options["steps"], "steps")
    write, said = (
        "data.ctrl[:2] += np.array((0.4, -0.2))[: model.nu]",
        "  # pan and lift" if is_the_arm(model) else "",
    )
    if options["ctrl"] is not None:
        write, said = f"data.ctrl[:] = {command(model, options['ctrl']).tolist()}", ""
    body = {
        None: [write + said, f"sm.step(model, data, {steps})"],
        "extra-step": [write + said, f"sm.step(model, data, {steps} + broken)"],
        "late-ctrl": [
            f"for k in range({steps}):",
            "    if k == broken:  # the command comes one step late",
            f"        {write}",
            "    sm.step(model, data)",
        ],
    }[options["break"]]
    lines = "\n".join(f"    {line}" for line in body)
    start = "    sm.reset(model, data, keyframe=0)\n    data.time = 0\n" if model.keyframes else ""
    argument, first, second = ("broken", "0", "1") if options["break"] else ("", "", "")
    return f"""\
import numpy as np
import statemachine as sm

model = {load}

def run({argument}):
    data = sm.make_data(model)
{start}{lines}
    return data.qpos.copy()

one, two = run({first}), run({second})
print(np.array_equal(one, two), abs(one - two).max())
"""


@dataclass(frozen=True)
class Finer:
    """The same movement with half the timestep, twice.

    Attributes:
        timestep: Of these runs [s].
        identical: Whether the two of them end in the same bits.
        difference: Largest |qpos difference| of their end to that of the usual timestep.
    """

    timestep: float
    identical: bool
    difference: float


@dataclass(frozen=True, eq=False)
class Replay:
    """Two runs, step by step.

    Attributes:
        ctrl: (nu,) the command of both runs.
        identical: Whether the last qpos are equal, `np.array_equal`.
        close: Whether `np.allclose` calls them equal.
        difference: (n+1,) largest |qpos difference| after each step.
        apart: (n+1,) distance [m] between the free body's positions in the two
            runs; None without a free body.
        qpos: (nq,) at the end of the first run.
        hinges: Where in qpos the hinges are.
        free: Where in qpos a free body's position is; None without one.
        travel: Largest movement of a hinge in the first run [rad].
        contacts: (n,) contacts that each step of the first run found.
        pairs: For each pair of bodies, in how many steps it touched.
        keyframe: Name of the keyframe, its time was set to zero; None for the default state.
        breaks: Second runs that were made to differ, if this one was not.
        finer: The same with half the timestep; None where the backend cannot set it.
        state: What a State of this engine holds.
        ways: Ways to go back through this interface, tried.
        own_ways: The engine's own ways, tried on the raw engine where that differs.
    """

    ctrl: Array
    broken_by: str | None
    identical: bool
    close: bool
    difference: Array
    apart: Array | None
    qpos: Array
    hinges: tuple[int, ...]
    free: tuple[int, int, int] | None
    travel: float
    contacts: Ints
    pairs: dict[str, int]
    keyframe: str | None
    breaks: tuple[Broken, ...]
    finer: Finer | None
    state: tuple[str, ...]
    ways: tuple[WayBack, ...]
    own_ways: tuple[WayBack, ...]
    provenance: Provenance


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Replay:
    """Watch both runs; then play the code that breaks them, and theirs with half the timestep."""
    model, nstep, way = play.model, options["steps"], options["break"]
    shares = [part_of(progress, k / 3, 1 / 3) for k in range(3)]
    paths = Paths(nstep, progress if way else shares[0])
    play(before=paths.before, after=paths.after)
    first, second = paths.both()
    broken, finer = [], None
    if way is None:
        for each, share in zip(BREAKS, shares[1:], strict=True):
            watch = Paths(nstep, share)
            with CodeRun(code(model, {**options, "break": each}, "sm.load()"), model) as other:
                other(before=watch.before, after=watch.after)
            broken.append(Broken.of(each, *watch.both()))
        finer = _finer(model, options, first[-1])
    gap = first - second
    free = model.jnt_qposadr[model.jnt_type == int(JointType.FREE)].tolist()
    hinges = model.jnt_qposadr[model.jnt_type == int(JointType.HINGE)]
    _, data = play.worlds[0]
    return Replay(
        ctrl=data.ctrl.copy(),
        broken_by=way,
        identical=bool(np.array_equal(first[-1], second[-1])),
        close=bool(np.allclose(first[-1], second[-1])),
        difference=np.abs(gap).max(axis=1),
        apart=np.linalg.norm(gap[:, free[0] : free[0] + 3], axis=1) if free else None,
        qpos=first[-1],
        hinges=tuple(hinges.tolist()),
        free=(free[0], free[0] + 1, free[0] + 2) if free else None,
        travel=float(np.ptp(first[:, hinges], axis=0).max(initial=0.0)),
        contacts=np.array(paths.contacts, dtype=np.int64),
        pairs=dict(paths.pairs),
        keyframe=model.keyframes[0].name if model.keyframes else None,
        breaks=tuple(broken),
        finer=finer,
        state=tuple(name for name, size in get_state(model, data).layout if size),
        ways=ways_back(model, data.ctrl),
        own_ways=room(model.backend).ways_back(model),
        provenance=provenance(model),
    )


def _finer(model: Model, options: Mapping[str, Any], end: Array) -> Finer | None:
    """Determinism is not truth: half the timestep replays as exactly, and ends elsewhere."""
    try:
        finer = model.replace(timestep=model.timestep / 2)
    except UnsupportedError:
        return None
    twice = {**options, "steps": 2 * options["steps"]}
    with CodeRun(code(finer, twice, "sm.load()"), finer) as play:
        ends = play()
    apart = float(np.abs(ends["one"] - end).max())
    return Finer(finer.timestep, bool(np.array_equal(ends["one"], ends["two"])), apart)


def page(results: Mapping[str, Replay], session: Session) -> Page:
    """Equal or not, and what touched on the way."""
    first = next(iter(results.values()))
    nstep = len(first.contacts)
    blocks: list[Any] = [
        Text(
            f"Two runs of {count(nstep, 'step')}, each in a new Data: {_start(first)}, one fixed "
            "command. Equal means np.array_equal on all of qpos: every bit, not nearly. "
            "Differences are the largest over all numbers of qpos: radians, metres and parts of a "
            "quaternion."
        ),
        *typed(session, _question(first)),
    ]
    if first.broken_by:
        blocks.append(Text(BROKEN[first.broken_by]))
    blocks.append(_outcome(results))
    blocks.append(_contacts(results))
    if first.broken_by:
        gaps = {name: result.difference for name, result in results.items()}
        blocks.append(growth(gaps, {name: result.apart for name, result in results.items()}))
        blocks.append(traces(gaps))
    for name, result in results.items():
        blocks.append(_finding(where(results, name), result))
    if not first.broken_by:
        blocks.append(through_us({name: result.ways for name, result in results.items()}))
        for name, result in results.items():
            blocks.append(
                sentence(
                    results,
                    name,
                    "get_state returns a State, and set_state takes one. It holds what decides "
                    f"the future, as far as the engine shows it: {', '.join(result.state)}.",
                )
            )
        for name, result in results.items():
            blocks += of_its_own(name, result.own_ways)
        if all(result.identical for result in results.values()):
            blocks.append(
                Text(
                    "So what a robot does can have a regression test: fix the start and the number "
                    "of steps, run your controller, and compare the end. The test fails when "
                    "something has changed, and not by chance."
                )
            )
        blocks += in_short({name: result.breaks for name, result in results.items()})
        for name, result in results.items():
            blocks += _truth(where(results, name), result)
    blocks += differences(
        results,
        [
            ("hinges at the end, worst", _joints_apart),
            ("free body at the end", _bodies_apart),
            ("contacts a step, on average", _contacts_apart),
        ],
    )
    return page_of("The same start, the same commands", results, blocks)


def _start(first: Replay) -> str:
    if first.keyframe is None:
        return "from the default state"
    return f"reset to keyframe 0 ({first.keyframe!r}), time set to zero"


def _question(first: Replay) -> Question:
    if first.broken_by:
        return Question(
            "one step differs. What becomes of the difference by the end?",
            ("it grows and grows", "it shrinks again", "it stays as large as its peak"),
            course(first.difference),
            f"It peaks at {first.difference.max():.1e} and ends at {first.difference[-1]:.1e}.",
        )
    return Question(
        f"how large is the largest difference after {count(len(first.contacts), 'step')}?",
        ("0.0, to the last bit", "about 1e-16, rounding", "it depends on the contacts"),
        0 if first.identical else None,
        "The same state and the same commands give the same next state, bit by bit.",
    )


def _truth(prefix: str, result: Replay) -> list[Any]:
    """Determinism is not truth."""
    finer = result.finer
    if finer is None or not finer.identical or finer.difference == 0:
        return []
    return [
        Verdict(
            f"{prefix}reproducible does not mean right. With half the timestep, "
            f"{finer.timestep * 1e3:g} ms, two runs are bit for bit the same, too; but they end "
            f"elsewhere, {finer.difference:.1e} away",
            True,
        )
    ]


def _joints_apart(one: Replay, two: Replay) -> str:
    gap = np.abs(one.qpos - two.qpos)[list(one.hinges)]
    return degrees(float(gap.max()), 3) if len(gap) else "there are none"


def _bodies_apart(one: Replay, two: Replay) -> str:
    if one.free is None:
        return "there is none"
    return millimetres(float(np.linalg.norm(one.qpos[list(one.free)] - two.qpos[list(one.free)])))


def _contacts_apart(one: Replay, two: Replay) -> str:
    return f"{two.contacts.mean():.1f} instead of {one.contacts.mean():.1f}"


def _outcome(results: Mapping[str, Replay]) -> Table:
    first = next(iter(results.values()))
    moves = "the arm moves by" if is_of_the_arm(results) else "a hinge moves by"
    return Table(
        ("", *results),
        [
            ("np.array_equal", *(str(r.identical) for r in results.values())),
            ("np.allclose", *(str(r.close) for r in results.values())),
            ("difference at the end", *(f"{r.difference[-1]:.1e}" for r in results.values())),
            ("largest on the way", *(f"{r.difference.max():.1e}" for r in results.values())),
            *[(moves, *(degrees(r.travel, 1) for r in results.values()))] * bool(first.hinges),
            # Two of them do not fit side by side; how far they are apart stands at the end.
            *(("qpos[:6] at the end", vector(r.qpos[:6], 3)) for r in _alone(results)),
        ],
        title="Two runs compared",
    )


def _alone(results: Mapping[str, Replay]) -> list[Replay]:
    """The only result, or none where there are several."""
    return list(results.values()) if len(results) == 1 else []


def _contacts(results: Mapping[str, Replay]) -> Table:
    rows = [
        (
            "contacts a step",
            *(
                f"{r.contacts.min()} to {r.contacts.max()}, {r.contacts.mean():.1f} on average"
                if r.contacts.min() < r.contacts.max()
                else f"{r.contacts.min()} in every step"
                for r in results.values()
            ),
        )
    ]
    pairs = dict.fromkeys(pair for r in results.values() for pair in r.pairs)
    for pair in pairs:
        rows.append(
            (
                pair,
                *(f"{r.pairs.get(pair, 0)} of {len(r.contacts)} steps" for r in results.values()),
            )
        )
    return Table(("", *results), rows, title="What touched, in the first run")


def _finding(prefix: str, result: Replay) -> Text | Verdict:
    steps = count(len(result.contacts), "step")
    if result.identical and not result.broken_by:
        return Verdict(
            f"{prefix}bit for bit the same after {steps}: largest difference "
            f"{result.difference.max():.1e}",
            True,
        )
    if result.identical:
        return Text(f"{prefix}The two runs are the same all the same: the break changed nothing.")
    peak, row = largest(result.difference)
    text = (
        f"{prefix}not the same: the difference peaks at {peak:.1e} after step "
        f"{row} and is {result.difference[-1]:.1e} at the end"
    )
    if result.difference[-1] < peak / 10:
        text += ". A small divergence need not grow: here it shrinks again"
    if result.close:
        text += "; np.allclose would call the two runs equal, np.array_equal does not"
    return Verdict(text, result.broken_by is not None)
