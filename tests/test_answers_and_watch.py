"""What is written down of a student's function: its result, its runs, and how that is read back."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.course.grading import alike
from statemachine.course.grading.inside import watch as watch_module
from statemachine.course.grading.inside.answers import (
    Answer,
    OtherValue,
    answer_of,
    decode,
    encode,
    kind,
)
from statemachine.course.grading.inside.watch import (
    EngineRun,
    Inputs,
    Nudge,
    StudentWatch,
    engine_watched,
    inputs_of,
    watching,
)
from statemachine.course.grading.likeness import StudentCode, likeness
from statemachine.course.grading.submissions import Submission

from .support.small_models import PENDULUM, TILTED_BOX, model_of


def read_back(result: Any) -> Any:
    """Return a result as the judge's process reads it."""
    return decode(json.loads(json.dumps(encode(Answer(result))))).result


# Results.


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        0.25,
        -(2**63) + 1,
        2**63 - 1,
        "text",
        "x" * 200,
        [1, [2.5, "a"]],
        (1, (2.5,)),
        {"a": (1, 2)},
        slice(1, None, 2),
        list(range(10_000)),
    ],
)
def test_a_value_is_read_back_as_it_was(value: Any) -> None:
    assert read_back(value) == value
    assert type(read_back(value)) is type(value)


@pytest.mark.parametrize(
    "array",
    [
        np.array([[1.5, 2.5], [3.5, 4.5], [5.5, 6.5]]),
        np.arange(3, dtype=np.int32),
        np.array([True, False]),
        np.array([1.5], dtype=np.float32),
        np.array([1, 2], dtype=">i4"),
        np.zeros((0, 3)),
        np.arange(12.0).reshape(3, 4).T,
    ],
)
def test_an_array_is_read_back_as_it_was(array: np.ndarray) -> None:
    back = read_back(array)
    assert back.shape == array.shape
    assert back.dtype == array.dtype.newbyteorder("=")
    assert back.tolist() == array.tolist()


@pytest.mark.parametrize(
    ("value", "read"),
    [
        (np.float64(0.5), 0.5),
        (np.int32(5), 5),
        (np.bool_(True), True),
        ("x" * 201, "x" * 200),
        ({1: 2, "y" * 201: 3}, {"an int: 1": 2, "y" * 200: 3}),
    ],
)
def test_what_is_nearly_plain_is_made_plain(value: Any, read: Any) -> None:
    assert read_back(value) == read
    assert type(read_back(value)) is type(read)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2**63, f"an int: {2**63}"),
        (-(2**63), f"an int: {-(2**63)}"),
        ([0] * 10_001, "a list of 10001"),
        (dict.fromkeys(range(10_001)), "a dict of 10001"),
        ({1, 2}, "a set of 2"),
        (np.array(["a"]), "an array of shape (1,)"),
        (np.zeros(2, complex), "an array of shape (2,)"),
        (np.zeros(1_000_001, np.int8), "an array of shape (1000001,)"),
        (range(3), "a range: range(0, 3)"),
    ],
)
def test_of_another_value_only_its_kind_is_told(value: Any, text: str) -> None:
    assert read_back(value) == OtherValue(text)


def test_lists_are_read_to_a_depth_of_seven() -> None:
    nested: Any = 5.0
    for _ in range(7):
        nested = [nested]
    assert read_back(nested) == nested
    deepest = read_back([nested])
    for _ in range(7):
        (deepest,) = deepest
    assert deepest == OtherValue("a list of 1")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "None"),
        (0.5, "a float: 0.5"),
        (5, "an int: 5"),
        ("a" * 37, f"a str: '{'a' * 37}'"),
        ("a" * 38, "a str"),
        ([1, 2], "a list of 2"),
        (np.zeros((2, 3)), "an array of shape (2, 3)"),
        (OtherValue("a thing"), "a thing"),
    ],
)
def test_a_value_in_words(value: Any, text: str) -> None:
    assert kind(value) == text


ARRAY = {"array": ["<f8", [2], "AAAAAAAAAAAAAAAAAAAAAA=="]}


