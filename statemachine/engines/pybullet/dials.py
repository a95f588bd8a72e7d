"""PyBullet between the two ways in which we have it: as it comes, and behind the contract.

`PybulletDials` makes Models of one file in which some settings are the engine's own and others the
model's. Each is turned in the engine itself, by its own calls, on the world of a Data.
The servo law decides what the others are turned in: the engine's motors live in a world as
`loadURDF` leaves it, the model's law in the emulated one.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from functools import partial
from typing import Any, cast

import numpy as np

from ...backends.bullet.client import pb
from ...backends.bullet.contacts import Surfaces
from ...backends.bullet.driven import Act
from ...backends.bullet.loaded_bodies import UNCLAMPED
from ...backends.bullet.plan import Plan
from ...backends.bullet.weights import weights, with_weights, with_weights_of
from ...backends.bullet.world import World
from ...backends.pybullet_backend import PybulletModel
from ...interface import Array, Model
from ..records import Dials, Setting

# What a fresh body has: a single-precision literal in the engine.
BODY_DAMPING = float(np.float32(0.04))
FRICTION = 0.5
CONTACT_ERP = 0.08
_FASTEST = 100.0  # [rad/s]
_WIDE = 1e6  # [rad or m] a range that no joint leaves


def with_parts_of(emulated: PybulletModel, model: PybulletModel) -> Model:
    """Return the Model of a file with the geoms and actuators that another Model of it was given.

    Args:
        emulated: The Model of the file, behind the contract.
        model: One of the same file, as it comes, which may have parts of another file.
    """
    own, given = emulated.compiled, model.compiled
    if not _has_other_parts(own, given):
        return emulated
    # The weights are the file's: those of `model` are what PyBullet makes of the shapes.
    with_parts = emulated.with_compiled(with_weights_of(given, own))
    return with_parts.replace(gravity=emulated.gravity, timestep=emulated.timestep)


def _has_other_parts(own: Any, given: Any) -> bool:
    """Tell whether two compiled models of one file differ in geoms or actuators."""
    if (own.ngeom, own.nu) != (given.ngeom, given.nu):
        return True
    fields = ("geom_type", "geom_size", "geom_pos", "actuator_gainprm", "actuator_biasprm")
    return not all(np.array_equal(getattr(own, name), getattr(given, name)) for name in fields)


class PybulletDials(Dials):
    """One file on PyBullet, and all that can be set in the engine's way or in the model's."""

    words: Mapping[str, str] = {
        "inertia": "of shapes",
        "damping": "explicit, +0.04",
        "armature": "none",
        "frictionloss": "none",
        "limits": "hard",
        "integrator": "its own",
        "contact": "its own",
        "self-collision": "off",
        "equality": "none",
    }

    def __init__(self, model: Model, emulated: Model) -> None:
        """Take a Model as it comes, and that of its file behind the contract."""
        super().__init__(model, emulated)
        own = cast("PybulletModel", model)
        # All that is in a URDF is one robot to the engine; of an MJCF each tree is one.
        self._whole = own.plan.file is not None or own.plan.weighed
        surfaces = cast("PybulletModel", emulated).plan.surfaces
        self.self_pairs = len(surfaces.of_one_robot(self._whole))
        if own.plan.file and own.plan.file.without_inertial:
            links = own.plan.file.without_inertial
            which = ", ".join(links) if len(links) == 1 else f"{len(links)} links"
            self.words = {**self.words, "inertia": f"of shapes, {which} 1 kg"}

    def build(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        """Return a Model with some dials at "model" or "off", the others as the engine comes.

        Args:
            dials: Of gravity, timestep, inertia, servo, armature, damping, frictionloss,
                limits, surfaces, self-collision, equality, contact; armature, frictionloss,
                self-collision and equality only with the servo, whose law gives the engine what
                it has not.
            values: What gravity (3,) [m/s²], timestep (step [s], substeps), and armature,
                damping and frictionloss (nv,) are at "model".

        Raises:
            UnsupportedError: The backend cannot run it.
        """
        return (self._with_law if "servo" in dials else self._with_motors)(dials, values)

    def _with_motors(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        raw, plan = self.model.compiled, None
        model = self.model.replace(**_world_options(dials, values))
        if "inertia" in dials and self._whole:
            # PyBullet moves no centre of mass: a URDF is written of the model that has them.
            plan = Plan(with_weights_of(model.compiled, self.emulated.compiled), weighed=True)
        joint = values["damping"] if dials.get("damping") == "model" else np.zeros(raw.nv)
        acts: dict[str, Act] = {
            "inertia": partial(_set_inertias, inertias=raw.body_inertia),
            "damping": partial(set_damping, body=0.0, joint=joint),
            "limits": partial(set_limits, ranges=None),
            "surfaces": partial(
                _set_surfaces, surfaces=cast("PybulletModel", self.emulated).plan.surfaces
            ),
            "contact": World.set_collision_groups,  # nothing meets anything
        }
        if plan:
            del acts["inertia"]
        return with_settings(model, [act for name, act in acts.items() if name in dials], plan)

    def _with_law(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        own, fresh = cast("PybulletModel", self.emulated), self.model.compiled
        ways: dict[str, Act] = {
            "damping": partial(set_damping, body=BODY_DAMPING, joint=fresh.dof_damping),
            "limits": partial(set_limits, ranges=joint_ranges(self.model)),
            "surfaces": partial(_fresh_surfaces, plan=own.plan, whole=self._whole),
            "self-collision": partial(_no_self_collision, plan=own.plan, whole=self._whole),
        }
        acts = [act for name, act in ways.items() if name not in dials]
        options = {name: getattr(self.model, name) for name in ("gravity", "timestep", "substeps")}
        options |= _world_options(dials, values)
        for name in ("armature", "damping", "frictionloss"):
            options[name] = values[name] if dials.get(name) == "model" else np.zeros(own.nv)
        if dials.get("limits") != "model":
            options["limits"] = False
        if "contact" in dials:
            options["contacts"] = False
        # An option that changes nothing may still change the last bit of what follows from it.
        changing = {name: value for name, value in options.items() if not _has(own, name, value)}
        model = cast("PybulletModel", own.replace(**changing)) if changing else own
        raw = model.compiled
        if "inertia" not in dials:
            raw = weighed_by_the_engine(cast("PybulletModel", self.model), raw)
        if "equality" not in dials and self._whole and raw.neq:
            raw = copy.copy(raw)
            raw.eq_active0[:] = False
        return with_settings(model, acts, Plan(raw) if raw is not model.compiled else None)

    @property
    def frictions(self) -> Array:
        with self.model._make_data() as data:
            world = data.raw
            frictions = [
                pb.getDynamicsInfo(b, link, world.client)[1] for b, link, _ in world.solids()
            ]
        return np.array(frictions)


def weighed_by_the_engine(model: PybulletModel, compiled: Any) -> Any:
    """Make a compiled model whose bodies weigh what the engine gives them of its own.

    Args:
        model: A Model as the engine comes.
        compiled: A compiled model of the same file.
    """
    if model.plan.file:
        return with_weights(compiled, weights(model.plan))
    if model.plan.weighed:
        return with_weights_of(compiled, model.compiled)
    raw = copy.copy(compiled)
    raw.body_inertia[:] = inertias_of_shapes(model)
    return raw


def inertias_of_shapes(model: Model) -> Array:
    """Return the inertias (nbody, 3) that the engine takes from the shapes, in the file's axes."""
    inertias = np.array(model.compiled.body_inertia)
    with model._make_data() as data:
        world = data.raw
        for body, link, b in world.links():
            inertias[b] = pb.getDynamicsInfo(body, link, world.client)[2]
    return inertias


