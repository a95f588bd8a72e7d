"""What a comparison found, in words, and what happens when: each from its figures, none a guess."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from ...measures import QUANTITIES
from ...measures.text import capital, few, grouped, listed, quantity, rounded, short_time
from ...show import report_template as template
from ...show.blocks import Block, Headline, Table, TableCell
from ...show.report_template import if_true, slots_of
from ..compare import Agreement, Comparison, Series
from ..compare.instead import Instead
from ..compare.perturbed import CLEAR, Chance, ChaosFloor
from ..compare.series import SETTLED, at_the_end
from ..compare.stillness import extent_of, nothing_moved
from ..recordings import Trace
from ..why.answer_page import answer, proofs

if TYPE_CHECKING:
    from ..why import Explanation

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
    events: Sequence[Event],
    explanation: Explanation | None = None,
    floor: ChaosFloor | None = None,
    instead: Instead | None = None,
) -> Headline:
    """Return the largest difference, what explains it, and what is left of it in the end.

    Args:
        comparison: The figures.
        events: What happens when.
        explanation: What explains the largest difference; None if that was not asked.
        floor: The chaos floor; None if it was not looked for.
        instead: What to run where nothing moved; None where that was not looked for.
    """
    if comparison.outcome == "nothing moved":
        return Headline(nothing_moved(comparison.motion, instead), holds=False)
    if comparison.agrees:
        same = all(agreement.max == 0 for agreement in comparison.agreements)
        return Headline(LEADS["same" if same else "agree"].format(until=comparison.until))
    if comparison.ended:
        return _of_an_early_end(comparison)
    what, far, at, agreement = subject(comparison, explanation, floor)
    parting_words = _parting(comparison, events)
    if agreement is not None and agreement.kind == "contact":
        what = name_of(agreement.name)
        far = agreement.note if agreement.note else far
        lead = LEADS["contact"].format(what=what, far=far, parting=parting_words)
    else:
        left, right = short_labels(comparison)
        lead = LEADS["apart"].format(
            what=what,
            far=far,
            at=short_time(at),
            left=left,
            right=right,
            parting=parting_words,
        )
    causes = () if explanation is None else (*proofs(explanation), f"{answer(explanation)}.")
    end = _by_chance(comparison, floor, agreement)
    if not end:
        end = _in_the_end(comparison, agreement)
    return Headline(capital(lead), causes, end, holds=False)


def _of_an_early_end(comparison: Comparison) -> Headline:
    """Return the headline of a comparison of which a run ended before its time."""
    sides = [side.label for side in (comparison.left, comparison.right) if side.trace.header.ended]
    verdicts = Counter(agreement.verdict for agreement in comparison.agreements)
    lead = LEADS["ended"].format(
        sides=" and ".join(sides),
        until=comparison.until,
        agrees=verdicts["agrees"],
        total=len(comparison.agreements),
    )
    return Headline(lead, holds=False)


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


def _parting(comparison: Comparison, events: Sequence[Event]) -> str:
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
    """Return what a reader should know before the figures."""
    slots = slots_of(_verdicts_of(comparison), _worst_of(comparison), _first_parting_of(comparison))
    return template.blocks("lab/questions/finding", **slots)


@dataclass(frozen=True)
class _Verdicts:
    """How many quantities agree, and which sentences that makes.

    Attributes:
        total: How many quantities there are.
        moments: How many moments were compared.
        agrees: How many quantities agree.
        settles: How many settle.
        differs: How many differ.
        within: "" where all agree.
        cut: "" where a run ended before its time.
        unlike: "" where neither is so.
        unmoved: How far the sides move where they agree in forces and energy alone; else None.
    """

    total: int
    moments: int
    agrees: int
    settles: int
    differs: int
    within: str | None
    cut: str | None
    unlike: str | None
    unmoved: str | None


def _verdicts_of(comparison: Comparison) -> _Verdicts:
    counts = Counter(agreement.verdict for agreement in comparison.agreements)
    outcome = comparison.outcome
    all_agree = outcome in ("agrees", "nothing moved")
    unmoved = None
    if outcome == "agrees" and not comparison.motion.moved:
        unmoved = extent_of(comparison.motion)
    total = len(comparison.agreements)
    return _Verdicts(
        total=total,
        moments=comparison.moments,
        agrees=counts["agrees"],
        settles=counts["settles"],
        differs=counts["differs"],
        within=if_true(all_agree),
        cut=if_true(outcome == "ended"),
        unlike=if_true(outcome == "differs"),
        unmoved=unmoved,
    )


@dataclass(frozen=True)
class _Worst:
    """The quantity that is farthest beyond its tolerance.

    Attributes:
        far: Its largest difference.
        tolerance: Its tolerance.
        at: When the difference is largest.
        nearest: What it is called where all agree and something differs at all; else None.
        farthest: What it is called where not all agree; else None.
    """

    far: str
    tolerance: str
    at: str
    nearest: str | None
    farthest: str | None


def _worst_of(comparison: Comparison) -> _Worst:
    worst = leading(comparison)
    nearest = farthest = None
    if comparison.outcome in ("agrees", "nothing moved") and worst.max:
        nearest = name_of(worst.name)
    if comparison.outcome == "differs" and worst.kind != "contact":
        farthest = named(worst)
    far, tolerance = (quantity(value, worst.unit) for value in (worst.max, worst.tolerance))
    return _Worst(far, tolerance, short_time(worst.at), nearest, farthest)


@dataclass(frozen=True)
class _FirstParting:
    """What leaves its tolerance first before a run ends early.

    Attributes:
        first: What it is called; None for nothing.
        parted: When.
    """

    first: str | None = None
    parted: str | None = None


def _first_parting_of(comparison: Comparison) -> _FirstParting:
    at = parting(comparison)
    if at is None or not comparison.ended:
        return _FirstParting()
    first = next(a for a in comparison.agreements if a.since == at)
    return _FirstParting(named(first), short_time(at))


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


@dataclass(frozen=True)
class Event:
    """Something that happens in one of two runs, or between them.

    Attributes:
        time: Since the start [s].
        kind: A first touch, a quantity that leaves its tolerance, a largest difference, or the
            early end of a run.
        text: What happens, in a few words.
        side: 0 for the left, 1 for the right; None for what is between them.
        what: What touches what; "" of other kinds.
    """

    time: float
    kind: Literal["touch", "part", "largest", "end"]
    text: str
    side: int | None = None
    what: str = ""


def events_of(comparison: Comparison) -> list[Event]:
    """Return first touches, where each quantity parts, largest differences, and early ends."""
    events: list[Event] = []
    for touch in comparison.touches:
        for side, contacts in enumerate((touch.left, touch.right)):
            if contacts.first is not None:
                text = f"first touch: {touch.pair}"
                events.append(Event(contacts.first, "touch", text, side, touch.pair))
    parted = [
        agreement
        for agreement in comparison.agreements
        if agreement.kind != "contact" and agreement.since is not None
    ]
    by_since = grouped((agreement.since, name_of(agreement.name)) for agreement in parted)
    for since, names in by_since.items():
        if since is not None:
            text = f"beyond tolerance from here: {'; '.join(names)}"
            events.append(Event(since, "part", text))
    by_largest = grouped((agreement.at, name_of(agreement.name)) for agreement in parted)
    for at, names in by_largest.items():
        events.append(Event(at, "largest", f"largest difference: {'; '.join(names)}"))
    for side, trace in enumerate(traces_of(comparison)):
        if trace.header.ended:
            end = (len(trace) - 1) * trace.timestep
            events.append(Event(end, "end", f"ends early: {trace.header.ended}", side))
    return sorted(events, key=lambda event: event.time)


def events_table(comparison: Comparison) -> Table:
    """Return what happens when; the same on both sides at the same time is one row."""
    both = grouped(((event.time, event.text), event.side) for event in events_of(comparison))
    rows = []
    for (time, text), sides in both.items():
        where = "both" if {0, 1} <= set(sides) else _where(sides[0], comparison)
        rows.append((TableCell(short_time(time), at=time), capital(text), where))
    return Table(
        ("time", "what", "on"),
        rows,
        "First touches, partings, largest differences; press a time to go there",
        words=frozenset({0, 1, 2}),
    )


def _where(side: int | None, comparison: Comparison) -> str:
    """Return what a side is called; None is between the two."""
    return "between them" if side is None else long_labels(comparison)[side]
