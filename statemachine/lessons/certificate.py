"""What a certificate says: the grade of the reading first, then how far apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..installed import WITNESS
from ..measures.text import degrees, listed, millimetres, vector
from ..page import Figures, Items, Page, Table
from ..witness import OWN_READING
from . import template
from .template import Results, by_engine, differences

_SHOWN = 12  # rows of a table of tips
_ROWS: Mapping[str, Callable[[Figures], str]] = {
    "grade": lambda r: r.grade,
    "distance of the two frames": lambda r: _offset(r.frames),
    "default pose [m]": lambda r: vector(r.default_pose),
    "position, worst [m]": lambda r: _figure(r.position_worst),
    "position, median [m]": lambda r: _figure(r.position_median),
    "rotation matrix, worst": lambda r: _figure(r.rotation_worst),
    "rotation matrix, median": lambda r: _figure(r.rotation_median),
}


def page(results: Results) -> Page:
    """Frames first, then the differences."""
    first = next(iter(results.values()))
    single = len(first.tips) == 1
    same_site = all(result.site == first.site for result in results.values())
    apart = {"default pose": lambda a, b: f"{math.dist(a.default_pose, b.default_pose):.1e} m"}
    blocks = {
        "prepared": Items(first.prepared),
        "tips": by_engine(results, _ROWS, "Engine against witness")
        if single
        else [_tips(*entry) for entry in results.items()],
        "differences": differences(results, apart) if same_site else [],
    }
    return template.page("certificate", results, {n: _slots(r) for n, r in results.items()}, blocks)


def _slots(result: Figures) -> dict[str, Any]:
    frames = result.frames
    return {
        "version": result.provenance.versions[WITNESS],
        "one": len(result.tips) == 1,
        "site": result.site,
        "tips_count": len(result.tips),
        "file": result.witness_file,
        "poses": result.poses,
        "seed": result.provenance.seed,
        "own_reading": result.grade == OWN_READING,
        "reason": result.reason,
        "rewritten": bool(result.prepared),
        "left_out": listed(result.left_out),
        "refused": frames is not None and not frames.same,
        "frames": _offset(frames),
        "witness_frame": result.witness_frame,
        "agrees": result.agrees,
        "same_place": result.agrees and result.grade != OWN_READING,
        "within": f"{result.tolerance:g}",
        "grade": result.grade,
    }


def _tips(name: str, result: Figures) -> Table:
    """The worst gaps; those that are not shown are no larger."""
    rows = [
        (tip.site, _figure(tip.position_worst), _figure(tip.rotation_worst), _offset(tip.frames))
        for tip in result.tips[:_SHOWN]
    ]
    head = ("tip", "position, worst [m]", "rotation matrix, worst", "distance of the two frames")
    worst = f"the worst of {len(result.tips)}"
    return Table(
        head,
        rows,
        title=f"{name} against the witness, {worst} ({result.grade})",
        wide=frozenset({3}),
    )


def _offset(offset: Figures | None) -> str:
    if offset is None:
        return "no common body: not comparable"
    if offset.same:
        return "0 mm, 0°"
    return f"{millimetres(offset.distance)}, {degrees(offset.angle)}"


def _figure(value: float | None) -> str:
    return "refused" if value is None else f"{value:.1e}"