def with_settings(model: Model, acts: list[Act], plan: Plan | None = None) -> PybulletModel:
    """Return a Model whose worlds are given some settings; what `forward` computes knows nothing
    of it.
    """
    own = cast("PybulletModel", model)
    every = (*own.acts, *acts)
    return PybulletModel(plan or own.plan, own.path, own.substeps, own.defaults, own._asked, every)


def _world_options(dials: Mapping[str, Setting], values: Mapping[str, Any]) -> dict[str, Any]:
    options: dict[str, Any] = {}
    if "gravity" in dials:
        options["gravity"] = values["gravity"] if dials["gravity"] == "model" else np.zeros(3)
    if "timestep" in dials:
        options["timestep"], options["substeps"] = values["timestep"]
    return options


def _has(model: Model, name: str, value: Any) -> bool:
    known = getattr(model, f"dof_{name}", getattr(model, name, None))
    return known is not None and np.array_equal(known, value)


def joint_ranges(model: Model) -> dict[int, tuple[float, float]]:
    """Return the range of each joint that has one, by degree of freedom."""
    return {
        int(model.jnt_dofadr[j]): (float(model.jnt_range[j, 0]), float(model.jnt_range[j, 1]))
        for j in np.flatnonzero(model.jnt_limited)
    }


def _set_inertias(world: World, inertias: np.ndarray) -> None:
    for body, link, b in world.links():
        world.change(body, link, localInertiaDiagonal=inertias[b].tolist())


