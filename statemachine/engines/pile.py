"""A pile of boxes that fall on each other, a driven joint, and what of it is kept or forgotten."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import partial
from typing import Any, ClassVar

from ..interface import Array
from .measured import Futures

HALF = 0.1  # an edge [m]
# Where the boxes begin, one over the other [m], and how the lowest is turned (w, x, y, z).
PLACES = ((0.0, 0.0, 0.25), (0.0, 0.02, 0.55), (0.0, 0.0, 0.85))
TILT = (0.92, 0.31, 0.21, 0.1)


def _pile_body(k: int) -> str:
    """Return a box of the pile in MJCF; the first of them is turned."""
    place, turn = PLACES[k], TILT if k == 0 else (1, 0, 0, 0)
    return (
        f'<body pos="{" ".join(map(str, place))}" quat="{" ".join(map(str, turn))}">'
        f'<freejoint/><geom type="box" size="{HALF} {HALF} {HALF}"/></body>'
    )


PILE_MJCF = f"""<mujoco><worldbody><geom type="plane" size="5 5 1"/>
{"".join(map(_pile_body, range(len(PLACES))))}
<body pos="2 0 2"><joint name="j" axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body></worldbody>
<actuator><position joint="j" kp="20"/></actuator></mujoco>"""

Write = Callable[[Any, float], object]
Read = Callable[[Any], float]
# Entered, it saves a world and gives what restores one.
Save = Callable[[Any], AbstractContextManager[Callable[[Any], object]]]
_WRITTEN, _OTHER = 0.5, -0.25  # half of anything is not what it has at the start


class Pile(ABC):
    """A world of an engine with a pile of bodies in it; each trial has a new one.

    Attributes:
        quantities: What decides the future, by name: a function that writes a number there, and
            one that reads it, which may take a step for it.
        near: The relative error with which a number may be read back.
        resets: The engine's functions that reset a world, by name.
        ways_to_save: Functions that save a world, by name.
    """

    quantities: ClassVar[Mapping[str, tuple[Write, Read]]]
    near: ClassVar[float] = 0.0
    resets: ClassVar[Mapping[str, Callable[[Any], object]]]
    ways_to_save: ClassVar[Mapping[str, Save]]

    @classmethod
    @abstractmethod
    def fresh(cls) -> AbstractContextManager[Pile]:
        """Return a new world."""

    @property
    @abstractmethod
    def timestep(self) -> float:
        """Return the engine's own step [s]."""

    @abstractmethod
    def bodies(self) -> int:
        """Return how many bodies there are."""

    @abstractmethod
    def run(self, steps: int) -> Array:
        """Go on under gravity; coordinates of boxes and joint (steps, 22) after every step."""

    def disturb(self, quantity: str) -> None:
        """Put something else there."""
        self.quantities[quantity][0](self, _OTHER)

    def refilled(self) -> Pile:
        """Return this world with the bodies in it, if a way to the start takes them away."""
        return self

    @classmethod
    def _survives(cls, quantity: str, act: Callable[[Any], object]) -> bool:
        """Tell whether a number that was written is there after something was done."""
        write, read = cls.quantities[quantity]
        with cls.fresh() as scene:
            write(scene, _WRITTEN)
            act(scene)
            return abs(read(scene.refilled()) - _WRITTEN) <= cls.near * _WRITTEN

    @classmethod
    def reset(cls) -> dict[str, dict[str, bool]]:
        """Measure which quantities are, for each way to reset, still what was written before."""
        survivors: dict[str, dict[str, bool]] = {}
        for name, way in cls.resets.items():
            survivors[name] = cls._survivors(way)
            with cls.fresh() as scene:
                bodies = scene.bodies()
                way(scene)
                survivors[name]["bodies"] = scene.bodies() == bodies
        return survivors

    @classmethod
    def _survivors(cls, act: Callable[[Any], object]) -> dict[str, bool]:
        """Tell for each quantity whether a number that was written is there after an act."""
        return {quantity: cls._survives(quantity, act) for quantity in cls.quantities}

    @classmethod
    def save(cls) -> dict[str, dict[str, bool]]:
        """Measure which quantities a restore brings back, for each way to save."""

        def there_and_back(quantity: str, save: Save, scene: Pile) -> None:
            with save(scene) as restore:
                scene.disturb(quantity)
                restore(scene)

        restored: dict[str, dict[str, bool]] = {}
        for name, save in cls.ways_to_save.items():
            restored[name] = {}
            for quantity in cls.quantities:
                act = partial(there_and_back, quantity, save)
                restored[name][quantity] = cls._survives(quantity, act)
        return restored

    @classmethod
    def future(cls, moments: Sequence[float], steps: int) -> dict[str, list[Futures]]:
        """Measure the two futures of each trial, set back to the start or to moments [s] in the
        middle.
        """

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

        futures = {name: [start(way)] for name, way in cls.resets.items()}
        for name, save in cls.ways_to_save.items():
            futures[name] = [middle(save, moment) for moment in moments]
        return futures
