"""The page of one step on each side from the same states: what parts first, and where."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import StepComparison
from ..compare.one_step import StageGap
from ..measures.text import NONE, figure, listed, quantity, sentence, short_time
from ..page import Headline, Items, Page, Table, TableCell, Text
from . import template

SAME_BITS = "From the same state both sides take the same step, to the last bit"
SAME_STEP = "From the same state both sides take the same step"
PART = "The sides part in the stage “{stage}”, {when} (at {beyond} of {moments} moments): {where}"
BEFORE = "What comes before it in a step is the same on both sides."
OTHERS = "At other moments the first stage that differs is {stages}: that has another cause."
_HEADS = ("stage", "differs", "first", "largest", "at, s", "where", "from, s", "null", "tolerance")


def page(
    result: StepComparison, labels: tuple[str, str], experiment: str, said: Sequence[str] = ()
) -> Page:
    """What each stage of a step gives on both sides.

    Args:
        result: What was found.
        labels: What the sides are called.
        experiment: What was run.
        said: Lines to say before anything else.
    """
    compared = [gap for gap in result.stages if gap.told and gap.unit]
    null = max(compared, key=lambda gap: gap.null / (gap.tolerance or 1e-300))
    left_out = [gap for gap in result.stages if not gap.told]
    notes = [f"{gap.stage} is not compared: {gap.reason}." for gap in left_out]
    notes += [sentence(line) for line in result.notes]
    stages = Table(
        _HEADS,
        [_row(gap) for gap in result.stages],
        "The stages of a step, in their order",
        words=frozenset({0, 5}),
        emphasis=frozenset(k for k, gap in enumerate(result.stages) if gap is result.first),
        wide=frozenset({7, 8}),
    )
    return template.page(
        "one_step",
        _headline(result),
        experiment=experiment,
        left=labels[0],
        right=labels[1],
        moments=result.moments,
        until=result.until,
        said=[Text(line) for line in said],
        every=result.every,
        primed=result.primed or "nothing",
        stages=[stages],
        relative=figure(result.relative),
        null=quantity(null.null, null.unit),
        stage=null.stage,
        spikes=[_spikes(result)] if result.spikes else [],
        notes=[Items(notes)] if notes else [],
    )


def _row(gap: StageGap) -> tuple[str, ...]:
    if not gap.told or not gap.unit:
        return gap.stage, NONE, NONE, gap.reason or NONE, NONE, NONE, NONE, NONE, NONE
    return (
        gap.stage,
        str(gap.beyond),
        str(gap.leads),
        quantity(gap.worst, gap.unit) if gap.beyond else "≈ 0" if gap.worst else "0",
        TableCell(f"{gap.at:.3f}", at=gap.at) if gap.beyond and gap.at is not None else NONE,
        gap.where if gap.beyond else NONE,
        TableCell(f"{gap.first:.3f}", at=gap.first) if gap.first is not None else "never",
        quantity(gap.null, gap.unit),
        quantity(gap.tolerance, gap.unit),
    )


def _spikes(result: StepComparison) -> Table:
    return Table(
        ("at, s", "acceleration apart", "joint", "first stage", "where"),
        [
            (
                TableCell(f"{spike.at:.3f}", at=spike.at),
                quantity(spike.size, spike.unit),
                spike.joint,
                spike.stage,
                spike.where,
            )
            for spike in result.spikes
        ],
        "The moments that stand out",
        words=frozenset({2, 3, 4}),
    )


def _headline(result: StepComparison) -> Headline:
    first = result.first
    if first is None:
        same = all(gap.worst == 0 for gap in result.stages)
        return Headline(SAME_BITS if same else SAME_STEP)
    when = "from the start" if first.first == 0 else f"from {short_time(first.first or 0.0)} on"
    lead = PART.format(
        stage=first.stage, when=when, beyond=first.beyond, moments=result.moments, where=first.where
    )
    others = [f"{gap.stage} ({gap.leads})" for gap in result.stages if gap.leads and gap != first]
    end = f"{BEFORE} {OTHERS.format(stages=listed(others))}" if others else BEFORE
    return Headline(lead, end=end, holds=False)
