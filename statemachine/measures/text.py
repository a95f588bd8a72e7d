"""Numbers and lists as text, in the units that a reader thinks in: degrees and millimetres."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

from ..installed import ENGINES

K = TypeVar("K")
V = TypeVar("V")
NO_NUMBER = "–"  # where there is no number
SHOWN_AS_TINY = 1e-6  # what is less, in the unit that is read, is only called so
_DISPLAY_UNITS = {"rad": (180.0 / math.pi, "°"), "m": (1e3, "mm"), "s": (1e3, "ms")}


def display_unit(unit: str) -> tuple[float, str]:
    """Return the factor from an SI unit to the one that is read, and that unit behind a figure."""
    factor, name = _DISPLAY_UNITS.get(unit, (1.0, unit))
    return factor, unit_suffix(name)


def unit_suffix(unit: str) -> str:
    """Return a unit as it follows a figure: " mm", "°"."""
    return unit if unit in ("", "°") else f" {unit}"


def quantity(value: float | None, unit: str) -> str:
    """Format a value [SI unit] with three significant digits, in the unit that is read.

    From 1000 mm or ms on that is m or s.
    """
    if value is None:
        return NO_NUMBER
    if math.isnan(value):
        return "none"
    factor, name = display_unit(unit)
    if unit in ("m", "s") and abs(value) >= 1.0:
        factor, name = 1.0, unit_suffix(unit)
    return f"{figure(value * factor)}{name}"


def rounded(value: float, unit: str, digits: int = 3) -> str:
    """Format a value [SI unit] with some significant digits, without zeros at the end."""
    factor, name = display_unit(unit)
    return f"{significant(value * factor, digits)}{name}"


def distance(size: float, unit: str, digits: int = 3) -> str:
    """Format a size as `rounded` does; what is below a millionth is only called so."""
    factor, name = display_unit(unit)
    return (
        rounded(size, unit, digits)
        if size * factor >= SHOWN_AS_TINY
        else f"below {SHOWN_AS_TINY:g}{name}"
    )


def rough(value: float, unit: str = "") -> str:
    """Format a size [SI unit] with two digits, or its order of magnitude where it is tiny."""
    factor, name = display_unit(unit)
    value *= factor
    if not math.isfinite(value):
        return f"beyond all{name}"
    if value >= 100:
        return f"{value:.0f}{name}"
    return f"{value:.2g}{name}" if value >= 1e-3 or value == 0 else f"{value:.0e}{name}"


def figure(value: float) -> str:
    """Format a number with three significant digits; tiny ones with their power of ten."""
    if not math.isfinite(value):
        return "no number" if math.isnan(value) else str(value)
    size = abs(value)
    if size and not 1e-3 <= size < 1e5:
        return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")
    digits = 2 - math.floor(math.log10(size)) if size else 0
    return f"{value:z.{min(max(digits, 0), 4)}f}"


def significant(value: float, digits: int = 4) -> str:
    """Format a number with some significant digits, without a power of ten below a million."""
    text = f"{value:z.{digits}g}"
    return f"{float(text):.0f}" if "e+0" in text and abs(value) < 1e6 else text


def fixed(value: float, decimals: int) -> str:
    """Format a number with some decimals; what rounds to zero has no sign."""
    return f"{value:z.{decimals}f}"


def signed(value: float | None, decimals: int = 4) -> str:
    """Format a number with its sign; what rounds to zero has none."""
    if value is None:
        return NO_NUMBER
    text = f"{value:+.{decimals}f}"
    return text[1:] if float(text) == 0 else text


def vector(values: Iterable[float], decimals: int = 4) -> str:
    """Format components in brackets; what rounds to zero has no sign."""
    return "[" + " ".join(fixed(float(value), decimals) for value in values) + "]"


def numbers(values: Iterable[float]) -> str:
    """Format numbers in a row, as short as they are exact to six digits."""
    return " ".join(f"{value:g}" for value in values)


def joint_difference(size: float, slide: bool) -> str:
    """Format a difference of a joint's positions [rad; of a slide, m]."""
    return distance(size, "m" if slide else "rad", 2)


def degrees(radians: float, decimals: int = 2) -> str:
    """Format an angle [rad] in degrees."""
    return f"{fixed(math.degrees(radians), decimals)}°"


def millimetres(metres: float, decimals: int = 2) -> str:
    """Format a length [m] in millimetres."""
    return f"{fixed(metres * 1e3, decimals)} mm"


def position(value: float, slide: bool, decimals: int = 2) -> str:
    """Format a joint's position: a hinge's [rad] in degrees, a slide's [m] in millimetres."""
    return millimetres(value, decimals) if slide else degrees(value, decimals)


def milliseconds(seconds: float, digits: int = 4) -> str:
    """Format a timestep [s] in milliseconds, to some significant digits."""
    return f"{significant(1000 * seconds, digits)} ms"


def short_time(seconds: float) -> str:
    """Format a time of a run [s], to the millisecond."""
    return f"{seconds:.3f} s"


def duration(seconds: float) -> str:
    """Format a wall time [s] in the unit that reads best."""
    for factor, unit in ((1e6, "µs"), (1e3, "ms")):
        if seconds * factor < 1000:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds:.3g} s"


def percent(part: float | None) -> str:
    """Format a fraction of a whole as a percentage; of a small one only that it is small.

    What is ten times the whole or more is a number of times.
    """
    if part is None:
        return NO_NUMBER
    value = 100 * part
    if 0 < abs(value) < 0.05:
        return "< 0.1 %"
    if 99.95 <= value < 100:
        return "> 99.9 %"
    if abs(value) >= 1000:
        return f"{part:.0f} times"
    return f"{value:.1f} %" if value else "0 %"


def count(number: int, thing: str, zero: str = "0") -> str:
    """Format a number of things: "1 step", "2,000 steps"."""
    things = thing if number == 1 else f"{thing}s"
    return f"{number:,} {things}" if number else f"{zero} {things}"


def versions_of(versions: Mapping[str, str]) -> str:
    """Return engines and packages with their versions, in a row."""
    return ", ".join(f"{name} {version}".strip() for name, version in versions.items())


def listed(words: Sequence[str]) -> str:
    """Join words: "a, b and c"."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} and {words[-1]}"


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """Group values by key, keys in the order in which they first come."""
    groups: dict[K, list[V]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def few(words: Sequence[str], most: int = 3, between: str = ", ") -> str:
    """Join the first of some words, and how many more there are: "a, b, c and 4 more"."""
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return between.join(words[:most]) + more


def on_label(label: str) -> str:
    """Return where something is seen: "on " an engine or a file, "with " an option."""
    is_option = "=" in label or label.endswith(" of the file")
    return f"{'with' if is_option else 'on'} {label}"


def capital(text: str) -> str:
    """Capitalize a text; the name of an engine or a file is left as it is."""
    first = text.partition(" ")[0].rstrip(",:")
    is_name = first in ENGINES or not first.replace("-", "").isalpha()
    return text if is_name else text[:1].upper() + text[1:]


def sentence(text: str) -> str:
    """Return a text with a capital first and a full stop last."""
    text = capital(text)
    return text if text.endswith(".") else f"{text}."


def command(words: Iterable[str], *options: tuple[str, object, object]) -> str:
    """Return a command as one types it.

    Args:
        words: What stands in any case.
        options: A flag, its value, and the value that needs no flag.
    """
    typed = [*words]
    for flag, value, usual in options:
        if value != usual:
            typed.append(flag)
            if value is not True:
                typed.append(str(value))
    return " ".join(map(shlex.quote, typed))
