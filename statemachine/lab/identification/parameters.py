"""Parameters of an arm that a recording may tell, as one vector.

Gains, friction and armature are factors of the model's figures, of which the vector has the
logarithm; offsets, the delay and the payload stand in it as they are.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import UnsupportedError
from ...interface import Array, Ints, Model
from .results import CAUSE_OF, Cause, Kind

BY_JOINT: tuple[Kind, ...] = ("kp", "viscous", "friction", "armature", "offset")
_FACTORS: tuple[Kind, ...] = ("kp", "viscous", "friction", "armature")


@dataclass(frozen=True)
class _Prior:
    """What is believed of a kind of parameter before the fit.

    Attributes:
        deviation: Standard deviation, of the logarithm where it is a factor.
        low, high: What the fit stays within, likewise.
        step: What it is changed by for a finite difference.
    """

    deviation: float
    low: float
    high: float
    step: float


# A gain is hardly known: servos of one make differ by a factor of a hundred with their settings.
_PRIORS: dict[Kind, _Prior] = {
    "kp": _Prior(1.2, -7.0, 3.0, 1e-3),
    "viscous": _Prior(1.0, -4.0, 2.5, 1e-3),
    "friction": _Prior(1.0, -4.0, 3.0, 1e-3),
    "armature": _Prior(0.5, -1.5, 1.5, 1e-3),
    "offset": _Prior(math.radians(4.0), -0.6, 0.6, 1e-4),
    "delay": _Prior(0.03, 0.0, 0.25, 1e-4),
    "payload": _Prior(0.1, 0.0, 0.5, 1e-3),
}


@dataclass(frozen=True)
class Parameter:
    """One parameter.

    Attributes:
        kind: Which.
        joint: Of which joint; None where it is of the arm.
        model: Its figure in the model, in SI units.
    """

    kind: Kind
    joint: str | None
    model: float

    @property
    def prior(self) -> _Prior:
        """Return what is believed of it."""
        return _PRIORS[self.kind]

    @property
    def cause(self) -> Cause:
        """Return the cause that it belongs to."""
        return CAUSE_OF[self.kind]

    @property
    def is_factor(self) -> bool:
        """Tell whether the vector has the logarithm of a factor."""
        return self.kind in _FACTORS

    def figure(self, value: float) -> float:
        """Return the figure, in SI units, for an entry of the vector."""
        return self.model * math.exp(value) if self.is_factor else value

    def value(self, figure: float) -> float:
        """Return the entry of the vector for a figure in SI units."""
        return math.log(figure / self.model) if self.is_factor else figure


@dataclass(frozen=True, eq=False)
class ArmParameters:
    """All parameters of an arm, and what of the model they stand for.

    Attributes:
        model: The Model.
        joints: (n,) names of the joints.
        position, dof, servo: (n,) places of the joints in qpos, qvel and ctrl.
        payload_body: Number of the body that a payload is added to.
        each: (P,) the parameters in the order of the vector.
    """

    model: Model
    joints: tuple[str, ...]
    position: Ints
    dof: Ints
    servo: Ints
    payload_body: int
    each: tuple[Parameter, ...]

    @classmethod
    def of(cls, model: Model, joints: Sequence[str]) -> ArmParameters:
        """Return the parameters of these joints.

        Raises:
            UnsupportedError: A joint has no position servo, or one with a gear.
            UnknownNameError: There is no such joint.
        """
        numbers = [model.joint_id(name) for name in joints]
        servos: list[int] = []
        for name, number in zip(joints, numbers, strict=True):
            mine = np.flatnonzero(model.actuator_jntid == number)
            if len(mine) != 1 or np.isnan(model.actuator_kp[mine[0]]):
                raise UnsupportedError(
                    f"a recording is of angles that servos were told, and joint {name} of "
                    f"{model.path.name} has no position servo of its own",
                    backend=model.backend,
                    feature="actuator",
                    reason="model",
                )
            _check_gear(model, name, int(mine[0]))
            servos.append(int(mine[0]))
        dof = np.array(model.jnt_dofadr)[numbers]
        servo = np.array(servos)
        each = _of_each_joint(model, joints, dof, servo)
        each += [Parameter("delay", None, 0.0), Parameter("payload", None, 0.0)]
        return cls(
            model=model,
            joints=tuple(joints),
            position=np.array(model.jnt_qposadr)[numbers],
            dof=dof,
            servo=servo,
            payload_body=_payload_body(model, numbers),
            each=tuple(each),
        )

    def __len__(self) -> int:
        return len(self.each)

    def check_factors(self) -> None:
        """Refuse to fit a figure that is zero, which no factor changes.

        Raises:
            UnsupportedError: A joint has no gain, no friction or no armature.
        """
        for parameter in self.each:
            if parameter.is_factor and not parameter.model > 0.0:
                raise _without(self.model, parameter.joint or "", parameter.kind)

    @property
    def deviations(self) -> Array:
        """Return the standard deviations (P,) of the prior."""
        return np.array([parameter.prior.deviation for parameter in self.each])

    @property
    def low(self) -> Array:
        """Return the least values (P,) of a fit."""
        return np.array([parameter.prior.low for parameter in self.each])

    @property
    def high(self) -> Array:
        """Return the largest values (P,) of a fit."""
        return np.array([parameter.prior.high for parameter in self.each])

    @property
    def steps(self) -> Array:
        """Return the steps (P,) of finite differences."""
        return np.array([parameter.prior.step for parameter in self.each])

    def of_kind(self, kind: Kind) -> Ints:
        """Return the places of a kind in the vector, in the order of the joints."""
        return np.array([i for i, each in enumerate(self.each) if each.kind == kind])

    def joints_of(self, number: int) -> Ints:
        """Return the places of the joints that a parameter is of: its own, or all of the arm."""
        joint = self.each[number].joint
        count = len(self.joints)
        return np.arange(count) if joint is None else np.array([self.joints.index(joint)])

    def of_causes(self, causes: Collection[Cause]) -> Ints:
        """Return the places of what belongs to these causes."""
        return np.array([i for i, each in enumerate(self.each) if each.cause in causes], int)

    def options(self, vectors: Array, viscous_outside: bool = False) -> dict[str, Any]:
        """Return options of `make_worlds`, each an array (W, …), one world for each vector.

        Args:
            vectors: (W, P) vectors.
            viscous_outside: Whether all viscous friction is joint damping, which the servo's
                force limit does not hold back, and none of it the servo's own.
        """
        count = len(vectors)
        model = self.model
        kp = np.tile(model.actuator_kp, (count, 1))
        kv = np.tile(model.actuator_kv, (count, 1))
        damping = np.tile(model.dof_damping, (count, 1))
        friction = np.tile(model.dof_frictionloss, (count, 1))
        armature = np.tile(model.dof_armature, (count, 1))
        mass = np.tile(model.body_mass, (count, 1))
        factor = np.exp(vectors[:, self.of_kind("viscous")])
        if viscous_outside:
            total = model.actuator_kv[self.servo] + model.dof_damping[self.dof]
            damping[:, self.dof] = total * factor
            kv[:, self.servo] = 0.0
        else:
            damping[:, self.dof] *= factor
            kv[:, self.servo] *= factor
        kp[:, self.servo] *= np.exp(vectors[:, self.of_kind("kp")])
        friction[:, self.dof] *= np.exp(vectors[:, self.of_kind("friction")])
        armature[:, self.dof] *= np.exp(vectors[:, self.of_kind("armature")])
        mass[:, self.payload_body] += vectors[:, self.of_kind("payload")[0]]
        return {
            "kp": kp,
            "kv": kv,
            "damping": damping,
            "frictionloss": friction,
            "armature": armature,
            "mass": mass,
        }


def _check_gear(model: Model, joint: str, servo: int) -> None:
    """Refuse a servo whose command is not the angle of its joint."""
    gear = float(model.actuator_gear[servo])
    if gear != 1.0:
        raise UnsupportedError(
            f"a recording has commands that are angles of joints, and the servo of {joint} in "
            f"{model.path.name} has gear {gear:g}, so that its are not: write gear 1, kp and kv "
            f"times {gear * gear:g}, and the ranges of its force and of its command accordingly",
            backend=model.backend,
            feature="gear",
            reason="model",
        )


def _of_each_joint(model: Model, joints: Sequence[str], dof: Ints, servo: Ints) -> list[Parameter]:
    """Return the parameters that each joint has."""
    viscous = model.actuator_kv[servo] + model.dof_damping[dof]
    kp, friction = model.actuator_kp[servo], model.dof_frictionloss[dof]
    armature = model.dof_armature[dof]
    figures: dict[Kind, Array] = {
        "kp": kp,
        "viscous": viscous,
        "friction": friction,
        "armature": armature,
        "offset": np.zeros(len(joints)),
    }
    each: list[Parameter] = []
    for kind in BY_JOINT:
        for name, figure in zip(joints, figures[kind].tolist(), strict=True):
            each.append(Parameter(kind, name, figure))
    return each


def _without(model: Model, joint: str, kind: Kind) -> UnsupportedError:
    """Return the error of a figure that is zero, which no factor changes."""
    return UnsupportedError(
        f"a fit changes figures of the model by factors, and joint {joint} of "
        f"{model.path.name} has no {kind}: write a figure into its file",
        backend=model.backend,
        feature=kind,
        reason="model",
    )


def _payload_body(model: Model, joints: Sequence[int]) -> int:
    """Return the body that holds a payload: the one that the last joint's body hangs on."""
    last = int(model.jnt_bodyid[joints[-1]])
    parent = int(model.body_parentid[last])
    return parent if parent > 0 and model.body_mass[parent] > 0.0 else last
