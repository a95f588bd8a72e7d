"""Both runs as data that the page's script draws: shapes, poses, trails, contacts, a camera."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ....interface import Array, Ints
from ....measures import common_moments
from ....show.drawing import Drawing
from ....show.drawing.scene import Camera, Motion, camera_for
from ....show.html.geometry import mesh_as_data, mesh_of, packed, quantised
from ....show.templates import PageContent, render_texts
from ...compare.series import world_forces
from ...recordings import Trace
from ..compared_names import long_labels, traces_of
from .bones import bones_of
from .both_runs import BothRuns
from .poses import last_finite, orientations_between, positions_between, rows_at

# What a side is drawn as; or why that cannot be had, a sentence without its end.
Look = Drawing | str
_SMOOTH = 1 / 60  # seconds between two pictures that look like motion
_BYTES = 450_000  # of the poses of both sides; each takes 14
_FAR = 8.0  # extents of the model beyond which nothing is drawn
# Extents beyond which nothing counts for where the camera stands, but when the page opens.
_NEAR = 2.0
_WAY = 2000  # points of the way of a site
_DASH = 0.0015  # m between these
_TRIANGLES = 24_000  # of all shapes
_CONTACTS = 9_000  # of one side, at all moments together
_ASPECT = 1.45  # width of the picture through its height; the script has it too


@dataclass(frozen=True)
class Scene:
    """Both runs at the moments that are shown.

    Attributes:
        data: What is drawn, for the script; None if there is nothing to draw.
        notes: What a reader should know of the picture, in sentences.
        strongest: The largest contact force that is drawn [N].
    """

    data: dict[str, Any] | None
    notes: list[str]
    strongest: float = 0.0


@dataclass(frozen=True)
class SimplifiedMesh:
    """Shapes that are drawn with fewer triangles than they have.

    Attributes:
        drawn: Number of triangles that are drawn.
        triangles: Number of those that they have.
    """

    drawn: int
    triangles: int


@dataclass(frozen=True)
class SceneNotes(PageContent):
    """What a reader should know of the picture.

    Attributes:
        lacking: Why there is nothing to draw; "" where there is.
        simplified: Shapes that are drawn with fewer triangles.
        other: Side whose poses are taken between two of its rows; "" for none.
        hidden: How many compared moments are not shown.
        few: How many contacts of a moment are drawn at most; 0 where that is all of them.
    """

    template = "scene.md.j2"
    lacking: Literal["", "poses", "finite poses"] = ""
    simplified: Sequence[SimplifiedMesh] = ()
    other: str = ""
    hidden: int = 0
    few: int = 0


@dataclass(frozen=True)
class SideNotes(PageContent):
    """What a reader should know of a side.

    Attributes:
        label: What it is called.
        left_out: What is not drawn.
        why_not: Why its shapes cannot be had; "" where they can.
    """

    template = "scene_side.md.j2"
    label: str
    left_out: Sequence[str]
    why_not: str


def moments_of(left: Trace, right: Trace, must: Sequence[float] = ()) -> tuple[Array, int]:
    """Return the moments to show: those compared, unless they are too few to look like motion.

    Args:
        left: A trace; without enough common moments its own are shown.
        right: The other.
        must: Moments that have to be among them [s].

    Returns:
        (n,) since the start [s], and how many compared moments are left out for their number.
    """
    bodies = len(left.header.bodies) + len(right.header.bodies)
    most = max(60, min(1200, _BYTES // (14 * bodies)))
    common = common_moments(left.time, right.time, (left.timestep, right.timestep)).time
    time, until = common, float(common[-1])
    if until / max(1, len(common) - 1) > max(_SMOOTH, 1.5 * max(left.timestep, right.timestep)):
        time = left.time - left.time[0]
        time = time[time <= until + 1e-9]
    wanted = np.searchsorted(time, np.array([*must, until]) - 1e-9)
    keep = np.union1d(np.arange(0, len(time), -(-len(time) // most)), wanted)
    time = time[np.minimum(keep, len(time) - 1)]
    return time, max(0, len(common) - len(time))


def scene_of(
    runs: BothRuns, looks: Sequence[Look], times: Array, left_out: int = 0, start: int = 0
) -> Scene:
    """Return both runs at the moments that are shown.

    Args:
        runs: The runs.
        looks: What each side is drawn as; the same object twice if both are of one model.
        times: (n,) the moments that are shown [s].
        left_out: How many compared moments are not.
        start: The moment that the page opens at, among them.
    """
    traces, site = traces_of(runs.comparison), runs.comparison.tip
    if any("xpos" not in trace or "xquat" not in trace for trace in traces):
        return Scene(None, render_texts(SceneNotes(lacking="poses")))
    labels = long_labels(runs.comparison)
    notes, drawings = _drawings(traces, looks, labels)
    shapes = list(dict.fromkeys(drawings))
    meshes = [mesh_of(drawing, _TRIANGLES // len(shapes)) for drawing in shapes]
    simplified = [
        SimplifiedMesh(len(mesh.faces), mesh.simplified) for mesh in meshes if mesh.simplified
    ]
    extent = max(drawing.extent for drawing in drawings)
    places = [rows_at(trace, times) for trace in traces]
    poses = [
        positions_between(trace["xpos"], *place)
        for trace, place in zip(traces, places, strict=True)
    ]
    box = _box(poses, drawings[0], extent)
    if box is None:
        return Scene(None, render_texts(SceneNotes(lacking="finite poses")))
    motions = [
        Motion(drawing, box.clipped(pos), orientations_between(trace["xquat"], *place))
        for drawing, pos, trace, place in zip(drawings, poses, traces, places, strict=True)
    ]
    tips = _tips(traces, places, site)
    few = max(2, _CONTACTS // len(times))
    contacts = [
        _contacts(trace, rows, few) for trace, (rows, _) in zip(traces, places, strict=True)
    ]
    sides = []
    for k, motion in enumerate(motions):
        side = _side_data(motion, shapes.index(motion.drawing), box)
        side["tip"] = packed(tips[k], "f4") if tips else ""
        side["contacts"] = contacts[k].as_data()
        side |= _way(traces[k], site, times)
        sides.append(side)
    notes += render_texts(
        SceneNotes(
            simplified=simplified,
            other=labels[1] if places[1][1].any() else "",
            hidden=left_out,
            few=few if any(of_side.more for of_side in contacts) else 0,
        )
    )
    camera = camera_for(motions, _ASPECT, _NEAR * extent, start)
    data = {
        "moving": _moving(*traces),
        **box.as_data(),
        "extent": extent,
        "near": _near(tips, start, extent),
        "floor": _floor_height(drawings[0]),
        **_camera_data(camera),
        "meshes": [mesh_as_data(mesh) for mesh in meshes],
        "sides": sides,
    }
    return Scene(data, notes, max(of_side.strongest for of_side in contacts))


@dataclass(frozen=True, eq=False)
class _Box:
    """What part of space is drawn.

    Attributes:
        low: (3,) its lowest corner [m].
        span: (3,) the lengths of its edges [m].
    """

    low: Array
    span: Array

    def clipped(self, pos: Array) -> Array:
        """Return positions (n, nbody, 3) that are finite, within the box."""
        return np.clip(last_finite(pos), self.low, self.low + self.span)

    def as_data(self) -> dict[str, list[float]]:
        """Return it for the script."""
        return {"low": self.low.tolist(), "span": self.span.tolist()}


def _box(poses: Sequence[Array], drawing: Drawing, extent: float) -> _Box | None:
    """Return what has all positions (n, nbody, 3) that are not too far away in it.

    None where none of them is finite.
    """
    finite = np.concatenate([pos[np.isfinite(pos).all(axis=2)] for pos in poses])
    if not len(finite):
        return None
    middle = np.asarray(drawing.center)
    low = np.maximum(finite.min(axis=0), middle - _FAR * extent)
    high = np.minimum(finite.max(axis=0), middle + _FAR * extent)
    return _Box(low, np.maximum(high - low, 1e-6))


def _floor_height(drawing: Drawing) -> float | None:
    """Return where the floor of a drawing is [m]; None without a floor."""
    ground = [float(part.vertices[0, 2]) for part in drawing.parts if part.is_ground]
    return ground[0] if ground else None


def _side_data(motion: Motion, mesh: int, box: _Box) -> dict[str, Any]:
    """Return the poses of a side, and the number of its mesh, for the script."""
    return {
        "mesh": mesh,
        "bodies": motion.xpos.shape[1],
        "pos": packed(quantised(motion.xpos, box.low, box.span), "u2"),
        "quat": packed(np.round(motion.xquat * 32767), "i2"),
    }


def _camera_data(camera: Camera) -> dict[str, Any]:
    """Return a camera for the script, which has its angles about the target, not of its view."""
    azimuth = math.radians(camera.azimuth) - math.pi
    elevation = -math.radians(camera.elevation)
    return {
        "camera": [*camera.target, camera.distance, azimuth, elevation],
        "opening": math.radians(camera.fovy),
    }


def _near(tips: tuple[Array, Array] | None, start: int, extent: float) -> float:
    """Return from how far the site is looked at when the reader asks for it [m]."""
    if tips is None:
        return 0.55 * extent
    gap = np.linalg.norm(tips[0][start] - tips[1][start])
    return float(np.clip(25 * gap, 0.4 * extent, 0.55 * extent))


def _drawings(
    traces: Sequence[Trace], looks: Sequence[Look], labels: Sequence[str]
) -> tuple[list[str], list[Drawing]]:
    """Return a drawing for each side, of sticks where there is none better; and notes on them."""
    notes: list[str] = []
    drawings: list[Drawing] = []
    for trace, look, label in zip(traces, looks, labels, strict=True):
        if drawings and look is looks[0]:
            return notes, [*drawings, *drawings]
        drawings.append(bones_of(trace) if isinstance(look, str) else look)
        why_not = look if isinstance(look, str) else ""
        notes += render_texts(SideNotes(label, drawings[-1].left_out, why_not))
    return notes, drawings


def _tips(
    traces: Sequence[Trace], places: Sequence[tuple[Ints, Array]], tip: str
) -> tuple[Array, Array] | None:
    if any("site_xpos" not in trace or tip not in trace.header.sites for trace in traces):
        return None
    left, right = (
        positions_between(trace.site(tip)[0], *place)
        for trace, place in zip(traces, places, strict=True)
    )
    return (left, right) if np.isfinite([left, right]).all() else None


def _way(trace: Trace, tip: str, shown: Array) -> dict[str, str]:
    """Return the path of a site at the rows that its side has, and how much of it lies behind."""
    if "site_xpos" not in trace or tip not in trace.header.sites:
        return {"way": "", "behind": ""}
    elapsed = trace.time - trace.time[0]
    rows = np.flatnonzero(elapsed <= shown[-1] + 1e-9)
    rows = np.unique([*rows[:: -(-len(rows) // _WAY)], rows[-1]])
    way = trace.site(tip)[0][rows]
    if len(rows) < 2 or not np.isfinite(way).all():
        return {"way": "", "behind": ""}
    # Points as far apart on the way as each other, so that its dashes are as long.
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    along += 1e-9 * np.arange(len(along))  # where it stands still, time goes on
    at = np.linspace(0.0, along[-1], int(np.clip(along[-1] / _DASH, 2, _WAY)))
    way = np.column_stack([np.interp(at, along, axis) for axis in way.T])
    when = np.interp(at, along, elapsed[rows])
    behind = np.clip(np.searchsorted(when, shown + 1e-9, side="right") - 1, 0, len(at) - 1)
    return {"way": packed(way, "f4"), "behind": packed(behind, "u2")}


@dataclass(frozen=True, eq=False)
class _Contacts:
    """The contacts of one side at the moments that are shown.

    Attributes:
        counts: (n,) how many there are at each moment; None where the trace tells none.
        where: (c, 6) of each the place [m] and the force [N], in world axes.
        strongest: The largest of the forces [N].
        more: Whether there are more at some moment than are drawn.
    """

    counts: Ints | None
    where: Array
    strongest: float
    more: bool

    def as_data(self) -> dict[str, str]:
        """Return them for the script."""
        if self.counts is None:
            return {"count": "", "at": ""}
        return {"count": packed(self.counts, "u1"), "at": packed(self.where, "f4")}


def _contacts(trace: Trace, rows: Ints, most: int) -> _Contacts:
    """Return the contacts in each row, the strongest first, at most so many."""
    if "contact_row" not in trace:
        return _Contacts(None, np.empty((0, 6)), 0.0, more=False)
    begins = np.searchsorted(trace["contact_row"], rows)
    ends = np.searchsorted(trace["contact_row"], rows, side="right")
    strength = np.linalg.norm(np.nan_to_num(trace["contact_force"]), axis=1)
    counts = np.minimum(ends - begins, min(most, 255))
    chosen = []
    for begin, end, count in zip(begins, ends, counts, strict=True):
        chosen.append(begin + np.argsort(-strength[begin:end], kind="stable")[:count])
    places = np.concatenate(chosen)
    where = np.hstack([trace["contact_pos"][places], world_forces(trace)[places]])
    where = np.nan_to_num(where)
    strongest = float(np.linalg.norm(where[:, 3:], axis=1).max(initial=0.0))
    return _Contacts(counts, where, strongest, more=bool((ends - begins > most).any()))


def _moving(left: Trace, right: Trace) -> list[int]:
    """Return for each body of the second side whether it is elsewhere later or on the first."""
    pairs = zip(left.header.bodies, right.header.bodies, strict=False)
    still = np.array([left_body == right_body for left_body, right_body in pairs])
    for trace, column in itertools.product((left, right), ("xpos", "xquat")):
        moved = np.abs(trace[column][:, : len(still)] - left[column][0, : len(still)])
        still &= moved.max(axis=(0, 2)) <= 1e-6
    return [*np.where(still, 0, 1).tolist(), *[1] * (len(right.header.bodies) - len(still))]
