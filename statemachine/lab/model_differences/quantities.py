"""Quantities of compiled models as a reader wants them: each figure with its own unit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from ...engines.description.records import OF_A_SLIDE
from ...engines.records import DifferingQuantity
from .records import Value

# What the two numbers of a solref are where they are positive, and their units.
_SOLREF_PARTS = (("timeconst", "s"), ("dampratio", ""))


def split_solref(values: Iterable[DifferingQuantity]) -> Iterator[DifferingQuantity]:
    """Yield quantities, of each positive solref its time constant and its damping ratio.

    One that is negative is a stiffness and a damping of the solver: it stays as it is.

    Args:
        values: The quantities of one difference.
    """
    for value in values:
        left, right = _entries(value.left), _entries(value.right)
        is_solref = "solref" in value.quantity and left and right
        if not is_solref or min(*left, *right) <= 0:
            yield value
            continue
        # Both have as many: those up to the last that differs.
        for (name, unit), ours, theirs in zip(_SOLREF_PARTS, left, right, strict=False):
            if ours != theirs:
                yield DifferingQuantity(f"{value.quantity} {name}", ours, theirs, unit)


def _entries(value: Value) -> tuple[float, ...]:
    """Return the numbers of a value; none of what is none."""
    if isinstance(value, tuple):
        return value
    if value is None or isinstance(value, str | bool):
        return ()
    return (float(value),)


def of_free_joint(value: DifferingQuantity) -> DifferingQuantity:
    """Return a quantity of a free joint with the units of its motions.

    Args:
        value: The quantity with the unit of a rotation.
    """
    return replace(value, unit=unit_of_free_joint(value.unit))


def unit_of_free_joint(of_a_hinge: str) -> str:
    """Return the units of a quantity of a free joint: three of its motions are translations.

    Args:
        of_a_hinge: The unit of the quantity of a hinge; one that a slide has too stays.
    """
    of_a_slide = OF_A_SLIDE.get(of_a_hinge)
    return of_a_hinge if of_a_slide is None else f"{of_a_slide} and {of_a_hinge}"