@pytest.mark.parametrize(
    "content",
    [
        ["<f8", [3], ARRAY["array"][2]],
        ["<f8", [-1, -2], ARRAY["array"][2]],
        ["<c16", [1], ARRAY["array"][2]],
        ["<f8", [1] * 16 + [2], ARRAY["array"][2]],
        ["(2,)<f8", [1], ARRAY["array"][2]],
        ["<f8", [2], "not base64"],
    ],
)
def test_a_record_of_no_array_is_refused(content: list[Any]) -> None:
    record: Any = encode(Answer(0.0))
    record["Answer"]["result"] = {"array": content}
    with pytest.raises(ValueError):
        decode(record)


@pytest.mark.parametrize("shape", [[2], [1] * 15 + [2]])
def test_a_record_of_an_array_is_read(shape: list[int]) -> None:
    record: Any = encode(Answer(0.0))
    record["Answer"]["result"] = {"array": ["<f8", shape, ARRAY["array"][2]]}
    assert decode(record).result.tolist() == np.zeros(shape).tolist()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("memory", {"tuple": [0.5]}),
        ("memory", [0]),
        ("live", {"tuple": [1]}),
        ("runs", {"tuple": [5]}),
        ("changed", {"tuple": []}),
    ],
)
def test_a_record_with_a_field_of_another_type_is_refused(name: str, value: Any) -> None:
    record: Any = encode(Answer(0.0))
    record["Answer"][name] = value
    with pytest.raises(ValueError, match=name):
        decode(record)


def test_runs_are_read_back() -> None:
    start = Inputs(1, np.array([0.5]), np.array([1.5]), np.array([2.5]), 3.5)
    end = Inputs(1, np.array([0.75]), np.array([1.75]), np.array([2.75]), 3.75)
    answer = Answer((), runs=(EngineRun(False, start, end, 7, 3),), ends=(end,))
    (run,) = decode(json.loads(json.dumps(encode(answer)))).runs
    assert (run.on_given_model, run.nstep, run.ctrl_changed) == (False, 7, 3)
    assert (run.start.qpos[0], run.end.qvel[0], run.end.ctrl[0]) == (0.5, 1.75, 2.75)
    assert (run.start.data, run.end.time) == (1, 3.75)


# What was watched.


@pytest.fixture
def model(tmp_path: Path) -> sm.Model:
    """A pendulum."""
    return model_of(tmp_path, PENDULUM)


@pytest.fixture
def watched(model: sm.Model) -> Iterator[StudentWatch]:
    """The watch of what is done with a pendulum."""
    with engine_watched("mujoco"), watching(model) as watch:
        yield watch


def test_steps_that_follow_each_other_are_one_run(watched: StudentWatch, model: sm.Model) -> None:
    with sm.make_data(model) as data:
        data.qpos[0] = 0.5
        sm.step(model, data, 3)
        sm.step(model, data)
    (run,) = watched.runs
    assert (run.nstep, run.on_given_model, run.ctrl_changed) == (4, True, None)
    assert run.start.qpos.tolist() == [0.5]
    assert (run.start.time, run.end.time) == pytest.approx((0.0, 0.02))
    assert run.end.qvel[0] != 0


@pytest.mark.parametrize("name", ["qpos", "qvel", "time"])
def test_a_state_that_was_written_begins_another_run(
    watched: StudentWatch, model: sm.Model, name: str
) -> None:
    with sm.make_data(model) as data:
        sm.step(model, data, 2)
        if name == "time":
            data.time = 5.0
        else:
            getattr(data, name)[0] += 0.5
        sm.step(model, data, 3)
    assert [run.nstep for run in watched.runs] == [2, 3]


def test_two_data_have_runs_of_their_own(watched: StudentWatch, model: sm.Model) -> None:
    with sm.make_data(model) as one, sm.make_data(model) as two:
        for steps in (1, 2):
            sm.step(model, one, steps)
            sm.step(model, two, 10 * steps)
    assert [(run.start.data, run.nstep) for run in watched.runs] == [(0, 3), (1, 30)]


