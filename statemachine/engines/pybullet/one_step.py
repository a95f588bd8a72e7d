"""What one step from a given state can be asked of PyBullet, past the interface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...backends._bullet_client import pb
from ...interface import Array, Data, Model, get_state, set_state

# Of the servo law, which the backend solves. The engine's own impulses of the step before can be
# neither read nor written.
PRIMES = "the contact and friction forces that its servos work against; the engine takes nothing"


def mass_matrix(model: Model, data: Data, qpos: Array) -> Array:
    """The engine's matrix (nv, nv) at a pose, with the rotors that the backend adds.

    Args:
        model: A Model on this engine.
        data: Any Data of it.
        qpos: (nq,) where.

    Returns:
        NaN for free bodies, of which the engine does not tell it, and between trees.
    """
    shared = data.machine.world._shared  # type: ignore[attr-defined]
    # What is stepped carries the armature in links of its own: the ghost is the true arm.
    world = shared.ghost if shared.kind == "stepped" else data.raw
    armature = model.capabilities.behaviours["armature"].support != "unsupported"
    mass = np.full((model.nv, model.nv), np.nan)
    for tree in world.trees:
        if tree.joints:
            places = qpos[tree.qpos].tolist()
            own = np.array(pb.calculateMassMatrix(tree.body, places, 0, world.client))
            if armature:
                own += np.diag(model.dof_armature[tree.dofs])
            mass[np.ix_(tree.dofs, tree.dofs)] = own
    return mass


def prime(model: Model, data: Data, before: Mapping[str, Array]) -> None:
    """Let a Data know the forces (nv,) of the step before, by their names in the contract."""
    state = get_state(model, data)
    parts = {name: state[name].copy() for name, _ in state.layout}
    for part, force in (("contact", "qfrc_contact"), ("friction", "qfrc_friction")):
        if part in parts and force in before:
            parts[part][:] = before[force]
    set_state(model, data, replace(state, blob=np.concatenate(list(parts.values())).tobytes()))
