"""Columns of golden data."""

from __future__ import annotations

import numpy as np


def columns(table: np.ndarray, *names: str) -> np.ndarray:
    """Return columns of a table side by side: (rows, names)."""
    return np.stack([table[name] for name in names], axis=1)


def angles(table: np.ndarray) -> np.ndarray:
    """Return the joint angles of a table: (rows, 6) [rad]."""
    return columns(table, *(f"q{i}_rad" for i in range(6)))
