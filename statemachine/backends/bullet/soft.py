"""MuJoCo's soft constraint: how it yields, what it aims at, and its row in the joint dynamics.

[MuJoCo's manual, chapter Computation, section Constraint model.]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...interface import Array

if TYPE_CHECKING:
    from ..compiled.types import MjModel

_TINY = 1e-300  # for a power that is too small for a float


class SoftRow(NamedTuple):
    """One constraint, which has a force F along J.

    Attributes:
        jacobian: J (n,).
        softness: R, by which it yields to its own force.
        reference: What J·a + R·F is to be.
        least, most: Bounds of F.
    """

    jacobian: Array
    softness: float
    reference: float
    least: float
    most: float


class SoftRows(NamedTuple):
    """Several constraints, as arrays with a row for each.

    Attributes:
        jacobian: J (m, n).
        softness: R (m,).
        reference: (m,) what J·a + R·F is to be.
        least, most: (m,) bounds of F.
    """

    jacobian: Array
    softness: Array
    reference: Array
    least: Array
    most: Array

    @classmethod
    def of(cls, rows: Sequence[SoftRow]) -> SoftRows:
        """Put m rows, at least one, into arrays."""
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    def followed_by(self, others: SoftRows) -> SoftRows:
        """Return these constraints, and others after them."""
        return SoftRows(*(np.concatenate(pair) for pair in zip(self, others, strict=True)))


# The curve of a constraint's impedance; damping b, stiffness k and inverse weight.
Soft = tuple[list[float], list[float]]


def soft(solref: Array, solimp: Array, weight: Array, shortest: float) -> list[Soft]:
    """Return the softness of m constraints, from solref (m, 2), solimp (m, 5) and inverse weight
    (m,).
    """
    damping, stiffness = springs(solref, solimp, shortest)
    constants = np.column_stack([damping, stiffness, weight]).tolist()
    return list(zip(curves(solimp), constants, strict=True))


def soft_row(
    kind: Soft,
    jacobian: Array,
    gap: float,
    speed: float,
    bounds: tuple[float, float] = (0.0, math.inf),
    distance: float | None = None,
) -> SoftRow:
    """Return the row of a constraint.

    Args:
        kind: What it is like.
        jacobian: J (n,).
        gap: By how much it is not met.
        speed: J·v.
        bounds: Of its force.
        distance: What its impedance depends on; by default the gap.
    """
    curve, (damping, stiffness, weight) = kind
    strength = impedance(curve, gap if distance is None else distance)
    goal = -damping * speed - stiffness * strength * gap
    return SoftRow(jacobian, softness(strength, weight), goal, *bounds)


def shortest_time(raw: MjModel, off: Mapping[str, bool]) -> float:
    """Return the least time constant of a constraint [s]: two steps, where MuJoCo takes care of
    it.
    """
    return 0.0 if off["refsafe"] else 2 * float(raw.opt.timestep)


def bounds_of(ranges: Array, limited: Any) -> tuple[Array, Array]:
    low, high = np.where(limited[:, None], ranges, [-np.inf, np.inf]).T
    return low, high


def curves(solimp: Array) -> list[list[float]]:
    """Return the rows of solimp, each number within what MuJoCo takes; then the scales of both
    halves.

    Their powers are Python's: the last bits of NumPy's are those of the processor.
    """
    least, most = [1e-4, 1e-4, 1e-15, 1e-4, 1.0], [0.9999, 0.9999, 9e9, 0.9999, 9e9]
    curves = []
    for low, high, width, middle, power in np.clip(solimp, least, most).tolist():
        scales = [math.pow(part, power - 1) or _TINY for part in (middle, 1 - middle)]
        curves.append([low, high, width, middle, power, *scales])
    return curves


def impedance(curve: Sequence[float], distance: float) -> float:
    """Return d(r) of a curve [MuJoCo's manual, chapter Modeling, Solver parameters]."""
    low, high, width, middle, power, rising, falling = curve
    if width <= 1e-15:
        return (low + high) / 2
    x = min(abs(distance) / width, 1.0)
    part = math.pow(x, power) / rising if x <= middle else 1 - math.pow(1 - x, power) / falling
    return low + part * (high - low)


def softness(impedance: float, inverse_weight: float) -> float:
    """Return R, by which a constraint yields to its own force."""
    return max((1 - impedance) / impedance * inverse_weight, 1e-15)


def springs(solref: Array, solimp: Array, shortest: float) -> tuple[Array, Array]:
    """Return the damping b and stiffness k of the reference acceleration, of solref (n, 2)."""
    time, ratio = solref.T
    most = np.clip(solimp[:, 1], 1e-4, 0.9999)
    given = time <= 0  # then they are stiffness and damping, negated
    time = np.where(given, 1.0, np.maximum(time, shortest))
    damping = np.where(given, -ratio / most, 2 / (most * time))
    stiffness = np.where(
        given, -solref[:, 0] / most**2, 1 / (most * time * np.where(given, 1, ratio)) ** 2
    )
    return damping, stiffness
