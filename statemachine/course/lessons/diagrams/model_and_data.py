"""The first diagram: what never changes, what does, and the function that reads both."""

from __future__ import annotations

from dataclasses import dataclass

from ....interface import Model, make_data
from ....show.diagrams.shapes import Arrow, Box, Label, Shape
from ....show.pictures import Diagram
from ....show.templates import PageContent
from .texts import diagram_of, file_of, lines, rows_of, stored_arrays

_WIDTH = 71
_MODEL_TOP = 3
_STEP = 18  # columns of its box
_DATA_LEFT, _DATA = 30, 21  # column and columns of its box
_OTHER_LEFT = 53


@dataclass(frozen=True)
class ModelAndDataContent(PageContent):
    """What is said of the diagram.

    Attributes:
        file: The model's file and its folder.
        bodies: Number of bodies, the world included.
        joints: Number of joints.
        actuators: Number of actuators.
        timestep: Simulated time of a step [s].
        arrays: What is stored of a Data, each array with its length.
        is_shared: Whether several Data share one model of the engine.
    """

    template = "model_and_data.md.j2"

    file: str
    bodies: int
    joints: int
    actuators: int
    timestep: float
    arrays: tuple[str, ...]
    is_shared: bool


def model_and_data(model: Model) -> Diagram:
    """Return the diagram of a Model, its Data, and `step`."""
    with make_data(model) as data:
        arrays = stored_arrays(model, data)
    content = ModelAndDataContent(
        file=file_of(model),
        bodies=model.nbody,
        joints=model.njnt,
        actuators=model.nu,
        timestep=model.timestep,
        arrays=tuple(arrays),
        is_shared=model.capabilities.shared_model,
    )
    rows = rows_of(_counts(content), _WIDTH - 4)
    model_box = Box(0, _MODEL_TOP, _WIDTH, len(rows) + 2, "constant", "Model: never changes")
    shapes: list[Shape] = [
        Label(content.file, 2, 0, _WIDTH - 2, is_code=True),
        Label("load, once", 7, 1, 20),
        model_box,
        Arrow(((4, 1), (4, _MODEL_TOP)), "constant"),
    ]
    shapes += lines(rows, 2, _MODEL_TOP + 1, _WIDTH - 4)
    return diagram_of(content, [*shapes, *_below(content, model_box.bottom)])


def _counts(content: ModelAndDataContent) -> list[str]:
    """Return what stands in the Model's box."""
    return [
        f"bodies {content.bodies}",
        f"joints {content.joints}",
        f"actuators {content.actuators}",
        f"timestep {content.timestep:g} s",
    ]


def _below(content: ModelAndDataContent, edge: int) -> list[Shape]:
    """Return what is below the Model: step, the Data that it overwrites, and another Data.

    Args:
        content: Of the diagram.
        edge: Row of the lower edge of the Model's box.
    """
    top = edge + 3
    height = len(content.arrays) + 3  # one row for what is derived
    step = Box(0, top, _STEP, height, "call", "step", is_rounded=True)
    data = Box(_DATA_LEFT, top, _DATA, height, "state", "Data: changes")
    other_width = _WIDTH - _OTHER_LEFT
    other = Box(_OTHER_LEFT, top, other_width, height, "state", "another Data", is_dashed=True)
    shapes: list[Shape] = [step, data, other]
    shapes += _from_the_model(edge, (step, data, other))
    shapes += _between(step, data)
    shapes += lines(("one timestep", "reads no clock"), 2, top + 1, _STEP - 4)
    shapes += _stored(content, data)
    shapes += lines(_about_another(content), other.left + 2, top + 1, other_width - 4)
    return shapes


def _about_another(content: ModelAndDataContent) -> tuple[str, str]:
    """Return what is said of another Data."""
    return "its own state", "the same Model" if content.is_shared else "its own world"


def _stored(content: ModelAndDataContent, data: Box) -> list[Shape]:
    """Return what stands in the box of the Data."""
    left, room = data.left + 2, data.width - 4
    return [
        *lines(content.arrays, left, data.top + 1, room, is_code=True),
        Label("derived arrays", left, data.bottom - 1, room, "faint"),
    ]


def _from_the_model(edge: int, boxes: tuple[Box, Box, Box]) -> list[Shape]:
    """Return the arrows from the Model down to the boxes, each with its name.

    Args:
        edge: Row of the lower edge of the Model's box.
        boxes: Of step, the Data and another one.
    """
    shapes: list[Shape] = []
    for box, name in zip(boxes, ("reads", "make_data", "make_data"), strict=True):
        column = box.left + 4
        shapes.append(Arrow(((column, edge), (column, box.top)), "constant"))
        is_code = name != "reads"
        shapes.append(Label(name, column + 2, edge + 1, _STEP - 6, is_code=is_code))
    return shapes


def _between(step: Box, data: Box) -> list[Shape]:
    """Return the arrows between step and the Data, each with its name."""
    middle, gap = (step.right + data.left + 1) // 2, data.left - step.right - 1
    there, back = step.top + 2, step.top + 4
    shapes: list[Shape] = [
        Arrow(((data.left, there), (step.right, there)), "state"),
        Arrow(((step.right, back), (data.left, back)), "call"),
    ]
    for text, row in (("reads", there - 1), ("overwrites", back + 1), ("in place", back + 2)):
        shapes.append(Label(text, middle, row, gap, is_centered=True))
    return shapes
