"""What an arm is told: chirps of each joint, or targets as a hand moves them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from statemachine.interface import Array

Motion = Literal["chirps", "hand"]
CENTRE = np.array([0.0, -0.6, 0.6, 0.3, 0.0, 0.6])  # rad, of the joints of so101
AMPLITUDE = np.array([0.5, 0.35, 0.45, 0.5, 0.6, 0.35])  # rad
_SLOWEST, _FASTEST = 0.15, 0.9  # Hz, of the first joint; each next one ends faster
_FASTER = 0.13  # Hz
_BETWEEN_TARGETS = 1.2  # s, of a hand
_SPREAD, _WIDEST = 0.6, 1.3  # of a hand's targets, by AMPLITUDE


def commands(motion: Motion, times: Array, rng: np.random.Generator) -> Array:
    """Return the commanded angles at some times, (K, 6) [rad]."""
    if motion == "chirps":
        return CENTRE + AMPLITUDE * _chirps(times, rng)
    return CENTRE + AMPLITUDE * _hand(times, rng)


def _chirps(times: Array, rng: np.random.Generator) -> Array:
    """Return sines that become faster, between -1 and 1; each episode has other phases."""
    end = times[-1]
    phases = rng.uniform(0.0, 2.0 * np.pi, len(CENTRE))
    columns: list[Array] = []
    for joint, phase in enumerate(phases):
        rise = (_FASTEST + _FASTER * joint) / (2.0 * end)
        turns = _SLOWEST * times + rise * times**2
        columns.append(np.sin(2.0 * np.pi * turns + phase))
    return np.stack(columns, axis=1)


def _hand(times: Array, rng: np.random.Generator) -> Array:
    """Return smooth curves through drawn targets."""
    knots = np.linspace(0.0, times[-1], max(4, int(times[-1] / _BETWEEN_TARGETS)))
    targets = rng.normal(0.0, _SPREAD, (len(knots), len(CENTRE)))
    return np.clip(CubicSpline(knots, targets)(times), -_WIDEST, _WIDEST)
