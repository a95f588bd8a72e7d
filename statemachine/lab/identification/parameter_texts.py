"""Parameters of an arm and their figures, in the words and units that people use."""

from __future__ import annotations

import math

from ...measures.text import (
    NO_NUMBER,
    degrees,
    figure,
    fixed,
    percent,
    rough,
    significant,
    unit_suffix,
)
from .results import UNITS, FittedParameter, Hypothesis, Kind, Reason

# Of what the model has none of: from the unit of a result to the one that is read, that, and how
# many decimals it has.
_ADDED: dict[Kind, tuple[float, str, int]] = {
    "offset": (math.degrees(1.0), "°", 2),
    "delay": (1e3, "ms", 1),
    "payload": (1e3, "g", 1),
}
REASON_WORDS: dict[Reason, str] = {
    "too little information": "information",
    "residual above the floor": "residual",
    "starts disagree": "starts",
    "does not hold elsewhere": "elsewhere",
    "play fits as well": "play",
    "friction of the load fits as well": "load",
    "a tilted base fits as well": "tilt",
}


def name_of_parameter(parameter: FittedParameter) -> str:
    """Return the name of a parameter, and of which joint."""
    return parameter.kind if parameter.joint is None else f"{parameter.kind} of {parameter.joint}"


def unit_text(kind: Kind) -> str:
    """Return the unit in which a parameter is read."""
    return _ADDED[kind][1] if kind in _ADDED else UNITS[kind]


def number_text(kind: Kind, value: float) -> str:
    """Return a figure of a parameter without its unit.

    Args:
        kind: Which parameter.
        value: Its figure, in the unit of `UNITS`.
    """
    if kind in _ADDED:
        factor, _, decimals = _ADDED[kind]
        return fixed(value * factor, decimals)
    return figure(value)


def half_width_text(parameter: FittedParameter) -> str:
    """Return half of a parameter's interval: by its figure, or as `number_text` of an added one."""
    half = 0.5 * (parameter.high - parameter.low)
    if parameter.kind in _ADDED:
        return number_text(parameter.kind, half)
    return f"{rough(100.0 * half / parameter.fitted)} %"


def figure_text(kind: Kind, value: float) -> str:
    """Return a figure of a parameter with its unit; arguments as of `number_text`."""
    return f"{number_text(kind, value)}{unit_suffix(unit_text(kind))}"


def size_text(hypothesis: Hypothesis) -> str:
    """Return the size of what the model lacks, with its unit; a dash of what has none."""
    if hypothesis.size is None:
        return NO_NUMBER
    if hypothesis.unit == "rad":
        return degrees(hypothesis.size, 2)
    return f"{percent(hypothesis.size)} {hypothesis.unit}"


def interval_text(parameter: FittedParameter) -> str:
    """Return the interval of a parameter, without its unit."""
    ends = [number_text(parameter.kind, end) for end in (parameter.low, parameter.high)]
    return " to ".join(ends)


def factor_text(parameter: FittedParameter) -> str:
    """Return how many times the model's figure the fitted one is; a dash where it has none."""
    if parameter.kind in _ADDED or parameter.model == 0.0:
        return NO_NUMBER
    return f"×{significant(parameter.fitted / parameter.model, 2)}"
