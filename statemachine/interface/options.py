"""What `Model.replace` takes, and how each value is checked before an engine sees it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..errors import BadInputError, unknown_name
from .checks import as_count, as_scalar, as_switch, as_vector

PER_DOF = ("armature", "damping", "frictionloss")  # one number for each degree of freedom
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
)


def as_option(name: str, value: Any, integrators: Sequence[str]) -> Any:
    """The value of an option that is none of `PER_DOF`, as a backend takes it.

    Args:
        name: Of `OPTIONS`.
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
