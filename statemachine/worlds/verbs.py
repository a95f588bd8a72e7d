"""The verbs on many worlds. They check their arguments and hand over to the engine's worlds."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..errors import (
    BadInputError,
    BusyDataError,
    DivergedError,
    DivergedWarning,
    check_name,
    shown,
)
from ..interface import Ints, Model, State
from ..interface.checks import as_count, as_vector, check_state, kind_of
from ..interface.exclusive_access import with_exclusive_access
from ..interface.options import checked_options
from ..interface.records import Arrays, Errors
from ..interface.worlds import BATCHED, WRITABLE, Worlds, in_world, without
from ..processes import checked_jobs, free_memory
from .loop import LoopWorlds

T = TypeVar("T")
_SHOWN = 5  # diverged worlds that a warning names


def make_worlds(
    model: Model,
    n: int,
    *,
    workers: int | None = None,
    derived: Sequence[str] = BATCHED,
    **options: Any,
) -> Worlds:
    """Make n worlds of one Model, each as `make_data` would: its zero or default pose.

    Args:
        model: The Model.
        n: Number of worlds, at least 1.
        workers: Threads at most; by default one for each processor. No result depends on it.
            On an engine that steps one world at a time there is one, whatever is asked for.
        derived: The derived arrays that are kept after each call. Fewer take less memory.
        **options: Of `Model.replace`, each a sequence of n values: world i is a Data of
            `model.replace(name=values[i], ...)`.

    Raises:
        TypeError: `model` is not a Model.
        BadInputError: `n`, `workers` or an option is invalid.
        UnknownNameError: `derived` has a name that is not of `BATCHED`.
        UnsupportedError: The backend has no such option.
    """
    if not isinstance(model, Model):
        raise TypeError(f"make_worlds takes a Model, from statemachine.load; got {kind_of(model)}")
    n = as_count(n, "n")
    threads = checked_jobs(None) if workers is None else as_count(workers, "workers")
    names = _names(derived, "derived array", BATCHED)
    checked = _options(model, n, options)
    worlds = model._make_worlds(n, min(threads, n), names, checked)
    if worlds is None:
        worlds = LoopWorlds(model, n, names, checked)
    return worlds


def step(
    worlds: Worlds, nstep: int = 1, *, ids: ArrayLike | None = None, forward: bool = False
) -> None:
    """Advance the worlds by `nstep` timesteps, each under its own ctrl.

    A world in which `statemachine.step` would raise is told of by a DivergedWarning and left
    out from then on; the others go on.

    Args:
        worlds: From `make_worlds`.
        nstep: Number of timesteps, at least 1.
        ids: Numbers of some worlds, each once, or a mask (n,) of bools; all by default. Those
            that have diverged are left out.
        forward: Whether to do what `forward` does, too, with those that did not diverge.

    Raises:
        BadInputError: `nstep` or `ids` is invalid.
        BusyDataError: Another thread is using `worlds`, or they are another process's.
        ClosedDataError: `worlds` are closed.
    """
    _admit(worlds)
    nstep = as_count(nstep, "nstep")
    _run(worlds, worlds._step, _chosen(worlds, ids), nstep, forward)


def forward(worlds: Worlds, *, ids: ArrayLike | None = None) -> None:
    """Recompute everything derived; no time passes.

    Args:
        worlds: From `make_worlds`.
        ids: As in `step`.

    Raises:
        BadInputError: An input is not finite, or `ids` is invalid; nothing is changed.
        BusyDataError, ClosedDataError: As in `step`.
    """
    _admit(worlds)
    _run(worlds, partial(_with_inputs, worlds, worlds._forward), _chosen(worlds, ids))


def _with_inputs(worlds: Worlds, call: Callable[[Ints], T], ids: Ints) -> T:
    """Call a hook that reads the inputs of these worlds."""
    worlds._check_inputs(ids)
    return call(ids)


def reset(
    worlds: Worlds, *, ids: ArrayLike | None = None, keyframe: int | str | None = None
) -> None:
    """Put worlds back to the default state, or to a keyframe.

    Args:
        worlds: From `make_worlds`.
        ids: As in `step`, but those that have diverged are reset, too.
        keyframe: Its number or name; None for the default state.

    Raises:
        UnknownNameError: There is no such keyframe; nothing is changed then.
        BadInputError, BusyDataError, ClosedDataError: As in `step`.
    """
    _admit(worlds)
    key = None if keyframe is None else worlds.model.key_id(keyframe)
    with_exclusive_access(worlds, _begin_anew, worlds, worlds._reset, _numbers(worlds, ids), key)


def _begin_anew(worlds: Worlds, call: Callable[[Ints, Any], None], ids: Ints, start: Any) -> None:
    """Call a hook after which none of these worlds has diverged."""
    call(ids, start)
    for world in ids.tolist() if worlds._errors else ():
        worlds._errors.pop(world, None)


def get_state(worlds: Worlds, world: int) -> State:
    """Return the State of one world; a single Data of the same Model takes it, and the reverse.

    Raises:
        BadInputError: There is no such world, or an input of it is not finite.
        DivergedError: It diverged earlier.
        BusyDataError, ClosedDataError: As in `step`.
    """
    _admit(worlds)
    number = worlds._world(world)
    if number in worlds._errors:
        raise DivergedError(
            f"world {number} is not usable any more ({worlds._errors[number]}): reset it, or "
            "set_state",
            world=number,
        )
    ids = worlds._numbers[number : number + 1]
    return with_exclusive_access(worlds, _with_inputs, worlds, worlds._get_states, ids)[0]


def get_states(worlds: Worlds, ids: ArrayLike | None = None) -> dict[int, State]:
    """Return the States of worlds, by their numbers; those that have diverged are left out.

    Args:
        worlds: From `make_worlds`.
        ids: As in `step`.

    Raises:
        BadInputError: An input is not finite, or `ids` is invalid.
        BusyDataError, ClosedDataError: As in `step`.
    """
    _admit(worlds)
    numbers = _chosen(worlds, ids)
    states = with_exclusive_access(worlds, _with_inputs, worlds, worlds._get_states, numbers)
    return dict(zip(numbers.tolist(), states, strict=True))


def set_state(worlds: Worlds, world: int, state: State) -> None:
    """Overwrite one world with a State; what is derived becomes zero.

    Raises:
        ForeignStateError: The State has another layout; nothing is changed then.
        BadInputError: There is no such world, or the State holds a number that is not finite.
        BusyDataError, ClosedDataError: As in `step`.
    """
    set_states(worlds, {world: state})


def set_states(worlds: Worlds, states: Mapping[int, State]) -> None:
    """Overwrite worlds with States, as `set_state` does one with one.

    Args:
        worlds: From `make_worlds`.
        states: By the number of the world; see `get_states`.

    Raises:
        ForeignStateError, BadInputError, BusyDataError, ClosedDataError: As in `set_state`.
    """
    _admit(worlds)
    checked = {worlds._world(world): state for world, state in states.items()}
    for world, state in checked.items():
        check_state(state, worlds.model, *worlds._state_layout(world))
    numbers = np.array(sorted(checked), dtype=np.int64)
    in_order = [checked[world] for world in numbers.tolist()]
    with_exclusive_access(worlds, _begin_anew, worlds, worlds._set_states, numbers, in_order)


def record(
    worlds: Worlds,
    nstep: int,
    fields: Sequence[str] = ("qpos",),
    *,
    every: int = 1,
    ctrl: ArrayLike | None = None,
) -> Arrays:
    """Advance by `nstep` and record: field to (n, nstep // every, ...), after each `every` steps.

    A world that has diverged, or does so meanwhile, has NaN from there on.

    Args:
        worlds: From `make_worlds`.
        nstep: Number of timesteps, a multiple of `every`.
        fields: Of qpos, qvel, ctrl, time and `worlds.derived`.
        every: Timesteps from one record to the next.
        ctrl: (n, nstep // every, nu), a command from each record to the next, or one
            (nstep // every, nu) for all worlds; by default ctrl as it is.

    Raises:
        UnknownNameError: There is no such field, or these Worlds do not keep it.
        BadInputError: `nstep`, `every` or `ctrl` is invalid; nothing is changed then.
        BusyDataError, ClosedDataError: As in `step`.
    """
    _admit(worlds)
    nstep, every = as_count(nstep, "nstep"), as_count(every, "every")
    if nstep % every:
        raise BadInputError(f"every must divide nstep; got every={every} and nstep={nstep}")
    names = _names(fields, "field", (*WRITABLE, *worlds.derived))
    rows = nstep // every
    commands = None
    if ctrl is not None:
        shape = (worlds.n, rows, worlds.model.nu)
        commands = as_vector(ctrl, shape[1:] if np.ndim(ctrl) == 2 else shape, "ctrl")
        commands = np.broadcast_to(commands, shape)
    size, free = sum(getattr(worlds, name).nbytes for name in names) * rows, free_memory()
    if free is not None and size > free:
        raise BadInputError(
            f"a record of {rows} rows of {', '.join(names)} takes {size / 1e9:.3g} GB, and "
            f"{free / 1e9:.3g} GB are free: take fewer steps, or a larger every"
        )
    arrays = {}
    for name in names:
        arrays[name] = np.full((worlds.n, rows, *getattr(worlds, name).shape[1:]), np.nan)
    _run(worlds, worlds._record, _chosen(worlds, None), nstep, every, arrays, commands)
    return arrays


def _run(worlds: Worlds, call: Any, ids: Ints, *args: Any) -> None:
    """Call a hook, and tell of the worlds that are left out from now on."""
    errors = with_exclusive_access(worlds, _checked_call, worlds, call, ids, args)
    if errors:
        warnings.warn(_warning_text(worlds, errors), DivergedWarning, stacklevel=3)


def _checked_call(worlds: Worlds, call: Any, ids: Ints, args: tuple[Any, ...]) -> Errors:
    for world in ids[~np.isfinite(worlds.time[ids])][:1].tolist():
        raise BadInputError(
            f"time[{world}] = {worlds.time[world]} is not a finite number",
            quantity="time",
            index=world,
            world=world,
        )
    errors = call(ids, *args)
    if errors:
        worlds._errors.update(errors)
    return errors


def _warning_text(worlds: Worlds, errors: Errors) -> str:
    """Return '3 of 1024 worlds diverged and are left out: 17 (qpos[2] (elbow) at 0.34 s), …'."""
    entries = [f"{world} ({_entry(worlds, errors[world])})" for world in sorted(errors)]
    more = f" and {len(entries) - _SHOWN} more" if len(entries) > _SHOWN else ""
    return (
        f"{len(entries)} of {worlds.n} worlds diverged and {'is' if len(entries) == 1 else 'are'} "
        f"left out until reset or set_state: {', '.join(entries[:_SHOWN])}{more}"
    )


def _entry(worlds: Worlds, error: Exception) -> str:
    """Return how one world ended, in short: 'qpos[2] (elbow) at 0.34 s'."""
    quantity, index = getattr(error, "quantity", None), getattr(error, "index", None)
    if quantity is None or index is None:
        return shown(str(error)).strip("'\"")
    time = getattr(error, "time", None)
    label = worlds.model._coordinate_name(quantity, index)
    return f"{quantity}[{index}]{label}" + ("" if time is None else f" at {time:g} s")


def _admit(worlds: Worlds) -> None:
    """Raise unless these are usable Worlds of this process."""
    if not isinstance(worlds, Worlds):
        raise TypeError(f"the first argument is Worlds, from make_worlds; got {kind_of(worlds)}")
    worlds._refuse_if_unusable()
    if worlds._process != os.getpid():
        raise BusyDataError(
            "these Worlds belong to another process, which made them: make others here"
        )


def _chosen(worlds: Worlds, ids: ArrayLike | None) -> Ints:
    """Return the worlds that are meant and have not diverged."""
    return without(_numbers(worlds, ids), worlds._errors)


def _numbers(worlds: Worlds, ids: ArrayLike | None) -> Ints:
    """Return the worlds that are meant, each once and in order."""
    if ids is None:
        return worlds._numbers
    wanted = f"ids must be numbers of worlds, each once, or a mask ({worlds.n},) of bools"
    try:
        array = np.asarray(ids)
    except (TypeError, ValueError, OverflowError) as error:  # a ragged list
        raise BadInputError(f"{wanted}; got {shown(ids)}") from error
    if array.dtype == bool and array.shape == (worlds.n,):
        return np.flatnonzero(array)
    if array.size == 0 and array.shape == (0,):
        return worlds._numbers[:0]
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise BadInputError(f"{wanted}; got {array.dtype} of shape {array.shape}")
    for bad in array[(array < 0) | (array >= worlds.n)][:1].tolist():
        raise BadInputError(f"there is no world {bad}: they are 0 to {worlds.n - 1}")
    numbers, counts = np.unique(array, return_counts=True)
    for twice in numbers[counts > 1][:1].tolist():
        raise BadInputError(f"{wanted}; world {twice} is there {counts.max()} times")
    return numbers.astype(np.int64)


def _names(names: Sequence[str], kind: str, known: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names that are known, each once, as given."""
    if not isinstance(names, Iterable):
        raise BadInputError(
            f"names of {kind}s are wanted, of {', '.join(known)}; got {shown(names)}"
        )
    listed = (names,) if isinstance(names, str) else tuple(names)
    for name in listed:
        check_name(kind, name, known)
    return tuple(dict.fromkeys(listed))


def _options(model: Model, n: int, options: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return each option of `Model.replace` as a checked value for each world."""
    checked = {}
    for name, values in options.items():
        listed = isinstance(values, Sequence) and not isinstance(values, str | bytes)
        listed |= isinstance(values, np.ndarray) and values.ndim > 0
        if not listed or len(values) != n:
            got = f"{len(values)}" if listed else shown(values)
            raise BadInputError(f"{name} takes {n} values, one for each world; got {got}")
        checked[name] = []
        for world, value in enumerate(values):
            try:
                checked[name].append(checked_options(model, {name: value})[name])
            except BadInputError as error:
                raise in_world(world, error) from None
    return checked
