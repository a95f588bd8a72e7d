"""The arm that is nowhere: the fingertip of a fresh Data, and the call that computes it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ...errors import StateMachineError
from ...interface import Array, Model, forward
from ...lab.runs.drive import Progress
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.readings import Tip, read_derived, read_stored, tips_of, usual_tip
from ._robot import usual_joint
from .session import CodeRun, Options

_MADE, _COMPUTED = "data = sm.make_data(model)", "sm.forward(model, data)"


@dataclass(frozen=True)
class WitnessedTip:
    """The fingertip as another library computes it, which no engine has a part in.

    Attributes:
        library: Its name and version.
        fingertip: (3,) the position that it computes [m].
        gap: Distance to the position that the engine computed [m].
    """

    library: str
    fingertip: Array
    gap: float


@dataclass(frozen=True)
class NowhereResult:
    """The fingertip of a fresh Data, before `forward` and after it.

    Attributes:
        site: What is read: the fingertip, or another site or body.
        first: (3,) its position before `forward` [m].
        second: (3,) its position after `forward` [m].
        empty: Whether every derived array of the fresh Data was zero.
        stored: Whether `forward` left positions, velocities, commands and time as they were.
        repeats: Whether a second `forward` computes the same bits.
        time: `data.time` at the end [s].
        further: Whether another library was asked.
        witness: What it computes; None where it was not asked, or cannot compute it.
        provenance: What it was computed with.
    """

    site: str
    first: Array
    second: Array
    empty: bool
    stored: bool
    repeats: bool
    time: float
    further: bool
    witness: WitnessedTip | None
    provenance: Provenance


def fit(model: Model, options: Options) -> dict[str, Any]:
    """Complete the options with a place of this robot."""
    values = dict(options)
    if values["site"] is None:
        values["site"] = usual_tip(model, usual_joint(model))
    return values


def code(model: Model, options: Options, load: str) -> str:
    """Write the two readings."""
    tip = tips_of(model, options["site"])[0]
    return f"""\
import statemachine as sm

model = {load}
{_MADE}
tip = model.{tip.kind}_id({tip.name!r})
print(data.{tip.array}[tip].round(4))
{_COMPUTED}
print(data.{tip.array}[tip].round(4))
"""


def run(play: CodeRun, options: Options, progress: Progress) -> NowhereResult:
    """Read all arrays after each line; then compute the fingertip with another library."""
    model = play.model
    tip = tips_of(model, options["site"])[0]
    stored: dict[str, dict[str, bytes]] = {}  # by the line after which it is stored
    derived: dict[str, dict[str, bytes]] = {}
    readings: list[Array] = []
    for source in play.lines():
        if "data" not in play.names:
            continue
        data = play.names["data"]
        stored[source], derived[source] = read_stored(data), read_derived(data)
        if source.startswith("print("):
            readings.append(tip.read(data))
    data = play.names["data"]
    forward(model, data)
    first, second = readings
    is_empty = not any(any(content) for content in derived[_MADE].values())
    repeats = read_derived(data) == derived[_COMPUTED]
    witness = None
    if options["further"]:
        witness = _witnessed(model, tip, data.qpos, second)
    return NowhereResult(
        site=options["site"],
        first=first,
        second=second,
        empty=is_empty,
        stored=stored[_MADE] == stored[_COMPUTED],
        repeats=repeats,
        time=data.time,
        further=options["further"],
        witness=witness,
        provenance=provenance(model),
    )


def _witnessed(model: Model, tip: Tip, qpos: Array, computed: Array) -> WitnessedTip | None:
    """Compute the fingertip with another library, from the file; None where it cannot.

    Args:
        model: The Model whose file it reads.
        tip: What is read.
        qpos: (nq,) the positions [rad or m].
        computed: (3,) what the engine computed [m].
    """
    from ...kinematics import Kinematics  # here, for it is much, and few ask for it

    try:
        kinematics = Kinematics(model.path)
        place = kinematics.pose(qpos, tip.name, tip.kind).pos
    except StateMachineError:  # it is not installed, or cannot read the file
        return None
    library = f"Pinocchio {kinematics.version}"
    return WitnessedTip(library, place, gap=math.dist(place, computed))
