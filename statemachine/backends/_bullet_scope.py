"""What of a compiled MJCF has no counterpart on PyBullet: refused by name, at load."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from ..errors import UnsupportedError
from ..interface import Array, JointType
from ._bullet_hulls import ELLIPSOID, HULLS, MARGIN, roughness
from ._bullet_law import in_force
from ._bullet_plan import MOST_PARTS, Plan
from ._bullet_surfaces import NO_CONTACT, PLANE, damping_ratios
from ._bullet_urdf import axes, parts, tree

_FREE, _BALL = int(JointType.FREE), int(JointType.BALL)
# What MuJoCo's contacts have by default; and the part of a speed that is a bounce to tell of.
_SOLREF, _SOLIMP, _BOUNCE = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0), 0.2
_SOLIDS = [
    int(kind)
    for kind in (
        mujoco.mjtGeom.mjGEOM_BOX,
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_PLANE,
    )
] + list(HULLS)


def check(plan: Plan, backend: str) -> None:
    """Raise UnsupportedError, naming all that PyBullet cannot be told of a model.

    Args:
        plan: The compiled model and what can touch what in it.
        backend: For the message.
    """
    raw = plan.raw
    found = [*_parts(raw), *_joints(raw), *_bodies(raw), *_actuators(raw)]
    if not raw.opt.disableflags & NO_CONTACT:
        found += _geoms(raw)
        found += [
            ("contact masks within a body", f"of {pair} some geoms meet and some do not")
            for pair in plan.surfaces.mixed
        ]
    if not found:
        return
    feature, reason = found[0]
    listed = "; ".join(f"{what}: {why}" for what, why in found)
    raise UnsupportedError(
        f"backend {backend!r} does not support what this model has: {listed}",
        backend=backend,
        feature=feature,
        reason=reason,
        features=tuple(dict.fromkeys(what for what, _ in found)),
    )


Found = Iterator[tuple[str, str]]


def _parts(raw: mujoco.MjModel) -> Found:
    """Whole kinds of elements, and settings of the model."""
    for feature, count in (
        ("equality constraint", raw.neq),
        ("tendon", raw.ntendon),
        ("flex", raw.nflex),
        ("explicit contact pair", raw.npair),
        ("plugin", raw.nplugin),
        ("gravity compensation", raw.ngravcomp),
    ):
        if count:
            yield feature, f"the model has {count}"
    if raw.opt.density or raw.opt.viscosity:
        yield "fluid", "density or viscosity is not zero"


def ignored(plan: Plan) -> list[str]:
    """Settings of a model that have no counterpart, and do not make it another robot."""
    raw = plan.raw
    override, sleep = mujoco.mjtEnableBit.mjENBL_OVERRIDE, mujoco.mjtEnableBit.mjENBL_SLEEP
    integrator = {
        int(mujoco.mjtIntegrator.mjINT_IMPLICIT): "implicit acts as implicitfast",
        int(mujoco.mjtIntegrator.mjINT_RK4): "RK4 acts as Euler",
        int(mujoco.mjtIntegrator.mjINT_DISCRETE): "discrete acts as implicitfast",
    }.get(int(raw.opt.integrator))
    found = [f"the integrator {integrator}"] if integrator else []
    for what, there in (
        ("noslip_iterations", raw.opt.noslip_iterations),
        ("the override of contact parameters", raw.opt.enableflags & int(override)),
        ("sleep", raw.opt.enableflags & int(sleep)),
    ):
        if there:
            found.append(f"{what} has no effect")
    if raw.jnt_springyield.any():
        found.append(f"springyield has no effect ({_list(raw, 'joint', raw.jnt_springyield)})")
    if not raw.opt.disableflags & NO_CONTACT:
        touching = (raw.geom_contype | raw.geom_conaffinity).astype(bool)
        margins = raw.geom_margin * touching
        if margins.any():
            largest = int(margins.argmax())
            found.append(
                f"contacts begin at a distance of 0, not at the margin of "
                f"{int(np.count_nonzero(margins))} geoms (the largest: "
                f"{1e3 * margins[largest]:.3g} mm, {_name(raw, 'geom', largest)})"
            )
        found += _hull_differences(plan)
        belts = np.sqrt((raw.geom_surfacevel[:, :3] ** 2).sum(axis=1)) * touching
        if belts.any():
            found.append(f"surfacevel has no effect ({_list(raw, 'geom', belts)})")
        found += _bounces(plan)
    return found


def _bounces(plan: Plan) -> list[str]:
    """The contact that would spring back most: a damping ratio far below one is restitution."""
    raw, pairs = plan.raw, plan.surfaces.meeting
    if not pairs:
        return []
    ratios = np.clip(damping_ratios(raw, pairs), 0.0, 1 - 1e-9)
    most = int(ratios.argmin())
    ratio = float(ratios[most])
    kept = math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2))  # of its speed, a damped spring
    if kept < _BOUNCE:
        return []
    names = " and ".join(str(_name(raw, "geom", geom)) for geom in pairs[most])
    return [
        f"contacts do not bounce: solref has no effect ({names} would keep about "
        f"{100 * kept:.0f} % of their speed)"
    ]


def softness(plan: Plan) -> str:
    """Geoms that touch and have a solref or solimp of their own, in words; "" without any."""
    raw = plan.raw
    touching = (raw.geom_contype | raw.geom_conaffinity).astype(bool)
    own = (raw.geom_solref != _SOLREF).any(axis=1) | (raw.geom_solimp != _SOLIMP).any(axis=1)
    geoms = np.flatnonzero(own & touching).tolist() if plan.surfaces.solids else []
    named = [str(_name(raw, "geom", geom)) for geom in geoms]
    rest = f", and {len(named) - 3} more" if len(named) > 3 else ""
    return ", ".join(named[:3]) + rest


def _hull_differences(plan: Plan) -> list[str]:
    """Where a hull is not its shape: ellipsoids, and what is thinner than the engine's margin."""
    raw, found = plan.raw, []
    eggs = [geom for geom in plan.hulls if int(raw.geom_type[geom]) == ELLIPSOID]
    if eggs:
        largest = max(eggs, key=lambda geom: raw.geom_size[geom].max())
        size = 1e3 * roughness(raw.geom_size[largest])
        found.append(
            f"ellipsoids touch as hulls, which are up to {size:.2g} mm off "
            f"({_name(raw, 'geom', largest)})"
        )
    excess = {geom: MARGIN - hull.allowance for geom, hull in plan.hulls.items()}
    thin = [geom for geom in excess if excess[geom] > 1e-6]
    if thin:
        worst = max(thin, key=lambda geom: excess[geom])
        found.append(
            f"{len(thin)} hulls are too thin to be made smaller by the engine's margin: up to "
            f"{1e3 * excess[worst]:.2g} mm too large ({_name(raw, 'geom', worst)})"
        )
    return found


