"""Numbers and their order: of a quaternion, of a velocity, of the joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations, product
from operator import itemgetter

import numpy as np

from ....engines.measured import Measurement
from ....engines.samples import CENTRE, FIXED, MARKS, TREE
from ....interface import Array
from .answers import UNDECIDED, EngineAnswer, closest, question

# A turn whose four numbers are all different: about (1, 2, 3), by 1 rad.
_ANGLE, _AXIS = 1.0, np.array([1.0, 2, 3]) / np.sqrt(14)
_NUMBERS = dict(zip("wxyz", (np.cos(_ANGLE / 2), *np.sin(_ANGLE / 2) * _AXIS), strict=True))


def _in_every_order(numbers: Mapping[str, float]) -> dict[str, list[float]]:
    """Return the numbers of a quaternion in each order, by the order, such as "wxyz"."""
    quaternions: dict[str, list[float]] = {}
    for order in permutations(numbers):
        quaternions["".join(order)] = [numbers[part] for part in order]
    return quaternions


_QUATERNIONS = _in_every_order(_NUMBERS)


def _turned(point: Array) -> Array:
    """Return a point (3,) [m] after the turn, by Rodrigues' formula: no quaternion in it."""
    cos, sin = np.cos(_ANGLE), np.sin(_ANGLE)
    along = _AXIS * _AXIS.dot(point) * (1 - cos)
    return point * cos + np.cross(_AXIS, point) * sin + along


@question(
    "In which order do the four numbers of a quaternion stand?",
    "Four numbers in the wrong order are still a rotation, only another one: nothing complains. "
    "Do not test with a third of a turn about 1 1 1: its four numbers are the same.",
    list(_QUATERNIONS.values()),
)
def quaternion(turned: Sequence[tuple[Array, Array]]) -> Iterator[EngineAnswer]:
    """Tell the order in which four numbers turn the marks as they should.

    Args:
        turned: For each four numbers that the marked body was turned by, the marks (3, 3) about
            the first of them [m], and the four numbers that are read.
    """
    expected = np.array([_turned(mark) for mark in MARKS])
    errors: dict[str, float] = {}
    numbers_read: dict[str, Array] = {}
    for order, (marks, numbers) in zip(_QUATERNIONS, turned, strict=True):
        errors[order] = float(np.abs(marks - expected).max())
        numbers_read[order] = numbers
    written = closest(errors)
    words = written.hypothesis
    if words != UNDECIDED:
        order_read = _order_of(numbers_read[words])
        if order_read != words:
            words = f"{words} written, {order_read} read"
    figures = (
        Measurement("off by", written.error, "m"),
        Measurement("the next order", written.next_error, "m"),
    )
    yield EngineAnswer(words, figures)


def _order_of(numbers: Array) -> str:
    """Return the order in which four numbers (4,) are those of the turn."""
    errors: dict[str, float] = {}
    for order, quaternion in _QUATERNIONS.items():
        errors[order] = float(np.abs(numbers - quaternion).max())
    return closest(errors).hypothesis


_POSITION = np.array([0.2, -0.1, 0.3])
_SIX_VELOCITIES = np.array([0.7, -0.4, 0.9, 0.5, -1.1, 0.8])
_FOUR_NUMBERS = np.array([0.5, 0.1, -0.7, 0.5])  # some turn; which one is read from the marks
_FOUR_NUMBERS = _FOUR_NUMBERS / np.linalg.norm(_FOUR_NUMBERS)
_SHORT_STEP = 1e-6  # the step [s]; the error of the difference quotient is of its order

_AXES, _POINTS = ("world", "body"), {"body origin": np.zeros(3), "centre of mass": CENTRE}
_PARTS = {
    "order": ("linear first", "angular first"),
    "linear": tuple(f"{axes} axes, {point}" for axes, point in product(_AXES, _POINTS)),
    "angular": tuple(f"{axes} axes" for axes in _AXES),
}


def _predicted(hypothesis: tuple[str, ...], before: Array) -> Array:
    """Return velocities of the marks (3, 3) [m/s], were the six numbers what the hypothesis says.

    Args:
        hypothesis: A choice for each of `_PARTS`.
        before: The marks (3, 3) [m].
    """
    order, linear, angular = hypothesis
    turn = _rotation(before)
    v, w = _SIX_VELOCITIES[:3], _SIX_VELOCITIES[3:]
    if order == "angular first":
        v, w = w, v
    if linear.startswith("body"):
        v = turn @ v
    if angular.startswith("body"):
        w = turn @ w
    point = _POINTS[linear.partition(" axes, ")[2]]
    return np.asarray(v + np.cross(w, (MARKS - point) @ turn.T), dtype=np.float64)


