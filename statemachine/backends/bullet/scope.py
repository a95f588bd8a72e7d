"""What of a compiled MJCF has no counterpart on PyBullet: refused by name, at load."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import UnsupportedError
from ...interface import Array, JointType
from ...measures.text import few
from ..compiled.actuators import ActivationKind, BiasKind, GainKind, TransmissionKind
from ..compiled.flags import EnableFlag, IntegratorKind
from ..compiled.kinds import GeomKind
from .contacts import NO_CONTACT, damping_ratios
from .drives import DYNAMICS, in_force
from .file import MOST_LINKS
from .plan import HULLS, MARGIN, Plan, roughness
from .ties import acting_tendons, ends_of, joints_of, linear_sum, movers, moving
from .urdf import floats

if TYPE_CHECKING:
    from ..compiled.types import MjModel

_FREE, _BALL = int(JointType.FREE), int(JointType.BALL)
# What MuJoCo's contacts have by default; and the part of a speed that is a bounce to tell of.
_SOLREF, _SOLIMP, _BOUNCE = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0), 0.2
_AFFINE = (BiasKind.NONE, BiasKind.AFFINE)
_SOLIDS = (
    GeomKind.BOX,
    GeomKind.SPHERE,
    GeomKind.CAPSULE,
    GeomKind.CYLINDER,
    GeomKind.PLANE,
    *HULLS,
)


def check(plan: Plan, backend: str, as_it_comes: bool = False) -> None:
    """Raise UnsupportedError, naming all that PyBullet cannot be told of a model.

    Args:
        plan: The compiled model and what can touch what in it.
        backend: For the message.
        as_it_comes: Whether nothing is emulated: then there are no joint dynamics either.
    """
    raw = plan.raw
    whole = {"flex": raw.nflex, "plugin": raw.nplugin}
    problems = [(feature, f"the model has {count}") for feature, count in whole.items() if count]
    parts = list(_of_joints(raw))
    if not plan.file:  # else it reads the file itself, and what it knows nothing of has no effect
        if as_it_comes:
            problems += _of_joint_dynamics(raw)
        problems += _between_robots(plan)
        for found in (_of_bodies(plan), _of_actuators(raw), _of_ties(raw), _of_geoms(plan)):
            parts += found
    for part in parts:
        for k in np.flatnonzero(part.which).tolist():
            problems.append((part.feature, f"{part.kind} {_name(raw, part.kind, k)} {part.says}"))
    if not problems:
        return
    feature, reason = problems[0]
    listed = "; ".join(f"{what}: {why}" for what, why in problems)
    raise UnsupportedError(
        f"backend {backend!r} does not support what this model has: {listed}",
        backend=backend,
        feature=feature,
        reason=reason,
        features=tuple(dict.fromkeys(what for what, _ in problems)),
    )


def _of_joint_dynamics(raw: MjModel) -> list[tuple[str, str]]:
    """Return what the adapter emulates, and the engine as it comes has nothing of."""
    dynamics_of_tendons = (
        raw.tendon_stiffness,
        raw.tendon_damping,
        raw.tendon_limited,
        raw.tendon_frictionloss,
        raw.tendon_armature,
    )
    features = {
        "equality constraint": raw.eq_active0.any(),
        "tendon": any(array.any() for array in dynamics_of_tendons),
        "actuator transmission": raw.actuator_trntype.any(),
        "actuator dynamics": raw.na,
        "gravity compensation": raw.ngravcomp,
        "fluid": raw.opt.density or raw.opt.viscosity,
    }
    return [(name, "the engine as it comes has none") for name, has in features.items() if has]


class UnsupportedPart(NamedTuple):
    """What elements of a model may have, and this backend has no counterpart for.

    Attributes:
        kind: Of the elements, as "joint".
        feature: What they may have.
        which: Which of them have it: a mask of all elements of that kind.
        says: What a message says of one that has it.
    """

    kind: str
    feature: str
    which: NDArray[np.bool_]
    says: str


def _of_joints(raw: MjModel) -> Iterator[UnsupportedPart]:
    free = raw.jnt_type == _FREE
    span = raw.jnt_range[:, 1] - raw.jnt_range[:, 0]
    part = partial(UnsupportedPart, "joint", says="has it")
    yield part("compensation of gravity by actuators", raw.jnt_actgravcomp.astype(bool))
    yield part("ball joint", raw.jnt_type == _BALL)
    yield part("stiffness of a free joint", free & (raw.jnt_stiffness != 0))
    yield part("nonlinear spring", raw.jnt_stiffnesspoly.any(axis=1))
    yield part("nonlinear damping", raw.dof_dampingpoly[raw.jnt_dofadr].any(axis=1))
    yield part("two limits at once", (raw.jnt_limited > 0) & (span < 2 * raw.jnt_margin))


def _of_bodies(plan: Plan) -> Iterator[UnsupportedPart]:
    large = np.zeros(plan.raw.nbody, dtype=bool)
    for root in plan.roots:
        large[root] = plan.links(root) > MOST_LINKS
    much = f"has more than {MOST_LINKS} joints and rigid parts"
    led = (plan.raw.body_mocapid[plan.raw.body_rootid] >= 0) & (plan.raw.body_jntnum > 0)
    yield UnsupportedPart("body", "a tree of so many parts", large, much)
    yield UnsupportedPart("body", "a joint on a mocap body", led, "has it")


def _of_actuators(raw: MjModel) -> Iterator[UnsupportedPart]:
    own = (raw.actuator_armature != 0) | (raw.actuator_damping != 0)
    own |= raw.actuator_dampingpoly.any(axis=1)
    used, joints = in_force(raw) & ~_sticks(raw), raw.actuator_trnid[:, 0]
    on_joint = raw.actuator_trntype == TransmissionKind.JOINT
    on_tendon = raw.actuator_trntype == TransmissionKind.TENDON
    turning = np.zeros(raw.nactuator, dtype=bool)
    turning[on_joint] = np.isin(raw.jnt_type[joints[on_joint]], (_FREE, _BALL))
    between = (raw.actuator_delay != 0) & (raw.actuator_history[:, 1] != 0)
    straight = raw.actuator_gaintype == GainKind.FIXED
    straight &= np.isin(raw.actuator_biastype, _AFFINE)
    of_muscles = np.array(
        [
            raw.actuator_gaintype == GainKind.MUSCLE,
            raw.actuator_biastype == BiasKind.MUSCLE,
            raw.actuator_dyntype == ActivationKind.MUSCLE,
        ]
    )
    straight = np.where(of_muscles.any(axis=0), of_muscles.all(axis=0), straight)
    stateful = ~np.isin(raw.actuator_dyntype, (ActivationKind.NONE, *DYNAMICS))
    elsewhere = used & ~(on_joint | on_tendon)
    part = partial(UnsupportedPart, "actuator")
    yield part("actuator armature or damping", own, "has it: give it to the joint")
    yield part("actuator transmission", elsewhere, "does not drive a joint")
    yield part("actuator of a free joint", used & turning, "is one")
    yield part("actuator dynamics", used & stateful, "has a state of its own")
    yield part("interpolated latency", used & between, "acts between two commands")
    yield part("actuator gain", used & ~straight, "has one that is not constant")


def _of_ties(raw: MjModel) -> Iterator[UnsupportedPart]:
    """Yield what tendons and equalities have, within one robot."""
    heavy = np.zeros(raw.ntendon, dtype=bool)
    for tendon in range(raw.ntendon):
        heavy[tendon] = raw.tendon_armature[tendon] and not len(linear_sum(raw, tendon)[0])
    poly = raw.tendon_stiffnesspoly.any(axis=1) | raw.tendon_dampingpoly.any(axis=1)
    strange = np.zeros(raw.neq, dtype=bool)
    for eq in np.flatnonzero(raw.eq_active0).tolist():
        strange[eq] = not ends_of(raw, eq)
    ranged = raw.tendon_actfrclimited.astype(bool)
    tendon, equality = partial(UnsupportedPart, "tendon"), partial(UnsupportedPart, "equality")
    yield tendon("armature of a spatial tendon", heavy, "has it")
    yield tendon("nonlinear tendon", poly, "has a spring or damper that is not linear")
    yield tendon("force range of a tendon", ranged, "has one")
    yield equality("equality constraint", strange, "is of a kind that is not known here")


def _between_robots(plan: Plan) -> list[tuple[str, str]]:
    """Return what ties two robots of which one floats, by the feature's name, in words."""
    raw, problems = plan.raw, list[tuple[str, str]]()
    for tendon in acting_tendons(raw):
        bodies, (joints, _) = movers(raw, tendon), linear_sum(raw, tendon)
        if len({int(plan.mechanism[body]) for body in bodies}) > 1:
            ends = _ends_in_words(raw, joints.tolist(), bodies)
            words = f"{_label(raw, 'tendon', tendon)} goes over {ends}, {_apart(plan, bodies)}; "
            way_out = "let both stand on the world, leave it out, or run the file on MuJoCo"
            problems.append(("tendon between trees", words + way_out))
    for eq in np.flatnonzero(raw.eq_active0).tolist():
        bodies = moving(raw, ends_of(raw, eq))
        if len({int(plan.mechanism[body]) for body in bodies}) > 1:
            ends = _ends_in_words(raw, joints_of(raw, eq), bodies)
            words = f"{_label(raw, 'equality', eq)} ties {ends}, {_apart(plan, bodies)}; "
            way_out = (
                'let both stand on the world, switch it off (active="false"), or run the file on '
                "MuJoCo"
            )
            problems.append(("equality between trees", words + way_out))
    return problems