def set_damping(world: World, body: float, joint: np.ndarray) -> None:
    for tree in world.trees:
        world.change_all(tree.body, linearDamping=body, angularDamping=body)
    for tree_body, index, dof in world.joints():
        # getJointInfo goes on telling what the URDF said.
        world.change(tree_body, index, jointDamping=float(joint[dof]))


def set_limits(world: World, ranges: Mapping[int, tuple[float, float]] | None) -> None:
    """Set the engine's own limits of position and of speed; without ranges, none."""
    for body, index, dof in world.joints():
        low, high = (ranges or {}).get(dof, (-_WIDE, _WIDE))
        world.change(body, index, jointLowerLimit=low, jointUpperLimit=high)
    fastest = UNCLAMPED if ranges is None else _FASTEST
    for tree in world.trees:
        world.change_all(tree.body, maxJointVelocity=fastest)


def _set_surfaces(world: World, surfaces: Surfaces) -> None:
    world.soften()
    if world.reads_file:  # in which nothing can touch
        return
    world.set_friction(surfaces.slide, surfaces.spin, surfaces.roll)


def harden(world: World) -> None:
    """Give contacts the parameters of a fresh world: they do not yield."""
    pb.setPhysicsEngineParameter(
        globalCFM=0.0, contactERP=CONTACT_ERP, physicsClientId=world.client
    )


def _fresh_surfaces(world: World, plan: Plan, whole: bool) -> None:
    """Set the friction and hardness of what was loaded, and let all meet that are two robots."""
    harden(world)
    solids = list(world.solids())
    none = np.zeros(len(solids))
    world.set_friction(none + FRICTION, none, none)
    for (i, j), meet in plan.surfaces.pairs.items():
        if whole:  # there is one
            break
        (body, link, solid), (other, other_link, other_solid) = solids[i], solids[j]
        # What never moves does not meet what never moves; of the rest, all that are two bodies.
        moves = any(plan.raw.body_weldid[s.body] for s in (solid, other_solid))
        if moves and body != other and not meet:
            pb.setCollisionFilterPair(
                body, other, link, other_link, 1, physicsClientId=world.client
            )


def _no_self_collision(world: World, plan: Plan, whole: bool) -> None:
    """Let no two links of one robot meet."""
    solids = list(world.solids())
    for i, j in plan.surfaces.of_one_robot(whole):
        (body, link, _), (other, other_link, _) = solids[i], solids[j]
        pb.setCollisionFilterPair(body, other, link, other_link, 0, physicsClientId=world.client)
