"""The page of one step on each side from the same states: what parts first, and where."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import StepComparison
from ..compare.step_samples import StageGap
from ..measures.text import NONE, figure, quantity, sentence, short_time
from ..page import Block, Headline, Items, Page, Table, TableCell, Text

METHOD = (
    "{right} is put to a state of {left}'s run (every {every} steps), and both take one step: "
    "nothing drifts, and a difference is of that step. From the step before {right} gets: {primed}."
)
TOLERANCE = (
    "Differs: at how many moments it is beyond {relative} of its usual size, and beyond the null: "
    "how far {left} gets from its own run when it is put back to its own states, since a restore "
    "may forget what the engine knows of contacts. Here that is at most {null} ({stage})."
)
NOT_COMPARED = "{stage} is not compared: {reason}."
ORIGIN = "{left} and {right}; moments: {moments}, until {until:g} s"
SAME_BITS = "From the same state both sides take the same step, to the last bit"
SAME_STEP = "From the same state both sides take the same step"
PART = "The sides part in the stage “{stage}”, {when} (at {beyond} of {moments} moments): {where}"
BEFORE = "What comes before it in a step is the same on both sides."
_HEADS = ("stage", "differs", "of", "largest", "at, s", "where", "from, s", "null", "tolerance")


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
    one, two = labels
    sides = {"left": one, "right": two}
    primed = result.primed or "nothing"
    blocks: list[Block] = [
        *(Text(line) for line in said),
        Text(METHOD.format(every=result.every, primed=primed, **sides)),
        Table(
            _HEADS,
            [_row(gap, result.moments) for gap in result.stages],
            "The stages of a step, in their order",
            words=frozenset({0, 5}),
            emphasis=frozenset(k for k, gap in enumerate(result.stages) if gap is result.first),
            wide=frozenset({7, 8}),
        ),
        Text(_tolerance(result, sides)),
    ]
    if result.spikes:
        blocks.append(_spikes(result))
    notes = [
        NOT_COMPARED.format(stage=gap.stage, reason=gap.reason)
        for gap in result.stages
        if not gap.told
    ]
    notes += [sentence(line) for line in result.notes]
    blocks += [Items(notes)] if notes else []
    origin = ORIGIN.format(moments=result.moments, until=result.until, **sides)
    return Page(f"{experiment}: one step at a time", origin, blocks, _headline(result))


def _row(gap: StageGap, moments: int) -> tuple[str, ...]:
    if not gap.told or not gap.unit:
        return gap.stage, NONE, NONE, gap.reason or NONE, NONE, NONE, NONE, NONE, NONE
    return (
        gap.stage,
        str(gap.beyond),
        str(moments),
        _size(gap.worst, gap) if gap.beyond else "≈ 0" if gap.worst else "0",
        TableCell(f"{gap.at:.3f}", at=gap.at) if gap.beyond and gap.at is not None else NONE,
        gap.where if gap.beyond else NONE,
        TableCell(f"{gap.first:.3f}", at=gap.first) if gap.first is not None else "never",
        _size(gap.null, gap),
        _size(gap.tolerance, gap),
    )


def _size(value: float, gap: StageGap) -> str:
    return quantity(value, gap.unit)


def _tolerance(result: StepComparison, sides: dict[str, str]) -> str:
    """What a difference is, and how large the largest null is, in its tolerances."""
    compared = [gap for gap in result.stages if gap.told and gap.unit]
    most = max(compared, key=lambda gap: gap.null / (gap.tolerance or 1e-300))
    null = _size(most.null, most)
    relative = figure(result.relative)
    return TOLERANCE.format(relative=relative, null=null, stage=most.stage, **sides)


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
    return Headline(lead, end=BEFORE, holds=False)
