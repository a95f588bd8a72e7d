"""PyBullet's contact points as the contract's contacts: by geom, with forces and axes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from ..interface import Array, Contacts
from ..rotations import matrix_from_quat
from . import _dense as dense
from ._bullet_world import World

_GEOM = mujoco.mjtGeom


def contacts(
    raw: mujoco.MjModel, world: World, poses: Callable[[], tuple[Array, Array]]
) -> Contacts:
    """The contacts that a world found at the beginning of its last step.

    PyBullet knows which links touch. A link may have several geoms: the one whose
    surface is nearest to the point is taken.

    Args:
        raw: The compiled model.
        world: The world; points that are apart and carry no force are left out.
        poses: Gives xpos (nbody, 3), where the bodies were then [m], and xquat (nbody, 4), how
            they were turned, wxyz; asked for only where a link has several geoms.
    """
    geoms = world.geoms_of_links
    turns: dict[int, Array] = {}  # by body, into its own axes

    def geom_at(body: int, link: int, point: Array) -> int:
        b, candidates = geoms[body, link]
        if len(candidates) == 1:
            return candidates[0]
        xpos, xquat = poses()
        if b not in turns:
            turns[b] = matrix_from_quat(xquat[b]).T.copy()
        local = dense.times(turns[b], point - xpos[b])
        return min(candidates, key=lambda g: abs(_distance(raw, g, world.geom_turns[g], local)))

    found: list[tuple[Any, ...]] = []
    for point in world.contact_points():
        _, body_a, body_b, link_a, link_b, on_a, on_b, normal, dist, push = point[:10]
        if dist > 0 and not push:
            continue
        on_a, on_b, normal = np.array(on_a), np.array(on_b), np.array(normal)
        pair = geom_at(body_b, link_b, on_b), geom_at(body_a, link_a, on_a)
        # The normal goes from B to A; friction is what A feels.
        force = push * normal
        for size, direction in (point[10:12], point[12:14]):
            force = force + size * np.array(direction)
        if pair[0] > pair[1]:
            pair, normal, force = pair[::-1], -normal, -force
        frame = _axes(normal)
        found.append((pair, dist, (on_a + on_b) / 2, frame, dense.times(frame, force)))
    count = len(found)
    columns = list(zip(*found, strict=True)) or [()] * 5
    return Contacts(
        geom=np.array(columns[0], dtype=np.int64).reshape(count, 2),
        dist=np.array(columns[1], dtype=np.float64),
        pos=np.array(columns[2], dtype=np.float64).reshape(count, 3),
        frame=np.array(columns[3], dtype=np.float64).reshape(count, 3, 3),
        force=np.array(columns[4], dtype=np.float64).reshape(count, 3),
        torque=np.zeros((count, 3)),
    )


def _axes(normal: Array) -> Array:
    """Contact axes (3, 3) as rows, the first the normal."""
    aside = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.5 else np.array([0.0, 0.0, 1.0])
    first = aside - normal * dense.dot(normal, aside)
    first /= math.hypot(*first)
    return np.array([normal, first, np.cross(normal, first)])


def _distance(raw: mujoco.MjModel, geom: int, turn: Array, point: Array) -> float:
    """Signed distance of a point, in the body's frame, from the surface of its geom [m].

    Args:
        raw: The compiled model.
        geom: Of the body.
        turn: (3, 3) from the body's axes into the geom's.
        point: (3,) [m].
    """
    local = dense.times(turn, point - raw.geom_pos[geom])
    size, kind = raw.geom_size[geom], int(raw.geom_type[geom])
    if kind == int(_GEOM.mjGEOM_SPHERE):
        return float(math.hypot(*local) - size[0])
    if kind == int(_GEOM.mjGEOM_CAPSULE):
        along = min(max(local[2], -size[1]), size[1])
        return float(math.hypot(*local[:2], local[2] - along) - size[0])
    if kind == int(_GEOM.mjGEOM_CYLINDER):
        beyond = np.array([np.hypot(local[0], local[1]) - size[0], abs(local[2]) - size[1]])
    else:  # a mesh by the box around it
        half = size if kind == int(_GEOM.mjGEOM_BOX) else raw.geom_aabb[geom, 3:]
        middle = np.zeros(3) if kind == int(_GEOM.mjGEOM_BOX) else raw.geom_aabb[geom, :3]
        beyond = np.abs(local - middle) - half
    return float(math.hypot(*np.maximum(beyond, 0)) + min(beyond.max(), 0.0))
