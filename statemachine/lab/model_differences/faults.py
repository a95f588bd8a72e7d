"""What had to be mended in a file before it compiled."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...engines.description.lines import SourceLine
from ...engines.description.reading import ModelReading
from .records import FileFault

if TYPE_CHECKING:
    from ...backends.compiled.repairs import Repair

_UNITS = {"kg m^2": "kg m²"}


def faults_of(readings: Sequence[ModelReading]) -> Iterator[FileFault]:
    """Yield each fault of two files: what is stated, and what a compiler can use instead.

    Args:
        readings: The left and the right.
    """
    left, right = readings
    for repair in left.repairs:
        yield _fault(left, "left", repair)
    for repair in right.repairs:
        yield _fault(right, "right", repair)


def not_compared(readings: Sequence[ModelReading]) -> Iterator[str]:
    """Yield what of two files was not compared since it cannot be read, in sentences."""
    for which, reading in zip(("left", "right"), readings, strict=True):
        for repair in reading.repairs:
            if repair.kind == "geom" and repair.is_deleted:
                yield (
                    f"the mesh {repair.stated!r} of {repair.body!r} on the {which} cannot be read: "
                    "its shape was not compared"
                )


def _fault(reading: ModelReading, side: str, repair: Repair) -> FileFault:
    """Return what was mended as a fault of a side."""
    unit = _UNITS.get(repair.unit, repair.unit)
    factor = repair.factor if math.isfinite(repair.factor) else None
    kind, element, quantity = repair.kind, repair.name, repair.quantity
    stated, used, reason = repair.stated, repair.used, repair.reason
    line = _line(reading, repair)
    return FileFault(
        side=side,
        kind=kind,
        element=element,
        quantity=quantity,
        unit=unit,
        stated=stated,
        used=used,
        factor=factor,
        reason=reason,
        line=line,
    )


def _line(reading: ModelReading, repair: Repair) -> SourceLine | None:
    """Return where the element of a fault stands."""
    if reading.lines is None:
        return None
    line = reading.lines.find(repair.kind, repair.name)
    if line is None and repair.body:
        line = reading.lines.find("body", repair.body)
    return line
