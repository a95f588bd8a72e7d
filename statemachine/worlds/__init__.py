"""Many worlds: one Model, thousands of Data, stepped together.

from statemachine.worlds import make_worlds, step

worlds = make_worlds(model, 1024)
worlds.ctrl[:] = commands                      # (1024, nu)
step(worlds, 100)                              # time passes in all of them
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from ..errors import BadInputError, check_name, shown
from ..interface import Array, Model
from ..interface.checks import as_count, as_scalar, kind_of, whole_number
from ..interface.worlds import BATCHED, Worlds
from .verbs import (
    forward,
    get_state,
    get_states,
    make_worlds,
    record,
    reset,
    set_state,
    set_states,
    step,
)

# Draw what worlds differ by: domain randomisation, as arrays from a seed.
#
# options = draw(model, 1024, seed=0, mass=(0.8, 1.2), friction=Uniform(0.5, 1.5, each=True))
# worlds = make_worlds(model, 1024, **options)


def _sliding_friction(model: Model) -> Array:
    return model.geom_friction[:, 0]


# Options of `Model.replace` that can be drawn, and their value in a Model. One that is drawn
# as it is, and multiplies nothing, has none.
_NOMINAL: dict[str, Callable[[Model], Array] | None] = {
    "mass": attrgetter("body_mass"),
    "friction": _sliding_friction,
    "kp": attrgetter("actuator_kp"),
    "kv": attrgetter("actuator_kv"),
    "armature": attrgetter("dof_armature"),
    "damping": attrgetter("dof_damping"),
    "frictionloss": attrgetter("dof_frictionloss"),
    "gravity": attrgetter("gravity"),
    "latency": None,
}


@dataclass(frozen=True)
class Uniform:
    """Every number between `low` and `high` is as likely as any other.

    Attributes:
        low, high: Factors of the nominal value; of latency seconds.
        each: Draw a number for each entry of the array (each body, each geom), not one for all.
    """

    low: float
    high: float
    each: bool = False

    def __post_init__(self) -> None:
        low, high = as_scalar(self.low, "low"), as_scalar(self.high, "high")
        if not 0 <= low <= high:
            raise BadInputError(f"a range takes 0 ≤ low ≤ high; got {low:g} and {high:g}")

    def at(self, parts: Array) -> Array:
        """Return the numbers at these fractions (n, k) of the range, drawn from 0 to 1."""
        return np.minimum(self.low + (self.high - self.low) * parts, self.high)


@dataclass(frozen=True)
class LogUniform(Uniform):
    """Every factor is as likely as its inverse: as much between 1/2 and 1 as between 1 and 2."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.low > 0:
            raise BadInputError(f"LogUniform takes low > 0; got {self.low:g}")

    def at(self, parts: Array) -> Array:
        """See the base. Python's exp: the last bits of NumPy's are those of the processor."""
        low, high = math.log(self.low), math.log(self.high)
        flat = [math.exp(low + (high - low) * part) for part in parts.ravel().tolist()]
        return np.clip(np.reshape(flat, parts.shape), self.low, self.high)


def draw(
    model: Model, n: int, *, seed: int, **ranges: Uniform | tuple[float, float]
) -> dict[str, Any]:
    """Return options for `make_worlds`, drawn for n worlds.

    A world's values depend on the seed, its number and the option alone: not on `n`, nor on
    what else is drawn. An entry that is zero stays zero (a body without mass), and one that is
    NaN stays NaN (the gains of what is not a servo).

    Args:
        model: The Model, whose values are multiplied.
        n: Number of worlds.
        seed: A whole number, at least 0.
        **ranges: Of mass, friction, kp, kv, armature, damping, frictionloss, gravity: what the
            nominal value is multiplied by, (low, high) or `Uniform` or `LogUniform`; of
            latency the seconds themselves.

    Returns:
        Arrays with one row for each world, by option: mass (n, nbody) [kg], friction
        (n, ngeom), kp and kv (n, nu), armature, damping and frictionloss (n, nv), gravity
        (n, 3) [m/s²], latency (n, nu) [s].

    Raises:
        UnknownNameError: An option cannot be drawn.
        BadInputError: `n`, `seed` or a range is invalid.
    """
    if not isinstance(model, Model):
        raise TypeError(f"draw takes a Model, from statemachine.load; got {kind_of(model)}")
    n = as_count(n, "n")
    number = whole_number(seed)
    if number is None or number < 0:
        raise BadInputError(f"seed must be a whole number of at least 0; got {shown(seed)}")
    options: dict[str, Any] = {}  # of arrays; typed so that make_worlds takes it by **
    for name, given in ranges.items():
        check_name("option to draw", name, _NOMINAL)
        of = _range(name, given)
        value = _NOMINAL[name]
        nominal = np.ones(model.nu) if value is None else value(model)
        # A stream for each option; rows are drawn one after the other.
        stream = np.random.default_rng([number, *name.encode()])
        parts = stream.random((n, len(nominal) if of.each else 1))
        options[name] = of.at(parts) * nominal
    return options


def _range(name: str, given: Uniform | tuple[float, float]) -> Uniform:
    if isinstance(given, Uniform):
        return given
    try:
        low, high = given
    except (TypeError, ValueError):
        raise BadInputError(
            f"{name} takes a range: (low, high), Uniform or LogUniform; got {shown(given)}"
        ) from None
    return Uniform(low, high)


__all__ = [
    "BATCHED",
    "LogUniform",
    "Uniform",
    "Worlds",
    "draw",
    "forward",
    "get_state",
    "get_states",
    "make_worlds",
    "record",
    "reset",
    "set_state",
    "set_states",
    "step",
]
