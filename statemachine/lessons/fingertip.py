"""The certificate in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..comparison.text import degrees, millimetres, vector
from ..experiments import fingertip
from ..installed import WITNESS
from ..page import Page, Table, Text, Verdict
from ._words import differences, page_of, where


def page(results: Mapping[str, fingertip.Certificate]) -> Page:
    """Frames first, then the differences."""
    first = next(iter(results.values()))
    seed = first.provenance.seed
    pinocchio = first.provenance.versions[WITNESS]
    blocks: list[Any] = [
        Text(
            f"The engine computes where the fingertip ({first.site}) is, by forward; Pinocchio "
            f"{pinocchio} computes it from {first.witness_file}, with its own parser and its own "
            f"code. {first.poses} poses within the joint limits, the default one first, seed "
            f"{seed}."
        ),
        Table(
            ("", *results),
            [
                ("frames apart", *(_offset(r.frames) for r in results.values())),
                ("default pose [m]", *(vector(r.default_pose) for r in results.values())),
                ("position, worst [m]", *(_figure(r.position_worst) for r in results.values())),
                ("position, median [m]", *(_figure(r.position_median) for r in results.values())),
                ("rotation matrix, worst", *(_figure(r.rotation_worst) for r in results.values())),
                (
                    "rotation matrix, median",
                    *(_figure(r.rotation_median) for r in results.values()),
                ),
            ],
            title="Engine against witness",
        ),
    ]
    for name, result in results.items():
        blocks.append(Verdict(f"{where(results, name)}{_said(result)}", result.agrees))
    blocks += differences(
        results,
        [("default pose", lambda a, b: f"{math.dist(a.default_pose, b.default_pose):.1e} m")],
    )
    return page_of("The fingertip, and an independent witness", results, blocks)


def _offset(offset: fingertip.Offset | None) -> str:
    if offset is None:
        return "no common body: not comparable"
    if offset.same:
        return "0 mm, 0°"
    return f"{millimetres(offset.distance)}, {degrees(offset.angle)}"


def _figure(value: float | None) -> str:
    return "refused" if value is None else f"{value:.1e}"


def _said(result: fingertip.Certificate) -> str:
    if result.frames is not None and not result.frames.same:
        return (
            f"refused: {result.site!r} and the witness's {result.witness_frame!r} are different "
            f"frames, {_offset(result.frames)} apart, so comparing their poses says nothing "
            "about the engine"
        )
    verdict = "agrees with" if result.agrees else "DISAGREES with"
    return f"{verdict} the witness, within {result.tolerance:g} m and {result.tolerance:g}"
