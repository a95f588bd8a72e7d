"""The page of a comparison with finer and finer timesteps."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import QuantityLimit, TimestepConvergence
from ..measures.text import milliseconds, quantity, short_time
from ..page import Headline, Page, Table, Text
from . import template
from .finding import name_of
from .template import if_true

LEADS = {
    "rounding": "There is no gap beyond rounding, whatever the timestep",
    "vanishes": "The gap vanishes with the timestep: it is discretisation",
    "neither": "The gap neither vanishes with the timestep nor stays as it is",
    "stays": "The gap does not vanish with the timestep: that of {name} is {coarse}, and {fine} "
    "with a quarter of it",
}
TOUCH = {
    True: "Before the first touch, at {touch}, there is no gap.",
    False: "Before the first touch, at {touch}, there is nothing but discretisation.",
}
_HEADS = ("quantity", "the gap is", "at h", "h/2", "h/4", "at 0", "left's own", "right's own")


def page(result: TimestepConvergence, experiment: str, said: Sequence[str] = ()) -> Page:
    """What vanishes with the timestep, and what does not.

    Args:
        result: What was found.
        experiment: What was run.
        said: Lines to say before anything else.
    """
    touch = result.touch
    at = "" if touch is None else short_time(touch)
    has_before = touch is not None and result.before
    title = f"The gap with finer steps, before the first touch at {at}"
    steps = dict.fromkeys(milliseconds(step, 3) for step in result.steps)
    return template.page(
        "convergence",
        _headline(result, at),
        experiment=experiment,
        left=result.labels[0],
        right=result.labels[1],
        until=result.until,
        said=[Text(line) for line in said],
        steps=" and ".join(steps),
        before=[_table(result.before, title)] if has_before else [],
        whole=[_table(result.whole, "The gap with finer steps, over the whole run")],
        touch=if_true(at),
        left_most=_own(result.whole, "left"),
        right_most=_own(result.whole, "right"),
    )


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


def _headline(result: TimestepConvergence, touch: str) -> Headline:
    if all(each.verdict == "rounding" for each in result.whole):
        return Headline(LEADS["rounding"])
    if result.vanishes:
        return Headline(LEADS["vanishes"])
    stay = [each for each in result.whole if each.verdict in ("stays", "in part")]
    same = [each for each in stay if each.unit == stay[0].unit]
    most = max(same, key=lambda each: each.gaps[2], default=None)
    lead, end = LEADS["neither"], ""
    if most is not None:
        coarse, fine = (quantity(most.gaps[k], most.unit) for k in (0, 2))
        lead = LEADS["stays"].format(name=name_of(most.name), coarse=coarse, fine=fine)
    verdicts = {each.verdict for each in result.before}
    if touch and verdicts and verdicts <= {"rounding", "discretisation"}:
        end = TOUCH[verdicts == {"rounding"}].format(touch=touch)
    return Headline(lead, end=end, holds=False)


def _own(limits: Sequence[QuantityLimit], side: str) -> str | None:
    """How far a side moves itself at most when its steps get finer, and in what."""
    known = [limit for limit in limits if limit.unit == limits[0].unit]
    most = max(known, key=lambda limit: getattr(limit, side)[0], default=None)
    return most and f"{quantity(getattr(most, side)[0], most.unit)} ({name_of(most.name)})"
