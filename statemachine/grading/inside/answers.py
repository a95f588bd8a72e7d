"""What came of calling a student's function, as text and back: anybody may have written it.

Nothing of it runs code, neither where it is written nor where it is read.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from ...errors import refuse
from ...interface import DERIVED, INPUTS
from .watch import EngineRun, Inputs, StudentWatch, inputs_of

_MOST = 10_000  # values that a list or a generator may have
_DEEPEST = 8  # lists within lists, in a record
_LONGEST = 200  # characters of a text
_SHOWN = 40  # characters of a value


@dataclass(frozen=True)
class OtherValue:
    """A value of another kind than any that is asked for; `text` is what it is, in words."""

    text: str


@dataclass(frozen=True)
class Answer:
    """What a function returned on a world, and what it did there.

    Attributes:
        result: What it returned: numbers, texts, lists, tuples, dicts, slices and copies of
            arrays; a `OtherValue` in place of all else.
        memory: For each part of the result, the number of the first part with the same
            memory: its own if it shares none.
        live: For each part, the array of a Data that it is itself, not a copy of; or "".
        runs: What was stepped.
        forwards: What the inputs were when derived values were recomputed.
        ends: What they were when the function returned, of each Data.
        changed: What of the engine's own model is another than before, by name: before, after.
    """

    result: Any
    memory: tuple[int, ...] = ()
    live: tuple[str, ...] = ()
    runs: tuple[EngineRun, ...] = ()
    forwards: tuple[Inputs, ...] = ()
    ends: tuple[Inputs, ...] = ()
    changed: dict[str, tuple[list[float], list[float]]] = field(default_factory=dict)


_RECORDS: dict[str, Any] = {kind.__name__: kind for kind in (Answer, EngineRun, Inputs, OtherValue)}


def answer_of(result: Any, watch: StudentWatch, changed: dict[str, Any]) -> Answer:
    """The answer that a result and what was seen amount to.

    What is worked out only when somebody asks (a generator) is asked for here.
    """
    if isinstance(result, Iterator):
        result = tuple(islice(result, _MOST))
    every = islice(result, _MOST) if isinstance(result, (tuple, list)) or _rows(result) else ()
    items = [list(islice(part, _MOST)) if isinstance(part, Iterator) else part for part in every]
    if type(result) in (tuple, list):
        result = type(result)(items)
    items = items[:100]
    first = [next(j for j in range(k + 1) if _same(items[j], items[k])) for k in range(len(items))]
    return Answer(
        result,
        tuple(first),
        tuple(_live(item, watch.datas) for item in items),
        tuple(watch.runs),
        tuple(watch.forwards),
        tuple(inputs_of(k, data) for k, data in enumerate(watch.datas)),
        changed,
    )


def _rows(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim > 0


def _same(left: Any, right: Any) -> bool:
    arrays = isinstance(left, np.ndarray) and isinstance(right, np.ndarray)
    return left is right or (arrays and bool(np.may_share_memory(left, right)))


def _live(value: Any, datas: Sequence[Any]) -> str:
    for data in datas if isinstance(value, np.ndarray) else ():
        for name in (*INPUTS, *DERIVED):
            try:
                array = getattr(data, name)
            except Exception:  # it is closed, refuses, or has no such array
                continue
            if isinstance(array, np.ndarray) and np.may_share_memory(value, array):
                return name
    return ""


def kind(value: Any) -> str:
    """What a value is, in words."""
    if isinstance(value, OtherValue):
        return value.text
    if _rows(value):
        return f"an array of shape {value.shape}"
    if isinstance(value, (tuple, list, dict, set)):
        return f"a {type(value).__name__} of {len(value)}"
    text, name = repr(value), type(value).__name__
    name = f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
    return f"{name}: {text}" if len(text) < _SHOWN else name


def encode(value: Any, depth: int = 0) -> Any:
    """An answer, or a part of one, as what JSON can hold; see `Answer.result`."""
    if isinstance(value, (np.bool_, np.integer, np.float64)):
        value = value.item()
    if value is None or type(value) in (bool, float):
        return value
    if type(value) is int and abs(value) < 2**63:
        return value
    if type(value) is str:
        return value[:_LONGEST]
    if isinstance(value, (np.ndarray, np.generic)) or hasattr(value, "__array__"):
        array = np.array(value, subok=False)
        if array.dtype.kind in "biuf" and array.size <= 100 * _MOST and array.dtype.itemsize <= 8:
            data = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
            return {"array": [array.dtype.str, list(array.shape), data]}
    elif depth < _DEEPEST:
        if type(value) in _RECORDS.values():
            parts = {name: encode(item, depth + 1) for name, item in vars(value).items()}
            return {type(value).__name__: parts}
        if isinstance(value, slice):
            ends = (value.start, value.stop, value.step)
            return {"slice": [encode(part, depth + 1) for part in ends]}
        if isinstance(value, dict) and len(value) <= _MOST:
            named = [(k[:_LONGEST] if type(k) is str else kind(k), v) for k, v in value.items()]
            return {"dict": [[name, encode(item, depth + 1)] for name, item in named]}
        if isinstance(value, (tuple, list)) and len(value) <= _MOST:
            items = [encode(item, depth + 1) for item in islice(value, _MOST)]
            return {"tuple": items} if isinstance(value, tuple) else items
    return {"OtherValue": {"text": kind(value)}}


def decode(record: Any) -> Answer:
    """The answer that `encode` was given.

    Raises:
        ValueError: It was given none.
    """
    try:
        answer = _decoded(record)
    except (KeyError, TypeError, OverflowError, RecursionError) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from None
    if not isinstance(answer, Answer):
        raise ValueError("no answer")
    return answer


def _decoded(record: Any) -> Any:
    if record is None or isinstance(record, (bool, int, float, str)):
        return record
    if isinstance(record, list):
        return [_decoded(item) for item in record]
    ((name, content),) = dict(record).items()
    if name == "array":
        return _array(*content)
    if name == "slice":
        start, stop, step = map(_decoded, content)
        return slice(start, stop, step)
    if name == "tuple":
        return tuple(map(_decoded, content))
    if name == "dict":
        return {key: _decoded(item) for key, item in content}
    values = {key: _decoded(item) for key, item in dict(content).items()}
    for key, hint in get_type_hints(_RECORDS[name]).items():
        if not _is(values[key], hint):
            raise ValueError(f"{key} is no {hint}")
    return _RECORDS[name](**values)


def _is(value: Any, hint: Any) -> bool:
    """Whether a value is of a type; of arrays there are rows of floats only."""
    origin = get_origin(hint)
    if hint is Any:
        return True
    if not isinstance(value, hint if origin in (None, UnionType) else origin):
        return False
    if isinstance(value, np.ndarray):
        return value.dtype == np.float64 and value.ndim == 1
    return origin is not tuple or all(_is(item, get_args(hint)[0]) for item in value)


def _array(dtype: str, shape: list[int], data: str) -> Any:
    kind = np.dtype(dtype)
    content = base64.b64decode(data, validate=True)
    negative, size = any(length < 0 for length in shape), math.prod(shape) * kind.itemsize
    refuse(
        (
            kind.kind not in "biuf" or kind.itemsize > 8 or kind.shape,
            "an array of no numbers",
        ),
        (negative or len(shape) > 16 or size != len(content), "an array of another size"),
        error=ValueError,
    )
    return np.frombuffer(content, kind).reshape(shape).astype(kind.newbyteorder("="))
