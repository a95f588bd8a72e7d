"""What a file of a trace may hold: how much, and of which kind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TraceError

# Bytes that a trace may unfold into: this many, or so many times the size of its file.
# Recorded runs are 2 to 3 times as large as their files.
_UNFOLDED, _TIMES, _MOST = 2**28, 100, 2**32
WHOLE = ("contact_row", "contact_geom")  # columns of whole numbers
# No number of a run is larger, and what is computed from smaller ones stays finite.
LARGEST = 1e100


def check_size(unfolded: int, path: Path) -> None:
    """Refuse a file that unfolds into more than a recorded run would.

    Raises:
        TraceError: It does.
    """
    most = min(max(_UNFOLDED, _TIMES * path.stat().st_size), _MOST)
    if unfolded > most:
        raise TraceError(
            f"unfolds into {unfolded / 2**20:,.0f} MB; a file of this size may into "
            f"{most / 2**20:,.0f}"
        )


def as_column(name: str, array: Any) -> Any:
    """An array of a file as a column: int64, or float64."""
    return np.asarray(array, dtype=np.int64 if name in WHOLE else np.float64)