def _ends_in_words(raw: MjModel, joints: list[int], bodies: list[int]) -> str:
    """Return the names of what a constraint ties: its joints, else its bodies."""
    if joints:
        return few([f"joint {_name(raw, 'joint', joint)}" for joint in joints], most=4)
    return few([f"body {_name(raw, 'body', body)}" for body in dict.fromkeys(bodies)], most=4)


def _apart(plan: Plan, bodies: list[int]) -> str:
    """Say of which robots some bodies are, and which of these float."""
    roots = dict.fromkeys(int(plan.mechanism[body]) for body in bodies)
    robots = [str(_name(plan.raw, "body", root)) for root in roots]
    afloat = [str(_name(plan.raw, "body", root)) for root in roots if floats(plan.raw, root)]
    verb = "floats" if len(afloat) == 1 else "float"
    return f"of the robots {few(robots, most=4)}, of which {few(afloat, most=4)} {verb}"


def _label(raw: MjModel, kind: str, number: int) -> str:
    """Return "tendon sum" of one with a name, "a tendon without a name" of others."""
    name = getattr(raw, kind)(number).name
    return f"{kind} {name}" if name else f"the {kind} without a name"


def _of_geoms(plan: Plan) -> Iterator[UnsupportedPart]:
    raw, touching = plan.raw, plan.surfaces.touching
    wet = bool(raw.opt.density or raw.opt.viscosity) & (raw.geom_fluid[:, 0] > 0)
    strange = touching & ~np.isin(raw.geom_type, _SOLIDS)
    bodies = raw.geom_bodyid
    moved = (raw.body_treeid[bodies] >= 0) | (raw.body_mocapid[raw.body_rootid[bodies]] >= 0)
    planes = touching & (raw.geom_type == GeomKind.PLANE) & moved
    yield UnsupportedPart("geom", "plane on a body", planes, "is on one that moves")
    yield UnsupportedPart("geom", "fluid around an ellipsoid", wet, "has it")
    for kind in np.unique(raw.geom_type[strange]).tolist():
        says = f"is a {GeomKind(kind).name.lower()}"
        which = strange & (raw.geom_type == kind)
        yield UnsupportedPart("geom", "shape of a geom", which, says)


