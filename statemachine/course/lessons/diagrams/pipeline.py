"""The third diagram: what is stored, what is derived from it, and how far each call reaches."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from ....errors import UnsupportedError
from ....interface import Data, Model, forward, make_data
from ....interface.records import DERIVED
from ....show.diagrams.shapes import Arrow, Box, Bracket, Look, Shape
from ....show.pictures import Diagram
from ....show.templates import PageContent
from .texts import diagram_of, lines, rows_of, stored_arrays

_LEFT, _WIDTH = 4, 44  # of the boxes
_BACK = 1  # column of the line from the last box to the first
_FORWARD, _STEP = 50, 63  # columns of the brackets
_ROOM = _WIDTH - 4
_MIDDLE = _LEFT + _WIDTH // 2
_COMPUTED = ("places", "contacts", "forces", "accelerations")
# Promises of the contract, by the box that they are about.
_OF_COMPUTING = (
    "position servo",
    "latency",
    "armature",
    "joint damping",
    "dry friction",
    "joint limits",
    "forces by part",
)
_OF_READING = ("zeros when fresh", "stale after a write", "stale after a step")


@dataclass(frozen=True)
class PipelineContent(PageContent):
    """What is said of the diagram.

    Attributes:
        stored: What is stored of a Data, each array with its length.
        derived: Names of what is derived.
        timestep: Simulated time of a step [s].
        computing: What of the computation this interface emulates.
        reading: What of the rules for derived arrays this interface emulates.
    """

    template = "pipeline.md.j2"

    stored: tuple[str, ...]
    derived: tuple[str, ...]
    timestep: float
    computing: tuple[str, ...]
    reading: tuple[str, ...]

    @property
    def emulated(self) -> tuple[str, ...]:
        """Return all that this interface emulates."""
        return (*self.reading, *self.computing)


@dataclass(frozen=True)
class _Stage:
    """A box of the diagram.

    Attributes:
        title: Its name.
        look: What it is about.
        names: What it has in it.
        emulated: What of it this interface emulates.
        is_code: Whether its names are those of arrays.
    """

    title: str
    look: Look
    names: tuple[str, ...]
    emulated: tuple[str, ...] = ()
    is_code: bool = False

    @property
    def rows(self) -> list[str]:
        """Return its names in rows."""
        return rows_of(self.names, _ROOM)

    @property
    def notes(self) -> list[str]:
        """Return what is emulated, in rows."""
        if not self.emulated:
            return []
        names = [f"{name}," for name in self.emulated[:-1]]
        return rows_of(("emulated:", *names, self.emulated[-1]), _ROOM)

    def box(self, top: int) -> Box:
        """Return its box, whose upper edge is in row `top`."""
        height = len(self.rows) + len(self.notes) + 2
        rounded = self.look == "call"
        return Box(_LEFT, top, _WIDTH, height, self.look, self.title, is_rounded=rounded)


def pipeline(model: Model) -> Diagram:
    """Return the diagram of what `forward` and `step` do with a Data of a Model."""
    with make_data(model) as data:
        forward(model, data)
        content = PipelineContent(
            stored=tuple(stored_arrays(model, data)),
            derived=tuple(_derived(model, data)),
            timestep=model.timestep,
            computing=_emulated(model, _OF_COMPUTING),
            reading=_emulated(model, _OF_READING),
        )
    stages = (
        _Stage("stored: writable", "state", content.stored, is_code=True),
        _Stage("compute", "call", _COMPUTED, content.computing),
        _Stage("derived: read-only", "derived", content.derived, content.reading, is_code=True),
        _Stage("integrate: overwrites stored", "call", _integrated(content)),
    )
    return diagram_of(content, _shapes(stages))


def _integrated(content: PipelineContent) -> tuple[str, ...]:
    """Return what the integration writes."""
    return "new qpos", "new qvel", f"time + {content.timestep:g} s"


def _shapes(stages: Sequence[_Stage]) -> list[Shape]:
    """Return the boxes from top to bottom, the arrows between them, and the brackets."""
    boxes: list[Box] = []
    contents: list[Shape] = []
    top = 0
    for stage in stages:
        box = stage.box(top)
        boxes.append(box)
        contents += lines(stage.rows, _LEFT + 2, top + 1, _ROOM, stage.is_code)
        below = top + 1 + len(stage.rows)
        contents += lines(stage.notes, _LEFT + 2, below, _ROOM, look="faint")
        top = box.bottom + 2
    arrows: list[Shape] = []
    for box, following in itertools.pairwise(boxes):
        arrows.append(Arrow(((_MIDDLE, box.bottom), (_MIDDLE, following.top))))
    first, compute, derived, last = boxes
    back = (
        (_LEFT, last.top + 1),
        (_BACK, last.top + 1),
        (_BACK, first.top + 1),
        (_LEFT, first.top + 1),
    )
    arrows.append(Arrow(back, "call"))
    return [
        *boxes,
        *contents,
        *arrows,
        Bracket(_FORWARD, compute.top, derived.bottom, "forward", "time stays"),
        Bracket(_STEP, compute.top, last.bottom, "step"),
    ]


def _derived(model: Model, data: Data) -> list[str]:
    """Return what can be read of a Data that is derived; forces are one entry."""
    names: list[str] = []
    forces = 0
    for name in DERIVED:
        try:
            getattr(data, name)
        except UnsupportedError:
            continue
        if name.startswith("qfrc_"):
            forces += 1
        elif model.nsite > 0 or not name.startswith("site_"):
            names.append(name)
    names.append(f"qfrc_* ({forces})")
    names.append("contacts")
    sensors = getattr(data.raw, "sensordata", None)
    if sensors is not None and len(sensors) > 0:
        names.append(f"raw.sensordata ({len(sensors)})")
    return names


def _emulated(model: Model, promises: Sequence[str]) -> tuple[str, ...]:
    """Return which of some promises of the contract this interface keeps in place of the engine."""
    behaviours = model.capabilities.behaviours
    return tuple(name for name in promises if behaviours[name].support == "emulated")
