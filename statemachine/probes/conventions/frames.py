"""Numbers and their order: of a quaternion, of a velocity, of the joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations, product
from operator import itemgetter

import numpy as np

from ...engines.measured import Measurement
from ...engines.samples import CENTRE, FIXED, MARKS, TREE
from ...interface import Array
from .answers import UNDECIDED, EngineAnswer, closest, question

# A turn whose four numbers are all different: about (1, 2, 3), by 1 rad.
_ANGLE, _AXIS = 1.0, np.array([1.0, 2, 3]) / np.sqrt(14)
_NUMBERS = dict(zip("wxyz", (np.cos(_ANGLE / 2), *np.sin(_ANGLE / 2) * _AXIS), strict=True))
_FOURS = {"".join(order): [_NUMBERS[part] for part in order] for order in permutations("wxyz")}


def _turned(point: Array) -> Array:
    """Rodrigues' formula: no quaternion in it."""
    cos, sin = np.cos(_ANGLE), np.sin(_ANGLE)
    along = _AXIS * _AXIS.dot(point) * (1 - cos)
    return point * cos + np.cross(_AXIS, point) * sin + along


@question(
    "In which order do the four numbers of a quaternion stand?",
    "Four numbers in the wrong order are still a rotation, only another one: nothing complains. "
    "Do not test with a third of a turn about 1 1 1: its four numbers are the same.",
    list(_FOURS.values()),
)
def quaternion(turned: Sequence[tuple[Array, Array]]) -> Iterator[EngineAnswer]:
    """The order in which four numbers turn the marks as they should.

    Args:
        turned: For each four numbers that the marked body was turned by, the marks (3, 3) about
            the first of them [m], and the four numbers that are read.
    """
    should = np.array([_turned(mark) for mark in MARKS])
    by_order = dict(zip(_FOURS, turned, strict=True))
    words, off, following = closest(
        {order: float(np.abs(marks - should).max()) for order, (marks, _) in by_order.items()}
    )
    if words != UNDECIDED:
        _, read = by_order[words]
        reads, _, _ = closest(
            {order: float(np.abs(read - four).max()) for order, four in _FOURS.items()}
        )
        words = words if reads == words else f"{words} written, {reads} read"
    figures = Measurement("off by", off, "m"), Measurement("the next order", following, "m")
    yield EngineAnswer(words, figures)


_PLACE = np.array([0.2, -0.1, 0.3])
_SIX = np.array([0.7, -0.4, 0.9, 0.5, -1.1, 0.8])
_FOUR = np.array([0.5, 0.1, -0.7, 0.5])  # some turn; which one is read from the marks
_FOUR = _FOUR / np.linalg.norm(_FOUR)
_SHORT = 1e-6  # the step [s]; the error of the difference quotient is of its order

_AXES, _POINTS = ("world", "body"), {"body origin": np.zeros(3), "centre of mass": CENTRE}
_PARTS = {
    "order": ("linear first", "angular first"),
    "linear": tuple(f"{axes} axes, {point}" for axes, point in product(_AXES, _POINTS)),
    "angular": tuple(f"{axes} axes" for axes in _AXES),
}


def _predicted(hypothesis: tuple[str, ...], before: Array) -> Array:
    """Velocities of the marks (3, 3) [m/s], were the six numbers what the hypothesis says."""
    order, linear, angular = hypothesis
    turn = _turn(before)
    halves = (_SIX[:3], _SIX[3:])
    v, w = halves if order == "linear first" else halves[::-1]
    v = turn @ v if linear.startswith("body") else v
    w = turn @ w if angular.startswith("body") else w
    point = _POINTS[linear.partition(" axes, ")[2]]
    return np.asarray(v + np.cross(w, (MARKS - point) @ turn.T), dtype=np.float64)


def _turn(marks: Array) -> Array:
    """The body's rotation (3, 3), from where its marks are."""
    x, y = marks[1:] - marks[0]
    return np.array((x, y, np.cross(x, y))).T


def _nearest(off: Mapping[str, float], unit: str, part: str) -> EngineAnswer:
    """The hypothesis that explains a part of the question."""
    words, residual, following = closest(off)
    figures = Measurement("off by", residual, unit), Measurement("else", following, unit)
    return EngineAnswer(words, figures, part)


@question(
    "What do the position and the six velocity numbers of a free body mean?",
    "Copied from one engine into another, the same numbers are another motion as soon as the "
    "body is turned, or its centre of mass is not at its origin.",
    _PLACE,
    _FOUR,
    _SIX,
    _SHORT,
)
def velocity(marks: tuple[Array, Array]) -> Iterator[EngineAnswer]:
    """What explains where the marked body is, and how it moved in one short step, part by part.

    Args:
        marks: The marks (3, 3) before and after the step [m]. The body was put to a place (3,)
            [m], with four numbers of a turn and six of a velocity.
    """
    before, after = marks
    moved = (after - before) / _SHORT
    off = {
        hypothesis: float(np.abs(_predicted(hypothesis, before) - moved).max())
        for hypothesis in product(*_PARTS.values())
    }
    places = {
        name: float(np.abs(before[0] + _turn(before) @ point - _PLACE).max())
        for name, point in _POINTS.items()
    }
    yield _nearest(places, "m", "position")
    for k, (part, meanings) in enumerate(_PARTS.items()):
        best = {words: min(off[full] for full in off if full[k] == words) for words in meanings}
        yield _nearest(best, "m/s", part)


def _depth_first(
    tree: Sequence[tuple[str, str, str]], parent: str = "base", level: int = 0
) -> Iterator[tuple[int, str]]:
    """Levels and names of the joints below a link."""
    for name, above, _ in tree:
        if above == parent:
            yield level, name
            yield from _depth_first(tree, name, level + 1)


def _orders(tree: Sequence[tuple[str, str, str]], children: str) -> dict[str, list[str]]:
    """The joints in each order, where those of one link come as they do in the tree."""
    walk = list(_depth_first(tree))
    return {
        children: [name for name, _, _ in tree],
        f"depth first, children {children}": [name for _, name in walk],
        # Those of one level come in the order of a walk in depth, too.
        f"breadth first, children {children}": [
            name for _, name in sorted(walk, key=itemgetter(0))
        ],
    }


ORDERS = _orders(TREE, "as listed") | _orders(sorted(TREE), "by alphabet")


@question(
    "In which order do the joints come, and does a fixed one take a number?",
    "A command in the order of another engine moves the wrong joints. Look joints up by name.",
)
def joints(names: Mapping[str, Sequence[str]]) -> Iterator[EngineAnswer]:
    """Which rule gives the engine's names, by format; and whether the fixed joint is among them."""
    for form, listed in names.items():
        moving = [name for name in listed if name != FIXED]
        words = next(
            (rule for rule, order in ORDERS.items() if [n for n in order if n != FIXED] == moving),
            UNDECIDED,
        )
        yield EngineAnswer(words, (Measurement("", tuple(moving)),), form)
        counted = Measurement("joints with a number", len(listed))
        fixed = "takes a number" if FIXED in listed else "none"
        yield EngineAnswer(fixed, (counted,), f"fixed joint, {form}")