def ignored(plan: Plan) -> list[str]:
    """Return the settings of a model that have no counterpart, and do not make it another robot."""
    raw = plan.raw
    enabled = {
        flag: raw.opt.enableflags & flag
        for flag in (EnableFlag.OVERRIDE, EnableFlag.SLEEP, EnableFlag.DIAGEXACT)
    }
    touches = not raw.opt.disableflags & NO_CONTACT
    integrators: dict[int, str] = {
        IntegratorKind.IMPLICIT: "implicit acts as implicitfast",
        IntegratorKind.RK4: "RK4 acts as Euler",
        IntegratorKind.DISCRETE: "discrete acts as implicitfast",
    }
    integrator = integrators.get(int(raw.opt.integrator))
    sentences = [f"the integrator {integrator}"] if integrator else []
    settings = {
        "noslip_iterations": raw.opt.noslip_iterations,
        "the override of contact parameters": enabled[EnableFlag.OVERRIDE],
        "sleep": enabled[EnableFlag.SLEEP],
        "diagexact": enabled[EnableFlag.DIAGEXACT],
        "springyield of a tendon": raw.tendon_springyield.any(),
    }
    if touches:
        settings |= _contact_settings(raw)
    sentences += [f"{what} has no effect" for what, there in settings.items() if there]
    if raw.jnt_springyield.any():
        sentences.append(f"springyield has no effect ({_list(raw, 'joint', raw.jnt_springyield)})")
    if touches:
        touching = plan.surfaces.touching
        margins = raw.geom_margin * touching
        if margins.any():
            largest = int(margins.argmax())
            sentences.append(
                f"contacts begin at a distance of 0, not at the margin of "
                f"{int(np.count_nonzero(margins))} geoms (the largest: "
                f"{1e3 * margins[largest]:.3g} mm, {_name(raw, 'geom', largest)})"
            )
        sentences += _hull_differences(plan)
        belts = np.sqrt((raw.geom_surfacevel[:, :3] ** 2).sum(axis=1)) * touching
        if belts.any():
            sentences.append(f"surfacevel has no effect ({_list(raw, 'geom', belts)})")
        sentences += _bounces(plan)
    return sentences


