"""The same start and the same commands, twice: the same bits, or how far apart?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..engines import room
from ..errors import BadInputError, UnsupportedError, check_name
from ..interface import Array, JointType, Model, get_state
from ..interface.options import as_count
from ..measures import largest
from ..measures.text import count, degrees, millimetres
from ..page import Figures
from ..runs.drive import Progress, part_of
from ..runs.header import provenance
from ..runs.robot import body_pairs, command, is_the_arm
from ._two_runs import BREAKS, broken, broken_table, growth, of_its_own, through_us, ways_back
from .session import CodeRun, Options
from .template import Results, by_engine, differences


def fit(model: Model, options: Options) -> dict[str, Any]:
    """Return the options of this lesson as they are.

    Raises:
        BadInputError: Nothing of the Model can move: there is no run that could be the same.
    """
    if not model.nq:
        raise BadInputError(f"{model.path.name} has no joints, and this lesson compares their runs")
    return dict(options)


def code(model: Model, options: Options, load: str) -> str:
    """Two runs from the keyframe, compared.

    With a way to break them, the second run differs: "extra-step" takes one step more before
    the count begins, "late-ctrl" writes the command one step late.
    """
    if options["break"] is not None:
        check_name("way to break a replay", options["break"], BREAKS)
    steps = as_count(options["steps"], "steps")
    write, said = (
        "data.ctrl[:2] += (0.4, -0.2)" if model.nu > 1 else "data.ctrl += 0.4",
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
    argument, *given = ("broken", "0", "1") if options["break"] else ("", "", "")
    return f"""\
import numpy as np
import statemachine as sm

model = {load}

def run({argument}):
    data = sm.make_data(model)
{start}{lines}
    return data.qpos.copy()

first, second = run({given[0]}), run({given[1]})
print(np.array_equal(first, second), abs(first - second).max())
"""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Watch both runs; then play the code that breaks them, and theirs with half the timestep.

    Returns:
        ctrl: (nu,) the command of both runs.
        broken_by: How the second run was made to differ; None if it was not.
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
        finer: The same with half the timestep, twice: that timestep [s], whether the two end in
            the same bits, and the largest |qpos difference| of their end to that of the usual
            timestep; None where the backend cannot set it.
        state: What a State of this engine holds.
        ways: Ways to go back through this interface, tried.
        own_ways: The engine's own ways, tried on the raw engine where that differs.
    """
    model, nstep, way = play.model, options["steps"], options["break"]
    shares = [part_of(progress, k / 3, 1 / 3) for k in range(3)]
    runs = play.follow(
        lambda model, data: body_pairs(model, data.contacts),
        2 * nstep,
        progress if way else shares[0],
    )
    first, second = _poses(runs, nstep)
    breaks, finer = [], None
    if way is None:
        for fault, share in zip(BREAKS, shares[1:], strict=True):
            with CodeRun(code(model, {**options, "break": fault}, "sm.load()"), model) as other:
                courses = other.follow(lambda _model, _data: None, 2 * nstep, share)
            breaks.append(broken(fault, *_poses(courses, nstep)))
        finer = _finer(model, options, first[-1])
    touches = runs[0].looks
    gap = first - second
    free = model.jnt_qposadr[model.jnt_type == int(JointType.FREE)].tolist()
    hinges = model.jnt_qposadr[model.jnt_type == int(JointType.HINGE)]
    _, data = play.worlds[0]
    return Figures(
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
        contacts=np.array([pairs.total() for pairs in touches], dtype=np.int64),
        pairs=dict(Counter(pair for pairs in touches for pair in pairs)),
        keyframe=model.keyframes[0].name if model.keyframes else None,
        breaks=tuple(breaks),
        finer=finer,
        state=tuple(name for name, size in get_state(model, data).layout if size),
        ways=ways_back(model, data.ctrl),
        own_ways=room(model.backend).ways_back(model),
        provenance=provenance(model),
    )


