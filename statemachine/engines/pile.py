"""A pile of boxes that fall on each other, a driven joint, and what of it is kept or forgotten.

What was forgotten shows in two futures of one state, byte by byte.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ..interface import Array, Ints
from ..measures import JointPlaces, farthest, largest_or_inf, turns
from .auditing import Save
from .measured import Futures

HALF = 0.1  # an edge [m]
# Where the boxes begin, one over the other [m], and how the lowest is turned (w, x, y, z).
PLACES = ((0.0, 0.0, 0.25), (0.0, 0.02, 0.55), (0.0, 0.0, 0.85))
TILT = (0.92, 0.31, 0.21, 0.1)
Write = Callable[[Any, float], object]
Read = Callable[[Any], float]
_WRITTEN, _OTHER = 0.5, -0.25  # half of anything is not what it has at the start


class Pile(ABC):
    """A world of an engine with the pile in it; of all there is a new one for each trial.

    Attributes:
        quantities: What decides the future: what puts a number there, and what tells the number
            that is there, which may take a step for it.
        near: By what part of a number it may be read otherwise than it was written.
        resets: Ways to the start, by name.
        ways_to_save: Ways to save, by name.
    """

    quantities: ClassVar[Mapping[str, tuple[Write, Read]]]
    near: ClassVar[float] = 0.0
    resets: ClassVar[Mapping[str, Callable[[Any], object]]]
    ways_to_save: ClassVar[Mapping[str, Save]]

    @classmethod
    @abstractmethod
    def fresh(cls) -> AbstractContextManager[Pile]:
        """A new world."""

    @property
    @abstractmethod
    def timestep(self) -> float:
        """The engine's own step [s]."""

    @abstractmethod
    def bodies(self) -> int:
        """How many there are."""

    @abstractmethod
    def run(self, steps: int) -> Array:
        """Go on under gravity; coordinates of boxes and joint (steps, 22) after every step."""

    def disturb(self, quantity: str) -> None:
        """Put something else there."""
        self.quantities[quantity][0](self, _OTHER)

    def refilled(self) -> Pile:
        """With the bodies in it, if a way to the start takes them away."""
        return self

    @classmethod
    def _survives(cls, quantity: str, act: Callable[[Any], object]) -> bool:
        """Whether a number that was written is there after something was done."""
        write, read = cls.quantities[quantity]
        with cls.fresh() as scene:
            write(scene, _WRITTEN)
            act(scene)
            return abs(read(scene.refilled()) - _WRITTEN) <= cls.near * _WRITTEN

    @classmethod
    def reset(cls) -> dict[str, dict[str, bool]]:
        """Which quantities are, for each way to reset, still what was written before."""
        survivors = {}
        for name, way in cls.resets.items():
            survivors[name] = {
                quantity: cls._survives(quantity, way) for quantity in cls.quantities
            }
            with cls.fresh() as scene:
                bodies = scene.bodies()
                way(scene)
                survivors[name]["bodies"] = scene.bodies() == bodies
        return survivors

    @classmethod
    def save(cls) -> dict[str, dict[str, bool]]:
        """Which quantities a restore brings back, for each way to save."""

        def there_and_back(quantity: str, save: Save, scene: Pile) -> None:
            with save(scene) as restore:
                scene.disturb(quantity)
                restore(scene)

        return {
            name: {q: cls._survives(q, partial(there_and_back, q, save)) for q in cls.quantities}
            for name, save in cls.ways_to_save.items()
        }

    @classmethod
    def future(cls, moments: Sequence[float], steps: int) -> dict[str, list[Futures]]:
        """The two futures of each trial, set back to the start or to moments [s] in the middle."""

        def start(way: Callable[[Any], object]) -> Futures:
            with cls.fresh() as scene:
                first = scene.run(steps)
                way(scene)
                return first, scene.refilled().run(steps)

        def middle(save: Save, moment: float) -> Futures:
            with cls.fresh() as scene:
                scene.run(round(moment / scene.timestep))
                with save(scene) as restore:
                    first = scene.run(steps)
                    restore(scene)
                    return first, scene.run(steps)

        return {name: [start(way)] for name, way in cls.resets.items()} | {
            name: [middle(save, moment) for moment in moments]
            for name, save in cls.ways_to_save.items()
        }


@dataclass(frozen=True)
class FutureGap:
    """How far two futures are apart.

    Attributes:
        steps: How many steps were compared.
        first: After how many a byte differs first: 0 is before any step, where what was
            restored does not read back as it was; None where none differs.
        angle: The largest difference of a hinge, or of a body's orientation, at any step [rad].
        length: That of a slide, or of a coordinate of a free body [m].
    """

    steps: int
    first: int | None
    angle: float
    length: float

    @property
    def exact(self) -> bool:
        """Whether every byte is the same."""
        return self.first is None

    @property
    def size(self) -> float:
        """The larger of angle and length, in SI units."""
        return max(self.angle, self.length)


def gap(first: Array, second: Array, places: JointPlaces, counts: Ints | None = None) -> FutureGap:
    """The gap between two futures.

    Args:
        first: Positions and velocities, (n, k).
        second: The same of the other future.
        places: What the numbers of a row are; velocities follow.
        counts: (n,) how many steps each row comes after, if not 0, 1, 2, …
    """
    rows = np.arange(len(first)) if counts is None else counts
    # As integers: what is compared are bytes, in which 0 is not -0, and NaN is NaN.
    differs = (
        np.ascontiguousarray(first).view(np.int64) != np.ascontiguousarray(second).view(np.int64)
    ).any(axis=1)
    steps = int(rows[-1])
    if not differs.any():
        return FutureGap(steps, None, 0.0, 0.0)
    moved = [np.concatenate((places.slides, places.positions)), places.hinges]
    length, angle = (farthest(first[:, chosen], second[:, chosen]) for chosen in moved)
    quats = places.quats[:, None] + np.arange(4)
    turned = turns(first[:, quats], second[:, quats])
    return FutureGap(
        steps,
        int(rows[np.argmax(differs)]),
        max(largest_or_inf(angle), largest_or_inf(turned)),
        largest_or_inf(length),
    )


def worst(gaps: list[FutureGap]) -> FutureGap:
    """The earliest difference and the largest, of several gaps over the same steps."""
    firsts = [of.first for of in gaps if of.first is not None]
    return FutureGap(
        gaps[0].steps,
        min(firsts, default=None),
        max(of.angle for of in gaps),
        max(of.length for of in gaps),
    )
