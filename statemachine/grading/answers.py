"""What came of calling a student's function, as plain data: nothing of it runs code."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np

from ..engines import room
from ..interface import DERIVED, INPUTS, Model
from .watch import EngineRun, Inputs, StudentWatch

_MOST = 10_000  # values that a list or a generator may have
_DEEPEST = 6  # lists within lists
_LONGEST = 200  # characters of a text
_SHOWN = 40  # characters of a value


@dataclass(frozen=True)
class Thing:
    """A value of another kind than any that is asked for; `text` is what it is, in words."""

    text: str


@dataclass(frozen=True)
class Answer:
    """What a function returned on a world, and what it did there.

    Attributes:
        result: What it returned: numbers, texts, lists, tuples, dicts, slices and copies of
            arrays; a `Thing` in place of all else.
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


def answer_of(result: Any, watch: StudentWatch) -> Answer:
    """The answer that a result and what was seen amount to.

    What is worked out only when somebody asks (a generator) is asked for here.
    """
    if isinstance(result, Iterator):
        result = tuple(islice(result, _MOST))
    every = islice(result, _MOST) if isinstance(result, (tuple, list)) or _rows(result) else ()
    items = [list(islice(each, _MOST)) if isinstance(each, Iterator) else each for each in every]
    if type(result) in (tuple, list):
        result = type(result)(items)
    return Answer(
        plain(result),
        tuple(next(j for j in range(k + 1) if _same(items[j], items[k])) for k in range(len(items)))
        if len(items) < 100
        else (),
        tuple(_live(item, watch.datas) for item in items[:100]),
        tuple(watch.runs),
        tuple(watch.forwards),
        tuple(watch.inputs(data) for data in watch.datas),
    )


def plain(value: Any, depth: int = 0) -> Any:
    """A value without code: see `Answer.result`."""
    if value is None or type(value) in (bool, float):
        return value
    if type(value) is int:
        return value if abs(value) < 2**63 else Thing(kind(value))
    if type(value) is str:
        return value[:_LONGEST]
    if isinstance(value, (np.bool_, np.integer, np.float64)):
        return value.item()
    if isinstance(value, (np.ndarray, np.generic)):
        return _numeric(value)
    if isinstance(value, slice) and depth < _DEEPEST:
        return slice(*(plain(part, depth + 1) for part in (value.start, value.stop, value.step)))
    if isinstance(value, (tuple, list, dict)) and depth < _DEEPEST:
        if len(value) > _MOST:
            return Thing(kind(value))
        if isinstance(value, dict):
            return {
                key[:_LONGEST] if type(key) is str else kind(key): plain(each, depth + 1)
                for key, each in islice(value.items(), _MOST)
            }
        items: Iterable[Any] = [plain(each, depth + 1) for each in islice(value, _MOST)]
        return tuple(items) if isinstance(value, tuple) else items
    if hasattr(value, "__array__"):
        return _numeric(np.asarray(value))
    return Thing(kind(value))


def _numeric(value: Any) -> Any:
    """A copy of an array of numbers, in the machine's byte order; its type is kept."""
    array = np.array(value, subok=False)
    if array.dtype.kind not in "biuf" or array.size > 100 * _MOST or array.dtype.itemsize > 8:
        return Thing(kind(value))
    return array.astype(array.dtype.newbyteorder("="))


def kind(value: Any) -> str:
    """What a value is, in words."""
    if isinstance(value, Thing):
        return value.text
    if isinstance(value, np.ndarray) and value.shape:
        return f"an array of shape {value.shape}"
    if isinstance(value, (tuple, list, dict, set)):
        return f"a {type(value).__name__} of {len(value)}"
    text, name = repr(value), type(value).__name__
    name = f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
    return f"{name}: {text}" if len(text) < _SHOWN else name


def _rows(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim > 0


def _same(one: Any, two: Any) -> bool:
    arrays = isinstance(one, np.ndarray) and isinstance(two, np.ndarray)
    return one is two or (arrays and bool(np.may_share_memory(one, two)))


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


def settings(model: Model) -> dict[str, list[float]]:
    """What of the engine's own model a student can reach: its options, and its arrays' sums."""
    return room(model.backend).settings(model.raw)
