"""What a robot can be asked to do on any engine: a start, a command over time, an end.

A scenario says no word about an engine. Recorded on two of them it is what they are compared by.
It is written for the SO-101; `Scenario.on` gives what it is on another robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import BadInputError, check_name
from ...interface import Array, Data, Model
from ...interface.options import OptionValue
from .drive import Controller
from .floor import has_floor
from .robot import FREE_FALL, UNACTUATED, home_keyframe, is_so101
from .usual_commands import check_has_actuators, draw_waves, hold_ctrl

# Swings the arm with the box in its jaws by 23 degrees.
BOX_SWING_CTRL = (0.4, -0.8, 0.5, 1.6, 1.57, 0.28)


@dataclass(frozen=True)
class Scenario:
    """One thing to do.

    Attributes:
        name: What it is called.
        description: What happens, in one sentence.
        model: The model that it is meant for.
        seconds: How long it takes [s].
        controller: Makes the controller, from the Model and a seed.
        general_description: The sentence for any robot.
        needs: Raises BadInputError for a Model on which it makes no sense.
        keyframe: Where it starts; None for the model's default state.
        options: What `Model.replace` is given.
        seeded: Whether the seed changes anything.
        is_user_function: Whether its controller is a function of the user's, which is the same on
            every robot, and may look at the state.
        is_policy: Whether that function is a policy: it finds joints by their names, and starts
            where the robot stands.
        start: Gives qpos (nq,) [rad or m] where it starts on a Model that has no keyframe for it;
            None for the Model's default state.
    """

    name: str
    description: str
    model: str
    seconds: float
    controller: Callable[[Model, int], Controller]
    general_description: str
    needs: Callable[[Model], None]
    keyframe: str | None = None
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    seeded: bool = False
    is_user_function: bool = False
    is_policy: bool = False
    start: Callable[[Model], Array] | None = None

    def on(self, model: Model) -> Scenario:
        """Return this scenario adapted to a Model: its start, and a description that is true of it.

        It starts where the scenario says; where it says nothing, a robot that is not the arm
        starts at its keyframe "home" if it has one, else in its default state; so does a policy.

        Raises:
            BadInputError: It makes no sense on the Model; with the names of those that do.
        """
        if self.is_policy:
            return self._at_home(model)
        if self.is_user_function or (
            is_so101(model) and (has_floor(model) or not self.description.count("floor"))
        ):
            return self
        try:
            self.needs(model)
        except BadInputError as error:
            others = suitable_scenarios(model)
            known = f"; what makes sense on it: {', '.join(others)}" if others else ""
            raise BadInputError(f"{error}{known}") from None
        if is_so101(model):
            return replace(self, description=self.general_description)
        return self._at_home(model)

    def _at_home(self, model: Model) -> Scenario:
        """Return this scenario with its start on a Model, which its description tells."""
        key = self.keyframe or home_keyframe(model)
        begins = "" if self.start is None else " Its joints start in the pose of its contract."
        if key is not None:
            begins = f" It starts in the keyframe {key!r}."
        return replace(self, description=self.general_description + begins, keyframe=key)

    def qpos_at_start(self, model: Model) -> Array | None:
        """Return qpos (nq,) [rad or m] where it starts; None for its keyframe or default state."""
        return None if self.keyframe is not None or self.start is None else self.start(model)


def suitable_scenarios(model: Model) -> tuple[str, ...]:
    """Return the names of the scenarios that make sense on a Model."""
    names = []
    for known in SCENARIOS.values():
        with suppress(BadInputError):
            known.needs(model)
            names.append(known.name)
    return tuple(names)


def _constant_command(ctrl: Array | None) -> Controller:
    """Return a controller with one command from the beginning on; None where nobody writes ctrl."""
    return lambda _model, _data: ctrl


def _check_holds_box(model: Model) -> None:
    if not is_so101(model) or all(frame.name != "held" for frame in model.keyframes):
        raise BadInputError(f"{model.path.name} has no SO-101 that holds a box (so101/scene_box)")


def _check_has_joints(model: Model) -> None:
    if not model.nv:
        raise BadInputError(
            f"{model.path.name} has no joints: nothing in it can move (two such files are compared "
            "by compare --models LEFT RIGHT)"
        )


def _check_has_joints_and_actuators(model: Model) -> None:
    _check_has_joints(model)
    check_has_actuators(model)


def _waves(model: Model, seed: int) -> Controller:
    """Return a controller: each actuator follows three sines within the middle of its range."""
    middle, size, frequency, phase = draw_waves(model, seed)

    def controller(_model: Model, data: Data) -> Array:
        # From where it stands: the waves grow in over half a second.
        time = data.time
        sines: Array = (size * np.sin(2 * np.pi * frequency * time + phase)).sum(axis=0)
        return middle + min(1.0, 2 * time) * sines

    return controller


def _hold(model: Model, _seed: int) -> Controller:
    """Return a controller: servos take a pose as target, other actuators hold their joint."""
    return _constant_command(hold_ctrl(model))


def _no_command(_model: Model, _seed: int) -> Controller:
    """Return a controller that never writes ctrl."""
    return _constant_command(None)


def _move_the_box(_model: Model, _seed: int) -> Controller:
    """Return a controller that swings the arm aside with the jaws closed."""
    return _constant_command(np.array(BOX_SWING_CTRL))


_ALL = (
    Scenario(
        "hold",
        "The arm is told one pose and goes there; on the way a finger meets the floor.",
        "so101/scene",
        2.0,
        _hold,
        "Each position servo is told a pose and goes there; any other actuator exerts what "
        "holds its joint at the start, or is left at the start's ctrl.",
        _check_has_joints_and_actuators,
    ),
    Scenario(
        "gravity",
        "The servos are off: the arm falls onto the floor.",
        "so101/scene",
        4.0,
        _no_command,
        "No actuator of the file acts: what can move is left to gravity and to what it touches.",
        _check_has_joints,
        options=UNACTUATED,
    ),
    Scenario(
        "droop",
        "Nobody writes ctrl: the servos hold the arm at zero.",
        "so101/scene",
        2.0,
        _no_command,
        "Nobody writes ctrl: each servo holds, and any other actuator exerts, what the start's "
        "ctrl says.",
        _check_has_joints_and_actuators,
    ),
    Scenario(
        "fall",
        "The servos are off and nothing can touch anything: the arm falls.",
        "so101/scene",
        2.0,
        _no_command,
        "No actuator of the file acts and nothing can touch anything: what can move is left "
        "to gravity. A robot that floats falls as a whole.",
        _check_has_joints,
        options=FREE_FALL,
    ),
    Scenario(
        "box",
        "The jaws hold a box while the arm swings it aside.",
        "so101/scene_box",
        3.0,
        _move_the_box,
        "The jaws hold a box while the arm swings it aside.",
        _check_holds_box,
        keyframe="held",
    ),
    Scenario(
        "waves",
        "Every joint follows waves that a seed draws.",
        "so101",
        4.0,
        _waves,
        "Every actuator follows waves that a seed draws.",
        _check_has_joints_and_actuators,
        seeded=True,
    ),
)
SCENARIOS = {scenario.name: scenario for scenario in _ALL}


def scenario(name: str) -> Scenario:
    """Return a scenario by name.

    Raises:
        UnknownNameError: There is none of this name.
    """
    check_name("experiment", name, SCENARIOS)
    return SCENARIOS[name]
