"""Play between a joint and its encoder: the encoder stays until the play is crossed.

It is the play operator of hysteresis (A. Visintin, Differential Models of Hysteresis, 1994).
"""

from __future__ import annotations

import numpy as np

from ...interface import Array


def behind_play(angles: Array, widths: Array) -> Array:
    """Return what encoders behind play show, (W, T, n) [rad].

    An encoder follows its joint at half of the play's width, and where the joint turns back it
    stays until the whole of it is crossed. It begins in the middle.

    Args:
        angles: (W, T, n) of joints, one time after another; or (1, T, n) for all worlds [rad].
        widths: (n,) of the play; or (W, n), (W, 1) of each world [rad].
    """
    half = 0.5 * np.atleast_2d(widths)[:, None]
    low, high = angles - half, angles + half
    shown = np.empty_like(low)
    shown[:, 0] = angles[:, 0]
    for time in range(1, low.shape[1]):
        held = np.maximum(shown[:, time - 1], low[:, time])
        np.minimum(held, high[:, time], out=shown[:, time])
    return shown
