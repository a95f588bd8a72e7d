"""The pictures that a page may have: what is drawn, and not yet how."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .diagrams.shapes import Shape

    Numbers = Sequence[float] | NDArray[Any]
    Poses = NDArray[np.float64]


@dataclass(frozen=True)
class Traces:
    """Curves over one axis; shown where pictures can be.

    Attributes:
        title: What they show.
        across: What the horizontal axis is, with its unit; up: the vertical one.
        curves: (x, y) by name, each a sequence of numbers.
        log: Whether the vertical axis is logarithmic; what is zero has a level below it.
        log_across: Whether the horizontal axis is; the points of the curves are marked then.
        sides: Whether the curves are the sides of a comparison, in the order of their styles.
        tolerance: Of the values; a line, and what is beyond it is filled.
        floor: (x, y) of the chaos floor, an area.
        least: What the vertical axis spans at least.
    """

    title: str
    across: str
    up: str
    curves: Mapping[str, tuple[Numbers, Numbers]]
    log: bool = False
    log_across: bool = False
    sides: bool = False
    tolerance: float | None = None
    floor: tuple[Numbers, Numbers] | None = None
    least: float = 0.0


@dataclass(frozen=True)
class Bars:
    """Bars for each name; shown where pictures can be.

    Attributes:
        title: What they show.
        across: What their length is.
        names: From top to bottom.
        bars: By what they are: the length for each name, which is not negative.
    """

    title: str
    across: str
    names: Sequence[str]
    bars: Mapping[str, Sequence[float]]


@dataclass(frozen=True, eq=False)
class RobotPicture:
    """The robot where it was, in one pose or moving; shown where pictures can be.

    Attributes:
        title: What it shows.
        words: What is to be seen, for who cannot see it.
        view: What to type to look at the same in a browser.
        model: Name of the model.
        poses: Makes qpos (n, nq) of what is drawn solid, and of what is drawn as a ghost over
            it or None; run only where it is drawn.
        interval: Simulated time from a pose to the next [s].
        near: Body to look at from close by; "" for the whole robot.
    """

    title: str
    words: str
    view: str
    model: str
    poses: Callable[[], tuple[Poses, Poses | None]]
    interval: float = 0.08
    near: str = ""


@dataclass(frozen=True)
class Diagram:
    """Boxes, arrows and brackets; shown by every medium in its own way.

    Attributes:
        title: What it shows.
        words: What is to be seen, for who cannot see it.
        shapes: What it consists of.
    """

    title: str
    words: str
    shapes: Sequence[Shape]


Picture = Traces | Bars | RobotPicture
