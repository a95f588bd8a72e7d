"""The page of a comparison with finer and finer timesteps."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import QuantityLimit, TimestepConvergence
from ..measures.text import milliseconds, quantity, short_time
from ..page import Block, Headline, Page, Table, Text
from .finding import name_of

METHOD = (
    "Both sides run three times, with their engines' steps as given ({steps}), halved and "
    "quartered; commands and moments stay. A gap that vanishes with the steps is discretisation: "
    "each engine goes to the same motion, in steps of its own. A gap that stays is of the machines."
)
BEFORE_TOUCH = "The gap with finer steps, before the first touch at {touch}"
WHOLE = "The gap with finer steps, over the whole run"
CONTACT = (
    "An engine's contact law depends on its own timestep, so that after a touch the two runs need "
    "not have a common limit. A gap that vanishes nevertheless is discretisation; of one that "
    "stays it cannot be said here whether the law or the timestep makes it."
)
LEGEND = (
    "Left: what is left where the steps have no length, on the line through the last two gaps. "
    "Own: how far a side moves away from its own first run with a quarter of its step; at most "
    "{left} ({left_of}) on the left and {right} ({right_of}) on the right."
)
NO_GAP = "There is no gap beyond rounding, whatever the timestep"
VANISHES = "The gap vanishes with the timestep: it is discretisation"
NEITHER = "The gap neither vanishes with the timestep nor stays as it is"
STAYS = (
    "The gap does not vanish with the timestep: that of {name} is {coarse}, and {fine} with a "
    "quarter of it"
)
TOUCH = {
    True: "Before the first touch, at {touch}, there is no gap.",
    False: "Before the first touch, at {touch}, there is nothing but discretisation.",
}
_HEADS = ("quantity", "the gap is", "at h", "h/2", "h/4", "left", "left's own", "right's own")


def page(result: TimestepConvergence, experiment: str, said: Sequence[str] = ()) -> Page:
    """What vanishes with the timestep, and what does not.

    Args:
        result: What was found.
        experiment: What was run.
        said: Lines to say before anything else.
    """
    steps = dict.fromkeys(milliseconds(step, 3) for step in result.steps)
    one, two = result.labels
    before = []
    if result.touch is not None and result.before:
        before = [_table(result.before, BEFORE_TOUCH.format(touch=short_time(result.touch)))]
    blocks: list[Block] = [
        *(Text(line) for line in said),
        Text(METHOD.format(steps=" and ".join(steps))),
        *before,
        _table(result.whole, WHOLE),
        *([] if result.touch is None else [Text(CONTACT)]),
        *([Text(_legend(result.whole), small=True)] if result.whole else []),
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
        _HEADS,
        rows,
        title,
        words=frozenset({0, 1}),
        wide=frozenset({6, 7}),
        emphasis=frozenset(
            k for k, each in enumerate(limits) if each.verdict in ("stays", "in part")
        ),
    )


def _headline(result: TimestepConvergence) -> Headline:
    if all(each.verdict == "rounding" for each in result.whole):
        return Headline(NO_GAP)
    if result.vanishes:
        return Headline(VANISHES)
    stay = [each for each in result.whole if each.verdict in ("stays", "in part")]
    same = [each for each in stay if each.unit == stay[0].unit]
    most = max(same, key=lambda each: each.gaps[2], default=None)
    lead, end = NEITHER, ""
    if most is not None:
        coarse, fine = (quantity(most.gaps[k], most.unit) for k in (0, 2))
        lead = STAYS.format(name=name_of(most.name), coarse=coarse, fine=fine)
    verdicts = {each.verdict for each in result.before}
    if result.touch is not None and verdicts and verdicts <= {"rounding", "discretisation"}:
        end = TOUCH[verdicts == {"rounding"}].format(touch=short_time(result.touch))
    return Headline(lead, end=end, holds=False)


def _legend(limits: Sequence[QuantityLimit]) -> str:
    """What the columns are, and how far each side moves itself when its steps get finer."""
    known = [limit for limit in limits if limit.unit == limits[0].unit]
    left, right = (
        max(known, key=lambda limit: getattr(limit, side)[0]) for side in ("left", "right")
    )
    return LEGEND.format(
        left=quantity(left.left[0], left.unit),
        left_of=name_of(left.name),
        right=quantity(right.right[0], right.unit),
        right_of=name_of(right.name),
    )
