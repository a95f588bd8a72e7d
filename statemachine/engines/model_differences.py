"""What two compiled models differ in: the part "differences" of a room, and its records."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from ..rotations import Placement


@dataclass(frozen=True, eq=False)
class BodyPair:
    """A rigid part of one model, or the world, and its counterpart in another.

    Attributes:
        one, two: Ids of the bodies that carry it.
        align: The frame of `one` in that of `two`, as the same solid.
        moved: Whether it hangs on another part in the other model.
    """

    one: int
    two: int
    align: Placement
    moved: bool


class Counterparts(Protocol):
    """What of one model is what of another: pairs of ids; actuators by their place in ctrl."""

    @property
    def joints(self) -> tuple[tuple[int, int], ...]: ...
    @property
    def sites(self) -> tuple[tuple[int, int], ...]: ...
    @property
    def actuators(self) -> tuple[tuple[int, int], ...]: ...
    @property
    def solids(self) -> tuple[BodyPair, ...]: ...


# An array of a compiled model or an option, where in it, and what is to stand there.
Edit = tuple[str, tuple[int | slice, ...], Any]


@dataclass(frozen=True, eq=False)
class ModelDifference:
    """One thing in which two compiled models differ, and what makes them alike.

    Attributes:
        subject: What it is: "mass", "range", "gravity".
        kind: Of the element that it is of: "body", "joint", "geom", "actuator", "option", …
        where: Name of that element; "" of the whole model.
        values: For each figure that differs its name and both values; None: it has none.
        unit: SI unit of the first of them.
        edits: What brings the second model to the first.
        edits_one: What brings the first to the second, where only it can be changed.
        refused: Why neither can be brought to the other; "" if one can.
    """

    subject: str
    kind: str
    where: str
    values: tuple[tuple[str, Any, Any], ...]
    unit: str = ""
    edits: tuple[Edit, ...] = ()
    edits_one: tuple[Edit, ...] = ()
    refused: str = ""

    @property
    def title(self) -> str:
        """What it is, and of what."""
        return f"{self.subject} of {self.where}" if self.where else self.subject


class DifferencesPart(Protocol):
    """The part "differences" of the engine by whose compiled models files are compared."""

    def differences(
        self, one: Any, two: Any, pairs: Counterparts, *, world: bool = True
    ) -> tuple[ModelDifference, ...]:
        """All that two compiled models differ in and that can change a motion.

        Args:
            one: A compiled model.
            two: Another.
            pairs: What of one is what of the other.
            world: Whether gravity and the timestep are compared, too.
        """
        ...

    def sensors(self, one: Any, two: Any, pairs: Counterparts) -> list[ModelDifference]:
        """What the sensors of two compiled models differ in, which only a controller reads."""
        ...

    def entries(self, two: Any, difference: ModelDifference) -> tuple[ModelDifference, ...]:
        """A difference by its single entries, or itself where it is of one piece.

        Args:
            two: The compiled model that its edits are of.
            difference: One of `differences`.
        """
        ...

    def edited(self, raw: Any, edits: Iterable[Edit]) -> Any:
        """A copy of a compiled model with these edits, and all that follows from them."""
        ...
