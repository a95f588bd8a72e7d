"""The page of one step on each side from the same states: what parts first, and where."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import StepComparison
from ..compare.step_samples import StageGap
from ..measures.text import NONE, count, figure, quantity, sentence, short_time
from ..page import Block, Headline, Items, Page, Table, TableCell, Text


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
    each = "each" if result.every == 1 else f"every {_ordinal(result.every)}"
    primed = (
        f" {two} gets {result.primed}."
        if result.primed
        else f" {two} takes nothing of the step before."
    )
    blocks: list[Block] = [Text(line) for line in said]
    blocks += [
        Text(
            f"{two} is put to {each} state of {one}'s run, and both take one step: nothing drifts, "
            f"and a difference is of that step.{primed}"
        ),
        Table(
            ("stage", "differs", "of", "largest", "at, s", "where", "from, s", "null", "tolerance"),
            [_row(gap, result.moments) for gap in result.stages],
            "The stages of a step, in their order",
            words=frozenset({0, 5}),
            emphasis=frozenset(k for k, gap in enumerate(result.stages) if gap is result.first),
            wide=frozenset({7, 8}),
        ),
        Text(
            f"Differs: at how many moments it is beyond {figure(result.relative)} of its usual "
            f"size, and beyond the null: how far {one} gets from its own run when it is put back "
            "to its own states, since a restore may forget what the engine knows of contacts. "
            f"{_null(result)}"
        ),
    ]
    if result.spikes:
        blocks.append(_spikes(result))
    reasons = [
        f"{gap.stage} is not compared: {gap.reason}" for gap in result.stages if not gap.told
    ]
    notes = [sentence(line) for line in (*reasons, *result.notes)]
    blocks += [Items(notes)] if notes else []
    origin = f"{one} and {two}, {count(result.moments, 'moment')} until {result.until:g} s"
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


def _null(result: StepComparison) -> str:
    worst = [gap for gap in result.stages if gap.null > gap.tolerance]
    if not worst:
        return "Here that is nothing."
    most = max(worst, key=lambda gap: gap.null / (gap.tolerance or 1e-300))
    return f"Here that is up to {_size(most.null, most)} ({most.stage})."


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


def _ordinal(number: int) -> str:
    ends = {1: "st", 2: "nd", 3: "rd"}
    return f"{number}{'th' if number % 100 in (11, 12, 13) else ends.get(number % 10, 'th')}"


def _headline(result: StepComparison) -> Headline:
    first = result.first
    if first is None:
        if all(gap.worst == 0 for gap in result.stages):
            return Headline("From the same state both sides take the same step, to the last bit")
        return Headline("From the same state both sides take the same step")
    when = "from the start" if first.first == 0 else f"from {short_time(first.first or 0.0)} on"
    share = f"at {first.beyond} of {result.moments} moments"
    later = [gap.stage for gap in result.stages if gap.beyond and gap is not first]
    end = "What comes before it in a step is the same on both sides."
    if not later:
        end += " No later stage shows it."
    return Headline(
        f"The sides part in the stage “{first.stage}”, {when} ({share}): {first.where}",
        end=end,
        holds=False,
    )
