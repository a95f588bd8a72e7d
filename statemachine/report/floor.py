"""The chaos floor of a comparison, in words."""

from __future__ import annotations

from ..compare import ChaosFloor, Comparison
from ..measures.text import listed, quantity, rounded, short_time
from ..page import Block
from . import template
from .finding import name_of, short_labels
from .template import if_true


def floor_words(comparison: Comparison, floor: ChaosFloor) -> list[Block]:
    """How the floor was made, how high it is, and what lies inside it."""
    largest = [
        max((band for band in floor.bands if band.unit == unit), key=lambda b: b.most, default=None)
        for unit in ("rad", "m")
    ]
    sizes = [f"{quantity(b.most, b.unit)} ({name_of(b.name)})" for b in largest if b]
    motion = [band for band in floor.bands if band.kind != "contact"]
    within = [band for band in motion if band.inside_from is not None]
    moving = [
        f"{name_of(b.name)} from {short_time(b.inside_from or 0.0)} on"
        for b in within
        if b.most > 0
    ]
    everywhere = len(within) == len(motion) and all(band.inside_from == 0 for band in within)
    verdicts = {agreement.name: agreement.verdict for agreement in comparison.agreements}
    chance = [b.name for b in floor.bands if not b.beyond and verdicts[b.name] != "agrees"]
    inside = moving and not everywhere
    return template.blocks(
        "floor",
        side=short_labels(comparison)[0],
        runs=floor.runs,
        changed=changed_by(floor),
        ended=floor.ended or None,
        most=listed(sizes) if sizes and not floor.ended else None,
        no_gap=if_true(not moving),
        every_gap=if_true(moving and everywhere),
        inside=", ".join(moving) if inside else None,
        chance=listed([name_of(name) for name in chance]) if chance and inside else None,
    )


def changed_by(floor: ChaosFloor) -> str:
    """What was changed in the runs that it is made of."""
    size = floor.uncertain
    sizes = [rounded(v, unit) for v, unit in ((size.length, "m"), (size.angle, "rad")) if v > 0]
    start = f", and its start by {listed(sizes)}" if sizes else ""
    return f"start and commands changed by rounding ({floor.rounding:g}){start}"
