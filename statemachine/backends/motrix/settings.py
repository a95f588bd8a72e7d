"""Which numbers of a file MotrixSim can be given otherwise: fields of a compiled model.

`Model.replace` edits a compiled model (`backends.edits`). The fields that differ are written into
MotrixSim's description of the file, before it is built.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...interface import Array, JointType
from ...interface.checks import unsupported_by
from ..actuators import servos
from ..compiled.flags import DisableFlag
from ..served.shared_fields import FLAGS, field_names, field_of

if TYPE_CHECKING:
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


@dataclass(frozen=True)
class WorldElements:
    """Elements of a world, as settings are written into it.

    Attributes:
        msd: The module `motrixsim.msd`.
        world: The world.
        links: All links, as `engine_model.links_of` yields them; body k + 1 is link k.
        geoms: All geoms, as `engine_model.geoms_of` gives them.
    """

    msd: Any
    world: Any
    links: Sequence[Any]
    geoms: Sequence[Any]

    def joints(self) -> list[tuple[Any, int]]:
        """Return all joints with their numbers of degrees of freedom, in the order of the file."""
        found: list[tuple[Any, int]] = []
        for each in self.links:
            if each.free is not None:
                found.append((each.free, JointType.FREE.nv))
            else:
                found += [(joint, _nv(joint)) for joint in each.link.joints]
        return found


def _nv(joint: Any) -> int:
    return JointType.BALL.nv if "Ball" in str(joint.type_) else 1


def flags_of(world: Any, flags: int) -> int:
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


def apply_settings(
    msd: Any, world: Any, links: Sequence[Any], geoms: Sequence[Any], settings: Mapping[str, Array]
) -> None:
    """Write settings into a world.

    Args:
        msd: The module `motrixsim.msd`.
        world: Is edited.
        links: All its links, in the order of the bodies.
        geoms: All its geoms, in their order.
        settings: As `settings_between` gives them.
    """
    elements = WorldElements(msd, world, links, geoms)
    for name, value in settings.items():
        _FIELDS[name](elements, value)


def _set_timestep(elements: WorldElements, value: Array) -> None:
    elements.world.simulate_option.timestep = float(value)


def _set_gravity(elements: WorldElements, value: Array) -> None:
    elements.world.simulate_option.gravity = value.tolist()


def _set_switches(elements: WorldElements, value: Array) -> None:
    option, flags = elements.world.simulate_option, int(value)
    for flag, switch in _SWITCHES.items():
        setattr(option, switch, bool(flags & int(flag)))
    if flags & DisableFlag.ACTUATION:
        # Its own switch, disable_actuators, is without effect. Keyframes have a command of each.
        elements.world.keyframes, elements.world.actuators = [], []


def _per_joint(attribute: str) -> Callable[[WorldElements, Array], None]:
    """Return what sets an attribute of each joint to the first number of its degrees of freedom."""

    def write(elements: WorldElements, value: Array) -> None:
        start = 0
        for joint, count in elements.joints():
            setattr(joint, attribute, float(value[start]))
            start += count

    return write


def _set_damping(elements: WorldElements, value: Array) -> None:
    start = 0
    for joint, count in elements.joints():
        damping = float(value[start])
        start += count
        if count == JointType.FREE.nv:
            if damping:
                raise unsupported_by("motrix", "damping", "a free joint of its has none")
            continue
        spring = joint.spring_damper
        stiffness = spring.coeff.value.k if spring is not None else 0.0
        spring = elements.msd.SpringDamper() if spring is None else spring
        coefficients = elements.msd.StiffnessDamping()
        coefficients.k, coefficients.d = stiffness, damping
        spring.coeff = elements.msd.SpringDampCoeff.stiffness_damping(coefficients)
        joint.spring_damper = spring


def _set_friction(elements: WorldElements, value: Array) -> None:
    for geom, row in zip(elements.geoms, value, strict=True):
        geom.physics_material.friction = row.tolist()


def _scale_masses(elements: WorldElements, value: Array) -> None:
    for each, factor in zip(elements.links, value[1:], strict=True):
        if factor == 1.0:
            continue
        for inertial in (each.link.inertial, *(geom.inertial for geom in each.link.geoms)):
            if inertial.mass is not None:
                inertial.mass = float(factor * inertial.mass)
            if inertial.diag_inertia is not None:
                inertial.diag_inertia = factor * inertial.diag_inertia
        for geom in each.link.geoms:
            geom.physics_material.density = float(factor * geom.physics_material.density)


def _gain(index: int) -> Callable[[WorldElements, Array], None]:
    """Return what sets a gain of the position servos: kp (1) or kv (2), as in biasprm."""

    def write(elements: WorldElements, value: Array) -> None:
        kinds = elements.msd.ActuatorType
        for actuator, gain in zip(elements.world.actuators, value.tolist(), strict=True):
            if np.isnan(gain):
                continue
            values = actuator.actuator_type.value
            if actuator.actuator_type.variant == "position":
                if index == 1:
                    values.kp = gain
                else:
                    values.damping_value, values.damping_type = gain, elements.msd.DampingType.Kv
                actuator.actuator_type = kinds.position(values)
                continue
            bias, gains = np.array(values.biasprm), np.array(values.gainprm)
            bias[index] = -gain
            if index == 1:
                gains[0] = gain
            values.biasprm, values.gainprm = bias, gains
            actuator.actuator_type = kinds.general(values)

    return write


_FIELDS: dict[str, Callable[[WorldElements, Array], None]] = {
    "opt.timestep": _set_timestep,
    "opt.gravity": _set_gravity,
    "opt.disableflags": _set_switches,
    "dof_armature": _per_joint("armature"),
    "dof_frictionloss": _per_joint("friction_loss"),
    "dof_damping": _set_damping,
    "geom_friction": _set_friction,
    "mass factor": _scale_masses,
    "kp": _gain(1),
    "kv": _gain(2),
}
