"""What each kind of difference of two compiled models means for a motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...engines.description.reading import ModelReading
from ...engines.records import TURNED, DifferingQuantity, ModelDifference
from .effects import Effects, Meaning
from .listing import share_of
from .loads import ServoParts
from .locating import ElementIds, Locator
from .records import Value

# What each gain of a servo decides.
_PARTS_OF_SERVO: dict[str, ServoParts] = {"kp": "sag", "kv": "ratio"}


class Meanings:
    """Tells what differences mean.

    Args:
        readings: Both sides.
        effects: What differences of elements mean.
        locator: Which elements they are.
    """

    def __init__(
        self, readings: Sequence[ModelReading], effects: Effects, locator: Locator
    ) -> None:
        self._readings, self._effects, self._locator = readings, effects, locator

    def of(
        self,
        row: ModelDifference,
        ids: ElementIds,
        value: DifferingQuantity,
        values: tuple[Value, Value],
    ) -> Meaning:
        """Return what a quantity that differs means for a motion."""
        match row.kind:
            case "body":
                return self._of_body(row, ids, value)
            case "joint":
                return self._of_joint(row, ids, value, values)
            case "actuator":
                return self._of_actuator(row, ids, value, values)
            case "site":
                return self._of_site(value)
            case "geom":
                return self._of_geom(row, value, values)
            case "option" | "flag":
                return self._of_setting(row, value, values)
        scale = self._effects.reach if value.unit == "m" else 0.0
        return Meaning(share_of(values), scale=scale)

    def _of_body(self, row: ModelDifference, ids: ElementIds, value: DifferingQuantity) -> Meaning:
        left, right = value.left, value.right
        effects = self._effects
        match value.quantity:
            case "mass" if isinstance(left, float) and isinstance(right, float):
                return effects.of_mass(ids.left, left, right)
            case "com" if isinstance(left, tuple) and isinstance(right, tuple):
                return effects.of_centre(ids.left, np.array(left), np.array(right))
        if row.subject == "place":
            return effects.of_place(ids.left, value.quantity, _largest_difference(left, right))
        if value.quantity in ("moments", TURNED):
            return effects.of_inertia(ids.left, ids.right)
        return Meaning(share_of((left, right)))

    def _of_joint(
        self,
        row: ModelDifference,
        ids: ElementIds,
        value: DifferingQuantity,
        values: tuple[Value, Value],
    ) -> Meaning:
        effects = self._effects
        left, right = values
        match row.subject:
            case "extra joint":
                return self._of_extra_joint(row)
            case "axis" if isinstance(left, tuple) and isinstance(right, tuple):
                return effects.of_axis(np.array(left), np.array(right))
            case "anchor":
                share = _largest_difference(left, right) / effects.reach
                return Meaning(share, "beside the other's axis", scale=effects.reach)
            case "range":
                ends = (_ends(left), _ends(right))
                return effects.of_range(ends, value.unit)
            case "force limit":
                limits = (_largest_magnitude(left), _largest_magnitude(right))
                return effects.of_joint(row.where, "effort", *limits)
        if row.subject in ("armature", "dry friction", "damping"):
            numbers = (_number(left), _number(right))
            if any(number is not None for number in numbers):
                return effects.of_joint(row.where, row.subject, *numbers)
        if row.subject == "rest of the spring":
            return Meaning(min(_largest_difference(left, right), 1.0), scale=1.0)
        return Meaning(share_of(values))

    def _of_extra_joint(self, row: ModelDifference) -> Meaning:
        """Return what a joint that only one side has carries.

        Of a base that floats on one side alone a URDF cannot say whether it does on the other.
        """
        sides = (self._effects.left, self._effects.right)
        carried: list[str] = []
        for side in sides:
            group = side.tree.by_joint.get(row.where)
            if group is not None:
                carried.append(f"carries {side.tree.carried[group.number].mass:.4g} kg")
        return Meaning(1.0, carried[0] if carried else "")

    def _of_actuator(
        self,
        row: ModelDifference,
        ids: ElementIds,
        value: DifferingQuantity,
        values: tuple[Value, Value],
    ) -> Meaning:
        left, right = (
            self._locator.name(0, "actuator", ids.left),
            self._locator.name(1, "actuator", ids.right),
        )
        if row.subject == "extra actuator":
            silent = "right" if ids.right < 0 else "left"
            if value.quantity == "actuator":
                return Meaning(1.0, f"the {silent} has none")
            parts = _PARTS_OF_SERVO[value.quantity]
            return Meaning(1.0, self._effects.of_servo(left, right, parts))
        if row.subject in ("gains", "gear"):
            parts = _PARTS_OF_SERVO.get(value.quantity, "both")
            if value.quantity == "kp" and self._same_kv(left, right):
                parts = "both"
            return Meaning(share_of(values), self._effects.of_servo(left, right, parts))
        if row.subject == "force range":
            return Meaning(share_of(values), self._at_most(left, right))
        return Meaning(share_of(values))

    def _same_kv(self, left: str, right: str) -> bool:
        """Tell whether two position servos damp alike."""
        ours, theirs = self._effects.left.actuators[left], self._effects.right.actuators[right]
        return ours.kv == theirs.kv

    def _at_most(self, left: str, right: str) -> str:
        """Return what an actuator exerts on its joint at most on each side, in words."""
        words: list[str] = []
        for side, name in ((self._effects.left, left), (self._effects.right, right)):
            actuator = side.actuators.get(name)
            if actuator is None or not actuator.joint:
                continue
            for load in self._effects.loads(actuator.joint)[:1]:
                ends = actuator.forcerange
                if ends is None:
                    words.append("unlimited")
                else:
                    most = max(abs(end) for end in ends) * abs(actuator.gear)
                    words.append(f"{most:.4g} {load.unit('N·m')}")
        return f"at most {' / '.join(dict.fromkeys(words))}" if words else ""

    def _of_site(self, value: DifferingQuantity) -> Meaning:
        """Return what another place of a frame means."""
        scale = np.pi if value.quantity == TURNED else self._effects.reach
        if value.quantity not in ("place", TURNED):
            return Meaning(1.0)
        return Meaning(_largest_difference(value.left, value.right) / scale, scale=float(scale))

    def _of_geom(
        self, row: ModelDifference, value: DifferingQuantity, values: tuple[Value, Value]
    ) -> Meaning:
        """Return what another shape, place or contact means, as a part of the robot's reach."""
        if value.quantity == TURNED:
            return Meaning(_largest_difference(*values) / np.pi / 10, scale=float(np.pi))
        if value.unit == "m" and _largest_difference(*values):
            reach = self._effects.reach
            return Meaning(
                _largest_difference(*values) / reach, scale=reach if row.subject == "place" else 0.0
            )
        return Meaning(share_of(values))

    def _of_setting(
        self, row: ModelDifference, value: DifferingQuantity, values: tuple[Value, Value]
    ) -> Meaning:
        """Return how much a setting weighs; of the solver's at most a fifth counts."""
        share = share_of((value.left, value.right))
        if row.subject not in ("gravity", "timestep"):
            share = min(share, 0.2) if not isinstance(value.left, str) else 0.5
        effect = ""
        for side, (entry, taken) in enumerate(zip(values, (value.left, value.right), strict=True)):
            if entry is None:
                engine = self._readings[side].reader.partition(" ")[0]
                effect = f"{engine} takes {_in_words(taken)}"
        return Meaning(share, effect)


def _largest_difference(left: Value, right: Value) -> float:
    """Return how far two numbers, or as many, are apart; 0 of what are none."""
    if isinstance(left, str) or isinstance(right, str) or left is None or right is None:
        return 0.0
    return float(np.linalg.norm(np.subtract(left, right)))


def _ends(value: Value) -> tuple[float, float] | None:
    """Return the two ends of a range; None of what has none."""
    if isinstance(value, tuple) and len(value) == 2:
        return value[0], value[1]
    return None


def _largest_magnitude(value: Value) -> float | None:
    """Return the largest number of a range without its sign; infinite of what has no range."""
    if value is None:
        return None
    if isinstance(value, tuple):
        return max(abs(entry) for entry in value)
    return np.inf


def _number(value: Value) -> float | None:
    """Return a number; of several the largest; None of what is none."""
    if isinstance(value, tuple):
        return max(value, key=abs)
    return value if isinstance(value, float) else None


def _in_words(value: Value) -> str:
    """Return a value in words."""
    if isinstance(value, tuple):
        return " ".join(f"{entry:g}" for entry in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
