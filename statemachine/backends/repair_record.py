"""What was changed of a file so that MuJoCo compiles it: one value, or one element."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import Array

# The mass [kg] and the moment of inertia [kg m^2] that a body gets which moves and has none. MuJoCo
# refuses what is not above 1e-15 (mjMINVAL).
LEAST = 1e-12

Stated = float | tuple[float, ...] | str | None


@dataclass(frozen=True)
class Repair:
    """One value of a file that was changed, or one element that was deleted, so that it compiles.

    Attributes:
        kind: Of the element, as MJCF calls it: "body", "mesh", "texture", "hfield", "skin", "geom",
            "site", "pair", "sensor".
        name: Of the element; "body 3" for one without a name, by its place in the file.
        body: Name of the body that has the element; "" for what is of no body.
        quantity: "inertia", the three principal moments, in the order of the axes of the file (ixx,
            iyy, izz); "mass"; "file" of a mesh, a texture, a height field or a skin; "mesh" or
            "hfield" of a geom or a site; "geom" of a pair or a sensor that refers to a deleted one.
        stated: What the file says, in `unit`: a number, three moments, a name; None where it says
            nothing.
        used: What the compiled model has instead; None where the element was deleted.
        unit: "kg", "kg m^2", or "" of a name.
        reason: Why, in one line; of the element that has the fault as MuJoCo says it.
        line: Of the file, where MuJoCo reports it; None where it does not, as of a URDF.
    """

    kind: str
    name: str
    body: str
    quantity: str
    stated: Stated
    used: Stated
    unit: str
    reason: str
    line: int | None = None

    @property
    def is_deleted(self) -> bool:
        """Tell whether the element is not in the compiled model."""
        return self.used is None

    @property
    def is_massless(self) -> bool:
        """Tell whether it gave a body a mass or an inertia that the file does not give it."""
        if self.kind != "body":
            return False
        return self.quantity == "mass" or not (_numbers(self.stated) != 0).any()

    @property
    def factor(self) -> float:
        """Return by which factor, at least 1, the used number differs from the stated one.

        Of three moments that of the one that changed most; infinite where a number was zero or
        negative; NaN where no numbers are compared.
        """
        stated, used = _numbers(self.stated), _numbers(self.used)
        if not len(stated) or len(stated) != len(used):
            return math.nan
        if (stated <= 0).any() or (used <= 0).any():
            return math.inf
        ratios = used / stated
        return float(np.maximum(ratios, 1 / ratios).max())


def _numbers(value: Stated) -> Array:
    """Return the numbers of a stated or a used value, (n,); none of a name."""
    if value is None or isinstance(value, str):
        return np.empty(0)
    return np.atleast_1d(np.asarray(value, dtype=np.float64))


def label_of(kind: str, element: Any, elements: Iterable[Any]) -> str:
    """Return the name of an element, or "geom 4" by its place among all of its kind."""
    if element.name:
        return str(element.name)
    places = [k for k, other in enumerate(elements) if other == element]
    return f"{kind} {places[0]}" if places else kind
