"""The contacts of a moment, with places and forces, by MotrixSim's own contact sensors.

Its list of contacts (`SceneData.low.get_contacts`) has normals and depths alone. A sensor of a
pair of geoms tells place, force and axes of each contact, too: so the same state is stepped once
more, in a scene that has a sensor for each pair that was ever seen to touch. What the solver
starts from is not known there: forces are those of a step without a past.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...interface import Array, Contacts, Ints
from .engine_model import MOST_POINTS, EngineModel, GeomPair

_NUMBERS = 16  # of a contact: force, torque, distance, place, normal, tangent


def contacts_at(
    engine: EngineModel, geoms: Ints, stepped: Any, start: Callable[[Any], Any]
) -> Contacts:
    """Return the contacts of the state that a SceneData was last stepped from.

    Args:
        engine: Its model.
        geoms: (number of MotrixSim's geoms,) the geom that each is here.
        stepped: The SceneData, after the step.
        start: Puts that state into a new SceneData of a given scene.
    """
    pairs = sorted(_touching(engine, stepped))
    told = list[Array]()
    if pairs:
        scene = engine.sensed_scene(frozenset(pairs))
        data = start(scene)
        scene.step(data)
        told = [_points(scene.get_sensor_value(f"{a} {b}", data)) for a, b in pairs]
    counts = [len(points) for points in told]
    owners = geoms[np.array(pairs, dtype=np.int64).reshape(-1, 2)]
    return _contacts(np.repeat(owners, counts, axis=0), np.vstack([np.empty((0, _NUMBERS)), *told]))


def _points(told: Any) -> Array:
    """Return what a sensor tells of each contact, (n, 16)."""
    numbers = np.asarray(told, dtype=np.float64).ravel()
    count = min(round(numbers[0]), MOST_POINTS)
    return numbers[1 : 1 + count * _NUMBERS].reshape(count, _NUMBERS)


def _contacts(pairs: Ints, points: Array) -> Contacts:
    """Return contacts of pairs of geoms (n, 2), of what sensors tell of each (n, 16)."""
    normal, tangent = _unit(points[:, 10:13]), _unit(points[:, 13:16])
    return Contacts(
        geom=pairs,
        dist=points[:, 6].copy(),
        pos=points[:, 7:10].copy(),
        frame=np.stack((normal, tangent, np.cross(normal, tangent)), axis=1),
        force=points[:, :3].copy(),
        torque=points[:, 3:6].copy(),
    )


def _touching(engine: EngineModel, stepped: Any) -> frozenset[GeomPair]:
    """Return the pairs of MotrixSim's geoms that touched in the last step of a SceneData."""
    owners = engine.owner_of_colliders
    pairs = set[GeomPair]()
    for contact in stepped.low.get_contacts():
        a, b = owners[contact.collider_index_a], owners[contact.collider_index_b]
        pairs.add((min(a, b), max(a, b)))
    return frozenset(pairs)


def _unit(vectors: Array) -> Array:
    """Return vectors (n, 3) of length one, which single precision rounds."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)
