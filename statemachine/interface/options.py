"""What `Model.replace` takes, and how each value is checked before an engine sees it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from ..errors import BadInputError, UnsupportedError, shown, unknown_name
from .checks import as_count, as_numbers, as_scalar, as_switch, as_vector
from .records import Array, Capabilities, Ints, JointType

# One number for each degree of freedom.
PER_DOF = ("armature", "damping", "frictionloss")
LONGEST = 10.0  # latency [s]: a State has every command of that time
_SWITCHES = ("actuation", "contacts", "limits")
OPTIONS = (
    "actuation",
    "gravity",
    "timestep",
    "substeps",
    "contacts",
    *PER_DOF,
    "mass",
    "friction",
    "kp",
    "kv",
    "latency",
    "limits",
    "integrator",
    "max_qvel",
)


class Optioned(Protocol):
    """What options are checked against: a Model, or the facts that one will be made from."""

    backend: str
    capabilities: Capabilities
    nu: int
    nv: int
    nbody: int
    ngeom: int
    body_names: tuple[str, ...]
    actuator_names: tuple[str, ...]
    jnt_type: Ints
    jnt_dofadr: Ints
    dof_armature: Array
    dof_damping: Array
    dof_frictionloss: Array
    body_mass: Array
    actuator_kp: Array


def checked_options(of: Optioned, options: Mapping[str, Any]) -> dict[str, Any]:
    """Options of `Model.replace`, as a backend takes them.

    Raises:
        UnsupportedError: The backend has no such option.
        BadInputError: A value has the wrong shape, kind or size.
    """
    checked = {}
    for name, value in options.items():
        if name not in OPTIONS:
            error = unknown_name("option", name, of.capabilities.options)
            raise UnsupportedError(
                str(error), backend=of.backend, feature=name, reason="unknown"
            ) from None
        if name not in of.capabilities.options:
            raise unsupported(of, name)
        if name in _OF_MODELS:
            checked[name] = _OF_MODELS[name](of, name, value)
        else:
            checked[name] = as_option(name, value, of.capabilities.integrators)
    return checked


def unsupported(of: Optioned, feature: str) -> UnsupportedError:
    """The error for what this backend cannot do; the reason is in its record."""
    known = of.capabilities.behaviours.get(feature)
    reason = known.note if known else "the engine has no such setting"
    reason = of.capabilities.refused.get(feature, reason)
    return UnsupportedError(
        f"backend {of.backend!r} does not support {feature!r}: {reason}",
        backend=of.backend,
        feature=feature,
        reason=reason,
    )


def _per_dof(of: Optioned, name: str, value: Any) -> Array:
    """The value of an option of `PER_DOF`, one number or (nv,), as a new array (nv,)."""
    given = _not_negative(name, value, of.nv)
    if given.ndim:
        return given
    # One number is meant for the joints of the robot, not for a free body.
    values = np.array(getattr(of, f"dof_{name}"))
    scalar = np.isin(of.jnt_type, (JointType.SLIDE, JointType.HINGE))
    values[of.jnt_dofadr[scalar]] = given
    return values


def _mass(of: Optioned, name: str, value: Any) -> Array:
    """The mass of each body, (nbody,), as a new array."""
    given = as_vector(value, (of.nbody,), name)
    wrong = (given > 0) != (of.body_mass > 0)
    for body in np.flatnonzero(wrong | (given < 0))[:1].tolist():
        wanted = (
            "must be above 0" if of.body_mass[body] > 0 else "must be 0: the body has no inertia"
        )
        label = of.body_names[body]
        raise BadInputError(
            f"mass[{body}]{f' ({label})' if label else ''} = {given[body]:g} {wanted}",
            quantity=name,
            index=body,
        )
    return given


def _friction(of: Optioned, name: str, value: Any) -> Array:
    """The sliding friction of each geom, one number or (ngeom,), as a new array (ngeom,)."""
    return np.array(np.broadcast_to(_not_negative(name, value, of.ngeom), (of.ngeom,)))


def _latency(of: Optioned, name: str, value: Any) -> Array:
    """How late each number of ctrl acts [s], one number or (nu,), as a new array (nu,)."""
    given = _not_negative(name, value, of.nu)
    if (given > LONGEST).any():
        raise BadInputError(f"{name} is at most {LONGEST:g} s; got {shown(value)}")
    return np.array(np.broadcast_to(given, (of.nu,)))


def _gain(of: Optioned, name: str, value: Any) -> Array:
    """A gain, one number or (nu,), as a new array (nu,) with NaN where there is no servo."""
    servo = ~np.isnan(of.actuator_kp)
    numbers = as_numbers(value, name)
    given = np.array(np.broadcast_to(numbers, (of.nu,) if numbers.ndim == 0 else numbers.shape))
    given = given.astype(np.float64)
    if not servo.any():
        raise BadInputError(f"{name} is of position servos, and the model has none")
    if given.shape != (of.nu,):
        as_vector(given, (of.nu,), name)  # says which shape it wants
    if not numbers.ndim:
        given[~servo] = np.nan
    for k in np.flatnonzero(~servo & ~np.isnan(given))[:1].tolist():
        raise BadInputError(
            f"{name}[{k}] is given for {of.actuator_names[k] or f'actuator {k}'}, which is no "
            f"position servo: it wants NaN there, as actuator_{name} has"
        )
    as_vector(given[servo], (int(servo.sum()),), name)  # finite
    wrong = given[servo] <= 0 if name == "kp" else given[servo] < 0
    if wrong.any():
        wanted = {"kp": "be above 0; actuation=False turns servos off", "kv": "not be negative"}
        raise BadInputError(f"{name} must {wanted[name]}; got {shown(value)}")
    return given


def _fastest(of: Optioned, name: str, value: Any) -> Array:
    """The value of max_qvel, one number or (nv,), as a new array (nv,)."""
    given = _numbers(name, value, of.nv)
    if (given <= 0).any():
        raise BadInputError(f"max_qvel must be above 0; got {shown(value)}")
    return np.array(np.broadcast_to(given, (of.nv,)))


def _not_negative(name: str, value: Any, length: int) -> Array:
    """One number, or (length,), that are at least 0."""
    given = _numbers(name, value, length)
    if (given < 0).any():
        raise BadInputError(f"{name} must not be negative; got {shown(value)}")
    return given


def _numbers(name: str, value: Any, length: int) -> Array:
    """One number, or (length,)."""
    numbers = as_numbers(value, name)
    return as_vector(numbers, (length,) if numbers.ndim else (), name)


# What depends on the model: its options, and how a value is checked.
_OF_MODELS = {
    **dict.fromkeys(PER_DOF, _per_dof),
    "mass": _mass,
    "friction": _friction,
    "kp": _gain,
    "kv": _gain,
    "latency": _latency,
    "max_qvel": _fastest,
}


def as_option(name: str, value: Any, integrators: Sequence[str]) -> Any:
    """The value of an option that does not depend on the model, as a backend takes it.

    Args:
        name: Of `OPTIONS`, but for those that are arrays of the model's.
        value: Whatever the caller gave.
        integrators: Those that the backend knows.

    Returns:
        A bool, a float, an int, a str or an array (3,).

    Raises:
        BadInputError: It has the wrong shape, kind or size.
        UnknownNameError: There is no such integrator.
    """
    if name in _SWITCHES:
        return as_switch(value, name)
    if name == "gravity":
        return as_vector(value, (3,), name)
    if name == "substeps":
        return as_count(value, name)
    if name == "integrator":
        if not isinstance(value, str) or value not in integrators:
            raise unknown_name("integrator", value, integrators)
        return value
    seconds = as_scalar(value, name)
    if seconds <= 0:
        raise BadInputError(f"timestep must be above 0 s; got {seconds}")
    return seconds
