"""Figures of a comparison as text, in the units that a reader thinks in."""

from __future__ import annotations

import math


def quantity(value: float, kind: str) -> str:
    """A difference as text: degrees, millimetres, joules, seconds or newtons."""
    if math.isnan(value):
        return "none"
    scale, unit = scale_of(kind)
    return f"{figure(value * scale)}{unit}"


def scale_of(kind: str) -> tuple[float, str]:
    """From SI to what is shown: the factor, and the unit as it follows the figure."""
    if kind in ("joint", "tip rotation", "body rotation"):
        return 180.0 / math.pi, "°"
    if kind in ("slide", "tip", "body"):
        return 1000.0, " mm"
    return {"energy": (1.0, " J"), "contact": (1000.0, " ms"), "force": (1.0, " N")}[kind]


def pressed(normal: float, total: float) -> str:
    """With what two bodies press: the sum of the normal forces, and the whole force [N]."""
    return f"pressed with {figure(normal)} N (with friction {figure(total)} N)"


def figure(value: float) -> str:
    """A number with three significant digits; tiny ones with their power of ten."""
    if value == 0:
        return "0"
    if not math.isfinite(value):
        return "no number" if math.isnan(value) else str(value)
    size = abs(value)
    if size < 1e-3 or size >= 1e5:
        return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")
    digits = max(0, 2 - math.floor(math.log10(size)))
    return f"{value:.{min(digits, 4)}f}"


def short_time(seconds: float) -> str:
    """A moment, to the millisecond."""
    return f"{seconds:.3f} s"
