"""What a robot can be asked to do on any engine: a start, a command over time, an end.

A scenario says no word about an engine. Recorded on two of them it is what they are compared by.
It is written for the SO-101; `Scenario.on` gives what it is on another robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..errors import BadInputError, check_name
from ..interface import Array, Data, Model
from ..measures.text import listed, sentence
from .commands import hold_ctrl, home, is_servo, need_actuators, waves
from .drive import Controller
from .robot import has_floor, is_the_arm

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
        elsewhere: The sentence for another robot than the arm; raises BadInputError if the
            experiment makes no sense on it.
        keyframe: Where it starts; None for the model's default state.
        options: What `Model.replace` is given.
        seeded: Whether the seed changes anything.
        own: Whether it is the user's: the same on every robot, and it may look at the state.
    """

    name: str
    says: str
    model: str
    seconds: float
    controller: Callable[[Model, int], Controller]
    elsewhere: Callable[[Model], str]
    keyframe: str | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    seeded: bool = False
    own: bool = False

    def on(self, model: Model) -> Scenario:
        """This scenario as it is on a Model: its start, and words that are true of it.

        The arm starts where the scenario says; another robot at its keyframe "home" if it has
        one, else in its default state.

        Raises:
            BadInputError: It makes no sense on the Model; with the names of those that do.
        """
        if self.own or (is_the_arm(model) and (has_floor(model) or not self.says.count("floor"))):
            return self
        try:
            says = self.elsewhere(model)
        except BadInputError as error:
            others = fitting(model)
            known = f"; what makes sense on it: {', '.join(others)}" if others else ""
            raise BadInputError(f"{error}{known}") from None
        if is_the_arm(model):
            return replace(self, says=says)
        key = home(model)
        if key is not None:
            says = f"{says[:-1]}, from the keyframe {key!r}."
        return replace(self, says=says, keyframe=key)


def fitting(model: Model) -> tuple[str, ...]:
    """Names of the scenarios that make sense on a Model."""
    names = []
    for each in SCENARIOS.values():
        with suppress(BadInputError):
            each.elsewhere(model)
            names.append(each.name)
    return tuple(names)


def _hold(model: Model, _seed: int) -> Controller:
    """One command from the beginning on."""
    target = hold_ctrl(model)
    return lambda _time, _data: target


def _hold_says(model: Model) -> str:
    _need_actuators(model)
    if is_the_arm(model):
        return "The arm is told one pose and goes there."
    servos = is_servo(model)
    pushes = bool(hold_ctrl(model)[~servos].any())
    rest = "exerts what holds its joint at the start" if pushes else "is left at the start's ctrl"
    says = ["each position servo is told a pose and goes there"] if servos.any() else []
    says += [] if servos.all() else [f"each {'other ' if says else ''}actuator {rest}"]
    return sentence("; ".join(says))


def _box(_model: Model, _seed: int) -> Controller:
    target = np.array(MOVING)
    return lambda _time, _data: target


def _box_says(model: Model) -> str:
    if not is_the_arm(model) or all(frame.name != "held" for frame in model.keyframes):
        raise BadInputError(f"{model.path.name} has no SO-101 that holds a box (so101/scene_box)")
    return "The jaws hold a box while the arm swings it aside."


def _untouched(_model: Model, _seed: int) -> Controller:
    """Nobody writes ctrl."""
    return lambda _time, _data: None


def _need_joints(model: Model) -> None:
    if not model.nv:
        raise BadInputError(f"{model.path.name} has no joints: nothing in it can move")


def _need_actuators(model: Model) -> None:
    _need_joints(model)
    need_actuators(model)


def _falls(model: Model, onto: bool) -> str:
    _need_joints(model)
    facts = [f"the {drives(model)} are off"] if model.nu else []
    facts += [] if onto else ["nothing can touch anything"]
    facts += [] if model.gravity.any() else ["there is no gravity"]
    falls = "falls onto the floor" if onto and has_floor(model) else "falls"
    falls = falls if model.gravity.any() else "coasts"
    what = "the arm" if is_the_arm(model) else "what can move"
    return sentence(f"{listed(facts) or 'nothing is driven'}: {what} {falls}")


def drives(model: Model) -> str:
    """What moves the robot, in a word: "servos" where one is among them, else "actuators"."""
    return "servos" if is_servo(model).any() else "actuators"


def _droop_says(model: Model) -> str:
    _need_actuators(model)
    where = "at zero" if home(model) is None else "where the keyframe's ctrl says"
    servos, says = int(is_servo(model).sum()), []
    if servos:
        what = "the arm" if is_the_arm(model) else "their joints"
        says.append(f"the servos hold {what} {where}")
    if servos < model.nu:
        says.append(f"{'other actuators' if servos else 'the actuators'} exert what ctrl says")
    return f"Nobody writes ctrl: {listed(says)}."


def _waves(model: Model, seed: int) -> Controller:
    """Every actuator follows a sum of three sines within the middle of its range."""
    middle, size, frequency, phase = waves(model, seed)

    def controller(time: float, _data: Data) -> Array:
        # From where it stands: the waves grow in over half a second.
        sines: Array = (size * np.sin(2 * np.pi * frequency * time + phase)).sum(axis=0)
        return middle + min(1.0, 2 * time) * sines

    return controller


def _waves_says(model: Model) -> str:
    _need_actuators(model)
    return "Every actuator follows waves that a seed draws."


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario(
            "hold",
            "The arm is told one pose and goes there; on the way a finger meets the floor.",
            "so101/scene",
            2.0,
            _hold,
            _hold_says,
        ),
        Scenario(
            "gravity",
            "The servos are off: the arm falls onto the floor.",
            "so101/scene",
            4.0,
            _untouched,
            partial(_falls, onto=True),
            options={"actuation": False},
        ),
        Scenario(
            "droop",
            "Nobody writes ctrl: the servos hold the arm at zero.",
            "so101/scene",
            2.0,
            _untouched,
            _droop_says,
        ),
        Scenario(
            "fall",
            "The servos are off and nothing can touch anything: the arm falls.",
            "so101/scene",
            2.0,
            _untouched,
            partial(_falls, onto=False),
            options={"actuation": False, "contacts": False},
        ),
        Scenario(
            "box",
            "The jaws hold a box while the arm swings it aside.",
            "so101/scene_box",
            3.0,
            _box,
            _box_says,
            keyframe="held",
        ),
        Scenario(
            "waves",
            "Every joint follows waves that a seed draws.",
            "so101",
            4.0,
            _waves,
            _waves_says,
            seeded=True,
        ),
    )
}


def scenario(name: str) -> Scenario:
    """A scenario by name.

    Raises:
        UnknownNameError: There is none of this name.
    """
    check_name("experiment", name, SCENARIOS)
    return SCENARIOS[name]
