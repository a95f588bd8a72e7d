"""What a student can do after the path: each ability in a line of code, run and shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import Array, Model
from ...lab.runs.drive import Progress
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.readings import tips_of, usual_tip
from ._robot import coordinate, usual_joint, usual_value
from .session import CodeRun, Options


def code(model: Model, options: Options, load: str) -> str:
    """Write one line for each lesson of the path."""
    joint = usual_joint(model)
    tip = tips_of(model, usual_tip(model, joint))[0]
    at, value = coordinate(model, joint), usual_value(model, joint)
    slot, sagged = at.slot, 'np.degrees(other.qpos[slot]).round(3), "degrees"'
    if at.slide:
        sagged = 'other.qpos[slot].round(6), "metres"'
    keyframe = ", keyframe=0" if model.keyframes else ""
    return f"""\
import time
import numpy as np
import statemachine as sm

model = {load}
data, other = sm.make_data(model), sm.make_data(model)
tip = model.{tip.kind}_id({tip.name!r})
slot = {slot}

def command(data):
    sm.reset(model, data{keyframe})
    data.ctrl[:1] += 0.4
    sm.step(model, data, 600)
    return data.qpos.copy()

sm.forward(model, data)
print("nowhere:", data.{tip.array}[tip].round(4))
sm.step(model, other, 100)
print("objects:", data.time, other.time)
print("state:", model.nq, model.nv, slot)
data.qpos[slot] = {value:g}
print("forward:", data.qpos[slot], data.{tip.array}[tip].round(4))
first = command(data)
print("hold:", data.qpos[0].round(3))
print("gravity:", {sagged})
sm.reset(model, data{keyframe})
print("reset:", data.time)
second = command(other)
print("replay:", np.array_equal(first, second))
began = time.perf_counter()
sm.step(model, data, 1000)
wall = time.perf_counter() - began
print("time:", round(1000 * model.timestep / wall), "times real time")
"""


@dataclass(frozen=True)
class SummaryResult:
    """What the program of the whole path does, run twice.

    Attributes:
        lines: What each of its lines printed, by the name of the lesson.
        changed_lines: The names of the lines that printed something else in a second run.
        fingertip: (3,) where `forward` puts the fingertip [m].
        nq: Length of qpos.
        nv: Length of qvel.
        joint: The joint that was written and watched.
        value: What was written into its place in qpos [rad; of a slide, m].
        sagged: Its position under an untouched ctrl [rad; of a slide, m].
        slide: Whether it is a slide.
        same: Whether the two ended in the same bits.
        restart: `data.time` after the reset [s].
        rate: Simulated time over wall time in the last line.
        provenance: What it was computed with.
    """

    lines: dict[str, str]
    changed_lines: tuple[str, ...]
    fingertip: Array
    nq: int
    nv: int
    joint: str
    value: float
    sagged: float
    slide: bool
    same: bool
    restart: float
    rate: float
    provenance: Provenance


def run(play: CodeRun, options: Options, progress: Progress) -> SummaryResult:
    """Read what each line shows; then run the program once more and compare what is printed."""
    model = play.model
    joint = usual_joint(model)
    at, tip = coordinate(model, joint), tips_of(model, usual_tip(model, joint))[0]
    fingertip, sagged, restart = np.zeros(3), 0.0, 0.0
    for source in play.lines():
        if source.startswith('print("nowhere:"'):
            fingertip = tip.read(play.names["data"])
        if source.startswith('print("gravity:"'):
            sagged = float(play.names["other"].qpos[at.place])
        if source.startswith('print("reset:"'):
            restart = play.names["data"].time
    progress(0.5)
    lines = _by_lesson(play.printed)
    with CodeRun(code(model, options, "sm.load()"), model) as second:
        second()
    again = _by_lesson(second.printed)
    names = play.names
    changed_lines = tuple(name for name in lines if lines[name] != again[name])
    is_same = bool(np.array_equal(names["first"], names["second"]))
    value, rate = usual_value(model, joint), 1000 * model.timestep / names["wall"]
    return SummaryResult(
        lines=lines,
        changed_lines=changed_lines,
        fingertip=fingertip,
        nq=model.nq,
        nv=model.nv,
        joint=joint,
        value=value,
        sagged=sagged,
        slide=at.slide,
        same=is_same,
        restart=restart,
        rate=rate,
        provenance=provenance(model),
    )


def _by_lesson(printed: str) -> dict[str, str]:
    """Return what the lines printed, by the name of the lesson with which each begins."""
    lines: dict[str, str] = {}
    for line in printed.splitlines():
        name, _, text = line.partition(": ")
        lines[name] = text
    return lines
