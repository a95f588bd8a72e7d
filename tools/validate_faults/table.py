"""The wrong parameters, and the case that has to notice each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .changes import (
    Change,
    attribute,
    gravity,
    leaning,
    moved,
    option,
    reordered,
    scaled,
    timestep,
    without,
    written,
)

_BODIES = "geom inertial"
_LESS_BOUNCE = (
    1.01904  # of the damping, by which the restitution of collision-restitution loses 1 %
)


# What a case does with a wrong parameter. "not read": the engine gives the same numbers, bit for
# bit: nothing can be noticed. "wrong anyway": by its record the engine is wrong in the case
# without the wrong parameter too. "refused": the engine does not run the case. "has none": the case
# has no such parameter.
Outcome = Literal["noticed", "missed", "not read", "wrong anyway", "refused", "has none"]


@dataclass(frozen=True)
class Fault:
    """A wrong parameter.

    Attributes:
        name: What is wrong, and by how much.
        case: Name of the case that has to notice it, on every engine that reads the parameter.
        change: Makes it wrong in a case.
        with_discrete: What the case does on MuJoCo with its integrator discrete.
        on_pybullet: What the case does there with our backend.
        as_it_comes: What it does on PyBullet as its own users meet it.
        on_motrix: What it does on MotrixSim.
    """

    name: str
    case: str
    change: Change
    with_discrete: Outcome = "noticed"
    on_pybullet: Outcome = "noticed"
    as_it_comes: Outcome = "noticed"
    on_motrix: Outcome = "noticed"


_BY_ONE_PERCENT = scaled(1.01)
_FRICTION = attribute("geom", "friction", scaled(1.01, 0, 1))
_LESS_FRICTION = attribute("geom", "friction", scaled(0.99, 0, 1))
_TORSION = attribute("geom", "friction", scaled(1.01, 1, 1))
_ROLLING = attribute("geom", "friction", scaled(1.01, 2, 1))
_PLACE = 0.001  # [m]
_ONE_MASS = attribute(_BODIES, "mass", _BY_ONE_PERCENT, only_first=True)

_MASS = attribute(_BODIES, "mass", _BY_ONE_PERCENT)
_MORE_GRAVITY, _LESS_GRAVITY = gravity(_BY_ONE_PERCENT), gravity(scaled(0.99))

FAULTS: tuple[Fault, ...] = (
    # Gravity and time.
    Fault("gravity 1 % too large", "resting-force", gravity(_BY_ONE_PERCENT)),
    Fault("gravity 1 % too small", "groove-force", gravity(scaled(0.99))),
    Fault("gravity upwards", "bounce-gain", gravity(scaled(-1.0))),
    Fault("gravity along x", "stack-force", gravity(reordered(2, 0, 1))),
    Fault("gravity leans by a hundredth", "groove-force", gravity(leaning(0.01))),
    Fault(
        "slope 1 % too steep",
        "block-slides",
        gravity(scaled(1.01, 0, 1)),
        as_it_comes="wrong anyway",
    ),
    Fault("timestep 1 % too short", "free-fall", timestep(0.99)),
    Fault("timestep 1 % too long", "thrown-body", timestep(1.01), as_it_comes="wrong anyway"),
    # Inertia.
    Fault("mass 1 % too large", "resting-force", attribute(_BODIES, "mass", _BY_ONE_PERCENT)),
    Fault("mass of one body 1 % too large", "collision-momentum", _ONE_MASS),
    Fault("mass on a servo 1 % too large", "servo-droop", _ONE_MASS, as_it_comes="not read"),
    Fault(
        "moment of inertia 1 % too large",
        "symmetric-body",
        attribute("inertial", "diaginertia", scaled(1.01, 0, 1)),
        as_it_comes="not read",
    ),
    Fault(
        "moments of inertia in another order",
        "symmetric-body",
        attribute("inertial", "diaginertia", reordered(2, 0, 1)),
        as_it_comes="not read",
    ),
    Fault(
        "centre of mass 1 % too far",
        "torque-at-rest",
        attribute("inertial", "pos", _BY_ONE_PERCENT),
        on_motrix="refused",
    ),
    Fault(
        "centre of mass on the other side",
        "torque-moving",
        attribute("inertial", "pos", scaled(-1.0)),
        on_motrix="refused",
    ),
    Fault(
        "link 1 % too long",
        "torque-at-rest",
        attribute("body", "pos", _BY_ONE_PERCENT),
        on_motrix="refused",
    ),
    Fault(
        "armature 1 % too large",
        "armature",
        attribute("joint", "armature", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault("no armature", "armature", without("joint", "armature"), as_it_comes="not read"),
    # Joints.
    Fault(
        "damping 1 % too large",
        "terminal-speed",
        attribute("joint", "damping", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault("no damping", "damped-spring", without("joint", "damping"), as_it_comes="not read"),
    Fault(
        "stiffness 1 % too large",
        "spring-period",
        attribute("joint", "stiffness", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault(
        "axis the other way round",
        "sinking-speed",
        attribute("joint", "axis", scaled(-1.0)),
        as_it_comes="not read",
    ),
    Fault(
        "axis y for z",
        "pendulum-60",
        attribute("joint", "axis", reordered(0, 2, 1)),
        as_it_comes="not read",
    ),
    Fault(
        "dry friction 1 % too large",
        "dry-friction-above",
        attribute("joint", "frictionloss", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault(
        "range of a joint 1 % too wide",
        "limit-rest",
        attribute("joint", "range", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault(
        "gear of a mimic 1 % too large",
        "reflected-inertia",
        attribute("joint", "polycoef", _BY_ONE_PERCENT),
        as_it_comes="refused",
    ),
    # Actuators.
    Fault(
        "kp 1 % too large",
        "servo-droop",
        attribute("position", "kp", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault(
        "kv 1 % too large",
        "servo-step",
        attribute("position", "kv", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault(
        "motor the other way round",
        "armature",
        written("motor", "gear", "-1"),
        as_it_comes="not read",
    ),
    Fault(
        "range of force 1 % too wide",
        "effort-limit",
        attribute("position", "forcerange", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    Fault(
        "range of commands 1 % too wide",
        "speed-limit",
        attribute("motor", "ctrlrange", _BY_ONE_PERCENT),
        as_it_comes="not read",
    ),
    # Contact.
    Fault("friction 1 % too large", "block-slides", _FRICTION, as_it_comes="not read"),
    Fault("friction 1 % too small", "friction-threshold", _LESS_FRICTION, as_it_comes="not read"),
    Fault(
        "torsional friction 1 % too large", "torsional-friction", _TORSION, as_it_comes="not read"
    ),
    Fault("rolling friction 1 % too large", "rolling-friction", _ROLLING, as_it_comes="not read"),
    Fault(
        "restitution 1 % too small",
        "collision-restitution",
        attribute("geom", "solref", scaled(_LESS_BOUNCE, 1, 1)),
        on_pybullet="not read",
        as_it_comes="not read",
    ),
    Fault(
        "time constant of contact 1 % too short",
        "contact-depth",
        written("geom", "solref", "0.0198 1"),
        on_pybullet="not read",
        as_it_comes="not read",
    ),
    Fault(
        "friction cone a pyramid",
        "block-slides-diagonal",
        option("elliptic", "pyramidal"),
        on_pybullet="not read",
        as_it_comes="not read",
        on_motrix="not read",
    ),
    Fault("size 1 % too large", "contact-depth", attribute("geom", "size", _BY_ONE_PERCENT)),
    # Orientation.
    Fault(
        "quaternion in the order x y z w",
        "rocking-time",
        attribute("geom body", "quat", reordered(1, 2, 3, 0)),
    ),
    Fault(
        "quaternion of the inverse rotation",
        "rocking-time",
        attribute("geom body", "quat", scaled(-1.0, 1, 3)),
    ),
    # Of one case each, which notices no smaller or no other fault.
    Fault(
        "weight of a pin 1 % too large",
        "reaction-at-rest",
        _MASS,
        as_it_comes="refused",
        on_motrix="refused",
    ),
    Fault(
        "gravity of a pin 1 % too large",
        "reaction-moving",
        _MORE_GRAVITY,
        as_it_comes="refused",
        on_motrix="refused",
    ),
    Fault(
        "gravity 1 % too small of what swings on a pin",
        "pinned-energy",
        _LESS_GRAVITY,
        as_it_comes="refused",
    ),
    Fault(
        "gravity of a linkage 1 % too large",
        "four-bar-period",
        _MORE_GRAVITY,
        as_it_comes="refused",
    ),
    Fault(
        "bars of a linkage 1 % too long",
        "four-bar-closure",
        attribute("body", "pos", _BY_ONE_PERCENT),
        as_it_comes="refused",
    ),
    Fault(
        "time constant of a weld twice as long",
        "weld-payload",
        written("weld", "solref", "0.04 1"),
        as_it_comes="refused",
    ),
    Fault(
        "time constant of a loop twice as long",
        "weld-loop",
        written("weld", "solref", "0.04 1"),
        as_it_comes="refused",
    ),
    Fault("gravity of a payload 1 % too large", "weld-droop", _MORE_GRAVITY, as_it_comes="refused"),
    Fault(
        "gear of a follower 1 % too large",
        "mimic",
        attribute("joint", "polycoef", _BY_ONE_PERCENT),
        as_it_comes="refused",
    ),
    Fault(
        "weight on a limit 1 % too large",
        "limit-force",
        _MASS,
        as_it_comes="refused",
        on_motrix="refused",
    ),
    Fault("no limit", "limit-rebound", without("joint", "range limited"), as_it_comes="not read"),
    Fault(
        "time constant of friction 1 % too short",
        "creep-of-solref",
        written("geom", "solref", "0.0198 1"),
        on_pybullet="not read",
        as_it_comes="not read",
        on_motrix="wrong anyway",
    ),
    Fault(
        "slope of a roll 1 % too steep",
        "sphere-rolls",
        gravity(scaled(1.01, 0, 1)),
        as_it_comes="wrong anyway",
    ),
    Fault(
        "gravity on spheres 1 % too large", "sphere-grid", _MORE_GRAVITY, as_it_comes="wrong anyway"
    ),
    Fault(
        "mass of a sphere on its shell",
        "sphere-slides-then-rolls",
        written("geom", "shellinertia", "true"),
        as_it_comes="not read",
        on_motrix="not read",
    ),
    Fault(
        "friction of a sphere 1 % too small",
        "sliding-time",
        _LESS_FRICTION,
        as_it_comes="not read",
    ),
    Fault(
        "restitution of a bounce 1 % too small",
        "bounce",
        attribute("geom", "solref", scaled(_LESS_BOUNCE, 1, 1)),
        with_discrete="wrong anyway",
        on_pybullet="not read",
        as_it_comes="not read",
    ),
    Fault(
        "friction of a skid 1 % too large",
        "sphere-skids",
        _FRICTION,
        as_it_comes="not read",
    ),
    Fault(
        "gravity on a stack 1 % too large",
        "stack-sag",
        _MORE_GRAVITY,
        on_pybullet="wrong anyway",
        as_it_comes="wrong anyway",
        on_motrix="wrong anyway",
    ),
    Fault(
        "friction a third of what it is",
        "held-box",
        attribute("geom", "friction", scaled(1 / 3, 0, 1)),
        as_it_comes="not read",
    ),
    Fault(
        "place of one body 1 mm off",
        "order-of-bodies",
        attribute("body", "pos", moved(_PLACE), only_first=True),
    ),
    Fault(
        "slope a tenth too steep",
        "tipping-threshold",
        gravity(scaled(1.1, 0, 1)),
        as_it_comes="wrong anyway",
        on_motrix="wrong anyway",
    ),
    Fault("gravity a fifth too small", "rocking-energy", gravity(scaled(0.8))),
    Fault(
        "block a tenth too wide",
        "rocking-rebound",
        attribute("geom", "size", scaled(1.1, 0, 1)),
    ),
)