def test_a_variant_of_the_model_counts_as_it_and_another_model_does_not(
    watched: StudentWatch, model: sm.Model, tmp_path: Path
) -> None:
    other = model_of(tmp_path, TILTED_BOX, "other.xml")
    for each in (model.replace(gravity=(0, 0, -1)), other):
        with sm.make_data(each) as data:
            sm.step(each, data)
    assert [run.on_given_model for run in watched.runs] == [True, False]


def test_a_forward_is_noted_with_its_inputs(watched: StudentWatch, model: sm.Model) -> None:
    with sm.make_data(model) as data:
        sm.forward(model, data)
        data.qpos[0] = 0.25
        sm.forward(model, data)
    assert [inputs.qpos.tolist() for inputs in watched.forwards] == [[0.0], [0.25]]
    assert watched.runs == []


class _Raw:
    """Arrays of an engine's own object."""

    def __init__(self) -> None:
        self.qpos, self.qvel, self.ctrl, self.time = np.zeros(2), np.zeros(2), np.zeros(1), 0.0


def advanced(watch: StudentWatch, model: sm.Model, data: Any, nstep: int = 1) -> None:
    """Let a watch see steps of a second each."""

    def advance() -> None:
        data.time += nstep

    watch.step(model, data, advance, nstep)


@pytest.fixture
def unwatched(model: sm.Model) -> StudentWatch:
    """A watch of nothing yet."""
    return StudentWatch(model, None)


def test_ctrl_that_changes_is_noted_with_the_steps_before(
    unwatched: StudentWatch, model: sm.Model
) -> None:
    data = _Raw()
    advanced(unwatched, model, data, 2)
    advanced(unwatched, model, data, 3)
    data.ctrl[0] = 1.0
    advanced(unwatched, model, data)
    data.ctrl[0] = 2.0
    advanced(unwatched, model, data)
    (run,) = unwatched.runs
    assert (run.nstep, run.ctrl_changed) == (7, 5)


def test_the_engine_s_own_object_is_no_other_data(unwatched: StudentWatch) -> None:
    raw = _Raw()
    data = SimpleNamespace(_raw=raw)
    assert [unwatched.number_of(each) for each in (data, raw, _Raw(), data)] == [0, 0, 1, 0]


def test_a_nudge_is_of_every_run_but_the_first(model: sm.Model) -> None:
    watch = StudentWatch(model, Nudge(1, -math.inf, 3, by=0.5))
    one, two = _Raw(), _Raw()
    advanced(watch, model, one, 5)
    advanced(watch, model, two, 2)
    assert two.qpos.tolist() == [0, 0]
    advanced(watch, model, two, 1)
    assert one.qpos.tolist() == [0, 0]
    assert two.qpos.tolist() == [0, np.nextafter(0.5, -math.inf)]
    assert watch.runs[1].end.qpos.tolist() == two.qpos.tolist()


def test_no_more_is_noted_than_there_is_room_for(
    monkeypatch: pytest.MonkeyPatch, model: sm.Model
) -> None:
    monkeypatch.setattr(watch_module, "_MOST", 2)
    watch = StudentWatch(model, None)
    datas = [_Raw(), _Raw()]
    for data in (datas[0], datas[1], datas[0]):
        data.qpos[0] += 1
        advanced(watch, model, data)
        watch.recomputed(data)
    assert (len(watch.runs), len(watch.forwards), len(watch.datas)) == (2, 2, 2)
    with pytest.raises(RuntimeError):
        watch.number_of(_Raw())


def test_inputs_are_copies() -> None:
    raw = _Raw()
    inputs = inputs_of(3, raw)
    raw.qpos[0] = 1
    assert (inputs.data, inputs.qpos.tolist(), inputs.time) == (3, [0, 0], 0.0)


def answered(watch: StudentWatch, result: Any) -> Answer:
    """Return the answer of a result."""
    return answer_of(result, watch, {})


def test_parts_with_one_memory_have_the_number_of_the_first(unwatched: StudentWatch) -> None:
    array = np.zeros(4)
    result = [np.ones(2), array, 1.5, array[1:], np.zeros(4), array]
    assert answered(unwatched, result).memory == (0, 1, 2, 1, 4, 1)


