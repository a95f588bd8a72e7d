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
    pairs = _touching(engine, stepped)
    rows, numbers = list[tuple[int, int]](), list[Array]()
    if pairs:
        scene, known = engine.sensed_scene(pairs)
        data = start(scene)
        scene.step(data)
        for a, b in known:
            if (a, b) not in pairs:
                continue
            told = np.asarray(scene.get_sensor_value(f"{a} {b}", data), dtype=np.float64).ravel()
            count = min(round(told[0]), MOST_POINTS)
            numbers += list(told[1 : 1 + count * _NUMBERS].reshape(count, _NUMBERS))
            rows += [(int(geoms[a]), int(geoms[b]))] * count
    told = np.array(numbers).reshape(-1, _NUMBERS)
    normal, tangent = _unit(told[:, 10:13]), _unit(told[:, 13:16])
    return Contacts(
        geom=np.array(rows, dtype=np.int64).reshape(-1, 2),
        dist=told[:, 6].copy(),
        pos=told[:, 7:10].copy(),
        frame=np.stack((normal, tangent, np.cross(normal, tangent)), axis=1),
        force=told[:, :3].copy(),
        torque=told[:, 3:6].copy(),
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
