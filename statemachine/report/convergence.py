"""The page of a comparison with finer and finer timesteps."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import QuantityLimit, TimestepConvergence
from ..measures.text import listed, milliseconds, quantity, short_time
from ..page import Block, Headline, Page, Table, Text
from .finding import name_of

_CONTACT = (
    "An engine's contact law depends on its own timestep, so that after a touch the two runs need "
    "not have a common limit. A gap that vanishes nevertheless is discretisation; of one that "
    "stays it cannot be said here whether the law or the timestep makes it."
)


def page(result: TimestepConvergence, experiment: str, said: Sequence[str] = ()) -> Page:
    """What vanishes with the timestep, and what does not.

    Args:
        result: What was found.
        experiment: What was run.
        said: Lines to say before anything else.
    """
    steps = [milliseconds(step, 3) for step in result.steps]
    one, two = result.labels
    touched = result.touch is not None
    before = f"The gap with finer steps, before the first touch at {short_time(result.touch or 0)}"
    blocks: list[Block] = [
        *(Text(line) for line in said),
        Text(
            "Both sides run three times, with their engines' steps as given "
            f"({' and '.join(dict.fromkeys(steps))}), halved and quartered; commands and moments "
            "stay. A gap that vanishes with the steps is discretisation: each engine goes to the "
            "same motion, in steps of its own. A gap that stays is of the machines."
        ),
        *([_table(result.before, before)] if touched and result.before else []),
        _table(result.whole, "The gap with finer steps" + ", over the whole run" * touched),
        *([Text(_CONTACT)] if touched else []),
        *([Text(_own(result))] if result.whole else []),
        Text("Left, where the steps have no length: on the line through the last two.", small=True),
    ]
    origin = f"{one} and {two}, {result.until:g} s"
    title = f"{experiment}: does the gap vanish with the timestep?"
    return Page(title, origin, blocks, _headline(result))


def _table(limits: Sequence[QuantityLimit], title: str) -> Table:
    rows = [
        (
            name_of(each.name),
            each.verdict,
            *(quantity(gap, each.unit) for gap in each.gaps),
            quantity(each.limit, each.unit),
            quantity(each.left[0], each.unit),
            quantity(each.right[0], each.unit),
        )
        for each in limits
    ]
    return Table(
        ("quantity", "the gap is", "at h", "h/2", "h/4", "left", "left's own", "right's own"),
        rows,
        title,
        words=frozenset({0, 1}),
        emphasis=frozenset(
            k for k, each in enumerate(limits) if each.verdict in ("stays", "in part")
        ),
        wide=frozenset({6, 7}),
    )


def _headline(result: TimestepConvergence) -> Headline:
    if all(each.verdict == "rounding" for each in result.whole):
        return Headline("There is no gap beyond rounding, whatever the timestep")
    if result.vanishes:
        return Headline("The gap vanishes with the timestep: it is discretisation")
    stay = [each for each in result.whole if each.verdict in ("stays", "in part")]
    lead, end = "The gap neither vanishes with the timestep nor stays as it is", ""
    if stay:
        most = max(
            (each for each in stay if each.unit == stay[0].unit), key=lambda each: each.gaps[2]
        )
        sizes = [quantity(most.gaps[k], most.unit) for k in (0, 2)]
        lead = (
            f"The gap does not vanish with the timestep: that of {name_of(most.name)} is "
            f"{sizes[0]}, and {sizes[1]} with a quarter of it"
        )
    verdicts = {each.verdict for each in result.before}
    if result.touch is not None and result.before and verdicts <= {"rounding", "discretisation"}:
        what = "no gap" if verdicts == {"rounding"} else "nothing but discretisation"
        end = f"Before the first touch, at {short_time(result.touch)}, there is {what}."
    return Headline(lead, end=end, holds=False)


def _own(result: TimestepConvergence) -> str:
    """How far each side moves itself when its steps get finer."""
    known = [each for each in result.whole if each.unit == result.whole[0].unit]
    words = []
    for label, place in zip(result.labels, ("left", "right"), strict=True):
        most = max(known, key=lambda each: getattr(each, place)[0])
        words.append(
            f"{label} by {quantity(getattr(most, place)[0], most.unit)} ({name_of(most.name)})"
        )
    return f"With a quarter of its step a side moves away from its own first run: {listed(words)}."
