"""What the step of Pinocchio leaves out: robots, options and flags that it is refused."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from ...engines import raw_engine_of
from ...errors import UnsupportedError
from ...installed import DEFAULT
from ...interface import JointType, Model
from ..runs.robot import is_servo
from .case import Integrator

# The integrator whose step Pinocchio makes, as MuJoCo's files name it.
INTEGRATOR = "implicitfast"
_REASON = "the step of Pinocchio computes servos, damping, armature and dry friction alone"
# What else acts on joints, and the fields of a compiled model that are not zero then.
_PASSIVE = {
    "joint springs": ("jnt_stiffness", "jnt_stiffnesspoly"),
    "damping that is not linear": ("dof_dampingpoly", "actuator_dampingpoly"),
    "damping and armature of actuators": ("actuator_damping", "actuator_armature"),
    "force limits of joints": ("jnt_actfrclimited",),
    "delays of actuators": ("actuator_delay",),
    "gravity compensation": ("body_gravcomp",),
    "tendons": ("ntendon",),
    "equality constraints": ("neq",),
    "flexes": ("nflex",),
}
# Flags that are on in a file that says nothing, and the fields of a compiled model on which they
# act: where all of these are zero, the flag changes nothing that is stepped here.
_FLAGS_ON = {
    "constraint": ("dof_frictionloss",),
    "frictionloss": ("dof_frictionloss",),
    "refsafe": ("dof_frictionloss",),
    "damper": ("dof_damping",),
    "gravity": ("opt.gravity",),
    "clampctrl": ("actuator_ctrllimited",),
    "actuation": ("nu",),
}
# Flags that are off in a file that says nothing, likewise.
_FLAGS_OFF = {
    "diagexact": ("dof_frictionloss",),
    "sleep": ("nv",),
}


def check_is_stepped(model: Model) -> None:
    """Check that a robot has nothing that the step of Pinocchio leaves out.

    Raises:
        UnsupportedError: It has; with everything that it leaves out.
    """
    features = left_out_features(model)
    if features:
        raise UnsupportedError(
            f"the step of Pinocchio leaves out what {model.path.name} has: {'; '.join(features)}",
            backend=model.backend,
            feature=features[0],
            features=tuple(features),
            reason=_REASON,
        )


def left_out_features(model: Model) -> list[str]:
    """Return what a robot has that the step of Pinocchio leaves out, in words."""
    compiled = model.compiled
    if compiled is None:
        return ["a model that was compiled elsewhere"]
    features: list[str] = []
    if not np.isin(model.jnt_type, (int(JointType.HINGE), int(JointType.SLIDE))).all():
        features.append("free and ball joints")
    if model.ngeom and model.options.get("contacts") is not False:
        features.append("contacts (type model.replace(contacts=False))")
    if model.jnt_limited.any() and model.options.get("limits") is not False:
        features.append("joint limits (type model.replace(limits=False))")
    if not is_servo(model).all():
        features.append("actuators that are no position servos of a joint")
    if model.options.get("actuation") is False:
        features.append("servos that are switched off")
    if model.substeps != 1:
        features.append("substeps")
    features += _passive_features(compiled)
    features += _flag_features(compiled)
    integrator = other_integrator(model)
    if integrator:
        features.append(
            f"the integrator {integrator} (type model.replace(integrator={INTEGRATOR!r}))"
        )
    return features


def other_integrator(model: Model) -> str:
    """Return the integrator of a model, as MuJoCo's files name it; "" of `INTEGRATOR`.

    It is "" of an engine without a choice of integrators, too: it steps in its own way.
    """
    if not model.capabilities.integrators or model.compiled is None:
        return ""
    integrator = raw_engine_of(DEFAULT).integrator(model.compiled)
    if integrator == INTEGRATOR:
        return ""
    return next(
        (name for name in get_args(Integrator) if name.casefold() == integrator), integrator
    )


def _passive_features(compiled: Any) -> list[str]:
    """Return what acts on the joints of a compiled model beside servos and linear damping."""
    features: list[str] = []
    for name, fields in _PASSIVE.items():
        if any(_is_set(compiled, field) for field in fields):
            features.append(name)
    if compiled.opt.density or compiled.opt.viscosity:
        features.append("a fluid around the robot")
    return features


def _flag_features(compiled: Any) -> list[str]:
    """Return the flags of a compiled model that change what is stepped here."""
    features: list[str] = []
    flags = raw_engine_of(DEFAULT).flags(compiled)
    for usual, table in ((True, _FLAGS_ON), (False, _FLAGS_OFF)):
        word = "disable" if usual else "enable"
        for name, fields in table.items():
            acts = any(_is_set(compiled, field) for field in fields)
            if flags.get(name, usual) != usual and acts:
                features.append(f'the flag {name}="{word}"')
    if compiled.opt.disableactuator and compiled.nu:
        features.append("groups of actuators that are switched off")
    return features


def _is_set(compiled: Any, field: str) -> bool:
    """Tell whether a field of a compiled model is not zero; not where a release lacks it."""
    owner = compiled
    if field.startswith("opt."):
        owner, field = compiled.opt, field.removeprefix("opt.")
    return bool(np.asarray(getattr(owner, field, 0.0)).any())
