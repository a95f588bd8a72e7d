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
_SWITCHES = ("actuation", "contacts", "limits")
OPTIONS = (
    "actuation",
    "gravity",
    "timestep",
    "substeps",
    "contacts",
    *PER_DOF,
    "limits",
    "integrator",
    "max_qvel",
)


class Optioned(Protocol):
    """What options are checked against: a Model, or the facts that one will be made from."""

    backend: str
    capabilities: Capabilities
    nv: int
    jnt_type: Ints
    jnt_dofadr: Ints
    dof_armature: Array
    dof_damping: Array
    dof_frictionloss: Array


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
        if name in PER_DOF:
            checked[name] = _per_dof(of, name, value)
        elif name == "max_qvel":
            checked[name] = _fastest(of, value)
        else:
            checked[name] = as_option(name, value, of.capabilities.integrators)
    return checked


def unsupported(of: Optioned, feature: str) -> UnsupportedError:
    """The error for what this backend cannot do; the reason is in its record."""
    known = of.capabilities.behaviours.get(feature)
    reason = known.note if known else "the engine has no such setting"
    return UnsupportedError(
        f"backend {of.backend!r} does not support {feature!r}: {reason}",
        backend=of.backend,
        feature=feature,
        reason=reason,
    )


def _per_dof(of: Optioned, name: str, value: Any) -> Array:
    """The value of an option of `PER_DOF`, one number or (nv,), as a new array (nv,)."""
    given = _numbers(of, name, value)
    if (given < 0).any():
        raise BadInputError(f"{name} must not be negative; got {shown(value)}")
    if given.ndim:
        return given
    # One number is meant for the joints of the robot, not for a free body.
    values = np.array(getattr(of, f"dof_{name}"))
    scalar = np.isin(of.jnt_type, (JointType.SLIDE, JointType.HINGE))
    values[of.jnt_dofadr[scalar]] = given
    return values


def _fastest(of: Optioned, value: Any) -> Array:
    """The value of max_qvel, one number or (nv,), as a new array (nv,)."""
    given = _numbers(of, "max_qvel", value)
    if (given <= 0).any():
        raise BadInputError(f"max_qvel must be above 0; got {shown(value)}")
    return np.array(np.broadcast_to(given, (of.nv,)))


def _numbers(of: Optioned, name: str, value: Any) -> Array:
    """One number, or one for each degree of freedom (nv,)."""
    numbers = as_numbers(value, name)
    return as_vector(numbers, (of.nv,) if numbers.ndim else (), name)


def as_option(name: str, value: Any, integrators: Sequence[str]) -> Any:
    """The value of an option that does not depend on the model, as a backend takes it.

    Args:
        name: Of `OPTIONS`, but for `PER_DOF` and max_qvel.
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
