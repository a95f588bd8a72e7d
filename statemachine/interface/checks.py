"""How an argument, an array or a State is checked before an engine sees it."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import (
    BadInputError,
    ForeignStateError,
    ReadOnlyError,
    UnsupportedError,
    shown,
    unknown_name,
)
from .records import Array, Capabilities, Sizes, State

# MuJoCo calls a coordinate beyond this "huge" and the simulation unstable (mjMAXVAL).
HUGE = 1e10
# Below this norm MuJoCo takes a quaternion for the identity without a word (mjMINVAL).
TINY = 1e-15

_LATE = ("given", "history")  # parts of a State with the commands that are on their way


def as_count(value: Any, name: str) -> int:
    """Return `value` as a whole number of at least 1.

    Raises:
        BadInputError: It is none, or too large for a C int.
    """
    number = whole_number(value)
    if number is None or number < 1:
        rounding = f": type round({value})" if isinstance(value, float) and value >= 1 else ""
        raise BadInputError(
            f"{name} must be a whole number of at least 1; got {shown(value)}{rounding}"
        )
    if number >= 2**31:  # engines count in a C int
        raise BadInputError(f"{name} must be below {2**31}; got {shown(value)}")
    return number


def engine_steps(nstep: int, substeps: int) -> int:
    """Return how many steps an engine takes in a call.

    Raises:
        BadInputError: It is more than a C int holds.
    """
    if nstep * substeps >= 2**31:
        raise BadInputError(f"nstep {nstep} × {substeps} substeps is too large for one call")
    return nstep * substeps


def whole_number(value: Any) -> int | None:
    """Return `value` as an int if it is a whole number by type (True is not), else None."""
    if isinstance(value, (bool, np.bool_)):
        return None
    try:
        return operator.index(value)
    except TypeError:
        return None


def as_switch(value: Any, name: str) -> bool:
    """Return `value` as a bool.

    Raises:
        BadInputError: It is neither True nor False.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise BadInputError(f"{name} must be True or False; got {shown(value)}")
    return bool(value)


def as_scalar(value: ArrayLike, name: str) -> float:
    """Return `value` as one finite float.

    Raises:
        BadInputError: It is no real number, or not finite.
    """
    return float(as_vector(value, (), name))


def as_vector(value: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """Return `value` as finite float64 of exactly this shape, in a new array.

    Raises:
        BadInputError: It has another shape, or an entry that is not a finite number.
    """
    array = as_numbers(value, name)
    if array.shape != shape:
        wanted = f"{math.prod(shape)} numbers, shape {shape}" if shape else "one number"
        raise BadInputError(f"{name} takes {wanted}; got shape {array.shape}")
    array = array.astype(np.float64)
    check_entries(array, name)
    return array


def as_numbers(value: ArrayLike, name: str) -> NDArray[Any]:
    """Return `value` as an array of real numbers, of any shape.

    Raises:
        BadInputError: It is a ragged list, or holds something else than real numbers.
    """
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError) as error:  # a ragged list
        raise BadInputError(f"{name} must be real numbers, in a regular array") from error
    if array.dtype.kind not in "fiu":
        got = shown(array.item()) if not array.ndim and array.dtype.kind == "U" else array.dtype
        raise BadInputError(f"{name} must be real numbers; got {got}")
    return array


def check_entries(array: Array, name: str, label: Callable[[str, int], str] | None = None) -> None:
    """Raise BadInputError for the first entry that is not finite, or is huge.

    Args:
        array: Any shape.
        name: What the array is called in the message.
        label: Gives ' (elbow_flex)' for (name, index), to be put after the entry.
    """
    # One comparison answers for all: NaN fails it too.
    if np.abs(array).max(initial=0.0) <= HUGE:
        return
    flat = array.ravel()
    index = int(np.flatnonzero(~(np.abs(flat) <= HUGE))[0])
    value = float(flat[index])
    where = f"{name}[{index}]" if array.ndim else name
    if label is not None:
        where += label(name, index)
    problem = f"is beyond {HUGE:g}" if math.isfinite(value) else "is not a finite number"
    raise BadInputError(f"{where} = {value} {problem}", quantity=name, index=index)


def check_writable(array: Array, name: str, owner: str = "data") -> None:
    """Raise ReadOnlyError if the caller took the flag of an input away with `setflags`."""
    if not array.flags.writeable:
        raise ReadOnlyError(
            f"{name} was made read-only, so that the engine has nowhere to write to: "
            f"call {owner}.{name}.setflags(write=True)"
        )


def check_state(state: Any, model: Any, fingerprint: str, layout: Sizes) -> None:
    """Raise unless `state` is a State that a Data of `model` can take.

    Args:
        state: Whatever the caller gave.
        model: The Model of the Data, for the messages and the name of its backend.
        fingerprint: Of the States of the Data.
        layout: Of the States of the Data.

    Raises:
        TypeError: It is not a State.
        ForeignStateError: It has another layout.
        BadInputError: It holds a number that is not finite.
    """
    if not isinstance(state, State):
        raise TypeError(f"set_state takes a State, from get_state; got {kind_of(state)}")
    if state.backend != model.backend:
        raise ForeignStateError(
            f"this State was made by backend {state.backend!r}, the Data is {model.backend!r}"
        )
    size = 8 * sum(length for _, length in layout)
    if (state.fingerprint, state.layout, len(state.blob)) != (fingerprint, layout, size):
        raise ForeignStateError(
            f"this State has another layout than {model!r}: it was made by another model"
        )
    check_vector(state.vector, layout, model)


def check_vector(vector: Array, layout: Sizes, model: Any) -> None:
    """Raise BadInputError for the first number of a State of `model` that is not finite.

    A command that is infinite may be there: what acts of it is within its range.
    """
    start = 0
    for name, size in () if np.isfinite(vector).all() else layout:
        part = model._acting(name, vector[start : start + size])
        bad = np.isnan(part) if name in _LATE else ~np.isfinite(part)
        for index in np.flatnonzero(bad)[:1].tolist():
            raise BadInputError(f"state[{name!r}][{index}] = {part[index]} is not a finite number")
        start += size


def index_of(kind: str, name: str, names: Sequence[str]) -> int:
    """Return the index of a name among the names of its kind.

    Raises:
        UnknownNameError: There is no such name.
    """
    if name and name in names:
        return names.index(name)
    raise unknown_name(kind, name, (known for known in names if known))


def kind_of(value: object) -> str:
    """Return what a value is, for messages: "a Data" of any backend, else its type."""
    for kind in type(value).__mro__:
        if kind.__module__.startswith("statemachine.interface."):
            return f"a {kind.__name__}"
    module, name = type(value).__module__, type(value).__qualname__
    return name if module == "builtins" else f"{module}.{name}"


class HasCapabilities(Protocol):
    """A Model, or what one will be made from."""

    @property
    def backend(self) -> str: ...
    @property
    def capabilities(self) -> Capabilities: ...


def unsupported(of: HasCapabilities, feature: str, reason: str = "") -> UnsupportedError:
    """Return the error for what a backend cannot do; without a reason, that of its record."""
    record = of.capabilities
    if not reason:
        known = record.behaviours.get(feature)
        reason = known.note if known else "the engine has no such setting"
        reason = record.refused.get(feature, reason)
    return unsupported_by(of.backend, feature, reason)


def unsupported_by(backend: str, feature: str, reason: str) -> UnsupportedError:
    """Return the error for what a backend cannot do, for a reason."""
    return UnsupportedError(
        f"backend {backend!r} does not support {feature!r}: {reason}",
        backend=backend,
        feature=feature,
        reason=reason,
    )
