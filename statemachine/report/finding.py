"""What a comparison found, in words, and what happens when: each from its figures, none a guess."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..compare import Agreement, Comparison, Series
from ..compare.perturbed import CLEAR, Chance, ChaosFloor
from ..compare.series import SETTLED, at_the_end
from ..measures import QUANTITIES
from ..measures.text import capital, few, grouped, listed, quantity, rounded, short_time
from ..page import Block, Figures, Headline, Table, TableCell
from ..runs import Trace
from . import template
from .template import if_true
from .why_answer import answer, proofs

if TYPE_CHECKING:
    from ..compare.why import Explanation

_NAMED = 6  # quantities in a sentence
_STEADY = 0.1  # share by which a difference may change in the end and be called settled

LEADS = {
    "same": "The two runs are the same in every figure that was compared",
    "agree": "The two runs agree for {until:g} s: nothing leaves its tolerance",
    "ended": "{sides} ended early; until {until:g} s {agrees} of {total} quantities are within "
    "tolerance",
    "apart": "{what} is up to {far} apart between {left} and {right}, at {at}{parting}",
    "contact": "{what}: {far}{parting}",
}
PARTING = {
    "at the start": "; the runs part from the start",
    "exact": "; the runs part at {time}",
    "first": "; they are apart at the first common moment already, {time}",
    "coarse": "; they are apart from the common moment {time} on",
}
ENDS = {
    "inside": "Nothing can be concluded: rounding alone makes up to {floor} of it (the chaos "
    "floor, from {runs} perturbed runs of {sides}).",
    "cannot be told": "Whether that is more than chance cannot be told: rounding alone makes up to "
    "{floor} of it (the chaos floor, from {runs} perturbed runs of {sides}).",
    "alike": "All of the motion is within its tolerance at all moments.",
    "within": "On average over {window}, all of the motion is within its tolerance.",
    "settled": "On average over {window} {what} is still {far} apart.",
    "changing": "On average over {window} {what} is still {far} apart, and still changing: {last} "
    "at the last moment.",
}


def headline(
    comparison: Comparison,
    events: Sequence[Figures],
    explanation: Explanation | None = None,
    floor: ChaosFloor | None = None,
) -> Headline:
    """The largest difference, what explains it, and what is left of it in the end."""
    agreements, until = comparison.agreements, comparison.until
    if comparison.agrees:
        same = all(agreement.max == 0 for agreement in agreements)
        return Headline(LEADS["same" if same else "agree"].format(until=until))
    if comparison.ended:
        sides = [s.label for s in (comparison.left, comparison.right) if s.trace.header.ended]
        lead = LEADS["ended"].format(
            sides=" and ".join(sides),
            until=until,
            agrees=sum(agreement.verdict == "agrees" for agreement in agreements),
            total=len(agreements),
        )
        return Headline(lead, holds=False)
    what, far, at, agreement = subject(comparison, explanation, floor)
    contact = agreement if agreement and agreement.kind == "contact" else None
    left, right = short_labels(comparison)
    lead = LEADS["contact" if contact else "apart"].format(
        what=name_of(contact.name) if contact else what,
        far=(contact and contact.note) or far,
        at=short_time(at),
        left=left,
        right=right,
        parting=_parting(comparison, events),
    )
    causes = () if explanation is None else (*proofs(explanation), f"{answer(explanation)}.")
    end = _by_chance(comparison, floor, agreement) or _in_the_end(comparison, agreement)
    return Headline(capital(lead), causes, end, holds=False)


def _by_chance(
    comparison: Comparison, floor: ChaosFloor | None, agreement: Agreement | None
) -> str:
    """Say that rounding alone may make the gap of a quantity; "" where the gap is beyond that."""
    if floor is None or agreement is None:
        return ""
    for band in floor.bands:
        if band.name == agreement.name and band.chance in ("inside", "cannot be told"):
            return ENDS[band.chance].format(
                floor=quantity(band.most, band.unit),
                runs=floor.runs,
                sides=floor_sides(comparison, floor),
            )
    return ""


def floor_sides(comparison: Comparison, floor: ChaosFloor) -> str:
    """The sides that were run again for the chaos floor: both, or the one that is not recorded."""
    left, right = short_labels(comparison)
    if len(floor.sides) > 1:
        return "each side"
    return left if floor.sides == (0,) else right


def _parting(comparison: Comparison, events: Sequence[Figures]) -> str:
    """When the runs part; of moments farther apart than timesteps, which is the first."""
    at = parting(comparison)
    if at is None:
        return ""
    step = max(trace.timestep for trace in traces_of(comparison))
    spacing = comparison.until / max(1, comparison.moments - 1)
    kind = "at the start" if at == 0 else "exact"
    if at and spacing > 1.5 * step:
        kind = "first" if at <= 1.001 * spacing else "coarse"
    # A touch later than a step after the parting has nothing to do with it.
    slack = 1.001 * step if at and kind != "first" else -1.0
    touches = (e.what for e in events if e.kind == "touch" and e.time and abs(e.time - at) <= slack)
    body, _, ground = next(touches, "").partition(" on ")
    when = f", when {body} touches {ground}" if body else ""
    return PARTING[kind].format(time=short_time(at)) + when


def short_labels(comparison: Comparison) -> tuple[str, str]:
    """What the sides are called for short: their engines, or what tells two of one apart."""
    return comparison.left.short, comparison.right.short


def long_labels(comparison: Comparison) -> tuple[str, str]:
    """What the sides are called: engine and version, or what tells two of one apart."""
    return comparison.left.label, comparison.right.label


def traces_of(comparison: Comparison) -> tuple[Trace, Trace]:
    """The runs of both sides."""
    return comparison.left.trace, comparison.right.trace


def window(comparison: Comparison) -> str:
    """What the figures of the end are a mean over."""
    return f"the last {SETTLED * comparison.until:.3g} s"


def _in_the_end(comparison: Comparison, lead: Agreement | None) -> str:
    """What of the motion is still apart, as a mean over the end, and whether it still changes.

    Of several that are as far apart it is `lead`, which the headline names already.
    """
    motion = [a for a in comparison.agreements if QUANTITIES[a.kind].moves]
    differ = [a for a in motion if a.verdict == "differs"]
    known = [a for a in differ if a.settled >= 0]  # what is not a number is on neither side
    over = window(comparison)
    if not known:
        kind = "alike" if all(a.verdict == "agrees" for a in motion) else "within"
        return "" if differ or not motion else ENDS[kind].format(window=over)
    most = max(
        known, key=lambda a: (float(f"{a.settled / (a.tolerance or 1e-300):.2g}"), a == lead)
    )
    last = next(_last(curve, most) for curve in comparison.curves if curve.name == most.name)
    return ENDS["settled" if last is None else "changing"].format(
        window=over,
        what=named(most),
        far=quantity(most.settled, most.unit),
        last=quantity(last, most.unit),
    )


def _last(curve: Series, agreement: Agreement) -> float | None:
    """The last difference, if it moves within the end by more than it may to be settled."""
    tail = curve.difference[at_the_end(curve.time)]
    moves = float(np.ptp(tail)) > min(agreement.tolerance, _STEADY * agreement.settled)
    return float(tail[-1]) if moves else None


def name_of(name: str) -> str:
    """A quantity's name where names stand in a list: without a comma of its own."""
    return name.replace(", ", " ")


