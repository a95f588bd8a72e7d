"""What a certificate says: the grade of the reading first, then how far apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..installed import WITNESS
from ..measures.text import capital, count, degrees, listed, millimetres, vector
from ..page import Items, Page, Table, Text, Verdict
from ..witness import OWN_READING
from ._words import differences, page_of, where
from .fingertip import Certificate, Offset

_SHOWN = 12  # rows of a table of tips


def page(results: Mapping[str, Certificate]) -> Page:
    """Frames first, then the differences."""
    first = next(iter(results.values()))
    blocks: list[Any] = [Text(_introduction(first))]
    if first.prepared:
        blocks.append(
            Text(
                f"Pinocchio's parser reads a part of MJCF. So the text of {first.witness_file} was "
                "first written another way:"
            )
        )
        blocks.append(Items(list(first.prepared)))
    if first.left_out:
        blocks.append(Text(f"Not in {first.witness_file}: {listed(first.left_out)}."))
    for name, result in results.items():
        if len(result.tips) > 1:
            blocks += _tips(result, where(results, name))
    if len(first.tips) == 1:
        blocks.append(_table(results))
    for name, result in results.items():
        said = f"{where(results, name)}{_said(result)}"
        if result.grade == OWN_READING or not result.agrees:
            blocks.append(Verdict(said, result.agrees))
        else:
            blocks.append(Text(capital(said)))
    if all(result.site == first.site for result in results.values()):
        blocks += differences(
            results,
            [("default pose", lambda a, b: f"{math.dist(a.default_pose, b.default_pose):.1e} m")],
        )
    return page_of("The fingertip, and an independent witness", results, blocks)


def _introduction(first: Certificate) -> str:
    pinocchio = f"Pinocchio {first.provenance.versions[WITNESS]}"
    tip = f"the fingertip ({first.site})" if len(first.tips) == 1 else _where_tips(first)
    asked = (
        f" {first.poses} poses within the joint limits, the default one first, seed "
        f"{first.provenance.seed}."
    )
    if first.grade == OWN_READING:
        return (
            f"The engine computes where {tip} is, by forward; {pinocchio} computes it from "
            f"{first.witness_file}, with its own parser and its own code.{asked}"
        )
    return (
        f"The engine computes where {tip} is, by forward; {pinocchio} computes it with its own "
        f"code from the numbers that the engine compiled of {first.witness_file}. This is the "
        f"same reading of the file: a misreading is in the numbers, and cannot be seen here. "
        f"It is no own reading, because {first.reason}.{asked}"
    )


def _where_tips(first: Certificate) -> str:
    return f"each of {len(first.tips)} tips (bodies that joints move and that carry no other)"


def _table(results: Mapping[str, Certificate]) -> Table:
    every = results.values()
    return Table(
        ("", *results),
        [
            ("grade", *(r.grade for r in every)),
            ("frames apart", *(_offset(r.frames) for r in every)),
            ("default pose [m]", *(vector(r.default_pose) for r in every)),
            ("position, worst [m]", *(_figure(r.position_worst) for r in every)),
            ("position, median [m]", *(_figure(r.position_median) for r in every)),
            ("rotation matrix, worst", *(_figure(r.rotation_worst) for r in every)),
            ("rotation matrix, median", *(_figure(r.rotation_median) for r in every)),
        ],
        title="Engine against witness",
    )


def _tips(result: Certificate, prefix: str) -> list[Table | Text]:
    """The worst gaps; those that are not shown are no larger."""
    rows = [
        (tip.site, _figure(tip.position_worst), _figure(tip.rotation_worst), _offset(tip.frames))
        for tip in result.tips[:_SHOWN]
    ]
    head = ("tip", "position, worst [m]", "rotation matrix, worst", "frames apart")
    title = capital(f"{prefix}engine against witness, the worst first ({result.grade})")
    table = Table(head, rows, title=title, wide=frozenset({3}))
    more = len(result.tips) - _SHOWN
    return [table, Text(f"And {count(more, 'more tip')}, no worse.")] if more > 0 else [table]


def _offset(offset: Offset | None) -> str:
    if offset is None:
        return "no common body: not comparable"
    if offset.same:
        return "0 mm, 0°"
    return f"{millimetres(offset.distance)}, {degrees(offset.angle)}"


def _figure(value: float | None) -> str:
    return "refused" if value is None else f"{value:.1e}"


def _said(result: Certificate) -> str:
    if result.frames is not None and not result.frames.same:
        return (
            f"refused: {result.site!r} and the witness's {result.witness_frame!r} are different "
            f"frames, {_offset(result.frames)} apart, so comparing their poses says nothing "
            "about the engine"
        )
    within = f"within {result.tolerance:g} m and {result.tolerance:g}"
    if result.grade == OWN_READING or not result.agrees:
        verdict = "agrees with" if result.agrees else "DISAGREES with"
        return f"{verdict} the witness, {within} ({result.grade})"
    them = "it" if len(result.tips) == 1 else "them"
    return (
        f"same reading: from the same numbers, the engine and Pinocchio put {them} at the same "
        f"place, {within}. That checks the engine's arithmetic, and not that the file was read "
        "rightly."
    )
