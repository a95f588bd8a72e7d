"""The kinds of quantities that two runs are compared by: units, words, tolerances."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import BadInputError, unknown_name


@dataclass(frozen=True)
class Quantity:
    """A kind of quantity.

    Attributes:
        name: As in an Agreement and in `--tolerance`.
        unit: SI unit.
        plural: What several of the kind are called.
        moves: Whether it says where something is.
        own: Whether it is a coordinate of its own, and nothing that follows from others.
    """

    name: str
    unit: str
    plural: str
    moves: bool = False
    own: bool = False


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("joint", "rad", "joints", moves=True, own=True),
        Quantity("slide", "m", "slides", moves=True, own=True),
        Quantity("tip", "m", "fingertip", moves=True),
        Quantity("tip rotation", "rad", "rotation of the fingertip", moves=True),
        Quantity("body", "m", "free bodies", moves=True, own=True),
        Quantity("body rotation", "rad", "rotation of free bodies", moves=True, own=True),
        Quantity("energy", "J", "energy"),
        Quantity("contact", "s", "first touches"),
        Quantity("force", "N", "normal forces"),
    )
}


@dataclass(frozen=True)
class Tolerance:
    """A difference that does not matter: how much [SI], and the reason."""

    value: float
    reason: str


# What a tolerance is given in: the suffix, its size in SI, and the SI unit.
_SUFFIXES = (
    ("deg", np.pi / 180, "rad"),
    ("rad", 1.0, "rad"),
    ("mm", 1e-3, "m"),
    ("cm", 1e-2, "m"),
    ("ms", 1e-3, "s"),
    ("mJ", 1e-3, "J"),
    ("m", 1.0, "m"),
    ("s", 1.0, "s"),
    ("J", 1.0, "J"),
    ("N", 1.0, "N"),
)


def parse_tolerances(words: Iterable[str]) -> dict[str, float]:
    """Tolerances [SI] by kind, from words like "joint=0.5deg", "tip=2mm", "energy=0.01J".

    Raises:
        BadInputError: A word is none.
        UnknownNameError: There is no such kind of quantity.
    """
    tolerances = {}
    for word in words:
        kind, _, text = word.partition("=")
        kind = kind.replace("-", " ")
        if kind not in QUANTITIES:
            raise unknown_name("kind of quantity", kind, QUANTITIES)
        unit, scale = QUANTITIES[kind].unit, 0.0
        for suffix, factor, of in _SUFFIXES:
            if text.endswith(suffix):
                text, scale = text.removesuffix(suffix), factor
                if of != unit:
                    raise BadInputError(f"{kind} is measured in {_units(unit)}, not in {suffix}")
                break
        if not scale:
            raise BadInputError(f"{word!r} needs a unit: {kind} is measured in {_units(unit)}")
        try:
            value = float(text) * scale
        except ValueError:
            value = float("nan")
        if not (np.isfinite(value) and value > 0):
            raise BadInputError(f"a tolerance reads like joint=0.5deg or tip=2mm; got {word!r}")
        tolerances[kind] = value
    return tolerances


def _units(unit: str) -> str:
    """What a quantity may be given in."""
    return ", ".join(suffix for suffix, _, of in _SUFFIXES if of == unit)