def _poses(runs: Sequence[Figures], nstep: int) -> list[Array]:
    """Qpos after each counted step (n+1, nq) of each run; one step more is not counted."""
    return [np.array(course.qpos[-nstep - 1 :]) for course in runs]


def _finer(model: Model, options: Options, end: Array) -> Figures | None:
    """Determinism is not truth: half the timestep replays as exactly, and ends elsewhere."""
    try:
        finer = model.replace(timestep=model.timestep / 2)
    except UnsupportedError:
        return None
    twice = {**options, "steps": 2 * options["steps"]}
    with CodeRun(code(finer, twice, "sm.load()"), finer) as play:
        ends = play()
    return Figures(
        timestep=finer.timestep,
        identical=bool(np.array_equal(ends["first"], ends["second"])),
        difference=float(np.abs(ends["first"] - end).max()),
    )


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    (peak, row), end = largest(result.difference), float(result.difference[-1])
    steps, finer = len(result.contacts), result.finer
    # Grown to the end, shrunk, or stayed near its peak.
    course = 1 if end < peak / 3 else 0 if row == steps else 2
    return {
        "steps": count(steps, "step"),
        "right": course if result.broken_by else 0 if result.identical else None,
        "start": f'the keyframe "{result.keyframe}"' if result.keyframe else "the default state",
        "peak": f"{peak:.1e}",
        "peak_step": row,
        "end": f"{end:.1e}",
        "shrinks": end < peak / 10,
        "held_in_state": ", ".join(result.state),
        "truth": bool(finer and finer.identical and finer.difference > 0),
        "finer_timestep": f"{finer.timestep * 1e3:g} ms" if finer else "",
        "finer_off": f"{finer.difference:.1e}" if finer else "",
    }


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """Equal or not, what touched on the way, and the ways back."""
    gaps = {name: result.difference for name, result in results.items()}
    bodies = {name: result.apart for name, result in results.items()}
    outcome = {
        "np.array_equal": lambda r: str(r.identical),
        "np.allclose": lambda r: str(r.close),
        "difference at the end": lambda r: f"{r.difference[-1]:.1e}",
        "largest on the way": lambda r: f"{r.difference.max():.1e}",
        "largest turn of a hinge": lambda r: degrees(r.travel, 1),
    }
    touched = {
        "fewest contacts in a step": lambda r: str(r.contacts.min()),
        "most": lambda r: str(r.contacts.max()),
        "on average": lambda r: f"{r.contacts.mean():.1f}",
        **{
            pair: lambda r, pair=pair: f"{r.pairs.get(pair, 0)} of {len(r.contacts)} steps"
            for pair in dict.fromkeys(pair for r in results.values() for pair in r.pairs)
        },
    }
    return {
        "outcome": by_engine(results, outcome, "Two runs compared"),
        "touched": by_engine(results, touched, "What touched, in the first run"),
        "growth": growth(gaps, bodies) if first.broken_by else [],
        "ways": through_us({name: result.ways for name, result in results.items()})
        if first.ways
        else [],
        "own": of_its_own({name: result.own_ways for name, result in results.items()}),
        "breaks": broken_table({name: result.breaks for name, result in results.items()}),
        "differences": differences(
            results,
            {
                "hinges at the end, worst": _hinges_apart,
                "free body at the end": _bodies_apart,
                "contacts a step, on average": lambda a, b: (
                    f"{b.contacts.mean():.1f} instead of {a.contacts.mean():.1f}"
                ),
            },
        ),
    }


def _hinges_apart(left: Figures, right: Figures) -> str:
    gaps = np.abs(left.qpos - right.qpos)[list(left.hinges)]
    return degrees(float(gaps.max()), 3) if len(gaps) else "there are none"


def _bodies_apart(left: Figures, right: Figures) -> str:
    if left.free is None:
        return "there is none"
    return millimetres(float(np.linalg.norm((left.qpos - right.qpos)[list(left.free)])))
