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

from ....interface import DERIVED, INPUTS, Data, Model
from ....interface.checks import kind_of
from .watch import EngineRun, Inputs, StudentWatch, inputs_of

_MOST = 10_000  # values that a list or a generator may have
_DEEPEST = 8  # lists within lists, in a record
_LONGEST = 200  # characters of a text
_SHOWN = 40  # characters of a value


Changes = dict[str, tuple[list[float], list[float]]]  # by name: before, after


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
    changed: Changes = field(default_factory=dict)


_Record = type[Answer] | type[EngineRun] | type[Inputs] | type[OtherValue]
_RECORDS: dict[str, _Record] = {
    "Answer": Answer,
    "EngineRun": EngineRun,
    "Inputs": Inputs,
    "OtherValue": OtherValue,
}


def answer_of(result: Any, watch: StudentWatch, changed: Changes) -> Answer:
    """Return the answer that a result and what was seen amount to.

    What is worked out only when somebody asks (a generator) is asked for here.
    """
    if isinstance(result, Iterator):
        result = tuple(islice(result, _MOST))
    items: list[Any] = []
    if isinstance(result, (tuple, list)) or _rows(result):
        for part in islice(result, _MOST):
            items.append(list(islice(part, _MOST)) if isinstance(part, Iterator) else part)
    if type(result) in (tuple, list):
        result = type(result)(items)
    parts = items[:100]
    memory = tuple(_first_with_memory_of(k, parts) for k in range(len(parts)))
    live = tuple(_live(part, watch.datas) for part in parts)
    ends = tuple(inputs_of(k, data) for k, data in enumerate(watch.datas))
    return Answer(result, memory, live, tuple(watch.runs), tuple(watch.forwards), ends, changed)


def _first_with_memory_of(k: int, parts: Sequence[Any]) -> int:
    """Return the number of the first part that has the memory of part k."""
    return next(j for j in range(k + 1) if _same(parts[j], parts[k]))


def _rows(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim > 0


def _same(left: Any, right: Any) -> bool:
    arrays = isinstance(left, np.ndarray) and isinstance(right, np.ndarray)
    return left is right or (arrays and bool(np.may_share_memory(left, right)))


def _live(value: Any, datas: Sequence[Any]) -> str:
    if not isinstance(value, np.ndarray):
        return ""
    for data in datas:
        for name in (*INPUTS, *DERIVED):
            try:
                array = getattr(data, name)
            except Exception:  # it is closed, refuses, or has no such array
                continue
            if isinstance(array, np.ndarray) and np.may_share_memory(value, array):
                return name
    return ""


def kind(value: Any) -> str:
    """Return what a value is, in words."""
    if isinstance(value, OtherValue):
        return value.text
    if _rows(value):
        return f"an array of shape {value.shape}"
    if isinstance(value, (tuple, list, dict, set)):
        return f"a {type(value).__name__} of {len(value)}"
    if isinstance(value, (Data, Model)):
        return kind_of(value)  # its class is named after the engine
    if value is None:
        return "None"
    text, name = repr(value), type(value).__name__
    name = f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
    return f"{name}: {text}" if len(text) < _SHOWN else name


def encode(value: Any, depth: int = 0) -> Any:
    """Return an answer, or a part of one, as what JSON can hold; see `Answer.result`."""
    if isinstance(value, (np.bool_, np.integer, np.float64)):
        value = value.item()
    if value is None or type(value) in (bool, float):
        return value
    if type(value) is int and abs(value) < 2**63:
        return value
    if type(value) is str:
        return value[:_LONGEST]
    record = None
    if isinstance(value, (np.ndarray, np.generic)) or hasattr(value, "__array__"):
        record = _encoded_array(value)
    elif depth < _DEEPEST:
        record = _encoded_parts(value, depth + 1)
    if record is None:
        return {"OtherValue": {"text": kind(value)}}
    return record


def _encoded_array(value: Any) -> Any:
    """Return an array of numbers as what JSON can hold; None for any other."""
    array = np.array(value, subok=False)
    if array.dtype.kind not in "biuf" or array.size > 100 * _MOST or array.dtype.itemsize > 8:
        return None
    data = base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
    return {"array": [array.dtype.str, list(array.shape), data]}


def _encoded_parts(value: Any, depth: int) -> Any:
    """Return what has parts as what JSON can hold; None for what is not known."""
    if type(value) in _RECORDS.values():
        parts = {name: encode(item, depth) for name, item in vars(value).items()}
        return {type(value).__name__: parts}
    if isinstance(value, slice):
        return {"slice": [encode(part, depth) for part in (value.start, value.stop, value.step)]}
    if isinstance(value, dict) and len(value) <= _MOST:
        pairs: list[Any] = []
        for key, item in value.items():
            name = key[:_LONGEST] if type(key) is str else kind(key)
            pairs.append([name, encode(item, depth)])
        return {"dict": pairs}
    if isinstance(value, (tuple, list)) and len(value) <= _MOST:
        items = [encode(item, depth) for item in islice(value, _MOST)]
        return {"tuple": items} if isinstance(value, tuple) else items
    return None


def decode(record: Any) -> Answer:
    """Return the answer that `encode` was given.

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
    """Return whether a value is of a type; of arrays there are rows of floats only."""
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
    if kind.kind not in "biuf" or kind.itemsize > 8 or kind.shape:
        raise ValueError("an array of no numbers")
    if negative or len(shape) > 16 or size != len(content):
        raise ValueError("an array of another size")
    return np.frombuffer(content, kind).reshape(shape).astype(kind.newbyteorder("="))