def _rotation(marks: Array) -> Array:
    """Return the body's rotation (3, 3), from where its marks (3, 3) are [m]."""
    x, y = marks[1:] - marks[0]
    return np.array((x, y, np.cross(x, y))).T


def _explained(errors: Mapping[str, float], unit: str, part: str) -> EngineAnswer:
    """Answer a part of the question by the hypothesis that explains it.

    Args:
        errors: How far each hypothesis is from what was measured.
        unit: Of the errors.
        part: Of the question.
    """
    best = closest(errors)
    figures = (
        Measurement("off by", best.error, unit),
        Measurement("else", best.next_error, unit),
    )
    return EngineAnswer(best.hypothesis, figures, part)


@question(
    "What do the position and the six velocity numbers of a free body mean?",
    "Copied from one engine into another, the same numbers are another motion as soon as the "
    "body is turned, or its centre of mass is not at its origin.",
    _POSITION,
    _FOUR_NUMBERS,
    _SIX_VELOCITIES,
    _SHORT_STEP,
)
def velocity(marks: tuple[Array, Array]) -> Iterator[EngineAnswer]:
    """Tell what explains where the marked body is, and how it moved in one short step.

    Args:
        marks: The marks (3, 3) before and after the step [m]. The body was put to a place (3,)
            [m], with four numbers of a turn and six of a velocity.
    """
    before, after = marks
    places: dict[str, float] = {}
    for name, point in _POINTS.items():
        places[name] = float(np.abs(before[0] + _rotation(before) @ point - _POSITION).max())
    yield _explained(places, "m", "position")

    velocities = (after - before) / _SHORT_STEP
    errors: dict[tuple[str, ...], float] = {}
    for hypothesis in product(*_PARTS.values()):
        errors[hypothesis] = float(np.abs(_predicted(hypothesis, before) - velocities).max())
    for k, (part, choices) in enumerate(_PARTS.items()):
        best: dict[str, float] = {}
        for choice in choices:
            best[choice] = min(off for full, off in errors.items() if full[k] == choice)
        yield _explained(best, "m/s", part)


def _depth_first(
    tree: Sequence[tuple[str, str, str]], parent: str = "base", level: int = 0
) -> Iterator[tuple[int, str]]:
    """Yield levels and names of the joints below a link."""
    for name, above, _ in tree:
        if above == parent:
            yield level, name
            yield from _depth_first(tree, name, level + 1)


def _orders(tree: Sequence[tuple[str, str, str]], children: str) -> dict[str, list[str]]:
    """Return the joints in each order, where those of one link come as they do in the tree."""
    walk = list(_depth_first(tree))
    # Those of one level come in the order of a walk in depth, too.
    by_level = sorted(walk, key=itemgetter(0))
    return {
        children: [name for name, _, _ in tree],
        f"depth first, children {children}": [name for _, name in walk],
        f"breadth first, children {children}": [name for _, name in by_level],
    }


ORDERS = _orders(TREE, "as listed") | _orders(sorted(TREE), "by alphabet")


@question(
    "In which order do the joints come, and does a fixed one take a number?",
    "A command in the order of another engine moves the wrong joints. Look joints up by name.",
)
def joints(names: Mapping[str, Sequence[str]]) -> Iterator[EngineAnswer]:
    """Tell which rule gives the engine's names, and whether the fixed joint is among them.

    Args:
        names: Of the joints in the engine's order, by the format of the file.
    """
    for form, joint_names in names.items():
        moving = _without_fixed(joint_names)
        yield EngineAnswer(_rule_of(moving), (Measurement("", tuple(moving)),), form)
        fixed = "takes a number" if FIXED in joint_names else "none"
        count = Measurement("joints with a number", len(joint_names))
        yield EngineAnswer(fixed, (count,), f"fixed joint, {form}")


def _rule_of(moving: Sequence[str]) -> str:
    """Return which of `ORDERS` joints that move come in."""
    for rule, order in ORDERS.items():
        if _without_fixed(order) == moving:
            return rule
    return UNDECIDED


def _without_fixed(names: Sequence[str]) -> list[str]:
    """Return the names of the joints that move."""
    return [name for name in names if name != FIXED]
