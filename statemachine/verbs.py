"""The verbs on objects: `make_data`, `step`, `forward`, `reset`, `get_state`, `set_state`.

They check their arguments and hand over to the engine; they do nothing else, so that
a step through them costs what the engine's own step costs.
"""

from __future__ import annotations

from .checks import as_count, check_entries, check_finite, kind_of
from .errors import ForeignDataError, ForeignStateError
from .interface import Data, Model
from .records import INPUTS, State

_ONE = 1


def make_data(model: Model) -> Data:
    """A new Data of `model`, at its zero or default pose; nothing derived yet.

    Raises:
        TypeError: `model` is not a Model.
    """
    if not isinstance(model, Model):
        raise TypeError(f"make_data wants a Model, from statemachine.load; got {kind_of(model)}")
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
        BadInputError: `nstep` is no whole number, or an input is not a number. In
            the second case the Data may have moved: it then refuses all but
            `reset` and `set_state`. A ctrl that is infinite, written in place, is
            clamped to its range like any other that lies beyond it; where it has no
            range, it is refused.
        DivergedError: A coordinate stopped being finite, now or earlier.
        EngineError: The engine gave up.
        ClosedDataError: `data` is closed.
    """
    try:
        ready = data._model is model
    except AttributeError:
        ready = False
    if not ready:
        _admit(model, data)
    advance = data._advance  # as an attribute, which CPython reads faster than a method
    try:
        if nstep is _ONE:  # by identity, which True and 1.0 do not pass
            advance()
        else:
            advance(as_count(nstep, "nstep"))
    except Exception as error:
        data._failed(error)
        raise
    if data._alarms:
        data._attend()


def forward(model: Model, data: Data) -> None:
    """Recompute everything derived from the present inputs; no time passes.

    Args:
        model: The Model that made `data`.
        data: Its qpos, qvel and ctrl are read; they and `time` stay as they are.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: An input is not finite; nothing is changed then.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data)
    for name in INPUTS:
        check_entries(getattr(data, name), name, model._coordinate_name)
    model._check_quaternions(data.qpos)
    data._recompute()
    if data._alarms:
        data._attend()


def reset(model: Model, data: Data, keyframe: int | str | None = None) -> None:
    """Put `data` back to the model's default state, or to a keyframe of it.

    Args:
        model: The Model that made `data`.
        data: Overwritten whole, ctrl and time too; derived arrays become zero.
        keyframe: Its number or name; None for the default state.

    Raises:
        ForeignDataError: `data` was made by another Model.
        UnknownNameError: There is no such keyframe; nothing is changed then.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data, even_troubled=True)
    data._reset(None if keyframe is None else model.key_id(keyframe))
    data._recover()


def get_state(model: Model, data: Data) -> State:
    """A copy of what the engine exposes of all that decides the future of `data`.

    Two restores of one State have the same future, bit for bit; where the record says
    `exact_restore`, it is also the future of `data` itself.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: An input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data)
    for name in INPUTS:
        check_entries(getattr(data, name), name, model._coordinate_name)
    return data._get_state()


def set_state(model: Model, data: Data, state: State) -> None:
    """Overwrite `data` with a State; derived arrays become zero, as after `reset`.

    The State may come from another Data, from a Model that `replace` made of the
    same one, or from another process.

    Raises:
        ForeignDataError: `data` was made by another Model.
        ForeignStateError: The State has another layout; nothing is changed then.
        BadInputError: The State holds a number that is not finite.
        ClosedDataError: `data` is closed.
    """
    _admit(model, data, even_troubled=True)
    if not isinstance(state, State):
        raise TypeError(f"set_state wants a State, from get_state; got {kind_of(state)}")
    fingerprint, layout = data._state_layout()
    if state.backend != model.backend:
        raise ForeignStateError(
            f"this State was made by backend {state.backend!r}, the Data is {model.backend!r}"
        )
    size = 8 * sum(length for _, length in layout)
    if (state.fingerprint, state.layout, len(state.blob)) != (fingerprint, layout, size):
        raise ForeignStateError(
            f"this State has another layout than {model!r}: it was made by another model"
        )
    check_finite(state.vector, "state")
    data._set_state(state)
    data._recover()


def _admit(model: Model, data: Data, even_troubled: bool = False) -> None:
    """Raise unless `data` is a usable Data of `model`."""
    if not isinstance(model, Model) or not isinstance(data, Data):
        raise TypeError(
            "the first two arguments are a Model and a Data; "
            f"got {kind_of(model)} and {kind_of(data)}"
        )
    if data._home is not model:
        raise ForeignDataError(
            f"this Data was made by another Model ({data._home!r}): a Data belongs to the "
            "Model that made it; a State moves between them"
        )
    if not even_troubled or data._trouble == "closed":
        data._refuse_if_troubled()
