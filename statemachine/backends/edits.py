"""What the options of `Model.replace` change in a compiled model: said once.

`edited` writes it into a copy. Worlds of one compiled model get it as arrays, one row a world.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import BadInputError
from ..interface import Array
from .actuators import servos
from .compiled.flags import DisableFlag
from .served.release_parts import owner_of_field

if TYPE_CHECKING:
    from .compiled.types import MjModel

_SWITCHES = {  # option of `replace` -> the flag that turns it off
    "actuation": DisableFlag.ACTUATION,
    "contacts": DisableFlag.CONTACT,
    "limits": DisableFlag.LIMIT,
}
_HINDRANCES = {  # option -> flags of a file that would leave it without effect
    "gravity": (DisableFlag.GRAVITY,),
    "damping": (DisableFlag.DAMPER,),
    "frictionloss": (DisableFlag.FRICTIONLOSS, DisableFlag.CONSTRAINT),
    "contacts": (DisableFlag.CONSTRAINT,),
    "limits": (DisableFlag.CONSTRAINT,),
}
_ARRAYS = {  # option -> the array that it is
    "gravity": "opt.gravity",
    "armature": "dof_armature",
    "damping": "dof_damping",
    "frictionloss": "dof_frictionloss",
    "mass": "body_mass",
}
# Options after which constants of the compiled model have to follow (`mj_setConst`).
CONSTANTS_FOLLOW = frozenset({"armature", "mass"})


def changes(raw: MjModel, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return which arrays of a compiled model some options change, and to what.

    Args:
        raw: The compiled model; stays as it is.
        options: actuation, contacts, limits: bool; gravity: (3,) [m/s²]; armature [kg·m² or
            kg], damping [N·m·s/rad or N·s/m], frictionloss [N·m or N]: (nv,); mass: (nbody,)
            [kg]; friction: (ngeom,); kp, kv: (nu,), NaN of what is not a position servo;
            latency: (nu,) [s]. All may have one more axis in front, with a value for each
            world. Others are ignored.

    Returns:
        Arrays by their names in MjModel, and as "opt.gravity" in MjOption; with that axis in
        front where an option has it. Constants that follow from them are not among them.
    """
    arrays: dict[str, Any] = {}
    for name, value in options.items():
        if name in _ARRAYS:
            arrays[_ARRAYS[name]] = value
        if name == "mass":
            own = raw.body_mass > 0
            factor = np.where(own, value / np.where(own, raw.body_mass, 1.0), 1.0)
            arrays["body_inertia"] = factor[..., None] * raw.body_inertia
        elif name == "friction":
            arrays["geom_friction"] = friction = _rows(raw.geom_friction, value)
            friction[..., 0] = value
        elif name == "latency":
            from .delays import SHORTER

            owner, _ = servos(raw)
            arrays["actuator_delay"] = delay = np.zeros((*value.shape[:-1], raw.nactuator))
            delay[..., owner] = SHORTER * value
        elif name in ("kp", "kv"):
            _set_gain(raw, arrays, name, value)
    flags = _flags(raw, options)
    if flags.ndim or int(flags) != raw.opt.disableflags:
        arrays["opt.disableflags"] = flags
    return arrays


def _set_gain(raw: MjModel, arrays: dict[str, Any], name: str, value: Array) -> None:
    """Add what one gain of the position servos changes.

    Args:
        raw: The compiled model.
        arrays: What is changed so far; the other gain may be in it.
        name: "kp" or "kv".
        value: (..., nu), NaN of what is not a position servo.
    """
    owner, servo = servos(raw)
    bias = arrays.setdefault("actuator_biasprm", _rows(raw.actuator_biasprm, value))
    bias[..., owner[servo], 1 if name == "kp" else 2] = -value[..., servo]
    if name == "kp":
        arrays["actuator_gainprm"] = gain = _rows(raw.actuator_gainprm, value)
        gain[..., owner[servo], 0] = value[..., servo]


