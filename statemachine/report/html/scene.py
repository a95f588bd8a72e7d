"""Both runs as data that the page's script draws: shapes, poses, trails, contacts, a camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...compare import labels_of
from ...drawing import Drawing
from ...drawing.camera import Camera
from ...interface import Array, Ints
from ...runs import Trace
from .. import template
from .geometry import bones_of, mesh_as_data, mesh_of, packed, quantised
from .timeline import Frames

_FAR = 8.0  # extents of the model beyond which nothing is drawn
OPENING = 0.6  # of the camera from top to bottom [rad]; the script has it too
_WAY = 2000  # points of the way of a site
_DASH = 0.0015  # m between these
_CLOSE = 0.05  # of the scene: a gap below it is looked at from near
_TRIANGLES = 24_000  # of all shapes
_CONTACTS = 9_000  # of one side, at all moments together
_ASPECT = 1.45  # width of the picture through its height


@dataclass(frozen=True, eq=False)
class SideDrawing:
    """What a side is drawn as.

    Attributes:
        drawing: Its shapes; None if they cannot be had.
        why_not: Then why; a sentence without its end.
    """

    drawing: Drawing | None
    why_not: str = ""


@dataclass(frozen=True, eq=False)
class Scene:
    """What is drawn.

    Attributes:
        data: For the script; None if the traces tell no poses.
        notes: What a reader should know of the picture, in sentences.
        strongest: The largest contact force that is drawn [N].
    """

    data: dict[str, Any] | None
    notes: tuple[str, ...]
    strongest: float = 0.0


def scene_of(
    one: Trace,
    two: Trace,
    frames: Frames,
    looks: Sequence[SideDrawing],
    tip: str,
    start: int = 0,
) -> Scene:
    """Both runs at the moments that are shown.

    Args:
        one: A trace.
        two: The other.
        frames: The moments that are shown.
        looks: What each side is drawn as; the same object twice if both are of one model.
        tip: The site whose way is drawn; "" for none.
        start: The moment that the page opens at, among the frames.
    """
    traces = (one, two)
    if any("xpos" not in t or "xquat" not in t for t in traces):
        return Scene(None, ("The traces tell no poses of the bodies: there is nothing to draw.",))
    notes, drawings = _drawings(traces, looks)
    shared = drawings[0] is drawings[1]
    most = _TRIANGLES // (1 if shared else 2)
    meshes = [mesh_of(drawing, most) for drawing in drawings[: 1 if shared else 2]]
    notes += [
        f"The shapes are drawn with {len(mesh.faces)} of their {mesh.simplified} triangles."
        for mesh in meshes
        if mesh.simplified
    ]
    extent = max(drawing.extent for drawing in drawings)
    places = ((one, frames.one, np.zeros(len(frames))), (two, frames.two, frames.share))
    poses = [_between(trace["xpos"], rows, share) for trace, rows, share in places]
    finite = np.concatenate([pos[np.isfinite(pos).all(axis=2)] for pos in poses])
    if not len(finite):
        return Scene(None, ("No pose of a body is a finite number: there is nothing to draw.",))
    middle = np.asarray(drawings[0].center)
    low = np.maximum(finite.min(axis=0), middle - _FAR * extent)
    high = np.minimum(finite.max(axis=0), middle + _FAR * extent)
    span = np.maximum(high - low, 1e-6)
    tips = _tips(places, tip)
    camera = _camera(poses, tips, extent)
    sides = []
    strongest = 0.0
    few = max(2, _CONTACTS // len(frames))
    for k, (trace, rows, share) in enumerate(places):
        contacts, most_of_side = _contacts(trace, rows, few)
        quat = _turned_between(trace["xquat"], rows, share)
        strongest = max(strongest, most_of_side)
        sides.append(
            {
                "mesh": 0 if shared else k,
                "bodies": len(trace.header.bodies),
                "pos": packed(quantised(_held(poses[k]), low, span), "u2"),
                "quat": packed(np.round(quat * 32767), "i2"),
                "tip": packed(tips[k], "f4") if tips else "",
                "contacts": contacts,
                **_way(trace, tip, float(frames.time[-1]), frames.time),
            }
        )
    notes += template.texts(
        "html/scene",
        other=labels_of(one.header, two.header).long[1] if frames.between else None,
        hidden=frames.left_out or None,
        few=few if any(_most_at_once(trace) > few for trace in traces) else None,
    )
    data = {
        "moving": [int(_moves(one, two, body)) for body in range(len(two.header.bodies))],
        "low": low.tolist(),
        "span": span.tolist(),
        "extent": extent,
        **_nearness(tips, start, extent),
        "floor": _floor(drawings),
        # The script has the angles of the camera about the target, not of its view.
        "camera": [
            *camera.target,
            camera.distance,
            math.radians(camera.azimuth) - math.pi,
            -math.radians(camera.elevation),
        ],
        "meshes": [mesh_as_data(mesh) for mesh in meshes],
        "sides": sides,
    }
    return Scene(data, tuple(notes), strongest)


def _nearness(tips: tuple[Array, Array] | None, start: int, extent: float) -> dict[str, Any]:
    """Whether to begin close to the site, and how close: so that a small gap is seen."""
    if tips is None:
        return {"begin_near": False, "near": 0.55 * extent}
    gap = float(np.linalg.norm(tips[0] - tips[1], axis=1).max())
    now = float(np.linalg.norm(tips[0][start] - tips[1][start]))
    return {
        "begin_near": bool(0 < gap < _CLOSE * extent),
        "near": float(np.clip(25 * now, 0.4 * extent, 0.55 * extent)),
    }


def _drawings(
    traces: Sequence[Trace], looks: Sequence[SideDrawing]
) -> tuple[list[str], list[Drawing]]:
    """A drawing for each side, of sticks where there is none better."""
    notes: list[str] = []
    drawings: list[Drawing] = []
    labels = labels_of(*(trace.header for trace in traces)).long
    for trace, look, label in zip(traces, looks, labels, strict=True):
        if drawings and look is looks[0]:
            return notes, [*drawings, *drawings]
        drawings.append(look.drawing or bones_of(trace))
        notes += template.texts(
            "html/scene_side",
            left_out=", ".join(drawings[-1].left_out) or None,
            label=label if look.drawing is None else None,
            why_not=look.why_not,
        )
    return notes, drawings


def _held(pos: Array) -> Array:
    """Positions that are not finite are those of the last moment that were."""
    pos = pos.copy()
    for k in range(len(pos)):
        bad = ~np.isfinite(pos[k]).all(axis=1)
        pos[k][bad] = pos[k - 1][bad] if k else 0.0
    return pos


def _between(values: Array, rows: Ints, share: Array) -> Array:
    """Rows of values, each gone a share of the way to the next."""
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    after = values[np.minimum(rows + 1, len(values) - 1)]
    return np.where(share > 0, (1 - share) * values[rows] + share * after, values[rows])


def _turned_between(quat: Array, rows: Ints, share: Array) -> Array:
    """The same of orientations, the shorter way, of unit length."""
    after = quat[np.minimum(rows + 1, len(quat) - 1)]
    same = (quat[rows] * after).sum(axis=-1, keepdims=True) >= 0
    weight = share[:, None, None]
    mixed = np.nan_to_num((1 - weight) * quat[rows] + weight * np.where(same, after, -after))
    length = np.linalg.norm(mixed, axis=-1, keepdims=True)
    return np.where(length > 0, mixed / np.where(length > 0, length, 1.0), [1.0, 0.0, 0.0, 0.0])


def _tips(places: Sequence[tuple[Trace, Ints, Array]], tip: str) -> tuple[Array, Array] | None:
    if any(not tip or "site_xpos" not in t or tip not in t.header.sites for t, _, _ in places):
        return None
    one, two = (_between(trace.site(tip)[0], rows, share) for trace, rows, share in places)
    return (one, two) if np.isfinite([one, two]).all() else None


def _way(trace: Trace, tip: str, until: float, shown: Array) -> dict[str, str]:
    """The way of a site at the rows that its own side has, and how much of it lies behind."""
    if not tip or "site_xpos" not in trace or tip not in trace.header.sites:
        return {"way": "", "behind": ""}
    elapsed = trace.time - trace.time[0]
    rows = np.flatnonzero(elapsed <= until + 1e-9)
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


def _contacts(trace: Trace, rows: Ints, most: int) -> tuple[dict[str, str], float]:
    """Where contacts are in each row, the strongest first, and the force on the second [N].

    Returns:
        These, and the largest of the forces.
    """
    if "contact_row" not in trace:
        return {"count": "", "at": ""}, 0.0
    begins = np.searchsorted(trace["contact_row"], rows)
    ends = np.searchsorted(trace["contact_row"], rows, side="right")
    strength = np.linalg.norm(np.nan_to_num(trace["contact_force"]), axis=1)
    picked, counts = [np.empty(0, np.int64)], []
    for a, b in zip(begins.tolist(), ends.tolist(), strict=True):
        strongest = a + np.argsort(-strength[a:b], kind="stable")[: min(most, 255)]
        picked.append(strongest)
        counts.append(len(strongest))
    chosen = np.concatenate(picked)
    # Rows of a contact frame are its axes; the force on the second geom is along them.
    axes = trace["contact_frame"][chosen].reshape(-1, 3, 3)
    force = np.einsum("cij,ci->cj", axes, trace["contact_force"][chosen])
    where = np.nan_to_num(np.hstack([trace["contact_pos"][chosen], force]))
    largest = float(np.linalg.norm(where[:, 3:], axis=1).max(initial=0.0))
    return {"count": packed(counts, "u1"), "at": packed(where, "f4")}, largest


def _most_at_once(trace: Trace) -> int:
    """How many contacts there are at one moment, at most."""
    if "contact_row" not in trace or not len(trace["contact_row"]):
        return 0
    return int(np.bincount(trace["contact_row"]).max())


def _moves(one: Trace, two: Trace, body: int) -> bool:
    """Whether a body is elsewhere at another time or on the other side."""
    if one.header.bodies[body : body + 1] != two.header.bodies[body : body + 1]:
        return True
    start = one["xpos"][0, body], one["xquat"][0, body]
    for trace in (one, two):
        for column, value in zip(("xpos", "xquat"), start, strict=True):
            if np.abs(trace[column][:, body] - value).max(initial=0.0) > 1e-6:
                return True
    return False


def _floor(drawings: Sequence[Drawing]) -> float | None:
    """The height of an endless level plane, if there is one."""
    for part in drawings[0].parts:
        if part.endless and part.body == 0 and np.ptp(part.vertices[:, 2]) < 1e-6:
            return float(part.vertices[0, 2])
    return None


def _camera(poses: Sequence[Array], tips: tuple[Array, Array] | None, extent: float) -> Camera:
    """From the side on which the fingertip's way is seen at its full width, near enough."""
    points = np.concatenate([pos[:, 1:].reshape(-1, 3) for pos in poses])
    points = points[np.isfinite(points).all(axis=1)]
    if tips is not None:
        points = np.vstack([points, *tips])
    if not len(points):
        points = np.zeros((1, 3))
    target = np.median(points, axis=0)
    points = points[np.abs(points - target).max(axis=1) <= 2 * extent]
    way = tips[0] if tips is not None else points
    flat = way[:, :2] - way[:, :2].mean(axis=0)
    size, ways = np.linalg.eigh(flat.T @ flat)
    along = ways[:, 1] if size[1] > 0 else np.array([1.0, 0.0])
    along = along if along[0] >= 0 else -along
    around = float(np.arctan2(along[1], along[0])) + np.pi / 2 + 0.35
    angles = math.degrees(around), -math.degrees(0.3), math.degrees(OPENING)
    axes = np.array(Camera((0.0, 0.0, 0.0), 0.0, *angles).axes)
    seen = points @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle = (low + high) / 2
    # Origins of bodies do not tell how thick these are.
    apart = np.abs(seen - middle) + 0.14 * extent
    slope = np.tan(OPENING / 2)
    needs = np.maximum(apart[:, 0] / (_ASPECT * slope), apart[:, 1] / slope)
    distance = float((needs - (seen[:, 2] - middle[2])).max())
    x, y, z = (middle @ axes).tolist()
    return Camera((x, y, z), distance, *angles)
