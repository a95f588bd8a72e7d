"""Stored, derived, integrated: which call changes which array, and of which moment it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..interface import INPUTS, Array, Data, Model, forward, make_data, step
from ..lessons._bytes import read_derived, read_stored
from ..scenarios import TARGET
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.robot import scalar_joint
from ..scenarios.runs import Progress, silent, steps_in

STORED = (*INPUTS, "time")
_Looks = list[dict[str, bytes]]  # the bytes of every array, before and after each call


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
        changes: Each array of a Data.
        same: Derived arrays that the step computed with the bits of the forward.
        time: (n,) of the state that each step started from [s].
        lag: (n,) distance [m] between the fingertip that a step leaves in `site_xpos`
            and the one that `forward` computes right after it.
        of_before: For each derived array, after how many of the n steps it was bit
            for bit what `forward` had computed before the step.
        of_after: And after how many it was what `forward` computes after it.
        site: The fingertip.
    """

    changes: tuple[Changes, ...]
    same: tuple[str, ...]
    time: Array
    lag: Array
    of_before: dict[str, int]
    of_after: dict[str, int]
    site: str
    provenance: Provenance


def run(
    model: Model,
    joint: str = "shoulder_lift",
    value: float = 0.8,
    site: str = "gripperframe",
    seconds: float = 2.0,
    progress: Progress = silent,
) -> Stages:
    """Write, forward, step, and compare bytes; then command a pose and compare moments.

    Args:
        model: Any model with the joint and the site.
        joint: The joint to write; a hinge or slide.
        value: What to write [rad or m].
        site: The fingertip.
        seconds: Simulated time under the command, long enough to touch something.
        progress: Told the fraction that is done.

    Raises:
        UnknownNameError: No such joint or site.
    """
    (place, _), tip, total = (
        scalar_joint(model, joint),
        model.site_id(site),
        steps_in(model, seconds),
    )
    with make_data(model) as data, make_data(model) as other:
        ends = {}
        for call, each in ((forward, data), (step, other)):
            forward(model, each)
            looks = [_look(each)]
            each.qpos[place] = value
            looks.append(_look(each))
            call(model, each)
            ends[call] = [*looks, _look(each)]
    with make_data(model) as data:
        if model.nu == len(TARGET):
            data.ctrl = TARGET
        forward(model, data)
        fresh, times, lags = read_derived(data), [], []
        of_before, of_after = dict.fromkeys(fresh, 0), dict.fromkeys(fresh, 0)
        for k in range(total):
            times.append(data.time)
            step(model, data)
            left, at = read_derived(data), np.array(data.site_xpos[tip])
            forward(model, data)
            now = read_derived(data)
            lags.append(float(np.linalg.norm(data.site_xpos[tip] - at)))
            for name in fresh:
                of_before[name] += left[name] == fresh[name]
                of_after[name] += left[name] == now[name]
            fresh = now
            if k % 50 == 0:
                progress(k / total)
    return Stages(
        changes=tuple(_changes(name, ends[forward], ends[step]) for name in ends[step][0]),
        same=tuple(name for name in fresh if ends[forward][-1][name] == ends[step][-1][name]),
        time=np.array(times),
        lag=np.array(lags),
        of_before=of_before,
        of_after=of_after,
        site=site,
        provenance=provenance(model),
    )


def _look(data: Data) -> dict[str, bytes]:
    """The bytes of every array of a Data, and of its time."""
    return read_stored(data) | read_derived(data)


def _changes(name: str, forwarded: _Looks, stepped: _Looks) -> Changes:
    start, written, computed = (look[name] for look in forwarded)
    _, before, after = (look[name] for look in stepped)
    return Changes(name, name in STORED, start != written, written != computed, before != after)
