"""Pages of the closer looks: finer timesteps, one step at a time, release after release."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

from ..compare import Comparison, Request
from ..compare.convergence import FINER
from ..compare.stages import FORCES
from ..measures.text import (
    NONE,
    command,
    figure,
    grouped,
    listed,
    milliseconds,
    quantity,
    sentence,
    short_time,
    significant,
)
from ..page import Bars, Code, Figures, Headline, Items, Page, Table
from . import template
from .finding import leading, moment, name_of
from .template import if_true

LEADS = {
    "rounding": "There is no gap beyond rounding, whatever the timestep",
    "vanishes": "The gap vanishes with the timestep: it is discretisation",
    "unclear": "It is unclear whether the gap vanishes with the timestep: that of {name} is "
    "{coarse}, and {fine} with the finest steps, in no steady order (so {unclear} of {total} "
    "quantities)",
    "stays": "The gap does not vanish with the timestep: that of {name} is {coarse}, and {fine} "
    "with the finest steps",
    "in part": "The gap vanishes with the timestep in part only: that of {name} is {coarse}, and "
    "{fine} with the finest steps",
}
TOUCH = {
    True: "Before the first touch, at {touch}, there is no gap.",
    False: "Before the first touch, at {touch}, there is nothing but discretisation.",
}


_STAGE_HEADS = ("differs", "first", "largest", "at, s", "where", "from, s", "null", "tolerance")
_FINER = ("at h", *(f"h/{finer}" for finer in FINER[1:]))


def convergence(result: Figures, experiment: str) -> Page:
    """What vanishes with the timestep, and what does not.

    Args:
        result: What was found.
        experiment: What was run.
    """
    at = "" if result.touch is None else short_time(result.touch)
    limited = {limit.verdict for limit in result.before} - {"rounding"}  # else one line says so
    rounding = sorted((max(g.gaps), g.unit) for g in result.whole if g.verdict == "rounding")
    most = {unit: quantity(gap, unit) for gap, unit in rounding}  # the largest of each unit
    asked = [milliseconds(period, 3) for period in result._periods]
    unlike = len(set(asked)) > 1
    by_verdict = grouped((limit.verdict, limit) for limit in result.whole)
    lead = _leading(by_verdict)
    # Of the unit of the first, that which is farthest apart with the steps as given.
    alike = [limit for limit in result.whole if limit.unit == result.whole[0].unit]
    far = max(alike, key=lambda limit: limit.gaps[0])
    title = f"The gap with finer steps, before the first touch at {at}"
    return template.page(
        "convergence",
        _of_the_limit(result, by_verdict, lead, at),
        experiment=experiment,
        left=result.labels[0],
        right=result.labels[1],
        counts=", ".join(f"{verdict} {len(of_it)}" for verdict, of_it in by_verdict.items()),
        name=name_of(far.name),
        left_moved=quantity(far.moved[0], far.unit),
        right_moved=quantity(far.moved[1], far.unit),
        until=result.until,
        steps=" and ".join(dict.fromkeys(milliseconds(step, 3) for step in result.steps)),
        here=asked[0] if unlike else None,
        there=asked[1],
        late=significant(max(result._periods)),
        before=_limits(result.before, title) if at and limited else None,
        whole=_limits(result.whole, "The gap with finer steps, over the whole run"),
        rounding=len(rounding) or None,
        total=len(result.whole),
        most=listed([*most.values()]),
        touch=if_true(at and len(result._engines) > 1),
        quarter=significant(min(result.steps) / 4) if result.unclear and not at else None,
    )


def _limits(limits: Sequence[Figures], title: str) -> Table:
    """A row for each gap that is more than rounding: with the first steps and the finest three."""
    levels = len(limits[0].gaps)
    return Table.of(
        [limit for limit in limits if limit.verdict != "rounding"],
        {
            "quantity": lambda limit: name_of(limit.name),
            "the gap is": lambda limit: limit.verdict,
            **{
                _FINER[k]: lambda limit, k=k: quantity(limit.gaps[k], limit.unit)
                for k in sorted({0, *range(levels - 3, levels)})
            },
            "at 0": lambda limit: quantity(limit.limit, limit.unit),
        },
        title,
        words={"the gap is"},
        emphasis=lambda limit: limit.verdict in ("stays", "in part"),
    )


def _leading(by_verdict: Mapping[str, Sequence[Figures]]) -> Figures:
    """The gap that the headline is of: what stays, or what is unclear, whichever is more often."""
    unclear = by_verdict.get("unclear", [])
    stay = [*by_verdict.get("stays", []), *by_verdict.get("in part", [])]
    said = (stay if len(stay) > len(unclear) else unclear) or [*chain(*by_verdict.values())]
    same = (limit for limit in said if limit.unit == said[0].unit)
    return max(same, key=lambda limit: limit.gaps[-1 if said is stay else 0])


def _of_the_limit(
    result: Figures, by_verdict: Mapping[str, Sequence[Figures]], most: Figures, touch: str
) -> Headline:
    if result.vanishes:
        return Headline(LEADS["vanishes" if by_verdict.keys() - {"rounding"} else "rounding"])
    coarse, fine = (quantity(most.gaps[k], most.unit) for k in (0, -1))
    lead = LEADS[most.verdict].format(
        name=name_of(most.name),
        coarse=coarse,
        fine=fine,
        unclear=len(by_verdict.get("unclear", [])),
        total=len(result.whole),
    )
    before = {limit.verdict for limit in result.before}
    tells = touch and before and before <= {"rounding", "discretisation"}
    end = TOUCH[before == {"rounding"}].format(touch=touch) if tells else ""
    return Headline(lead, end=end, holds=False)


def one_step(result: Figures, labels: tuple[str, str], experiment: str) -> Page:
    """What each stage of a step gives on both sides: what parts first, and where.

    Args:
        result: What was found.
        labels: What the sides are called.
        experiment: What was run.
    """
    compared = [gap for gap in result.stages if gap.told and gap.unit]
    null = max(compared, key=lambda gap: gap.null / (gap.tolerance or 1e-300))
    notes = [f"{gap.stage} is not compared: {gap.reason}." for gap in result.stages if not gap.told]
    notes += [sentence(line) for line in result.notes]
    first = result.first
    differ = [gap for gap in result.stages if gap.beyond]
    forces = {  # the largest of each unit
        gap.unit: f"{gap.stage}, {quantity(gap.worst, gap.unit)} at {moment(gap.at)} s, {gap.where}"
        for gap in sorted(differ, key=lambda gap: gap.worst)
        if gap.stage in FORCES
    }
    return template.page(
        "one_step",
        experiment=experiment,
        left=labels[0],
        right=labels[1],
        moments=result.moments,
        until=result.until,
        every=result.every,
        primed=result.primed or "nothing",
        stages=Table(
            ("stage", *_STAGE_HEADS),
            [(gap.stage, *_stage_cells(gap)) for gap in result.stages],
            "The stages of a step, in their order",
            words=frozenset({0, 5}),
            emphasis=frozenset(k for k, gap in enumerate(result.stages) if gap is result.first),
            wide=frozenset({4, 7, 8}),
        ),
        relative=figure(result.relative),
        null=quantity(null.null, null.unit),
        stage=null.stage,
        spikes=Table.of(
            result.spikes,
            {
                "at, s": lambda spike: moment(spike.at),
                "velocity update apart": lambda spike: quantity(spike.size, spike.unit),
                "joint": lambda spike: spike.joint,
                "first stage": lambda spike: spike.stage,
                "where": lambda spike: spike.where,
            },
            "The moments that stand out",
            words={"joint", "first stage", "where"},
        ),
        notes=Items(notes),
        same=None if first else True,
        exact=if_true(all(gap.worst == 0 for gap in result.stages)),
        differs=False if first else None,
        first=first and first.stage,
        since=first and moment(first.first),
        beyond=first and first.beyond,
        where=first and first.where,
        others=listed([f"{g.stage} ({g.leads})" for g in differ if g.leads and g != first]) or None,
        forces="; ".join(forces.values()) or None,
    )


def _stage_cells(gap: Figures) -> tuple[str, ...]:
    if not gap.told or not gap.unit:
        return NONE, NONE, NONE, NONE, gap.reason or NONE, NONE, NONE, NONE
    return (
        str(gap.beyond),
        str(gap.leads),
        quantity(gap.worst, gap.unit) if gap.beyond else "≈ 0" if gap.worst else "0",
        moment(gap.at) if gap.beyond and gap.at is not None else NONE,
        gap.where if gap.beyond else NONE,
        moment(gap.first),
        quantity(gap.null, gap.unit),
        quantity(gap.tolerance, gap.unit),
    )


def versions(comparisons: Sequence[Comparison], request: Request) -> Page:
    """What each comparison of a release with the next one gives, and a command that asks why."""
    what, model = request.what[0], request.model or request.scenario().model
    rows, changed, bars = [], [], []
    for comparison in comparisons:
        both = comparison.left.trace.header, comparison.right.trace.header
        left, right = (header.provenance.versions[header.backend] for header in both)
        cells, worst = ("nothing differs", NONE, NONE, NONE), leading(comparison)
        bars.append(worst.max / worst.tolerance if worst.tolerance else 0.0)
        if worst.max:
            largest, tolerance = (quantity(v, worst.unit) for v in (worst.max, worst.tolerance))
            cells = (name_of(worst.name), largest, short_time(worst.at), tolerance)
        rows.append((left, right, *cells, "agrees" if comparison.agrees else "DIFFERS"))
        if not comparison.agrees:
            changed.append((f"MuJoCo {left} and {right}", [f"{model}@{s.backend}" for s in both]))
    heads = ("release", "next", "quantity", "largest", "at", "tolerance", "verdict")
    return template.page(
        "versions",
        experiment=Path(what).name,
        first=rows[0][0],
        last=rows[-1][1],
        until=max(comparison.until for comparison in comparisons),
        steps=Table(heads, rows, "From release to release", words=frozenset({0, 1, 2, 6})),
        bars=Bars(
            "How far a release is from the next",
            "largest gap [tolerances]",
            [f"{left} to {right}" for left, right, *_ in rows],
            {"farthest beyond its tolerance": bars},
        ),
        why=[Code([command(["statemachine", "compare", what, *sides, "--why"])])
             for _, sides in changed],
        same=None if changed else True,
        differs=False if changed else None,
        pairs=listed([pair for pair, _ in changed]) or None,
    )  # fmt: skip
