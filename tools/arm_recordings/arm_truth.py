"""The true figures of a simulated arm, drawn about those of the model or of soft servos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from statemachine.interface import Array, Model

Servos = Literal["soft", "stiff"]
_SOFT_KP, _SOFT_VISCOUS = 25.0, 1.5  # N·m/rad; N·m·s/rad
PAYLOAD_BODY = "gripper"
GRIPPER = "gripper"  # its joint
# Standard deviations of what is drawn, of logarithms where it is a factor: of all joints
# together, and of each.
_FACTORS = {
    "kp": (0.25, 0.2),
    "viscous": (0.2, 0.15),
    "friction": (0.3, 0.2),
    "armature": (0.1, 0.1),
}
_OFFSET = np.radians(2.0)
_DELAYS = (0.015, 0.075)  # s
_PAYLOADS = (0.02, 0.12)  # kg


@dataclass(frozen=True)
class Fault:
    """A fault of what is recorded.

    Attributes:
        zero: By how much the zero of a joint is off, by its name [rad].
        reversed_joint: A joint that is recorded with the other sign; "" for none.
        gripper_scale: Recorded opening of the gripper by its true one.
        play: Between a joint and its encoder, by the joint's name [rad].
        tilt: Of the base, about the x and the y axis of the world [rad].
    """

    zero: tuple[tuple[str, float], ...] = ()
    reversed_joint: str = ""
    gripper_scale: float = 1.0
    play: tuple[tuple[str, float], ...] = ()
    tilt: tuple[float, float] = (0.0, 0.0)


NO_FAULT = Fault()


@dataclass(frozen=True, eq=False)
class ArmTruth:
    """What a simulated arm really is, each array (n,) in the order of the joints.

    A joint at the angle q is recorded as `pivot + scale * (q - pivot) + offset`, where pivot is 0,
    and the lower limit of the gripper.

    Attributes:
        joints: Their names.
        kp: Gains of the servos [N·m/rad].
        kv: Their damping, within their force limit [N·m·s/rad].
        damping: That of the joints, beside that limit [N·m·s/rad].
        friction: Dry friction [N·m].
        armature: Inertia of the rotors [kg·m²].
        offset: [rad]
        scale: 1; -1 of a joint whose sign is reversed.
        pivot: [rad]
        play: Between joint and encoder [rad].
        gravity: (3,) in the axes of the base [m/s²].
        delay: Of all that is measured [s].
        payload: Mass added to the body `gripper` [kg].
    """

    joints: tuple[str, ...]
    kp: Array
    kv: Array
    damping: Array
    friction: Array
    armature: Array
    offset: Array
    scale: Array
    pivot: Array
    play: Array
    gravity: Array
    delay: float
    payload: float

    @property
    def viscous(self) -> Array:
        """Return the damping of servo and joint together [N·m·s/rad]."""
        return self.kv + self.damping

    def applied_to(self, model: Model) -> Model:
        """Return the model with these figures; offset, scale and delay are not in it."""
        mass = np.array(model.body_mass)
        mass[model.body_id(PAYLOAD_BODY)] += self.payload
        return model.replace(
            kp=self.kp,
            kv=self.kv,
            damping=self.damping,
            frictionloss=self.friction,
            armature=self.armature,
            mass=mass,
            gravity=self.gravity,
        )

    def recorded(self, angles: Array) -> Array:
        """Return angles as they are recorded."""
        return self.pivot + self.scale * (angles - self.pivot) + self.offset

    def real(self, recorded: Array) -> Array:
        """Return recorded angles as they really are."""
        return self.pivot + (recorded - self.offset - self.pivot) / self.scale

    def as_dict(self) -> dict[str, object]:
        """Return all figures for JSON, in SI units, with viscous beside its two parts."""
        arrays = {
            "kp": self.kp,
            "viscous": self.viscous,
            "kv": self.kv,
            "damping": self.damping,
            "frictionloss": self.friction,
            "armature": self.armature,
            "offset": self.offset,
            "scale": self.scale,
            "pivot": self.pivot,
            "play": self.play,
            "gravity": self.gravity,
        }
        figures: dict[str, object] = {name: array.tolist() for name, array in arrays.items()}
        return {
            "joints": list(self.joints),
            **figures,
            "delay": self.delay,
            "payload": self.payload,
        }


def nominal_gains(model: Model, servos: Servos) -> tuple[Array, Array, Array]:
    """Return kp, kv and damping about which is drawn: the model's, or those of soft servos."""
    kp, kv = np.array(model.actuator_kp), np.array(model.actuator_kv)
    damping = np.array(model.dof_damping)
    if servos == "stiff":
        return kp, kv, damping
    softer = _SOFT_VISCOUS / (kv + damping)
    return np.full_like(kp, _SOFT_KP), kv * softer, damping * softer


def drawn_truth(
    model: Model, servos: Servos, rng: np.random.Generator, fault: Fault = NO_FAULT
) -> ArmTruth:
    """Draw the figures of an arm: a factor of all joints of each figure, times one of each joint.

    Args:
        model: Has as many actuators as joints, in the same order.
        servos: What is drawn about.
        rng: Draws them.
        fault: Of what is recorded.
    """
    count = model.nu
    factors: dict[str, Array] = {}
    for name, (common, each) in _FACTORS.items():
        logarithms = rng.normal(0.0, common) + rng.normal(0.0, each, count)
        factors[name] = np.exp(logarithms)
    offset = rng.normal(0.0, _OFFSET, count)
    delay = float(rng.uniform(*_DELAYS))
    payload = float(rng.uniform(*_PAYLOADS))
    kp, kv, damping = nominal_gains(model, servos)
    scale = np.ones(count)
    pivot = np.zeros(count)
    gripper = model.joint_id(GRIPPER)
    pivot[gripper] = model.jnt_range[gripper, 0]
    scale[gripper] = fault.gripper_scale
    if fault.reversed_joint:
        scale[model.joint_id(fault.reversed_joint)] = -1.0
    for joint, angle in fault.zero:
        offset[model.joint_id(joint)] += angle
    play = np.zeros(count)
    for joint, angle in fault.play:
        play[model.joint_id(joint)] = angle
    return ArmTruth(
        joints=model.joint_names,
        kp=kp * factors["kp"],
        kv=kv * factors["viscous"],
        damping=damping * factors["viscous"],
        friction=np.array(model.dof_frictionloss) * factors["friction"],
        armature=np.array(model.dof_armature) * factors["armature"],
        offset=offset,
        scale=scale,
        pivot=pivot,
        play=play,
        gravity=_tilted(np.array(model.gravity), *fault.tilt),
        delay=delay,
        payload=payload,
    )


def _tilted(gravity: Array, about_x: float, about_y: float) -> Array:
    """Return gravity (3,) in the axes of a base that is turned about x, then about y [rad]."""
    x, y, z = gravity
    y, z = np.cos(about_x) * y + np.sin(about_x) * z, np.cos(about_x) * z - np.sin(about_x) * y
    x, z = np.cos(about_y) * x - np.sin(about_y) * z, np.cos(about_y) * z + np.sin(about_y) * x
    return np.array([x, y, z])
