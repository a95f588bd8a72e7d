"""Enters quantities of two files into one list, with what each means and where it stands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...engines.description.lines import SourceLine
from ...interface import Array
from ...measures.text import grouped
from .effects import Meaning
from .records import SUBJECTS, ListedDifference, Value

_ORDER = tuple(SUBJECTS)
_MAX_ROUNDING_STEPS = 8  # that may have come together in a figure


@dataclass(frozen=True)
class ElementPlace:
    """An element of two files.

    Attributes:
        kind: What it is, as MJCF calls it.
        name: Its name on the left; on the right, where only that has it.
        left_line, right_line: Where it stands in each file; None where that is not known.
    """

    kind: str
    name: str
    left_line: SourceLine | None = None
    right_line: SourceLine | None = None


@dataclass(frozen=True)
class CompiledCause:
    """The difference of two compiled models that a quantity is of.

    Attributes:
        title: What `..why` calls it.
        refused: Why the right cannot be brought to the left in it; "" where it can.
    """

    title: str = ""
    refused: str = ""


class Listing:
    """One list of what differs by more than rounding.

    Args:
        digits: Numbers that agree to so many are rounded, not different.
    """

    def __init__(self, digits: int) -> None:
        self.tolerance = 0.5 * 10.0 ** (1 - digits)
        self.differences: list[ListedDifference] = []

    def enter(
        self,
        subject: str,
        element: ElementPlace,
        quantity: str,
        values: tuple[Value, Value],
        meaning: Meaning,
        unit: str = "",
        cause: CompiledCause = CompiledCause(),
    ) -> None:
        """Enter a quantity that is not the same, bit for bit, on both sides.

        Args:
            subject: A key of `SUBJECTS`.
            element: What it is of.
            quantity: What of it.
            values: Of the left and of the right; None where a side does not say.
            meaning: What the difference means.
            unit: SI unit of each number.
            cause: The difference of the compiled models that it is of.
        """
        size, usual = _difference_and_scale(*values)
        relative = meaning.relative
        if relative is None:
            scale = max(usual, meaning.scale)
            relative = size / scale if size is not None and scale else math.inf
        if size is not None and relative <= self.tolerance * _MAX_ROUNDING_STEPS:
            return
        left, right = (_text_if_infinite(value) for value in values)
        share = float(min(max(meaning.share, 0.0), 1.0))
        if size is not None and not math.isfinite(size):
            size = None
        kind, name = element.kind, element.name
        left_line, right_line = element.left_line, element.right_line
        effect, matters = meaning.effect, meaning.matters
        title, refused = cause.title, cause.refused
        difference = ListedDifference(
            subject=subject,
            kind=kind,
            element=name,
            quantity=quantity,
            unit=unit,
            left=left,
            right=right,
            size=size,
            share=share,
            effect=effect,
            matters=matters,
            left_line=left_line,
            right_line=right_line,
            cause=title,
            refused=refused,
        )
        self.differences.append(difference)

    def ordered(self) -> tuple[ListedDifference, ...]:
        """Return the differences by subject, the subject with the heaviest one first."""
        by_subject = grouped((row.subject, _weight(row)) for row in self.differences)
        weight = {subject: max(weights) for subject, weights in by_subject.items()}

        def place(row: ListedDifference) -> tuple[float, int, bool, float]:
            heaviest = -round(weight[row.subject], 3)
            order = _ORDER.index(row.subject)
            return heaviest, order, not row.matters, -round(row.share, 6)

        return tuple(sorted(self.differences, key=place))


def _weight(row: ListedDifference) -> float:
    """Return how much a difference weighs; what is said for the record, nothing."""
    return 1 + row.share if row.matters else 0.0


def share_of(values: tuple[Value, Value]) -> float:
    """Return how far two numbers are apart, as a part of the larger one; 0.5 of words."""
    size, usual = _difference_and_scale(*values)
    if size is None or not usual or not math.isfinite(size):
        return 0.5
    return min(size / usual, 1.0)


def _difference_and_scale(left: Value, right: Value) -> tuple[float | None, float]:
    """Return how far two values are apart, and how large they are.

    Args:
        left: A number, several, a word, or None.
        right: The other.

    Returns:
        The norm of the difference of as many numbers, of a range the largest of both ends; None of
        what are not as many numbers. The larger norm of both, of a range at least its width.
    """
    a, b = _as_numbers(left), _as_numbers(right)
    if a is None or b is None or a.shape != b.shape:
        return None, 0.0
    with np.errstate(invalid="ignore"):
        apart = np.where(a == b, 0.0, a - b)
    size = float(np.linalg.norm(apart))
    usual = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
    if apart.size == 2:
        size = float(np.abs(apart).max())
        usual = max(usual, float(np.ptp(a)), float(np.ptp(b)))
    return size, usual


def _as_numbers(value: Value) -> Array | None:
    """Return a value as numbers (n,); None of one that is none."""
    if value is None or isinstance(value, str | bool):
        return None
    return np.atleast_1d(np.asarray(value, dtype=np.float64))


def _text_if_infinite(value: Value) -> Value:
    """Return a value; of an infinite number a word, and of a range without ends, too."""
    if isinstance(value, tuple):
        return value if np.isfinite(value).all() else "none"
    if isinstance(value, float) and math.isinf(value):
        return "unlimited"
    return value
