"""Claims that a failure explains."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Container
from functools import partial
from typing import Any, TypeVar

import numpy as np
import pytest

from statemachine.errors import EngineWarning, StateMachineError

T = TypeVar("T")
# Of a test whose model has shapes that start inside each other on purpose: `load` warns of them,
# and what it says is tested elsewhere.
overlapping = pytest.mark.filterwarnings(
    "ignore:.*shapes are inside each other:statemachine.errors.EngineWarning"
)


def assert_in(whole: Container[Any], *parts: object) -> None:
    """Assert that all of these are in it; a failure lists those that are not."""
    assert not [part for part in parts if part not in whole], f"not in {whole}"


def assert_not_in(whole: Container[Any], *parts: object) -> None:
    """Assert that none of these is in it; a failure lists those that are."""
    assert not [part for part in parts if part in whole], f"in {whole}"


def assert_has(record: Any, **fields: object) -> None:
    """Assert fields of a record, or entries of a dict; a failure lists those that differ."""
    of = record.__getitem__ if isinstance(record, dict) else partial(getattr, record)
    assert {name: of(name) for name in fields} == fields


def refused(
    *cases: tuple[type[BaseException] | tuple[type[BaseException], ...], str, Callable[[], object]],
) -> Any:
    """Assert that every call raises its error, its pattern in the text; one of ours is one line.

    Returns:
        The error of the last.
    """
    raised: Any = None
    for error, says, call in cases:
        with pytest.raises(error, match=says or None) as caught:  # noqa: PT012
            call()
            pytest.fail(f"nothing was refused, where {error} was to say: {says}")
        raised = caught.value
        assert not isinstance(raised, (StateMachineError, TypeError)) or "\n" not in str(raised)
    return raised


def warnings_of(call: Callable[[], T]) -> tuple[T, str]:
    """Return what a call gives, and what we warned of in it; nobody else warned."""
    with warnings.catch_warnings(record=True, action="always") as told:
        result = call()
    assert {warning.category for warning in told} <= {EngineWarning}
    return result, " ".join(str(warning.message) for warning in told)


def numbers(*values: object) -> np.ndarray:
    """Return values that must be numbers, or lists of as many, as an array."""
    return np.array(values, dtype=float)
