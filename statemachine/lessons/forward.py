"""Writing into the state writes into the simulator: immediately, and not at all."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..experiments import forward
from ..page import Code, Page, Table, Text, Verdict
from ._words import differences, millimetres, page_of, vector, where


def run(model: Any, options: Mapping[str, Any], progress: Any) -> forward.Forward:
    """Four readings."""
    return forward.run(model, joint=options["joint"], value=options["value"], site=options["site"])


def page(results: Mapping[str, forward.Forward]) -> Page:
    """The readings, which are equal, and that no time passed."""
    first = next(iter(results.values()))
    write = first.readings[2].after
    blocks: list[Any] = [
        Text(
            "qpos is an input; the fingertip is derived from it. Nothing derived is computed "
            "until you ask: a write to qpos marks nothing as out of date, and what you read "
            "keeps saying what it said before. forward recomputes all of it, and takes no time."
        ),
        Code(
            (
                "data = sm.make_data(model)   # 1",
                "sm.forward(model, data)      # 2",
                f"data.{write:<24}# 3",
                "sm.forward(model, data)      # 4",
            )
        ),
    ]
    twins = {index for result in results.values() for pair in result.equal for index in pair}
    several = len(results) > 1
    headers = [f"{name} [m]" for name in results] if several else ["fingertip [m]"]
    digits = 3 if several else 4  # so that two columns fit
    blocks.append(
        Table(
            ("", "after", *headers, "data.time"),
            [
                (
                    str(i + 1),
                    reading.after,
                    *(vector(r.readings[i].fingertip, digits) for r in results.values()),
                    f"{reading.time:g} s",
                )
                for i, reading in enumerate(first.readings)
            ],
            title="The fingertip, read four times",
            words=frozenset({0, 1}),
            emphasis=frozenset(twins),
        )
    )
    for name, result in results.items():
        blocks.append(
            Verdict(
                f"{where(results, name)}readings 2 and 3 are equal bit by bit: the write changed "
                "nothing that is derived",
                (1, 2) in result.equal,
            )
        )
        moved = millimetres(result.moved, 1)
        if result.moved:
            text = f"The second forward moved the fingertip by {moved}"
        else:
            text = (
                f"The second forward moved the fingertip by {moved}: {result.joint} was there "
                "already, or does not carry it"
            )
        blocks.append(Text(f"{where(results, name)}{text}."))
        unmoved = all(reading.time == result.readings[0].time for reading in result.readings)
        blocks.append(
            Verdict(f"{where(results, name)}data.time is the same in all four readings", unmoved)
        )
    rows = [(f"fingertip, reading {i + 1}", _apart(i)) for i in range(len(first.readings))]
    blocks += differences(results, rows)
    return page_of("The arm that is nowhere", results, blocks)


def _apart(reading: int) -> Callable[[Any, Any], str]:
    def say(one: forward.Forward, two: forward.Forward) -> str:
        return (
            f"{math.dist(one.readings[reading].fingertip, two.readings[reading].fingertip):.1e} m"
        )

    return say
