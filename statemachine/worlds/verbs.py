"""The verbs on many worlds. They check their arguments and hand over to the engine's worlds."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from ..interface import Array, Model, State
from ..interface.worlds import BATCHED, Worlds


def make_worlds(
    model: Model,
    n: int,
    *,
    workers: int | None = None,
    derived: Sequence[str] = BATCHED,
    **options: ArrayLike,
) -> Worlds:
    """Make n worlds of one Model, each as `make_data` would: its zero or default pose.

    Args:
        model: The Model.
        n: Number of worlds, at least 1.
        workers: Threads or processes; by default one for each processor. No result depends
            on it.
        derived: The derived arrays that are kept after each call. Fewer take less memory.
        **options: Of `Model.replace`, each an array with a first axis of length n: world i is
            a Data of `model.replace(name=value[i], ...)`.

    Raises:
        TypeError: `model` is not a Model.
        BadInputError: `n`, `workers` or an option is no such value.
        UnknownNameError: `derived` has a name that is not of `BATCHED`.
        UnsupportedError: The backend has no such option.
    """
    raise NotImplementedError


def step(worlds: Worlds, nstep: int = 1, *, ids: ArrayLike | None = None) -> None:
    """Advance the worlds by `nstep` timesteps, each under its own ctrl.

    Args:
        worlds: From `make_worlds`.
        nstep: Number of timesteps, at least 1.
        ids: Numbers of some worlds, or a mask (n,) of bools; all by default.
    """
    raise NotImplementedError


def forward(worlds: Worlds, *, ids: ArrayLike | None = None) -> None:
    """Recompute everything derived; no time passes."""
    raise NotImplementedError


def reset(
    worlds: Worlds, *, ids: ArrayLike | None = None, keyframe: int | str | None = None
) -> None:
    """Put worlds back to the default state, or to a keyframe."""
    raise NotImplementedError


def get_state(worlds: Worlds, world: int) -> State:
    """The State of one world; a single Data of the same Model takes it, and the other way."""
    raise NotImplementedError


def set_state(worlds: Worlds, world: int, state: State) -> None:
    """Overwrite one world with a State; what is derived becomes zero."""
    raise NotImplementedError


def record(
    worlds: Worlds,
    nstep: int,
    fields: Sequence[str] = ("qpos",),
    *,
    every: int = 1,
    ctrl: ArrayLike | None = None,
) -> dict[str, Array]:
    """Advance by `nstep` and record: field to (n, nstep // every, ...), after each `every` steps.

    Args:
        ctrl: (n, nstep // every, nu), a command for each stretch; by default ctrl as it is.
    """
    raise NotImplementedError
