"""Page of a certificate: the grade of the reading first, then how far apart."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..installed import WITNESS
from ..measures.text import degrees, listed, millimetres, vector
from ..page import Block, Items, Page, Table
from . import template
from .fingertip import FingertipResult, FrameOffset, TipGap
from .template import by_engine, differences

_SHOWN = 12  # rows of a table of tips


def page(results: Mapping[str, FingertipResult]) -> Page:
    """Return the page of a certificate: frames first, then the differences."""
    first = next(iter(results.values()))
    blocks: dict[str, Block | Sequence[Block]] = {
        "prepared": Items(first.prepared),
        "tips": tables_of_gaps(results),
        "differences": tables_of_differences(results),
    }
    slots = {name: _slots(result) for name, result in results.items()}
    return template.page("certificate", results, slots, blocks)


def _slots(result: FingertipResult) -> dict[str, Any]:
    """Return what the page's slots take."""
    return {
        **_witness_slots(result),
        **_tip_slots(result),
        "poses": result.poses,
        "seed": result.provenance.seed,
        "refused": result.verdict == "different frames",
        "same_place": result.verdict == "same place",
        "agrees": result.agrees,
        "within": f"{result.tolerance:g}",
    }


def _witness_slots(result: FingertipResult) -> dict[str, Any]:
    """Return what the page says of the witness, and of what it read."""
    return {
        "version": result.provenance.versions[WITNESS],
        "file": result.witness_file,
        "own_reading": result.is_own_reading,
        "grade": result.grade,
        "reason": result.reason,
        "rewritten": bool(result.prepared),
        "left_out": listed(result.left_out),
    }


def _tip_slots(result: FingertipResult) -> dict[str, Any]:
    """Return what the page says of the tips that were compared."""
    return {
        "one": result.has_one_tip,
        "tips_count": len(result.tips),
        "site": result.site,
        "witness_frame": result.witness_frame,
        "frames": _offset(result.frames),
    }


def tables_of_gaps(results: Mapping[str, FingertipResult]) -> list[Table]:
    """Return the gaps: of one tip by engine, of several a table for each engine."""
    first = next(iter(results.values()))
    if first.has_one_tip:
        return [table_of_gap(results)]
    return [table_of_tips(engine, result) for engine, result in results.items()]


def table_of_gap(results: Mapping[str, FingertipResult]) -> Table:
    """Return the gap of the one tip by engine."""
    rows = {
        "grade": _grade,
        "distance of the two frames": _frames,
        "default pose [m]": _default_pose,
        "position, worst [m]": _position_worst,
        "position, median [m]": _position_median,
        "rotation matrix, worst": _rotation_worst,
        "rotation matrix, median": _rotation_median,
    }
    return by_engine(results, rows, "Engine against witness")


def _grade(result: FingertipResult) -> str:
    return result.grade


def _frames(gap: FingertipResult | TipGap) -> str:
    return _offset(gap.frames)


def _default_pose(result: FingertipResult) -> str:
    return vector(result.default_pose)


def _position_worst(gap: FingertipResult | TipGap) -> str:
    return _figure(gap.position_worst)


def _position_median(result: FingertipResult) -> str:
    return _figure(result.position_median)


def _rotation_worst(gap: FingertipResult | TipGap) -> str:
    return _figure(gap.rotation_worst)


def _rotation_median(result: FingertipResult) -> str:
    return _figure(result.rotation_median)


def table_of_tips(engine: str, result: FingertipResult) -> Table:
    """Return the worst gaps of an engine; those that are not shown are no larger."""
    return Table.of(
        result.tips[:_SHOWN],
        {
            "tip": lambda gap: gap.site,
            "position, worst [m]": _position_worst,
            "rotation matrix, worst": _rotation_worst,
            "distance of the two frames": _frames,
        },
        title=f"{engine} against the witness, the worst of {len(result.tips)} ({result.grade})",
        wide=("distance of the two frames",),
    )


def tables_of_differences(results: Mapping[str, FingertipResult]) -> list[Table]:
    """Return how far the engines' own default poses are apart, if all are of one tip."""
    if len({result.site for result in results.values()}) > 1:
        return []
    return differences(results, {"default pose": _apart})


def _apart(first: FingertipResult, other: FingertipResult) -> str:
    return f"{math.dist(first.default_pose, other.default_pose):.1e} m"


def _offset(offset: FrameOffset | None) -> str:
    """Write an offset between two frames; None is of files without a common body."""
    if offset is None:
        return "no common body: not comparable"
    if offset.same:
        return "0 mm, 0°"
    return f"{millimetres(offset.distance)}, {degrees(offset.angle)}"


def _figure(value: float | None) -> str:
    """Write a difference; None is of two frames, which are not compared."""
    return "refused" if value is None else f"{value:.1e}"