def moment(time: float | None) -> TableCell:
    """A time of the run [s] in a cell, to which a slider can go."""
    return TableCell("never" if time is None else f"{time:.3f}", at=time)


def named(agreement: Agreement) -> str:
    """A quantity within a sentence."""
    if agreement.kind in ("joint", "slide"):
        return f"joint {agreement.name}"
    name, _, part = agreement.name.partition(", ")
    return f"the {part} of {name}" if part else f"the {name}"


def subject(
    comparison: Comparison,
    explanation: Explanation | None = None,
    floor: ChaosFloor | None = None,
) -> tuple[str, str, float, Agreement | None]:
    """The largest difference: that whose causes were looked for, else the leading one.

    Returns:
        Its name, the largest value as text, when that is [s], and the figures of the comparison;
        None where they have no such quantity.
    """
    if explanation is None or not explanation.verdict.divides:
        lead = leading(comparison, floor)
        return named(lead), quantity(lead.max, lead.unit), lead.at, lead
    gap, quantities = explanation.first[explanation.quantity], explanation.quantity
    kind = {"joints": "joint", "slides": "slide"}.get(quantities)
    same = [
        agreement
        for agreement in comparison.agreements
        if (agreement.kind == kind if kind else agreement.name == f"{quantities}, position")
        and abs(agreement.max - gap.worst) <= 1e-6 * gap.worst
    ]
    who = f"one of the {quantities}" if kind else f"the {quantities}"
    first = max(same, key=lambda a: a.max, default=None)  # as `leading`
    far = quantity(gap.worst, explanation.unit)
    return named(first) if first else who, far, gap.at, first


def leading(comparison: Comparison, floor: ChaosFloor | None = None) -> Agreement:
    """The quantity farthest beyond its tolerance: a coordinate, of which --why speaks, if any is.

    Else one of the motion, as the fingertip; else any. What is not a number comes last. Where some
    gaps may be chance, it is one of those that are beyond the chaos floor.
    """
    beyond = [a for a in comparison.agreements if a.verdict != "agrees"]
    chances: tuple[Chance, ...] = ("beyond", "cannot be told") if floor else ()
    for chance in chances:
        clear = [a for a in beyond if floor is not None and floor.chance(a.name) == chance]
        if clear:
            beyond = clear
            break
    own = [a for a in beyond if QUANTITIES[a.kind].own]
    motion = [a for a in beyond if QUANTITIES[a.kind].moves]
    return max(
        own or motion or beyond or comparison.agreements,
        key=lambda a: np.nan_to_num(a.tolerances(), posinf=-1.0),
    )


def parting(comparison: Comparison) -> float | None:
    """When the first quantity leaves its tolerance [s]; None if none does."""
    return min((a.since for a in comparison.agreements if a.since is not None), default=None)


