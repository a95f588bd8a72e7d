"""What two contracts say otherwise, field by field."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from ...measures.text import NO_NUMBER, few, significant
from .contract import Clock, Contract


@dataclass(frozen=True)
class FieldDifference:
    """A field that two contracts fill otherwise.

    Attributes:
        name: Where it stands: "base_ang_vel.frame", "action.scale".
        first: What the first says.
        second: What the second says.
    """

    name: str
    first: str
    second: str


def field_differences(first: Contract, second: Contract) -> tuple[FieldDifference, ...]:
    """Return what two contracts say otherwise; the order of their joints and terms included."""
    return tuple(_differences(first, second))


def _differences(first: Contract, second: Contract) -> Iterator[FieldDifference]:
    yield from _one("joints", first.joints, second.joints)
    yield from _one("default_joint_pos", first.default_joint_pos, second.default_joint_pos)
    names = tuple(term.name for term in first.terms)
    yield from _one("terms", names, tuple(term.name for term in second.terms))
    for term in first.terms:
        other = next((known for known in second.terms if known.name == term.name), None)
        if other is not None:
            yield from _of_record(term.name, term, other)
    yield from _one("quaternion order", first.quat_order, second.quat_order)
    yield from _one("clip before scale", first.clips_before_scale, second.clips_before_scale)
    yield from _of_record("history", first.history, second.history)
    yield from _of_record("action", first.action, second.action)
    yield from _of_record("timing", first.timing, second.timing)
    yield from _of_record("servos", first.servos, second.servos)


def _of_record(name: str, first: object, second: object) -> Iterator[FieldDifference]:
    """Yield the differences of two records of one class."""
    for field in fields(first):  # type: ignore[arg-type]
        values = (getattr(first, field.name), getattr(second, field.name))
        if field.name != "name":
            yield from _one(f"{name}.{field.name}", *values)


def _one(name: str, first: object, second: object) -> Iterator[FieldDifference]:
    """Yield a difference where two values are not equal."""
    if not _are_equal(first, second):
        yield FieldDifference(name, _text(first), _text(second))


def _are_equal(first: object, second: object) -> bool:
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        return np.array_equal(first, second)
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return False
    return first == second


def _text(value: object) -> str:
    """Return a value as a cell of a table."""
    if value is None:
        return NO_NUMBER
    if isinstance(value, np.ndarray):
        if np.all(value == value.flat[0]):
            return significant(float(value.flat[0]), 4)
        return few([significant(float(number), 3) for number in value.flat])
    if isinstance(value, float):
        return significant(value, 4)
    if isinstance(value, tuple):
        return few([str(entry) for entry in value]) or NO_NUMBER
    if isinstance(value, Clock):
        return f"{value.period:g} s, {value.offset_steps} calls ahead"
    return str(value)
