"""The chaos floor of a comparison, in words."""

from __future__ import annotations

from ..compare import ChaosFloor, Comparison
from ..measures.text import listed, quantity, rounded, short_time
from ..page import Block, Text
from .finding import name_of, short_labels

CHANGED = "start and commands changed by rounding ({rounding:g})"
CHANGED_START = "{changed}, and its start by {sizes}"
FLOOR = (
    "The chaos floor (runs of {side}: {runs} more, {changed}). Where a gap is no larger than what "
    "that makes of the run, nothing can be concluded."
)
ENDED = "Runs of it that ended early: {ended}; from then on it has no bound."
MOST = "It is at most {sizes}."
NO_GAP = "No gap ends inside it."
EVERY_GAP = "Every gap lies inside it, all the time."
INSIDE = "Inside it in the end: {names}."
INSIDE_FROM = "{name} from {since} on"
CHANCE = (
    "{names}: beyond the tolerance, but never where the gap is beyond the floor, so that may be "
    "chance."
)


def floor_words(comparison: Comparison, floor: ChaosFloor) -> list[Block]:
    """How the floor was made, how high it is, and what lies inside it."""
    side, changed = short_labels(comparison)[0], changed_by(floor)
    lines = [FLOOR.format(side=side, runs=floor.runs, changed=changed)]
    largest = [
        max((band for band in floor.bands if band.unit == unit), key=lambda b: b.most, default=None)
        for unit in ("rad", "m")
    ]
    sizes = [f"{quantity(b.most, b.unit)} ({name_of(b.name)})" for b in largest if b]
    if floor.ended:
        lines.append(ENDED.format(ended=floor.ended))
    elif sizes:
        lines.append(MOST.format(sizes=listed(sizes)))
    motion = [band for band in floor.bands if band.kind != "contact"]
    within = [band for band in motion if band.inside_from is not None]
    moving = [
        INSIDE_FROM.format(name=name_of(b.name), since=short_time(b.inside_from or 0.0))
        for b in within
        if b.most > 0
    ]
    everywhere = len(within) == len(motion) and all(band.inside_from == 0 for band in within)
    inside = NO_GAP if not moving else EVERY_GAP if everywhere else INSIDE
    lines.append(inside.format(names=", ".join(moving)))
    verdicts = {agreement.name: agreement.verdict for agreement in comparison.agreements}
    chance = [b.name for b in floor.bands if not b.beyond and verdicts[b.name] != "agrees"]
    if chance and inside is INSIDE:
        lines.append(CHANCE.format(names=listed([name_of(name) for name in chance])))
    return [Text(" ".join(lines))]


def changed_by(floor: ChaosFloor) -> str:
    """What was changed in the runs that it is made of."""
    size = floor.uncertain
    sizes = [rounded(v, unit) for v, unit in ((size.length, "m"), (size.angle, "rad")) if v > 0]
    changed = CHANGED.format(rounding=floor.rounding)
    return CHANGED_START.format(changed=changed, sizes=listed(sizes)) if sizes else changed
