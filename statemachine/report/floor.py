"""The chaos floor of a comparison, in words."""

from __future__ import annotations

from ..compare import ChaosFloor, Comparison, FloorBand
from ..measures.text import count, listed, quantity, rounded, short_time
from ..page import Block, Text
from .finding import name_of, short_labels


def floor_words(comparison: Comparison, floor: ChaosFloor) -> list[Block]:
    """How the floor was found, how high it is, and what lies inside it."""
    return [Text(" ".join([_made(comparison, floor), *_high(floor), *_inside(comparison, floor)]))]


def changed_by(floor: ChaosFloor) -> str:
    """What was changed in the runs that it is made of."""
    size = floor.uncertain
    uncertain = [
        rounded(value, unit)
        for value, unit in ((size.length, "m"), (size.angle, "rad"))
        if value > 0
    ]
    start = f", and its start by {listed(uncertain)}" if uncertain else ""
    return f"start and commands changed by rounding ({floor.rounding:g}){start}"


def _made(comparison: Comparison, floor: ChaosFloor) -> str:
    return (
        f"The chaos floor: {short_labels(comparison)[0]} was run {count(floor.runs, 'time')} more, "
        f"{changed_by(floor)}. Where a gap is no larger than what that makes of the run, nothing "
        "can be concluded."
    )


def _high(floor: ChaosFloor) -> list[str]:
    """The largest floor of each unit of motion."""
    if floor.ended:
        return [f"{floor.ended} of these runs ended early: from then on it has no bound."]
    words = []
    for unit in ("rad", "m"):
        bands = [band for band in floor.bands if band.unit == unit]
        if bands:
            most = max(bands, key=lambda band: band.most)
            words.append(f"{quantity(most.most, unit)} ({name_of(most.name)})")
    return [f"It is at most {listed(words)}."] if words else []


def _inside(comparison: Comparison, floor: ChaosFloor) -> list[str]:
    """Which gaps end inside the floor, and which are never beyond it and their tolerance."""
    motion = [band for band in floor.bands if band.kind != "contact"]
    within = [band for band in motion if band.inside_from is not None]
    moving = [band for band in within if band.most > 0]
    if not moving:
        return ["No gap ends inside it."]
    if len(within) == len(motion) and all(band.inside_from == 0 for band in within):
        return ["Every gap lies inside it, all the time."]
    groups: dict[float, list[FloorBand]] = {}
    for band in moving:
        groups.setdefault(float(band.inside_from or 0.0), []).append(band)
    words = [
        f"{listed([name_of(band.name) for band in bands])} "
        + (f"from {short_time(since)} on" if since else "all the time")
        for since, bands in sorted(groups.items())
    ]
    found = [f"Inside it: {'; '.join(words)}."]
    verdicts = {each.name: each.verdict for each in comparison.agreements}
    chance = [
        name_of(band.name)
        for band in floor.bands
        if not band.beyond and verdicts[band.name] != "agrees"
    ]
    if chance:
        found.append(
            f"{listed(chance)}: beyond the tolerance, but never where the gap is beyond the floor, "
            "so that may be chance."
        )
    return found
