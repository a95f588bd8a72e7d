"""What the links of a URDF weigh when PyBullet read it itself, by MuJoCo's bodies."""

from __future__ import annotations

import copy
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...interface import Array
from ...rotations import matrix_from_quat, wxyz_from_xyzw
from ..compiled.algebra import principal_axes
from ..compiled.stages import set_constants
from ..dense import dot, product, times
from .client import pb
from .plan import Plan
from .trees import FileTree
from .world import World

if TYPE_CHECKING:
    from ..compiled.types import MjModel


@dataclass(frozen=True, eq=False)
class Weight:
    """A rigid body.

    Attributes:
        mass: [kg].
        com: (3,) centre of mass [m], in the body's frame.
        inertia: (3, 3) about it [kg m²], in the body's axes.
    """

    mass: float
    com: Array
    inertia: Array

    def plus(self, other: Weight) -> Weight:
        """Return the mass properties of two bodies held together."""
        mass = self.mass + other.mass
        if not mass:
            return self
        com = (self.mass * self.com + other.mass * other.com) / mass
        return Weight(mass, com, self.about(com) + other.about(com))

    def about(self, point: Array) -> Array:
        """Return the inertia (3, 3) about another point (3,), by the theorem of Huygens and
        Steiner.
        """
        arm = self.com - point
        return self.inertia + self.mass * (dot(arm, arm) * np.eye(3) - np.outer(arm, arm))


NOTHING = Weight(0.0, np.zeros(3), np.zeros((3, 3)))


def weights(plan: Plan) -> dict[int, Weight]:
    """Read what each body of the model weighs in a world as it comes, off the loaded engine.

    Links that fixed joints hold together are one body.
    """
    found: dict[int, Weight] = {}
    with closing(World(plan, "engine")) as world:
        client = world.client
        world.put(plan.raw.qpos0, np.zeros(plan.raw.nv))
        for tree in world.trees:
            if isinstance(tree, FileTree):
                for link, b in enumerate(tree.bodies[:-1]):
                    if b:
                        weight = _weight_of_link(plan, tree, link, b, client)
                        found[b] = found.get(b, NOTHING).plus(weight)
                if tree.free or tree.bodies[-1]:
                    weight = _weight_of_link(plan, tree, -1, tree.root or tree.bodies[-1], client)
                    body = tree.root or tree.bodies[-1]
                    found[body] = found.get(body, NOTHING).plus(weight)
    return found


def _weight_of_link(plan: Plan, tree: FileTree, link: int, body: int, client: int) -> Weight:
    """Read one link in the frame of MuJoCo's body, all joints where the model has them at first."""
    dynamics = pb.getDynamicsInfo(tree.body, link, client)
    if link < 0:
        where, quat = pb.getBasePositionAndOrientation(tree.body, client)
    else:
        state = pb.getLinkState(tree.body, link, computeForwardKinematics=1, physicsClientId=client)
        where, quat = state[:2]
    still = plan.still
    back = np.ascontiguousarray(still.xmat[body].reshape(3, 3).T)
    axes = product(back, matrix_from_quat(wxyz_from_xyzw(np.array(quat))))
    com = times(back, np.array(where) - still.xpos[body])
    scaled = axes * np.array(dynamics[2])  # columns by the principal moments
    return Weight(dynamics[0], com, product(scaled, np.ascontiguousarray(axes.T)))


def with_weights(compiled: MjModel, found: dict[int, Weight]) -> MjModel:
    """Make a compiled model whose bodies have other inertias, and all that follows from them."""
    raw = copy.copy(compiled)
    for body, weight in found.items():
        if weight.mass > 0:
            moments, quat = principal_axes(weight.inertia)
            raw.body_mass[body], raw.body_ipos[body] = weight.mass, weight.com
            raw.body_inertia[body], raw.body_iquat[body] = moments, quat
    set_constants(raw)
    return raw


def weighed_as_it_comes(plan: Plan, compiled: MjModel) -> MjModel:
    """Make an edited model whose bodies weigh what PyBullet gives them of its own.

    It takes a mass from the file, and an inertia from the shapes: so a mass that was edited counts
    by its difference, and the inertia grows with it; an inertia that was edited has no effect.

    Args:
        plan: Of the file as it comes.
        compiled: The same model, edited.
    """
    of_file, found = plan.raw, weights(plan)
    for body, weight in found.items():
        mass = max(weight.mass + float(compiled.body_mass[body] - of_file.body_mass[body]), 1e-9)
        moment = weight.mass * weight.com + compiled.body_mass[body] * compiled.body_ipos[body]
        com = (moment - of_file.body_mass[body] * of_file.body_ipos[body]) / mass
        found[body] = Weight(mass, com, weight.inertia * (mass / max(weight.mass, 1e-9)))
    return with_weights(compiled, found)


def with_weights_of(compiled: MjModel, other: MjModel) -> MjModel:
    """Make a compiled model with the inertias of another, and what follows from them."""
    raw = copy.copy(compiled)
    for name in ("body_mass", "body_ipos", "body_iquat", "body_inertia"):
        getattr(raw, name)[:] = getattr(other, name)
    set_constants(raw)
    return raw
