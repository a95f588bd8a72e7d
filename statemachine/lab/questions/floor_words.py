"""What is said of the chaos floor: how it was made, how high it is, which gaps may be chance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...measures.text import few, listed, quantity, rounded, short_time
from ...show import report_template as template
from ...show.blocks import Block
from ...show.report_template import if_true, slots_of
from ..compare import Comparison
from ..compare.chaos import CLEAR, Chance, ChaosFloor

if TYPE_CHECKING:
    pass
from .compared_names import name_of, short_labels

_NAMED = 6  # quantities in a sentence


def floor_sides(comparison: Comparison, floor: ChaosFloor) -> str:
    """The sides that were run again for the chaos floor: both, or the one that is not recorded."""
    left, right = short_labels(comparison)
    if len(floor.sides) > 1:
        return "each side"
    return left if floor.sides == (0,) else right


def floor_words(comparison: Comparison, floor: ChaosFloor) -> list[Block]:
    """Say how the floor was made, how high it is, and which gaps may be chance."""
    return template.blocks(
        "lab/questions/floor",
        clear=f"{CLEAR:g}",
        **slots_of(_perturbed_of(comparison, floor), _chances_of(floor)),
    )


@dataclass(frozen=True)
class _Perturbed:
    """The runs that a chaos floor is made of.

    Attributes:
        sides: What was run again.
        recorded: The side that was not; None for none.
        runs: How many more times each.
        changed: By what.
        ended: How many of the runs ended early; None for none.
        most: How far they get from the run of their own side; None where that has no bound.
    """

    sides: str
    recorded: str | None
    runs: int
    changed: str
    ended: int | None
    most: str | None


def _perturbed_of(comparison: Comparison, floor: ChaosFloor) -> _Perturbed:
    recorded = None
    for side, label in enumerate(short_labels(comparison)):
        if side not in floor.sides:
            recorded = label
    sizes = _highest(floor)
    return _Perturbed(
        sides=floor_sides(comparison, floor),
        recorded=recorded,
        runs=floor.runs,
        changed=changed_by(floor),
        ended=floor.ended if floor.ended else None,
        most=listed(sizes) if sizes and not floor.ended else None,
    )


def _highest(floor: ChaosFloor) -> list[str]:
    """Return the highest floor of all angles, and that of all lengths."""
    sizes = []
    for unit in ("rad", "m"):
        bands = [band for band in floor.bands if band.unit == unit]
        if bands:
            highest = max(bands, key=lambda band: band.most)
            sizes.append(f"{quantity(highest.most, unit)} ({name_of(highest.name)})")
    return sizes


@dataclass(frozen=True)
class _Chances:
    """Which gaps may be chance.

    Attributes:
        every_gap: "" where every gap is inside the floor all the time.
        later: Quantities that are inside it in the end alone; None for none.
        inside: Quantities of which nothing can be concluded; None for none.
        between: Those of which it cannot be told; None for none.
    """

    every_gap: str | None
    later: str | None
    inside: str | None
    between: str | None


def _chances_of(floor: ChaosFloor) -> _Chances:
    motion = [band for band in floor.bands if band.kind != "contact"]
    everywhere = all(band.inside_from == 0 for band in motion)
    is_chaotic = any(band.most > 0 for band in motion)
    later = [
        f"{name_of(band.name)} from {short_time(band.inside_from)} on"
        for band in motion
        if band.inside_from is not None and band.most > 0 and band.chance == "beyond"
    ]
    return _Chances(
        every_gap=if_true(everywhere and is_chaotic),
        later=few(later, _NAMED) if later else None,
        inside=_names_with(floor, "inside"),
        between=_names_with(floor, "cannot be told"),
    )


def _names_with(floor: ChaosFloor, chance: Chance) -> str | None:
    """Return the quantities with a chance, in a sentence; None for none."""
    names = [name_of(band.name) for band in floor.bands if band.chance == chance]
    return few(names, _NAMED) if names else None


def changed_by(floor: ChaosFloor) -> str:
    """Return what was changed in the runs that it is made of."""
    size = floor.uncertain
    sizes = [rounded(v, unit) for v, unit in ((size.length, "m"), (size.angle, "rad")) if v > 0]
    start = f", and the start by {listed(sizes)}" if sizes else ""
    return f"start and commands changed by rounding ({floor.rounding:g}){start}"
