"""The verbs on objects: `make_data`, `step`, `forward`, `reset`, `get_state`, `set_state`.

They check their arguments and hand over to the engine; they do nothing else, so that
a step through them costs what the engine's own step costs. Each is all or nothing: what
interrupts it finds the Data as it was, or as it was to be, or refusing.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import get_ident
from typing import Any

from ..errors import BadInputError, ForeignDataError
from .checks import as_count, check_entries, check_state, kind_of
from .data import Data
from .exclusive_access import with_exclusive_access
from .model import Model
from .records import INPUTS, MOCAP, State

_ONE = 1


def make_data(model: Model) -> Data:
    """Return a new Data of `model`, at its zero or default pose; nothing is derived yet.

    Raises:
        TypeError: `model` is not a Model.
    """
    if not isinstance(model, Model):
        raise TypeError(f"make_data takes a Model, from statemachine.load; got {kind_of(model)}")
    return model._make_data()


def step(model: Model, data: Data, nstep: int = 1) -> None:
    """Advance `data` by `nstep` timesteps under the current `ctrl`.

    Derived arrays (`xpos`, `site_xpos`, contacts) then belong to the state
    before the last integration; call `forward` to bring them up to date.

    Args:
        model: The Model that made `data`.
        data: qpos (nq,) [rad or m], qvel (nv,) [rad/s or m/s], ctrl (nu,)
            [unit of the actuator]; advanced in place.
        nstep: Number of timesteps, at least 1.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BusyDataError: Another thread is using `data`.
        BadInputError: `nstep` is not a whole number, or an input is not a number. In
            the second case the Data may have moved: it then refuses all but
            `reset` and `set_state`. A ctrl that is infinite, written in place, is
            clamped to its range like any other that lies beyond it, by every verb;
            where it has no range, it is refused.
        DivergedError: A coordinate stopped being finite, now or earlier.
        EngineError: The engine gave up.
        ClosedDataError: `data` is closed.
    """
    me = get_ident()
    held = False
    try:  # as `with_exclusive_access`, but in line, which is faster
        owner = data._owner
        if data._model is model and not data._unusable:  # noqa: SIM102
            if not owner.thread: owner.thread = me; held = True  # fmt: skip  # noqa: E701, E702
        if held:
            if nstep is _ONE:  # by identity, which True and 1.0 do not pass
                data._advance(data._raw_model, data._raw)
            else:
                nstep = as_count(nstep, "nstep")
                data._advance(data._raw_model, data._raw, nstep)
            if data._pending_warnings != data._seen_warnings:
                data._raise_pending_warnings()
            return
    except Exception as error:
        if held:
            data._failed(error)
            raise
        if not isinstance(error, AttributeError):
            raise
    finally:
        if held:
            owner.thread = 0  # pyright: ignore[reportPossiblyUnboundVariable]
    _admit(model, data)
    with_exclusive_access(data, _step, data, as_count(nstep, "nstep"))


def _step(data: Data, nstep: int) -> None:
    data._advance(data._raw_model, data._raw, nstep)
    data._raise_pending_warnings()


def forward(model: Model, data: Data) -> None:
    """Recompute everything derived from the present inputs; no time passes.

    Args:
        model: The Model that made `data`.
        data: Its qpos, qvel and ctrl are read; they and `time` stay as they are.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BusyDataError: Another thread is using `data`.
        BadInputError: An input is not finite; nothing is changed then.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data)
    with_exclusive_access(data, _forward, model, data)


def _forward(model: Model, data: Data) -> None:
    _check_inputs(model, data)
    model._check_quaternions(data.qpos)
    data._recompute()


def reset(model: Model, data: Data, keyframe: int | str | None = None) -> None:
    """Put `data` back to the model's default state, or to a keyframe of it.

    Args:
        model: The Model that made `data`.
        data: Overwritten whole, ctrl and time too; derived arrays become zero.
        keyframe: Its number or name; None for the default state.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BusyDataError: Another thread is using `data`.
        UnknownNameError: There is no such keyframe; nothing is changed then.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data)
    key = None if keyframe is None else model.key_id(keyframe)
    with_exclusive_access(data, _overwrite, data, "reset", data._reset, key, even_unusable=True)


def get_state(model: Model, data: Data) -> State:
    """Return a copy of what the engine exposes of all that decides the future of `data`.

    Two restores of one State have the same future, bit for bit; where the record says
    `exact_restore`, it is also the future of `data` itself.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BusyDataError: Another thread is using `data`.
        BadInputError: An input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data)
    return with_exclusive_access(data, _get_state, model, data)


def _get_state(model: Model, data: Data) -> State:
    _check_inputs(model, data)
    return data._get_state()


def set_state(model: Model, data: Data, state: State) -> None:
    """Overwrite `data` with a State; derived arrays become zero, as after `reset`.

    The State may come from another Data, from a Model that `replace` made of the
    same one, or from another process.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BusyDataError: Another thread is using `data`.
        ForeignStateError: The State has another layout; nothing is changed then.
        BadInputError: The State holds a number that is not finite.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data)
    check_state(state, model, *data._layout)
    with_exclusive_access(
        data, _overwrite, data, "set_state", data._set_state, state, even_unusable=True
    )


def _overwrite(data: Data, verb: str, change: Callable[[Any], None], to: Any) -> None:
    """Change the whole state: between the beginning and the end, the Data refuses."""
    data._check_writable()
    before = data._unusable
    data._make_unusable(f"{verb} was interrupted")
    try:
        change(to)
    except BadInputError:  # raised before anything is changed
        data._make_unusable(before)
        raise
    data._make_usable()


def _check_inputs(model: Model, data: Data) -> None:
    """Raise BadInputError for the first entry that acts and is not a finite number."""
    for name in (*INPUTS, *MOCAP):
        check_entries(model._acting(name, getattr(data, name)), name, model._coordinate_name)


def _admit(model: Model, data: Data) -> None:
    """Raise unless `data` is a Data of `model`."""
    if not isinstance(model, Model) or not isinstance(data, Data):
        raise TypeError(
            "the first two arguments are a Model and a Data; "
            f"got {kind_of(model)} and {kind_of(data)}"
        )
    if data._model is not model:
        from .model_labels import distinct_labels

        maker, other = distinct_labels(data._model, model)
        raise ForeignDataError(
            f"this Data was made by {maker}, and is used with {other}: make a Data of the Model "
            "that you step, sm.make_data(model)"
        )
