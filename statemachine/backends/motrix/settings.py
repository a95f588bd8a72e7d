"""Which numbers of a file MotrixSim can be given otherwise: fields of a compiled model.

`Model.replace` edits a compiled model (`backends.edits`). The fields that differ are written into
MotrixSim's description of the file, before it is built.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ...interface import Array
from ...interface.checks import unsupported_by
from ..actuators import servos
from ..compiled.flags import DisableFlag
from ..served.shared_fields import FLAGS, field_names, field_of
from .links import free_joints_of, geoms_of, joints_of, links_of, mx

if TYPE_CHECKING:
    from motrixsim import msd

    from ..compiled.types import MjModel

# Constants that follow from others, and what is no part of a motion: `mj_setConst`, and delays,
# which a HiddenData does itself.
_FOLLOW = (
    *("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0", "actuator_acc0"),
    *("tendon_invweight0", "actuator_delay", "actuator_lengthrange", "tendon_length0"),
    *("stat.meaninertia", "stat.meanmass", "stat.meansize", "stat.extent", "stat.center"),
)
# Flags of `opt.disableflags` -> the switch of MotrixSim's options, of those that have an effect.
_SWITCHES = {
    DisableFlag.CONTACT: "disable_contacts",
    DisableFlag.LIMIT: "disable_limit",
    DisableFlag.GRAVITY: "disable_gravity",
    DisableFlag.FRICTIONLOSS: "disable_frictionloss",
    DisableFlag.DAMPER: "disable_damping",
    DisableFlag.EQUALITY: "disable_equality",
    DisableFlag.CONSTRAINT: "disable_constraints",
}
_REASON = "its model does not take it"


def settings_between(base: MjModel, edited: MjModel) -> dict[str, Array]:
    """Return the fields in which an edited compiled model differs from that of the file.

    Of a mass it is the factor of each body, as "mass factor" (nbody,); of the gains of servos
    "kp" and "kv" (nu,).

    Args:
        base: As the file says.
        edited: Of the same elements.

    Raises:
        UnsupportedError: MotrixSim cannot be given one of them.
    """
    settings: dict[str, Array] = {}
    for name in (*field_names(edited, ()), *FLAGS):
        before, after = np.asarray(field_of(base, name)), np.asarray(field_of(edited, name))
        if name in _FOLLOW or np.array_equal(before, after):
            continue
        if name not in _FIELDS and name not in _JOINTLY:
            raise unsupported_by("motrix", name, _REASON)
        settings[name] = np.array(after, dtype=np.float64)
    if not _JOINTLY.isdisjoint(settings):
        _together(base, edited, settings)
    return settings


# Fields that are changed together with others.
_JOINTLY = frozenset(("body_mass", "body_inertia", "actuator_gainprm", "actuator_biasprm"))


def _together(base: MjModel, edited: MjModel, settings: dict[str, Array]) -> None:
    """Replace fields that belong together by the number that MotrixSim takes for them.

    Raises:
        UnsupportedError: They do not change together.
    """
    if "body_mass" in settings or "body_inertia" in settings:
        has_mass = base.body_mass > 0
        factors = np.divide(
            edited.body_mass, base.body_mass, where=has_mass, out=np.ones(base.nbody)
        )
        if not np.allclose(edited.body_inertia, factors[:, None] * base.body_inertia, rtol=1e-9):
            reason = "it takes a mass and its inertia together"
            raise unsupported_by("motrix", "body_inertia", reason)
        settings["mass factor"] = factors
    if "actuator_gainprm" in settings or "actuator_biasprm" in settings:
        owner, servo = servos(edited)
        _, was_servo = servos(base)
        same = np.array(edited.actuator_biasprm), np.array(edited.actuator_gainprm)
        same[0][owner[servo], 1:3] = base.actuator_biasprm[owner[servo], 1:3]
        same[1][owner[servo], 0] = base.actuator_gainprm[owner[servo], 0]
        only_gains = np.array_equal(same[0], base.actuator_biasprm)
        only_gains = only_gains and np.array_equal(same[1], base.actuator_gainprm)
        if not (only_gains and np.array_equal(servo, was_servo)):
            raise unsupported_by("motrix", "actuator_biasprm", "it takes the gains of servos alone")
        settings["kp"] = np.where(servo, edited.actuator_gainprm[owner, 0], np.nan)
        settings["kv"] = np.where(servo, -edited.actuator_biasprm[owner, 2], np.nan)
    for name in _JOINTLY:
        settings.pop(name, None)


def flags_of(world: msd.World, flags: int) -> int:
    """Return the flags of a compiled model as MotrixSim has them: those that it knows, as it read.

    Args:
        world: What it read.
        flags: What MuJoCo read, `opt.disableflags`.
    """
    flags &= ~int(DisableFlag.ACTUATION)
    for flag, switch in _SWITCHES.items():
        is_set = getattr(world.simulate_option, switch)
        flags = flags | int(flag) if is_set else flags & ~int(flag)
    return flags


def apply_settings(world: msd.World, settings: Mapping[str, Array]) -> None:
    """Write settings into a world, which is edited.

    Args:
        world: As it was read; its link k is body k + 1.
        settings: As `settings_between` gives them.
    """
    for name, write in _FIELDS.items():
        if name in settings:
            write(world, settings[name])


def _set_timestep(world: msd.World, value: Array) -> None:
    world.simulate_option.timestep = float(value)


def _set_gravity(world: msd.World, value: Array) -> None:
    world.simulate_option.gravity = value.tolist()


def _set_switches(world: msd.World, value: Array) -> None:
    option, flags = world.simulate_option, int(value)
    for flag, switch in _SWITCHES.items():
        setattr(option, switch, bool(flags & int(flag)))
    if flags & DisableFlag.ACTUATION:
        # Its own switch, disable_actuators, is without effect.
        _without_actuators(world, value)


def _per_joint(attribute: str) -> Callable[[msd.World, Array], None]:
    """Return what sets an attribute of each joint to the first number of its degrees of freedom."""

    def write(world: msd.World, value: Array) -> None:
        for joint, start in (*joints_of(world), *free_joints_of(world)):
            setattr(joint, attribute, float(value[start]))

    return write


def _set_damping(world: msd.World, value: Array) -> None:
    for _, start in free_joints_of(world):
        if value[start]:
            raise unsupported_by("motrix", "damping", "a free joint of its has none")
    for joint, start in joints_of(world):
        spring, coefficients = joint.spring_damper, mx.msd.StiffnessDamping()
        if spring is None:
            spring = mx.msd.SpringDamper()
        else:
            coefficients.k = spring.coeff.value.k
        coefficients.d = float(value[start])
        spring.coeff = mx.msd.SpringDampCoeff.stiffness_damping(coefficients)
        joint.spring_damper = spring


def _set_friction(world: msd.World, value: Array) -> None:
    for geom, row in zip(geoms_of(world), value, strict=True):
        geom.physics_material.friction = row.tolist()


def _scale_masses(world: msd.World, value: Array) -> None:
    for each, factor in zip(links_of(world), value[1:].tolist(), strict=True):
        if factor == 1.0:
            continue
        for inertial in (each.link.inertial, *(geom.inertial for geom in each.link.geoms)):
            if inertial.mass is not None:
                inertial.mass = factor * inertial.mass
            if inertial.diag_inertia is not None:
                inertial.diag_inertia = factor * inertial.diag_inertia
        for geom in each.link.geoms:
            geom.physics_material.density = factor * geom.physics_material.density


def _set_kp(world: msd.World, value: Array) -> None:
    for actuator, gain in _servos_of(world, value):
        values = actuator.actuator_type.value
        if actuator.actuator_type.variant == "position":
            values.kp = gain
            actuator.actuator_type = mx.msd.ActuatorType.position(values)
        else:
            _set_general(actuator, 1, gain)


def _set_kv(world: msd.World, value: Array) -> None:
    for actuator, gain in _servos_of(world, value):
        values = actuator.actuator_type.value
        if actuator.actuator_type.variant == "position":
            values.damping_value, values.damping_type = gain, mx.msd.DampingType.Kv
            actuator.actuator_type = mx.msd.ActuatorType.position(values)
        else:
            _set_general(actuator, 2, gain)


def _servos_of(world: msd.World, gains: Array) -> Iterator[tuple[msd.Actuator, float]]:
    """Yield each actuator of which a gain is given, with the gain; NaN is of others."""
    for actuator, gain in zip(world.actuators, gains.tolist(), strict=True):
        if not np.isnan(gain):
            yield actuator, gain


def _set_general(actuator: msd.Actuator, place: int, gain: float) -> None:
    """Set a gain of a servo that is written as a general actuator: 1 for kp, 2 for kv."""
    values = actuator.actuator_type.value
    bias, gains = np.array(values.biasprm), np.array(values.gainprm)
    bias[place] = -gain
    if place == 1:
        gains[0] = gain
    values.biasprm, values.gainprm = bias, gains
    actuator.actuator_type = mx.msd.ActuatorType.general(values)


def _fix_base(world: msd.World, _value: Array) -> None:
    for body in world.hierarchy.bodies:
        body.free = None


def _without_actuators(world: msd.World, _value: Array) -> None:
    """Take actuators out. Keyframes, which have a command of each, go with them."""
    world.keyframes, world.actuators = [], []


# What makes a world the robot that MuJoCo reads of a URDF: MotrixSim lets the base of each float,
# and gives each joint a motor.
FIXED_BASE, NO_ACTUATORS = "fixed base", "no actuators"

# By their names here, in the order in which they are written: what takes actuators out is last.
_FIELDS: dict[str, Callable[[msd.World, Array], None]] = {
    FIXED_BASE: _fix_base,
    NO_ACTUATORS: _without_actuators,
    "opt.timestep": _set_timestep,
    "opt.gravity": _set_gravity,
    "dof_armature": _per_joint("armature"),
    "dof_frictionloss": _per_joint("friction_loss"),
    "dof_damping": _set_damping,
    "geom_friction": _set_friction,
    "mass factor": _scale_masses,
    "kp": _set_kp,
    "kv": _set_kv,
    "opt.disableflags": _set_switches,
}