def test_a_view_of_a_data_is_named(unwatched: StudentWatch) -> None:
    data = _Raw()
    unwatched.number_of(data)
    answer = answered(unwatched, (data.qvel[1:], data.qpos.copy(), data.ctrl, 1.0))
    assert answer.live == ("qvel", "", "ctrl", "")


def test_a_generator_is_asked_for_what_it_gives(unwatched: StudentWatch) -> None:
    assert answered(unwatched, (value for value in (1, 2))).result == (1, 2)
    assert answered(unwatched, [iter((1, 2)), 3]).result == [[1, 2], 3]


def test_of_a_hundred_parts_the_memory_is_told(unwatched: StudentWatch) -> None:
    answer = answered(unwatched, list(range(1000, 1101)))
    assert (len(answer.memory), len(answer.live), len(answer.result)) == (100, 100, 101)


# How alike a class is.


def test_likeness_is_twice_what_is_common_by_the_sum() -> None:
    assert likeness(frozenset("abcd"), frozenset("ab")) == pytest.approx(2 * 2 / 6)
    assert likeness(frozenset(), frozenset()) == 0


def test_code_without_what_others_have() -> None:
    code = StudentCode({"f": frozenset("abc"), "g": frozenset("a")})
    assert code.without(frozenset("a")) == StudentCode({"f": frozenset("bc")})
    assert (code.size, code.all_shingles) == (3, frozenset("abc"))


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Compare submissions that have these likenesses, by pairs of letters."""

    def compare(names: str, shares: dict[str, float], size: int = 200) -> alike.ClassLikeness:
        codes = {
            name: StudentCode({"f": frozenset(f"{name}{k}" for k in range(size))}) for name in names
        }

        def of_pair(left: frozenset[str], right: frozenset[str]) -> float:
            if not left or not right:
                return 0.0
            pair = min(left)[0] + min(right)[0]
            return shares.get(pair, shares.get(pair[::-1], 0.0))

        monkeypatch.setattr(alike, "likeness", of_pair)
        monkeypatch.setattr(alike, "_code_of", lambda submission: codes[submission.name])
        return alike.compare_submissions([Submission(name, None) for name in names])

    return compare


def test_two_are_a_group_from_95_percent_on(compared: Any) -> None:
    (group,) = compared("abcd", {"ab": 0.95, "cd": 0.949}).groups
    assert group.students == ("a", "b")


def test_two_are_nearly_alike_from_85_percent_on(compared: Any) -> None:
    found = compared("abcd", {"ab": 0.85, "cd": 0.849})
    assert found.nearly == (alike.AlikePair(("a", "b"), 0.85),)


def test_a_group_has_its_least_and_its_most(compared: Any) -> None:
    found = compared("abcde", {"ab": 0.96, "bc": 0.99, "ac": 0.7, "de": 0.97})
    first, second = found.groups
    assert (first.students, first.least, first.most) == (("a", "b", "c"), 0.7, 0.99)
    assert (second.students, second.least, second.most) == (("d", "e"), 0.97, 0.97)


@pytest.mark.parametrize(("size", "is_short"), [(99, True), (100, False)])
def test_less_than_a_hundred_shingles_are_short(compared: Any, size: int, is_short: bool) -> None:
    (group,) = compared("ab", {"ab": 1.0}, size).groups
    assert (group.size, group.is_short, group.is_solution) == (size, is_short, False)


def test_each_has_the_one_that_it_is_most_like(compared: Any) -> None:
    found = compared("abcd", {"ab": 0.2, "ac": 0.3, "bc": 0.1})
    assert found.nearest == {
        "a": alike.Nearest("c", 0.3),
        "b": alike.Nearest("a", 0.2),
        "c": alike.Nearest("a", 0.3),
    }


def test_with_those_of_a_group_only_the_nearest_is_told(compared: Any) -> None:
    shares = {"ab": 1.0, "ac": 0.9, "bc": 0.92, "cd": 0.91}
    assert compared("abcd", shares).nearly == (
        alike.AlikePair(("b", "c"), 0.92),
        alike.AlikePair(("c", "d"), 0.91),
    )