def _list(raw: mujoco.MjModel, kind: str, values: Array) -> str:
    """Elements whose value is not zero, the largest first, as "a 0.5, b 0.1, and 3 more"."""
    order = [int(k) for k in np.argsort(-np.abs(values), kind="stable") if values[k]]
    named = [f"{_name(raw, kind, k)} {values[k]:.3g}" for k in order[:2]]
    return ", ".join(named) + (f", and {len(order) - 2} more" if len(order) > 2 else "")


def _joints(raw: mujoco.MjModel) -> Found:
    for j in range(raw.njnt):
        name, kind, dof = _name(raw, "joint", j), raw.jnt_type[j], raw.jnt_dofadr[j]
        if kind == _BALL:
            yield "ball joint", f"joint {name} has no counterpart in URDF"
        elif kind == _FREE:
            own = slice(dof, dof + 6)
            for what in ("armature", "damping", "frictionloss"):
                if getattr(raw, f"dof_{what}")[own].any():
                    yield f"{what} of a free joint", f"joint {name} has it"
            if raw.jnt_stiffness[j]:
                yield "stiffness of a free joint", f"joint {name} has it"
        low, high = raw.jnt_range[j]
        for what, values in (
            ("nonlinear spring", raw.jnt_stiffnesspoly[j]),
            ("nonlinear damping", raw.dof_dampingpoly[dof]),
            ("two limits at once", raw.jnt_limited[j] and high - low < 2 * raw.jnt_margin[j]),
        ):
            if np.any(values):
                yield what, f"joint {name} has it"


def _bodies(raw: mujoco.MjModel) -> Found:
    for b in range(1, raw.nbody):
        name = _name(raw, "body", b)
        if raw.body_mocapid[b] >= 0:
            yield "mocap body", f"body {name} is one"
        if not raw.body_parentid[b]:
            count = parts(raw, b)
            if count > MOST_PARTS:
                yield (
                    "a tree of so many parts",
                    f"{name} has {count} bodies and joints: more than {MOST_PARTS}",
                )
        if not raw.body_parentid[b] and raw.body_jntnum[b] and not axes(raw, b):
            rest = len(tree(raw, b)) - 1
            if rest:
                yield "free body of several bodies", f"{name} carries {rest} more"


def _geoms(raw: mujoco.MjModel) -> Found:
    for g in range(raw.ngeom):
        if not (raw.geom_contype[g] or raw.geom_conaffinity[g]):
            continue
        name, kind = _name(raw, "geom", g), int(raw.geom_type[g])
        if kind not in _SOLIDS:
            yield "shape of a geom", f"geom {name} is a {mujoco.mjtGeom(kind).name[7:].lower()}"
        elif kind == PLANE and raw.geom_bodyid[g]:
            yield "plane on a body", f"geom {name} is not the world's own"


def _actuators(raw: mujoco.MjModel) -> Found:
    gain, bias = mujoco.mjtGain, mujoco.mjtBias
    used = in_force(raw)
    for a in range(raw.nactuator):
        name, joint = _name(raw, "actuator", a), int(raw.actuator_trnid[a, 0])
        if raw.actuator_armature[a] or raw.actuator_damping[a] or raw.actuator_dampingpoly[a].any():
            yield "actuator armature or damping", f"actuator {name} has it: give it to the joint"
        if not used[a]:
            continue
        if raw.actuator_trntype[a] != int(mujoco.mjtTrn.mjTRN_JOINT):
            yield "actuator transmission", f"actuator {name} does not drive a joint"
        elif raw.jnt_type[joint] in (_FREE, _BALL):
            yield "actuator of a free joint", f"actuator {name} is one"
        if raw.actuator_dyntype[a] != int(mujoco.mjtDyn.mjDYN_NONE):
            yield "actuator dynamics", f"actuator {name} has a state of its own"
        if raw.actuator_delay[a] and raw.actuator_history[a, 1]:
            yield "interpolated latency", f"that of actuator {name} is between two commands"
        affine = raw.actuator_biastype[a] in (int(bias.mjBIAS_NONE), int(bias.mjBIAS_AFFINE))
        if raw.actuator_gaintype[a] != int(gain.mjGAIN_FIXED) or not affine:
            kind = gain(raw.actuator_gaintype[a]) if affine else bias(raw.actuator_biastype[a])
            yield (
                "actuator gain",
                f"that of actuator {name} is not constant ({kind.name[7:].lower()})",
            )


def _name(raw: mujoco.MjModel, kind: str, number: int) -> Any:
    return getattr(raw, kind)(number).name or f"number {number}"
