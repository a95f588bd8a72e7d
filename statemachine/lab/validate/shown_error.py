"""An error of a case, as it is read: all of a column in one unit."""

from __future__ import annotations

import math

from ...measures.text import NO_NUMBER, display_unit, figure


def error_text(error: float | None, unit: str) -> str:
    """Return an error as it is read; a relative one in per cent where it is large enough.

    Args:
        error: [unit]; None where there is none.
        unit: SI; "" of a relative error.
    """
    if error is None:
        return NO_NUMBER
    if math.isinf(error):
        return "no event"
    if unit == "" and abs(error) >= 1e-4:
        return f"{figure(100.0 * error)} %"
    factor, name = display_unit(unit)  # one unit for a column, however large
    return "none" if math.isnan(error) else f"{figure(error * factor)}{name}"
