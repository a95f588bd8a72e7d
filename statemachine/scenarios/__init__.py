"""What the arm can be asked to do on any engine: a start, a command over time, an end.

A scenario says no word about an engine. Recorded on two of them it is what they are compared by.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import BadInputError, unknown_name
from ..interface import Array, Data, Model

Controller = Callable[[float, Data], Any]  # (time, data) -> ctrl, or None to leave it
TARGET = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)  # a command to the arm [rad]
# Swings the arm with the box in its jaws by 23 degrees.
MOVING = (0.4, -0.8, 0.5, 1.6, 1.57, 0.28)


@dataclass(frozen=True)
class Scenario:
    """One thing to do.

    Attributes:
        name: What it is called.
        says: What happens, in one sentence.
        model: The model that it is meant for.
        seconds: How long it takes [s].
        controller: Makes the controller, from the Model and a seed.
        keyframe: Where it starts; None for the model's default state.
        options: What `Model.replace` is given.
        seeded: Whether the seed changes anything.
    """

    name: str
    says: str
    model: str
    seconds: float
    controller: Callable[[Model, int], Controller]
    keyframe: str | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    seeded: bool = False


def _command(values: tuple[float, ...]) -> Callable[[Model, int], Controller]:
    """One command from the beginning on."""

    def make(model: Model, _seed: int) -> Controller:
        if model.nu != len(values):
            raise BadInputError(
                f"this is for {len(values)} actuators; {model.path.name} has {model.nu}"
            )
        target = np.array(values)
        return lambda _time, _data: target

    return make


def _untouched(_model: Model, _seed: int) -> Controller:
    """Nobody writes ctrl."""
    return lambda _time, _data: None


def _waves(model: Model, seed: int) -> Controller:
    """Every actuator follows a sum of three sines within the middle of its range."""
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    low, high = np.nan_to_num(model.actuator_ctrlrange, posinf=1.0, neginf=-1.0).T
    draw = np.random.default_rng(seed)
    frequency = draw.uniform(0.2, 1.5, (3, model.nu))  # Hz
    phase = draw.uniform(0.0, 2 * np.pi, (3, model.nu))
    size = draw.uniform(0.2, 1.0, (3, model.nu))
    size *= 0.25 * (high - low) / size.sum(axis=0)
    middle = (low + high) / 2

    def controller(time: float, _data: Data) -> Array:
        # From where it stands: the waves grow in over half a second.
        waves: Array = (size * np.sin(2 * np.pi * frequency * time + phase)).sum(axis=0)
        return middle + min(1.0, 2 * time) * waves

    return controller


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario(
            "hold",
            "The arm is told one pose and goes there; on the way a finger meets the floor.",
            "so101/scene",
            2.0,
            _command(TARGET),
        ),
        Scenario(
            "gravity",
            "The servos are off: the arm falls onto the floor.",
            "so101/scene",
            4.0,
            _untouched,
            options={"actuation": False},
        ),
        Scenario(
            "droop",
            "Nobody writes ctrl: the servos hold the arm at zero.",
            "so101/scene",
            2.0,
            _untouched,
        ),
        Scenario(
            "fall",
            "The servos are off and nothing can touch anything: the arm falls.",
            "so101/scene",
            2.0,
            _untouched,
            options={"actuation": False, "contacts": False},
        ),
        Scenario(
            "box",
            "The jaws hold a box while the arm swings it aside.",
            "so101/scene_box",
            3.0,
            _command(MOVING),
            keyframe="held",
        ),
        Scenario(
            "waves",
            "Every joint follows waves that a seed draws.",
            "so101",
            4.0,
            _waves,
            seeded=True,
        ),
    )
}


def scenario(name: str) -> Scenario:
    """A scenario by name.

    Raises:
        UnknownNameError: There is none of this name.
    """
    if name not in SCENARIOS:
        raise unknown_name("experiment", name, SCENARIOS)
    return SCENARIOS[name]
