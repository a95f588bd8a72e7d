"""What `Model.replace` takes, and how the value of an option is checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from ..errors import BadInputError, UnsupportedError, check_name, shown, unknown_name
from .checks import (
    HasCapabilities,
    as_count,
    as_numbers,
    as_scalar,
    as_switch,
    as_vector,
    unsupported,
)
from .records import OPTIONS, Array, Ints, JointType

OptionValue = bool | int | float | str | Sequence[float] | Array  # of what `replace` takes
# One number for each degree of freedom.
PER_DOF = ("armature", "damping", "frictionloss")
LONGEST = 10.0  # latency [s]: a State has every command of that time
_SWITCHES = ("actuation", "contacts", "limits")


class OptionFacts(HasCapabilities, Protocol):
    """What options are checked against: a Model, or the facts that one will be made from.

    Shapes and units are those of `Model`.
    """

    @property
    def nv(self) -> int: ...
    @property
    def nu(self) -> int: ...
    @property
    def nbody(self) -> int: ...
    @property
    def ngeom(self) -> int: ...
    @property
    def jnt_type(self) -> Ints: ...
    @property
    def jnt_dofadr(self) -> Ints: ...
    @property
    def dof_armature(self) -> Array: ...
    @property
    def dof_damping(self) -> Array: ...
    @property
    def dof_frictionloss(self) -> Array: ...
    @property
    def body_mass(self) -> Array: ...
    @property
    def body_names(self) -> tuple[str, ...]: ...
    @property
    def actuator_kp(self) -> Array: ...
    @property
    def actuator_names(self) -> tuple[str, ...]: ...


def checked_options(of: OptionFacts, options: Mapping[str, Any]) -> dict[str, Any]:
    """Check options of `Model.replace`, and return them as a backend takes them.

    Args:
        of: What they are checked against: a Model, or the facts that one will be made from.
        options: Values by name, as the caller gave them.

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
        if name in _CHECKED_AGAINST_MODEL:
            checked[name] = _CHECKED_AGAINST_MODEL[name](of, name, value)
        else:
            checked[name] = as_option(name, value, of.capabilities.integrators)
    return checked


def _mass(of: OptionFacts, name: str, value: Any) -> Array:
    """Return the mass of each body, (nbody,), as a new array."""
    values = as_vector(value, (of.nbody,), name)
    wrong = (values > 0) != (of.body_mass > 0)
    for body in np.flatnonzero(wrong | (values < 0))[:1].tolist():
        wanted = (
            "must be above 0" if of.body_mass[body] > 0 else "must be 0: the body has no inertia"
        )
        label = of.body_names[body]
        raise BadInputError(
            f"mass[{body}]{f' ({label})' if label else ''} = {values[body]:g} {wanted}",
            quantity=name,
            index=body,
        )
    return values


def _gain(of: OptionFacts, name: str, value: Any) -> Array:
    """Return a gain, one number or (nu,), as a new array (nu,) with NaN where there is no servo."""
    servo = ~np.isnan(of.actuator_kp)
    numbers = as_numbers(value, name)
    values = np.array(np.broadcast_to(numbers, (of.nu,) if numbers.ndim == 0 else numbers.shape))
    values = values.astype(np.float64)
    if not servo.any():
        raise BadInputError(f"{name} is of position servos, and the model has none")
    if values.shape != (of.nu,):
        as_vector(values, (of.nu,), name)  # says which shape it wants
    if not numbers.ndim:
        values[~servo] = np.nan
    for k in np.flatnonzero(~servo & ~np.isnan(values))[:1].tolist():
        raise BadInputError(
            f"{name}[{k}] is given for {of.actuator_names[k] or f'actuator {k}'}, which is not a "
            f"position servo: write NaN there, as actuator_{name} has"
        )
    as_vector(values[servo], (int(servo.sum()),), name)  # finite
    least = values[servo].min()
    if name == "kp" and least <= 0:
        raise BadInputError(
            f"kp must be above 0; actuation=False turns servos off; got {shown(value)}"
        )
    if least < 0:
        raise BadInputError(f"{name} must not be negative; got {shown(value)}")
    return values


def _numbers(of: OptionFacts, name: str, value: Any) -> Array:
    """Return the value of an option of `_LENGTHS`, one number or one for each, as a new array."""
    length, numbers = getattr(of, _LENGTHS[name]), as_numbers(value, name)
    checked = as_vector(numbers, (length,) if numbers.ndim else (), name)
    if name == "max_qvel" and (checked <= 0).any():
        raise BadInputError(f"{name} must be above 0; got {shown(value)}")
    if (checked < 0).any():
        raise BadInputError(f"{name} must not be negative; got {shown(value)}")
    if name == "latency" and (checked > LONGEST).any():
        raise BadInputError(f"{name} is at most {LONGEST:g} s; got {shown(value)}")
    values = np.array(np.broadcast_to(checked, (length,)))
    if name in PER_DOF and not checked.ndim:
        # One number is meant for the joints of the robot, not for a free body.
        scalar = np.isin(of.jnt_type, (JointType.SLIDE, JointType.HINGE))
        values = np.array(getattr(of, f"dof_{name}"))
        values[of.jnt_dofadr[scalar]] = checked
    return values


# Options with one number for each of what a Model counts.
_LENGTHS = dict.fromkeys(PER_DOF, "nv") | {"friction": "ngeom", "latency": "nu", "max_qvel": "nv"}
# What depends on the model: its options, and how a value is checked.
_CHECKED_AGAINST_MODEL: dict[str, Callable[[OptionFacts, str, Any], Array]] = {
    **dict.fromkeys(_LENGTHS, _numbers),
    "mass": _mass,
    "kp": _gain,
    "kv": _gain,
}


def as_option(name: str, value: Any, integrators: Sequence[str]) -> Any:
    """Return the value of an option that does not depend on the model, as a backend takes it.

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
        check_name("integrator", value, integrators)
        return value
    seconds = as_scalar(value, name)
    if seconds <= 0:
        raise BadInputError(f"timestep must be above 0 s; got {seconds}")
    return seconds