def _flags(raw: MjModel, options: Mapping[str, Any]) -> Any:
    """Return the bits of what is disabled, with some options: an array, without axes or (n,)."""
    flags = np.asarray(raw.opt.disableflags)
    for name, value in options.items():
        for flag in _HINDRANCES.get(name, ()):  # else the option would be without effect
            flags = flags & ~int(flag)
        if name in _SWITCHES:
            flag = int(_SWITCHES[name])
            flags = (flags & ~flag) | np.where(value, 0, flag)
    return flags


def varied(raw: MjModel, options: Mapping[str, Any]) -> tuple[MjModel, dict[str, Any]]:
    """Return what worlds share, and the arrays of the compiled model that each has of its own.

    Args:
        raw: The compiled model; flags that are the same for all are written into it.
        options: Those of `changes` with a value for each world, and as (n,) "timestep", of an
            engine step [s], and "integrator", a number of mjtIntegrator.

    Returns:
        The compiled model, with room for the longest latency; (n, ...) arrays, as `changes`.
    """
    from .delays import commands_kept, with_room

    arrays = changes(raw, options)
    arrays |= {
        f"opt.{name}": options[name] for name in ("timestep", "integrator") if name in options
    }
    for name in [name for name, value in arrays.items() if not np.ndim(value)]:
        put(raw, name, arrays.pop(name))
    delay = arrays.get("actuator_delay", raw.actuator_delay)
    timestep = np.asarray(arrays.get("opt.timestep", raw.opt.timestep))
    counts = commands_kept(raw, delay, timestep)
    most = np.atleast_2d(counts).max(axis=0)
    if (counts != most).any():
        history = np.repeat(raw.actuator_history[None], len(counts), axis=0)
        history[..., 0] = counts
        arrays["actuator_history"] = history
    return with_room(raw, most), arrays


def _rows(array: Array, value: Any) -> Array:
    """Return a copy of an array of the compiled model, once for each world that a value speaks
    of.
    """
    return np.array(np.broadcast_to(array, (*value.shape[:-1], *array.shape[-2:])))


def edited(raw: MjModel, options: dict[str, Any], timestep: float) -> MjModel:
    """Return a copy with options of `Model.replace`, which has checked them, and room for a
    latency.

    Args:
        raw: Stays as it is.
        options: Those of `changes`. `integrator` and `max_qvel` are left to the backend.
        timestep: Of an engine step [s], as `step_length` gives it.

    Raises:
        BadInputError: As in `with_room`.
    """
    written = changes(raw, options)
    raw = copy.copy(raw)
    for name, value in written.items():
        put(raw, name, value)
    if CONSTANTS_FOLLOW & options.keys():
        from .compiled.stages import set_constants

        set_constants(raw)
    raw.opt.timestep = timestep
    if not raw.actuator_delay.any():
        return raw
    from .delays import with_room

    return with_room(raw)


def put(raw: MjModel, name: str, value: Any, index: tuple[Any, ...] = ()) -> None:
    """Write into a compiled model.

    Args:
        raw: The compiled model.
        name: Of an array, or of an option as "opt.timestep".
        value: What is to stand there.
        index: Where in an array; or which bit of a set of flags.
    """
    holder, field = owner_of_field(raw, name)
    now = getattr(holder, field)
    if np.ndim(now):
        now[index] = value
    elif index:
        setattr(holder, field, now | index[0] if value else now & ~index[0])
    else:
        setattr(holder, field, value)


def step_length(timestep: float, substeps: int, options: Mapping[str, Any]) -> float:
    """Return what one engine step takes [s] after `replace`.

    Args:
        timestep: Of the Model before [s].
        substeps: Of the Model after.
        options: What `Model.replace` has checked; its "timestep" comes before the first one.

    Raises:
        BadInputError: So many substeps leave nothing of a timestep.
    """
    length = options.get("timestep", timestep)
    if length / substeps <= 0:
        raise BadInputError(f"a timestep of {length} s cannot have {substeps} substeps")
    return length / substeps
