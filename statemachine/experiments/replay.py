"""Run twice from one keyframe under one command: the same bits, or how far apart?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..comparison import largest
from ..engines import part
from ..engines.parts import AsItComes, WayBack
from ..errors import BadInputError, UnsupportedError, unknown_name
from ..interface import (
    Array,
    Data,
    Ints,
    JointType,
    Model,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ..interface.checks import as_count
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.robot import body_pairs, command
from ..scenarios.runs import Progress, part_of, silent

Break = Literal["extra-step", "late-ctrl"]
BREAKS: tuple[Break, ...] = ("extra-step", "late-ctrl")
# Added to the keyframe's own ctrl: pan and lift, so that the arm visibly moves.
MOVE = (0.4, -0.2)


@dataclass(frozen=True)
class Broken:
    """What became of a second run that was made to differ.

    Attributes:
        way: One of `BREAKS`.
        close: Whether `np.allclose` calls the ends equal.
        peak, peak_step: The largest |qpos difference| on the way, and after which step.
        end: That at the end.
    """

    way: str
    close: bool
    peak: float
    peak_step: int
    end: float


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
        keyframe: Name of the keyframe; its time was set to zero.
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
    keyframe: str
    breaks: tuple[Broken, ...]
    finer: Finer | None
    state: tuple[str, ...]
    ways: tuple[WayBack, ...]
    own_ways: tuple[WayBack, ...]
    provenance: Provenance


def run(
    model: Model,
    steps: int = 600,
    ctrl: Sequence[float] | None = None,
    break_with: Break | None = None,
    progress: Progress = silent,
) -> Replay:
    """Reset to keyframe 0, zero the time, step under a fixed ctrl; twice.

    Args:
        model: A model with a keyframe.
        steps: How many, in each run.
        ctrl: The command (nu,); by default the keyframe's own with `MOVE` added.
        break_with: Make the second run differ: "extra-step" takes one step more
            before the count begins, "late-ctrl" writes the command one step late.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: No keyframe, `steps` is no whole number, or `ctrl` has the wrong length.
        UnknownNameError: `break_with` is none of `BREAKS`.
    """
    if break_with is not None and break_with not in BREAKS:
        raise unknown_name("way to break a replay", break_with, BREAKS)
    if not model.keyframes:
        raise BadInputError(f"{model.path.name} has no keyframe to start from: try so101/scene_box")
    nstep = as_count(steps, "steps")
    goal = model.keyframes[0].ctrl.copy()
    if ctrl is None:
        goal[: len(MOVE)] += MOVE[: model.nu]
    else:
        goal = command(model, ctrl)
    shares = 2 if break_with else 7  # of the runs below, about

    parts = [part_of(progress, k / shares, 1 / shares) for k in range(shares)]
    first, contacts, pairs = _once(model, goal, nstep, None, parts[0])
    second, _, _ = _once(model, goal, nstep, break_with, parts[1])
    broken, finer = [], None
    if not break_with:
        for number, way in enumerate(BREAKS):
            other, _, _ = _once(model, goal, nstep, way, parts[2 + number])
            broken.append(_broken(way, first, other))
        finer = _finer(model, goal, nstep, first, parts)
    free = [
        int(place)
        for kind, place in zip(model.jnt_type, model.jnt_qposadr, strict=True)
        if kind == JointType.FREE
    ]
    gap = first - second
    own: AsItComes | None = part(model.backend, "as_it_comes")
    hinges = model.jnt_qposadr[model.jnt_type == int(JointType.HINGE)]
    return Replay(
        ctrl=goal,
        broken_by=break_with,
        identical=bool(np.array_equal(first[-1], second[-1])),
        close=bool(np.allclose(first[-1], second[-1])),
        difference=np.abs(gap).max(axis=1),
        apart=np.linalg.norm(gap[:, free[0] : free[0] + 3], axis=1) if free else None,
        qpos=first[-1],
        hinges=tuple(hinges.tolist()),
        free=(free[0], free[0] + 1, free[0] + 2) if free else None,
        travel=float(np.ptp(first[:, hinges], axis=0).max(initial=0.0)),
        contacts=contacts,
        pairs=pairs,
        keyframe=model.keyframes[0].name,
        breaks=tuple(broken),
        finer=finer,
        state=_components(model),
        ways=ways_back(model, goal),
        own_ways=own.ways_back(model) if own else (),
        provenance=provenance(model),
    )


def _broken(way: str, first: Array, other: Array) -> Broken:
    gap = np.abs(first - other).max(axis=1)
    peak, step = largest(gap)
    close = bool(np.allclose(first[-1], other[-1]))
    return Broken(way, close, peak, step, float(gap[-1]))


def _finer(
    model: Model, goal: Array, nstep: int, first: Array, parts: list[Progress]
) -> Finer | None:
    """Determinism is not truth: half the timestep replays as exactly, and ends elsewhere."""
    try:
        finer = model.replace(timestep=model.timestep / 2)
    except UnsupportedError:
        return None
    ends = [_once(finer, goal, 2 * nstep, None, parts[4 + k])[0][-1] for k in range(2)]
    apart = float(np.abs(ends[0] - first[-1]).max())
    return Finer(finer.timestep, bool(np.array_equal(*ends)), apart)


def ways_back(model: Model, ctrl: Array, steps: int = 100) -> tuple[WayBack, ...]:
    """Go back in each way that the interface has, and compare the futures.

    Args:
        model: Started from keyframe 0.
        ctrl: The command (nu,).
        steps: How many before and after the moment to which some ways go back.
    """

    def start(data: Data) -> None:
        reset(model, data, keyframe=0)
        data.ctrl = ctrl

    def future(data: Data, count: int) -> Array:
        trace = []
        for _ in range(count):
            step(model, data)
            trace.append(data.qpos.copy())
        return np.array(trace)

    with make_data(model) as data, make_data(model) as other:
        start(data)
        whole = future(data, steps)
        state = get_state(model, data)
        rest = future(data, steps)
        found = {}
        start(data)
        found["reset to the keyframe"] = future(data, steps) - whole
        start(other)
        found["a new Data, same keyframe"] = future(other, steps) - whole
        set_state(model, data, state)
        restored = future(data, steps)
        found["set_state, against going on"] = restored - rest
        set_state(model, other, state)
        found["set_state, done twice"] = future(other, steps) - restored
        reset(model, other)
        for name in ("qpos", "qvel", "ctrl"):
            setattr(other, name, state[name])
        found["qpos, qvel, ctrl put back"] = future(other, steps) - rest
    return tuple(WayBack(name, float(np.abs(gap).max())) for name, gap in found.items())


def _components(model: Model) -> tuple[str, ...]:
    """Names of what a State holds."""
    with make_data(model) as data:
        return tuple(name for name, size in get_state(model, data).layout if size)


def _once(
    model: Model, ctrl: Array, nstep: int, break_with: str | None, progress: Progress
) -> tuple[Array, Ints, dict[str, int]]:
    """Qpos after each step (n+1, nq), contacts of each step (n,), steps by body pair."""
    poses, counts, pairs = [], [], Counter[str]()
    with make_data(model) as data:
        reset(model, data, keyframe=0)
        data.time = 0.0
        if break_with != "late-ctrl":
            data.ctrl = ctrl
        if break_with == "extra-step":
            step(model, data)
        poses.append(data.qpos.copy())
        for k in range(nstep):
            step(model, data)
            if k == 0:
                data.ctrl = ctrl  # a second time, or one step late
            contacts = data.contacts
            counts.append(len(contacts))
            pairs.update(body_pairs(model, contacts).keys())
            poses.append(data.qpos.copy())
            if k % 100 == 0:
                progress(k / nstep)
    return np.array(poses), np.array(counts, dtype=np.int64), dict(pairs)
