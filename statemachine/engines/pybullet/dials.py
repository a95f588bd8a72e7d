"""PyBullet between the two ways in which we have it: as it comes, and behind the contract.

`PybulletDials` makes Models of one file in which some settings are the engine's own and others the
model's. Each is turned in the engine itself, by its own calls, on the world of a Data.
The servo law decides what the others are turned in: the engine's motors live in a world as
`loadURDF` leaves it, the model's law in the emulated one.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from ...backends import load
from ...backends._bullet_client import pb
from ...backends._bullet_driven import DrivenWorld
from ...backends._bullet_plan import Plan
from ...backends._bullet_shared import Shared
from ...backends._bullet_surfaces import Surfaces
from ...backends._bullet_world import UNCLAMPED, World
from ...backends.pybullet_backend import PybulletModel
from ...errors import EngineError
from ...interface import Array, Model
from ..records import Setting

# What a fresh body has: a single-precision literal in the engine.
BODY_DAMPING = float(np.float32(0.04))
FRICTION = 0.5
CONTACT_ERP = 0.08
_FASTEST = 100.0  # [rad/s]
_WIDE = 1e6  # [rad or m] a range that no joint leaves
_CLOSE = 1e-6  # relative: the engine reports some figures in single precision

Act = Callable[[World], None]


class PybulletDials:
    """One file on PyBullet, and all that can be set in the engine's way or in the model's.

    Attributes:
        model: As it comes: `load(…, defaults="engine")`, with the options of an experiment.
        emulated: The same file behind the contract, with the same options.
        with_servo: What only an adapter can give, and so only the world of the model's law.
        words: The engine's own setting of a factor.
    """

    with_servo: tuple[str, ...] = ("armature", "frictionloss")
    words: Mapping[str, str] = {
        "inertia": "of shapes",
        "damping": "explicit, +0.04",
        "armature": "none",
        "frictionloss": "none",
        "limits": "hard",
        "integrator": "its own",
        "contact": "its own",
    }

    def __init__(self, model: Model, options: Mapping[str, Any]) -> None:
        """Of a Model with `defaults="engine"`, and the options of an experiment."""
        self.model = cast("PybulletModel", model.replace(**options))
        emulated = load(model.path, backend="pybullet").replace(**options)
        self.emulated = cast("PybulletModel", emulated)

    def build(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        """A Model with some dials at "model" or "off", the others as the engine comes.

        Args:
            dials: Of gravity, timestep, inertia, servo, armature, damping, frictionloss,
                limits, surfaces, contact.
            values: What gravity (3,) [m/s²], timestep (step [s], substeps), and armature,
                damping and frictionloss (nv,) are at "model".

        Raises:
            ValueError: Armature or dry friction without the model's servo law.
            EngineError: A dial did not act: the engine reports another figure.
        """
        if "servo" not in dials:
            if any(name in dials for name in self.with_servo):
                raise ValueError("without the model's servo law there is no armature or friction")
            return self._with_motors(dials, values)
        return self._with_law(dials, values)

    def _with_motors(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        raw = self.model.compiled
        model = self.model.replace(**_world_options(dials, values))
        joint = values["damping"] if dials.get("damping") == "model" else np.zeros(raw.nv)
        acts: dict[str, Act] = {
            "inertia": partial(_set_inertias, inertias=raw.body_inertia),
            "damping": partial(_set_damping, body=0.0, joint=joint),
            "limits": partial(_set_limits, ranges=None),
            "surfaces": partial(_set_surfaces, surfaces=self.emulated.plan.surfaces),
            "contact": _touch_nothing,
        }
        return _dialled(model, [act for name, act in acts.items() if name in dials])

    def _with_law(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        own, fresh = self.emulated, self.model.compiled
        ways: dict[str, Act] = {
            "damping": partial(_set_damping, body=BODY_DAMPING, joint=fresh.dof_damping),
            "limits": partial(_set_limits, ranges=_ranges(self.model)),
            "surfaces": partial(_fresh_surfaces, plan=own.plan),
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
        plan = None
        if "inertia" not in dials:
            raw = copy.copy(model.compiled)
            raw.body_inertia[:] = self.shapes
            plan = Plan(raw)
        return _dialled(model, acts, plan) if acts or plan else model

    @property
    def shapes(self) -> np.ndarray:
        """(nbody, 3) inertias that the engine takes from the shapes, in the file's axes."""
        raw = self.model.compiled
        inertias = np.array(raw.body_inertia)
        with self.model._make_data() as data:
            world = data.raw
            for body, link, b in _links(world):
                inertias[b] = pb.getDynamicsInfo(body, link, world.client)[2]
        return inertias

    @property
    def frictions(self) -> Array:
        """(nsolid,) lateral friction that the engine tells of each link that touches."""
        with self.model._make_data() as data:
            world = data.raw
            told = [pb.getDynamicsInfo(b, link, world.client)[1] for b, link, _ in world.solids()]
        return np.array(told)


def frictionless(model: Model) -> Model:
    """The same Model with surfaces that have no friction."""
    return _dialled(model, [_smooth])


class DialledWorld(DrivenWorld):
    """A world that is given some settings when it is opened."""

    def __init__(self, shared: Shared, acts: tuple[Act, ...]) -> None:
        super().__init__(shared)
        self._acts = acts
        for act in acts:
            act(self.raw)

    def _anew(self) -> DialledWorld:
        return DialledWorld(self._shared, self._acts)


class DialledModel(PybulletModel):
    """A Model whose Data have such worlds. What `forward` computes knows nothing of the dials."""

    _acts: tuple[Act, ...]

    def __init__(
        self,
        plan: Plan,
        path: Path,
        substeps: int,
        defaults: Literal["model", "engine"],
        acts: tuple[Act, ...],
    ) -> None:
        super().__init__(plan, path, substeps, defaults)
        vars(self).update(_acts=acts, _open_world=partial(DialledWorld, self._shared, acts))


