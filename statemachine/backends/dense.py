"""Small dense algebra that gives the same bits on every processor of a kind.

NumPy's products and solutions go through a BLAS that chooses its kernels by the
processor, and their last bits differ. Those of `compiled.algebra` do not, and are as quick at
these sizes.
"""

from __future__ import annotations

import numpy as np

from ..interface import Array
from .compiled.algebra import dot, factored, product, solved, times

__all__ = ["dot", "factored", "pivoted", "product", "solved", "times"]

_PIVOTS, _SWEEPS, _SETTLED = 30, 500, 1e-9


def pivoted(matrix: Array, right: Array, least: Array, most: Array, start: Array) -> Array:
    """Return F with matrix·F = right where F is between its bounds; elsewhere F is at a bound.

    At its lower bound a row may have matrix·F > right, at its upper one <. Rows change
    between free and bounded until none has to; where that goes round in circles,
    projected Gauss-Seidel ends it, for the matrix is positive definite.
    """
    force = np.minimum(np.maximum(start, least), most)
    free = (force > least) & (force < most) | (least == 0) & (most > 0)
    for _ in range(_PIVOTS):
        if free.all():
            force = solved(factored(matrix.copy()), right.copy())
            if ((least <= force) & (force <= most)).all():
                return force
        else:
            inside, held = free.nonzero()[0], (~free).nonzero()[0]
            rows = inside[:, None]
            bound = times(matrix[rows, held], force[held])
            factor = factored(matrix[rows, inside])
            force[inside] = solved(factor, right[inside] - bound)
        outside = free & ((force < least) | (force > most))
        force = np.minimum(np.maximum(force, least), most)
        miss = times(matrix, force) - right
        back = ~free & (least < most) & np.where(force <= least, miss < 0, miss > 0)
        if not (outside.any() or back.any()):
            return force
        free = free & ~outside | back
    for _ in range(_SWEEPS):
        before = force.copy()
        for k in range(len(force)):
            new = force[k] - (dot(matrix[k], force) - right[k]) / matrix[k, k]
            force[k] = min(max(new, least[k]), most[k])
        if np.abs(force - before).max() < _SETTLED * np.abs(force).max():
            break
    return force
