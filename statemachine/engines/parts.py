"""What the parts of a room offer: a protocol for each part, and the records that it gives.

A part is a module; its functions are those of the protocol, without `self`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from ..interface import Array, Model


@dataclass(frozen=True)
class Term:
    """What the interface calls a thing, and what an engine calls it."""

    thing: str
    ours: str
    engine: str


@dataclass(frozen=True)
class LeftAlone:
    """A joint that nobody commands, on an engine as it comes.

    Attributes:
        label: What was done to the engine before.
        time: Simulated time [s].
        position: Of the joint then [rad; of a slide, m].
        motor: What the engine's own motor exerts on it [N·m or N].
        explicit: Largest h·D/M of the joint damping that the engine applies explicitly;
            above 2 a joint gains speed from being damped.
        gravity: Length of the gravity of a fresh world [m/s²].
        widest: How far any joint of the robot is from zero then [rad or m].
        turns: In how many steps the joint's velocity changed its sign.
        steps: Of how many.
    """

    label: str
    time: float
    position: float
    motor: float
    explicit: float
    gravity: float
    widest: float
    turns: int
    steps: int


@dataclass(frozen=True)
class WayBack:
    """A way to go back to an earlier state, and how far the second future is from the first.

    Attributes:
        name: What is done.
        difference: Largest difference of a coordinate; zero means the same bits.
    """

    name: str
    difference: float


class AsItComes(Protocol):
    """The part "as_it_comes": a model as the engine's own users load it.

    An engine has it where the backend emulates some of the contract: what the engine does must
    not be read from the emulation then.
    """

    def terms(self, model: Model) -> tuple[Term, ...]:
        """What the engine calls the things of the interface."""
        ...

    def left_alone(self, model: Model, seconds: float, joint: int) -> tuple[LeftAlone, ...]:
        """A joint that nobody commands, after some time [s], on four freshly loaded models.

        As it comes; with the model's gravity; without the engine's own motors too; and
        without the damping of joints.
        """
        ...

    def ways_back(self, model: Model) -> tuple[WayBack, ...]:
        """Which of the engine's own ways to go back is exact."""
        ...


Setting = Literal["model", "off"]  # of a dial; one that is not named is as it comes


class Dials(Protocol):
    """What can be set in an engine's own way or in the model's.

    Attributes:
        model: The model as it comes, with the options of an experiment.
        emulated: The same file behind the contract, with the same options.
        with_servo: What only an adapter can give, and so only the world of the model's law.
        words: What the engine's own setting of a factor is, in a few words.
        frictions: (nsolid,) friction that the engine tells of each body that touches.
    """

    with_servo: tuple[str, ...]
    words: Mapping[str, str]

    @property
    def model(self) -> Model: ...
    @property
    def emulated(self) -> Model: ...
    @property
    def frictions(self) -> Array: ...

    def build(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        """A Model with some of them turned."""
        ...


class DialsPart(Protocol):
    """The part "dials": Models between an engine as it comes and the contract."""

    def dials(self, model: Model, options: Mapping[str, Any]) -> Dials | None:
        """The dials of a Model of the engine as it comes; None of any other Model."""
        ...

    def frictionless(self, model: Model) -> Model:
        """The same Model with surfaces that have no friction."""
        ...