def in_words(comparison: Comparison) -> list[Block]:
    """What a reader should know before the figures."""
    agreements, holds, ended = comparison.agreements, comparison.agrees, comparison.ended
    worst, first = leading(comparison), parting(comparison)
    counts = Counter(agreement.verdict for agreement in agreements)
    unlike, cut = not holds and not ended, bool(ended and not holds)
    parted = [named(a) for a in agreements if first is not None and a.since == first]
    return template.blocks(
        "finding",
        total=len(agreements),
        moments=comparison.moments,
        within=if_true(holds),
        cut=if_true(cut),
        unlike=if_true(unlike),
        **{kind: counts[kind] for kind in ("agrees", "settles", "differs")},
        far=quantity(worst.max, worst.unit),
        tolerance=quantity(worst.tolerance, worst.unit),
        at=short_time(worst.at),
        nearest=name_of(worst.name) if holds and worst.max else None,
        farthest=named(worst) if unlike and worst.kind != "contact" else None,
        first=parted[0] if cut and parted else None,
        parted=short_time(first or 0.0),
    )


def floor_words(comparison: Comparison, floor: ChaosFloor) -> list[Block]:
    """How the floor was made, how high it is, and which gaps may be chance."""
    sizes = []
    for unit in ("rad", "m"):
        bands = [band for band in floor.bands if band.unit == unit]
        if bands:
            highest = max(bands, key=lambda band: band.most)
            sizes.append(f"{quantity(highest.most, unit)} ({name_of(highest.name)})")
    motion = [band for band in floor.bands if band.kind != "contact"]
    everywhere = all(band.inside_from == 0 for band in motion)
    moving = [
        f"{name_of(band.name)} from {short_time(band.inside_from)} on"
        for band in motion
        if band.inside_from is not None and band.most > 0 and band.chance == "beyond"
    ]

    def named(chance: Chance) -> str | None:
        names = [name_of(band.name) for band in floor.bands if band.chance == chance]
        return few(names, _NAMED) if names else None

    recorded = {0, 1} - set(floor.sides)
    return template.blocks(
        "floor",
        sides=floor_sides(comparison, floor),
        recorded=short_labels(comparison)[recorded.pop()] if recorded else None,
        runs=floor.runs,
        changed=changed_by(floor),
        ended=floor.ended or None,
        most=listed(sizes) if sizes and not floor.ended else None,
        clear=f"{CLEAR:g}",
        every_gap=if_true(everywhere and any(band.most > 0 for band in motion)),
        later=few(moving, _NAMED) if moving else None,
        inside=named("inside"),
        between=named("cannot be told"),
    )


def changed_by(floor: ChaosFloor) -> str:
    """What was changed in the runs that it is made of."""
    size = floor.uncertain
    sizes = [rounded(v, unit) for v, unit in ((size.length, "m"), (size.angle, "rad")) if v > 0]
    start = f", and the start by {listed(sizes)}" if sizes else ""
    return f"start and commands changed by rounding ({floor.rounding:g}){start}"


def events_of(comparison: Comparison) -> list[Figures]:
    """First touches on each side, where each quantity parts, largest differences, early ends.

    Returns:
        time: Since the start [s].
        kind: "touch", "part", "largest" or "end".
        text: What happens, in a few words.
        side: 0 or 1, or None for both.
        what: What touches what; empty otherwise.
    """
    parted = [
        (agreement.since, agreement.at, agreement.name.replace(", ", " "))
        for agreement in comparison.agreements
        if agreement.kind != "contact" and agreement.since is not None
    ]
    rows: list[tuple[float, str, str, int | None, str]] = [
        *(
            (contact.first, "touch", f"first touch: {touch.pair}", side, touch.pair)
            for touch in comparison.touches
            for side, contact in enumerate((touch.left, touch.right))
            if contact.first is not None
        ),
        *(
            (since, "part", f"beyond tolerance from here: {'; '.join(names)}", None, "")
            for since, names in grouped((since, name) for since, _, name in parted).items()
        ),
        *(
            (at, "largest", f"largest difference: {'; '.join(names)}", None, "")
            for at, names in grouped((at, name) for _, at, name in parted).items()
        ),
        *(
            ((len(trace) - 1) * trace.timestep, "end", f"ends early: {ended}", number, "")
            for number, trace in enumerate(traces_of(comparison))
            if (ended := trace.header.ended)
        ),
    ]
    names = ("time", "kind", "text", "side", "what")
    events = [Figures(**dict(zip(names, row, strict=True))) for row in rows]
    return sorted(events, key=lambda event: event.time)


def events_table(comparison: Comparison) -> Table:
    """What happens when; the same on both sides at the same time is one row."""
    sides = grouped(((event.time, event.text), event.side) for event in events_of(comparison))
    where = {None: "between them", **dict(enumerate(long_labels(comparison)))}
    return Table.of(
        sides,
        {
            "time": lambda event: TableCell(short_time(event[0]), at=event[0]),
            "what": lambda event: capital(event[1]),
            "on": lambda event: "both" if {0, 1} <= {*sides[event]} else where[sides[event][0]],
        },
        "First touches, partings, largest differences; press a time to go there",
        words={"what", "on"},
    )
