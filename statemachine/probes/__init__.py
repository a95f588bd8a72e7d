"""What an engine itself calls things and does, looked at without our adapter.

Where a backend emulates the contract, a statement about the engine must not be made by
looking at the emulation. A probe loads the model as the engine's own users do.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, cast

from ..interface import Model


@dataclass(frozen=True)
class Term:
    """What the interface calls a thing, and what an engine calls it."""

    thing: str
    ours: str
    engine: str


@dataclass(frozen=True)
class Alone:
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


class Probe(Protocol):
    """What a probe module offers: the engine itself, without its adapter."""

    def terms(self, model: Model) -> tuple[Term, ...]:
        """What the engine calls the things of the interface."""
        ...

    def left_alone(self, model: Model, seconds: float, joint: int) -> tuple[Alone, ...]:
        """A joint of a freshly loaded model that nobody commands."""
        ...

    def ways_back(self, model: Model) -> tuple[WayBack, ...]:
        """Which of the engine's own ways to go back is exact."""
        ...


_PROBES = {"pybullet": "pybullet_probe"}


def probe(model: Model) -> Probe | None:
    """What looks at the raw engine of a Model; None where the interface is the engine's own."""
    name = _PROBES.get(model.backend)
    return cast("Probe", importlib.import_module(f".{name}", __name__)) if name else None


class Dials(Protocol):
    """What can be set in an engine's own way or in the model's; see `pybullet_dials`."""

    model: Model
    emulated: Model
    with_servo: tuple[str, ...]

    def build(self, dials: Mapping[str, Any], values: Mapping[str, Any]) -> Model:
        """A Model with some of them turned."""
        ...


_DIALS = {"pybullet": "pybullet_dials"}


def dials_of(model: Model, options: Mapping[str, Any]) -> Dials | None:
    """The dials of a Model of an engine as it comes; None of any other Model."""
    name = _DIALS.get(model.backend)
    if not name:
        return None
    return cast("Dials | None", importlib.import_module(f".{name}", __name__).dials(model, options))


def frictionless(model: Model) -> Model | None:
    """A Model whose surfaces have no friction, turned in the engine; None if we cannot."""
    name = _DIALS.get(model.backend)
    return importlib.import_module(f".{name}", __name__).frictionless(model) if name else None
