"""Writing into the state writes into the simulator: immediately, and not at all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..experiments import forward
from ._words import millimetres, page_of, vector, where
from .page import Page, Table, Text, Verdict


def run(model: Any, options: Mapping[str, Any], progress: Any) -> forward.Forward:
    """Four readings."""
    return forward.run(model, joint=options["joint"], value=options["value"])


def page(results: Mapping[str, forward.Forward]) -> Page:
    """The readings, which are equal, and that no time passed."""
    blocks: list[Any] = [
        Text(
            "qpos is an input; the fingertip is derived from it. Nothing derived is computed "
            "until you ask: a write to qpos marks nothing as out of date, and what you read "
            "keeps saying what it said before. forward recomputes all of it, and takes no time."
        )
    ]
    for name, result in results.items():
        twins = {index for pair in result.equal for index in pair}
        blocks.append(
            Table(
                ("", "after", "fingertip [m]", "data.time"),
                [
                    (str(i + 1), reading.after, vector(reading.fingertip), f"{reading.time:g} s")
                    for i, reading in enumerate(result.readings)
                ],
                title=f"{where(results, name)}the fingertip, read four times",
                words=frozenset({0, 1}),
                emphasis=frozenset(twins),
            )
        )
        pairs = " and ".join(f"{i + 1} = {j + 1}" for i, j in result.equal) or "none"
        blocks.append(
            Verdict(
                f"{where(results, name)}equal bit by bit: {pairs}. The write moved nothing that "
                f"you can read; the second forward moved it {millimetres(result.moved, 1)}",
                result.equal == ((1, 2),),
            )
        )
        unmoved = all(reading.time == result.readings[0].time for reading in result.readings)
        blocks.append(
            Verdict(f"{where(results, name)}data.time is the same in all four readings", unmoved)
        )
    return page_of("The arm that is nowhere", results, blocks)
