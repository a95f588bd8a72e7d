"""Answers as text: the same again, and whatever else is written there is refused."""

from __future__ import annotations

import copy
import json
import random
from typing import Any

import numpy as np
import pytest

from statemachine.grading.answers import Answer, Thing, decode, encode
from statemachine.grading.watch import EngineRun, Inputs

from .conftest import refused


def _answer() -> Answer:
    row = np.array([1.5, np.nan, -0.0])
    inputs = Inputs(0, row, row, row[:1], 0.5)
    run = EngineRun(True, inputs, Inputs(0, row, row, row[:0], 1.5), 3, None)
    result = (
        [True, None, "text", 3, 2.5, float("inf")],
        {"joint": (slice(0, None), slice(1, 2, None))},
        np.arange(6, dtype=np.float32).reshape(2, 3),
        np.array([True, False]),
        Thing("an object"),
    )
    changed = {"opt.gravity": ([0.0], [1.0])}
    return Answer(result, (0, 1, 2), ("", "qpos", ""), (run,), (inputs,), (inputs,), changed)


def _text(answer: Answer) -> str:
    return json.dumps(encode(answer))


def test_an_answer_comes_back_as_it_was() -> None:
    text = _text(_answer())
    back = decode(json.loads(text))
    assert _text(back) == text
    assert back.result[1] == _answer().result[1]
    assert (back.result[2].dtype, back.result[2].shape) == (np.float32, (2, 3))
    assert back.runs[0].start.qpos.tobytes() == _answer().runs[0].start.qpos.tobytes()


def test_no_object_gets_through() -> None:
    class Any3:
        def __iter__(self) -> Any:
            raise SystemExit

        def __repr__(self) -> str:
            return "x" * 1000

    odd = [Any3(), {1: 2j}, np.array([1j]), np.array(["a"]), 10**30, {1, 2}]
    value = decode(json.loads(_text(Answer(odd)))).result
    things, numbers = value[:1] + value[2:], value[1]
    assert [type(thing) for thing in things] == [Thing] * 5
    assert numbers == {"an int: 1": Thing("a complex: 2j")}


def _places(found: Any) -> list[tuple[Any, Any]]:
    """Every container with each of its keys."""
    if not isinstance(found, (dict, list)):
        return []
    keys = list(found) if isinstance(found, dict) else range(len(found))
    return [(found, key) for key in keys] + [
        place for key in keys for place in _places(found[key])
    ]  # fmt: skip


OTHERS = [
    None, True, -1, 2**70, 0.5, float("nan"), "", "x" * 20_000, "<f8", "|O8", "<U3", [], {},
    [1], {"array": ["<f8", [2], "AAAA"]}, {"array": ["|O", [1], ""]}, {"code": "1"}, [[[]]],
    {"array": ["<f8", [-1], ""]}, {"slice": [1]}, {"tuple": 5}, {"dict": [[1, 2, 3]]},
]  # fmt: skip


def test_whatever_is_written_there_is_an_answer_or_refused() -> None:
    chance = random.Random(1)
    refused = 0
    for _ in range(1000):
        found = copy.deepcopy(encode(_answer()))
        for _ in range(chance.randint(1, 3)):
            where, key = chance.choice(_places(found))
            if isinstance(where, dict) and chance.random() < 0.2:
                del where[key]
            else:
                where[key] = copy.deepcopy(chance.choice(OTHERS))
        try:
            decode(found)
        except ValueError:
            refused += 1
    assert 500 < refused < 1000


@pytest.mark.parametrize("found", [None, 3, [], "x", {}, {"result": 1}])
def test_no_answer_at_all(found: Any) -> None:
    refused((ValueError, "", lambda: decode(found)))