def _contact_settings(raw: MjModel) -> dict[str, np.bool_]:
    """Return settings of contacts that have no counterpart, and whether a model has them."""
    slide, _, roll = np.split(raw.pair_friction, [2, 3], axis=1)
    softness = (raw.pair_solref != _SOLREF).any() or (raw.pair_solimp != _SOLIMP).any()
    softness = softness or raw.pair_solreffriction.any()
    settings = {"adhesion": raw.geom_adhesion.any() or raw.pair_adhesion.any()}
    settings["an actuator of adhesion"] = (_sticks(raw) & in_force(raw)).any()
    settings["the margin of a pair"] = raw.pair_margin.any()
    settings["the second friction of a pair"] = np.ptp(slide, axis=1).any()
    settings["the second rolling friction of a pair"] = np.ptp(roll, axis=1).any()
    settings["solref, solimp or solreffriction of a pair"] = softness
    return settings


def as_targets(plan: Plan) -> list[str]:
    """Return the actuators whose ctrl is no position, and is the target of one on the engine as
    it comes.
    """
    raw = plan.raw
    others = np.flatnonzero(in_force(raw) & (raw.actuator_biasprm[:, 1] == 0))
    names = few([str(_name(raw, "actuator", int(a))) for a in others], 3)
    what = f"ctrl of {names} is a target position there, and no force or speed"
    return [what] if names else []


def otherwise(plan: Plan) -> list[str]:
    """Say what PyBullet makes of a URDF that it reads itself, where the file means something else.

    What every file meets, such as the inertias, is told by `statemachine compare --models`.
    """
    sentences: list[str] = []
    if plan.file and plan.file.mimics:
        names = few(list(plan.file.mimics), 3)
        sentences.append(f"<mimic> has no effect there: {names} moves by itself")
    if plan.file and plan.file.floating and plan.file.floats:
        names = few(list(plan.file.floating), 3)
        sentences.append(f"it makes a fixed joint of the floating {names}")
    return sentences


def _sticks(raw: MjModel) -> Any:
    """Return (nactuator,) bool of which actuators act on the contacts of a body alone."""
    return raw.actuator_trntype == TransmissionKind.BODY


def _bounces(plan: Plan) -> list[str]:
    """Return the contact that would spring back most: a damping ratio far below one is
    restitution.
    """
    raw, pairs = plan.raw, plan.surfaces.meeting
    if not pairs:
        return []
    ratios = np.clip(damping_ratios(raw, pairs), 0.0, 1 - 1e-9)
    most = int(ratios.argmin())
    ratio = float(ratios[most])
    left = math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2))  # of its speed, a damped spring
    if left < _BOUNCE:
        return []
    names = " and ".join(str(_name(raw, "geom", geom)) for geom in pairs[most])
    return [
        f"contacts do not bounce: solref has no effect ({names} would keep about "
        f"{100 * left:.0f} % of their speed)"
    ]


def softness(plan: Plan) -> str:
    """Return the geoms that touch and have a solref or solimp of their own, in words; "" without
    any.
    """
    raw = plan.raw
    touching = plan.surfaces.touching
    own = (raw.geom_solref != _SOLREF).any(axis=1) | (raw.geom_solimp != _SOLIMP).any(axis=1)
    geoms = np.flatnonzero(own & touching).tolist() if plan.surfaces.solids else []
    return few([str(_name(raw, "geom", geom)) for geom in geoms])


def _hull_differences(plan: Plan) -> list[str]:
    """Return where a hull differs from its shape: ellipsoids, and what is thinner than the
    engine's margin.
    """
    raw, sentences = plan.raw, []
    eggs = [geom for geom in plan.hulls if int(raw.geom_type[geom]) == GeomKind.ELLIPSOID]
    if eggs:
        largest = max(eggs, key=lambda geom: raw.geom_size[geom].max())
        size = 1e3 * roughness(raw.geom_size[largest])
        sentences.append(
            f"ellipsoids touch as hulls, which are up to {size:.2g} mm off "
            f"({_name(raw, 'geom', largest)})"
        )
    excess = {geom: MARGIN - hull.allowance for geom, hull in plan.hulls.items()}
    thin = [geom for geom in excess if excess[geom] > 1e-6]
    if thin:
        worst = max(thin, key=lambda geom: excess[geom])
        sentences.append(
            f"{len(thin)} hulls are too thin to be made smaller by the engine's margin: up to "
            f"{1e3 * excess[worst]:.2g} mm too large ({_name(raw, 'geom', worst)})"
        )
    return sentences


def _list(raw: MjModel, kind: str, values: Array) -> str:
    """Return the elements whose value is not zero, the largest first, as "a 0.5, b 0.1 and 3
    more".
    """
    order = [int(k) for k in np.argsort(-np.abs(values), kind="stable") if values[k]]
    return few([f"{_name(raw, kind, k)} {values[k]:.3g}" for k in order], most=2)


def _name(raw: MjModel, kind: str, number: int) -> Any:
    return getattr(raw, kind)(number).name or f"number {number}"
