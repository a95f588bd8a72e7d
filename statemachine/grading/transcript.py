"""Answers as text, and back: no code, everything checked, so that anybody may have written it."""

from __future__ import annotations

import base64
import math
from typing import Any, cast

import numpy as np

from ..interface import Array
from .answers import Answer, Thing
from .watch import EngineRun, Inputs

_TEXT = 10_000  # characters of one text
_RUNS = 10_000


def encode(answer: Answer) -> dict[str, Any]:
    """An answer as what JSON can hold."""
    return {
        "result": _encoded(answer.result),
        "memory": list(answer.memory),
        "live": list(answer.live),
        "runs": [
            {name: _encoded(value) for name, value in vars(run).items()} for run in answer.runs
        ],
        "forwards": [_encoded_inputs(each) for each in answer.forwards],
        "ends": [_encoded_inputs(each) for each in answer.ends],
        "changed": {name: list(pair) for name, pair in answer.changed.items()},
    }


def decode(found: Any) -> Answer:
    """The answer that `encode` was given.

    Raises:
        ValueError: It was given none.
    """
    try:
        runs = tuple(_run(each) for each in _few(found["runs"]))
        ends = tuple(_inputs(each) for each in _few(found["ends"]))
        if any(not 0 <= run.data < len(ends) for run in runs):
            raise ValueError("a run of no Data")
        return Answer(
            _decoded(found["result"]),
            tuple(_whole(each) for each in _few(found["memory"])),
            tuple(_text(each) for each in _few(found["live"])),
            runs,
            tuple(_inputs(each) for each in _few(found["forwards"])),
            ends,
            {_text(name): _pair(pair) for name, pair in dict(found["changed"]).items()},
        )
    except (KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from None


def _encoded(value: Any) -> Any:
    """A value of `answers.plain`; what JSON has not by the name of what it is."""
    if isinstance(value, np.ndarray):
        data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode("ascii")
        return {"array": [value.dtype.str, list(value.shape), data]}
    if isinstance(value, Thing):
        return {"thing": value.text}
    if isinstance(value, slice):
        return {"slice": [_encoded(part) for part in (value.start, value.stop, value.step)]}
    if isinstance(value, tuple):
        return {"tuple": [_encoded(each) for each in value]}
    if isinstance(value, dict):
        return {"dict": [[name, _encoded(each)] for name, each in value.items()]}
    if isinstance(value, list):
        return [_encoded(each) for each in value]
    return value


def _decoded(found: Any) -> Any:
    if found is None or isinstance(found, (bool, float)):
        return found
    if isinstance(found, int):
        return _whole(found)
    if isinstance(found, str):
        return _text(found)
    if isinstance(found, list):
        return [_decoded(each) for each in found]
    match list(dict(found).items()):
        case [("array", [dtype, shape, data])]:
            return _array(dtype, shape, data)
        case [("thing", text)]:
            return Thing(_text(text))
        case [("slice", [start, stop, step])]:
            return slice(_decoded(start), _decoded(stop), _decoded(step))
        case [("tuple", list(items))]:
            return tuple(_decoded(each) for each in items)
        case [("dict", list(items))]:
            return {_text(name): _decoded(each) for name, each in items}
    raise ValueError("a value of no known kind")


def _array(dtype: Any, shape: Any, data: Any) -> Any:
    kind = np.dtype(_text(dtype))
    if kind.kind not in "biuf" or kind.itemsize > 8 or kind.shape:
        raise ValueError("an array of no numbers")
    lengths = [_whole(each) for each in shape]
    content = base64.b64decode(data, validate=True)
    negative = any(each < 0 for each in lengths)
    if negative or len(lengths) > 16 or math.prod(lengths) * kind.itemsize != len(content):
        raise ValueError("an array of another size")
    array = np.frombuffer(content, kind).reshape(lengths)
    return array.astype(kind.newbyteorder("="))


def _row(found: Any) -> Array:
    array = _decoded(found)
    if not isinstance(array, np.ndarray) or array.dtype != np.float64 or array.ndim != 1:
        raise ValueError("no row of numbers")
    return array


def _encoded_inputs(inputs: Inputs) -> dict[str, Any]:
    return {name: _encoded(value) for name, value in vars(inputs).items()}


def _inputs(found: Any) -> Inputs:
    rows = (_row(found[name]) for name in ("qpos", "qvel", "ctrl"))
    return Inputs(_whole(found["data"]), *rows)


def _run(found: Any) -> EngineRun:
    changed = found["ctrl_changed"]
    if not isinstance(found["own"], bool):
        raise ValueError("own is no bool")
    names = ("qpos", "qvel", "ctrl", "end", "end_qvel")
    return EngineRun(
        data=_whole(found["data"]),
        own=found["own"],
        **{name: _row(found[name]) for name in names},
        time=_number(found["time"]),
        end_time=_number(found["end_time"]),
        nstep=_whole(found["nstep"]),
        ctrl_changed=None if changed is None else _whole(changed),
    )


def _pair(found: Any) -> tuple[list[float], list[float]]:
    before, after = ([_number(each) for each in _few(side)] for side in found)
    return before, after


def _few(found: Any) -> list[Any]:
    if not isinstance(found, list) or len(found) > _RUNS:
        raise ValueError("no list, or too long a one")
    return cast("list[Any]", found)


def _whole(found: Any) -> int:
    if not isinstance(found, int) or isinstance(found, bool) or abs(found) >= 2**63:
        raise ValueError("no whole number")
    return found


def _number(found: Any) -> float:
    if not isinstance(found, (int, float)) or isinstance(found, bool):
        raise ValueError("no number")
    return float(found)


def _text(found: Any) -> str:
    if not isinstance(found, str) or len(found) > _TEXT:
        raise ValueError("no text, or too long a one")
    return found