def _dialled(model: Model, acts: list[Act], plan: Plan | None = None) -> Model:
    if not acts and plan is None:
        return model
    own = cast("PybulletModel", model)
    return DialledModel(plan or own.plan, own.path, own.substeps, own.defaults, tuple(acts))


def _world_options(dials: Mapping[str, Setting], values: Mapping[str, Any]) -> dict[str, Any]:
    options: dict[str, Any] = {}
    if "gravity" in dials:
        options["gravity"] = values["gravity"] if dials["gravity"] == "model" else np.zeros(3)
    if "timestep" in dials:
        options["timestep"], options["substeps"] = values["timestep"]
    return options


def _has(model: Model, name: str, value: Any) -> bool:
    known = getattr(model, f"dof_{name}", None)
    known = getattr(model, name, None) if known is None else known
    return known is not None and np.array_equal(known, value)


def _ranges(model: Model) -> dict[int, tuple[float, float]]:
    """Range of each joint that has one, by degree of freedom."""
    return {
        int(model.jnt_dofadr[j]): (float(model.jnt_range[j, 0]), float(model.jnt_range[j, 1]))
        for j in np.flatnonzero(model.jnt_limited)
    }


def _links(world: World) -> Iterator[tuple[int, int, int]]:
    """PyBullet's body and link, and MuJoCo's body, of all that has a mass."""
    for tree in world.trees:
        for b, link in tree.links.items():
            yield tree.body, link, b


def _joints(world: World) -> Iterator[tuple[int, int, int]]:
    """PyBullet's body and joint, and its degree of freedom."""
    for tree in world.trees:
        for index, dof in zip(tree.joints, np.atleast_1d(tree.dofs).tolist(), strict=False):
            yield tree.body, index, dof


def _change(world: World, body: int, link: int, **settings: Any) -> None:
    pb.changeDynamics(body, link, physicsClientId=world.client, **settings)


def _verify(what: str, wanted: Any, told: Any) -> None:
    """Raise EngineError unless the engine reports what it was given."""
    if not np.allclose(told, wanted, rtol=_CLOSE, atol=1e-15):
        raise EngineError(f"PyBullet did not take {what}: it was given {wanted}, reports {told}")


def _set_inertias(world: World, inertias: np.ndarray) -> None:
    for body, link, b in _links(world):
        wanted = inertias[b].tolist()
        _change(world, body, link, localInertiaDiagonal=wanted)
        _verify("an inertia", wanted, pb.getDynamicsInfo(body, link, world.client)[2])


def _set_damping(world: World, body: float, joint: np.ndarray) -> None:
    for tree in world.trees:
        for link in range(-1, pb.getNumJoints(tree.body, world.client)):
            _change(world, tree.body, link, linearDamping=body, angularDamping=body)
    for tree_body, index, dof in _joints(world):
        # getJointInfo goes on telling what the URDF said.
        _change(world, tree_body, index, jointDamping=float(joint[dof]))


def _set_limits(world: World, ranges: Mapping[int, tuple[float, float]] | None) -> None:
    """The engine's own limits, of position and of speed; without ranges, none."""
    for body, index, dof in _joints(world):
        low, high = (-_WIDE, _WIDE) if ranges is None else ranges.get(dof, (-_WIDE, _WIDE))
        _change(world, body, index, jointLowerLimit=low, jointUpperLimit=high)
    fastest = UNCLAMPED if ranges is None else _FASTEST
    for tree in world.trees:
        for link in range(-1, pb.getNumJoints(tree.body, world.client)):
            _change(world, tree.body, link, maxJointVelocity=fastest)


def _set_surfaces(world: World, surfaces: Surfaces) -> None:
    world.soften()
    for k, (body, link, _) in enumerate(world.solids()):
        wanted = [float(friction[k]) for friction in (surfaces.slide, surfaces.roll, surfaces.spin)]
        _rub(world, body, link, wanted)


def _smooth(world: World) -> None:
    for body, link, _ in world.solids():
        _rub(world, body, link, [0.0, 0.0, 0.0])


def _rub(world: World, body: int, link: int, wanted: list[float]) -> None:
    slide, roll, spin = wanted
    _change(world, body, link, lateralFriction=slide, rollingFriction=roll, spinningFriction=spin)
    told = pb.getDynamicsInfo(body, link, world.client)
    _verify("a friction", wanted, [told[1], told[6], told[7]])


def _harden(world: World) -> None:
    """Contacts as they are in a fresh world: they do not yield."""
    pb.setPhysicsEngineParameter(
        globalCFM=0.0, contactERP=CONTACT_ERP, physicsClientId=world.client
    )


def _fresh_surfaces(world: World, plan: Plan) -> None:
    """Friction and hardness of what was loaded, and links of one robot that do not meet."""
    _harden(world)
    solids = list(world.solids())
    for body, link, _ in solids:
        _rub(world, body, link, [FRICTION, 0.0, 0.0])
    for (i, j), meet in plan.surfaces.pairs.items():
        (body, link, solid), (other, other_link, other_solid) = solids[i], solids[j]
        # What never moves does not meet what never moves; of the rest, all that are two bodies.
        moves = any(plan.raw.body_weldid[s.body] for s in (solid, other_solid))
        wanted = moves and body != other
        if wanted != meet:
            pb.setCollisionFilterPair(
                body, other, link, other_link, int(wanted), physicsClientId=world.client
            )


def _touch_nothing(world: World) -> None:
    for body, link, _ in world.solids():
        pb.setCollisionFilterGroupMask(body, link, 0, 0, world.client)
