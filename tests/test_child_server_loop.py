"""The loop of a process that answers for an engine: driven over pipes, by an engine of sums."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.backends.served import child_server

# An engine whose world adds its command to its state at each step.
ENGINE = """
import numpy as np


def load(file, text, names):
    print("what an engine prints")
    return {"scale": 2.0}, {"version": "7"}, {name: np.arange(3.0) for name in names}


def edit(model, edits, flags):
    model["scale"] = float(edits["scale"])


class Simulation:
    memory, kept_memory, unavailable = [("m", 1)], ["m"], ["xpos"]

    def __init__(self, model):
        self.model, self.vector = model, np.zeros(2)

    def place(self, vector):
        self.vector = vector.copy()

    def state(self):
        return self.vector.copy()

    def command(self, ctrl):
        self.ctrl = ctrl

    def advance(self, steps, fastest):
        for taken in range(steps):
            if np.abs(self.vector).max() > fastest:
                return taken
            self.vector = self.vector + self.model["scale"] * self.ctrl
        return steps

    def forward(self):
        self.vector = -self.vector

    def derived(self, vector):
        if vector[0] > 100:
            raise RuntimeError("too  far\\n away")
        return {"twice": 2 * vector, "now": self.vector}
"""
JOB: dict[str, Any] = {"free": ()}
NONE: dict[str, np.ndarray] = {}


class Loop:
    """A process of the server: asked, and answering."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process = process

    def ask(self, verb: str, arrays: dict[str, Any] | None = None, **job: Any) -> tuple[Any, Any]:
        """Return the facts and the arrays of an answer."""
        child_server.send(self.process.stdin, {**JOB, "verb": verb, **job}, arrays or NONE)
        facts, answered, _ = child_server.receive(self.process.stdout, 0.0)
        return facts, answered


@contextmanager
def _serving(folder: Path) -> Iterator[Loop]:
    file = folder / "engine.py"
    file.write_text(ENGINE, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, child_server.__file__, str(file)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        try:
            yield Loop(process)
        finally:
            process.kill()


@pytest.fixture
def loop(tmp_path: Path) -> Iterator[Loop]:
    with _serving(tmp_path) as serving:
        yield serving


def _world(loop: Loop) -> int:
    facts, _ = loop.ask("load", file="a", text="", fields=())
    return loop.ask("make", model=facts["model"])[0]["world"]


def test_what_an_engine_prints_is_no_answer(loop: Loop) -> None:
    facts, fields = loop.ask("load", file="a", text="", fields=("mass",))
    assert facts["version"] == "7"
    np.testing.assert_array_equal(fields["mass"], [0, 1, 2])


def test_a_file_that_changed_is_refused(loop: Loop) -> None:
    digest = loop.ask("load", file="a", text="", fields=())[0]["digest"]
    assert "error" not in loop.ask("load", file="a", text="", fields=(), digest=digest)[0]
    facts, _ = loop.ask("load", file="a", text="", fields=(), digest="0")
    assert facts.keys() == {"error"}


def test_a_model_is_edited_before_worlds_are_made(loop: Loop) -> None:
    edits = {"scale": np.array(5.0)}
    facts, _ = loop.ask("load", edits, file="a", text="", fields=(), flags=())
    world = loop.ask("make", model=facts["model"])[0]["world"]
    run = {"steps": 1, "fastest": np.inf, "ahead": False, "world": world}
    _, states = loop.ask("run", {"ctrl": np.array([1.0, 2.0])}, **run)
    np.testing.assert_array_equal(states["before"], [5, 10])


def test_a_world_tells_what_it_remembers(loop: Loop) -> None:
    facts, _ = loop.ask("load", file="a", text="", fields=())
    made, _ = loop.ask("make", model=facts["model"])
    assert made["memory"] == [("m", 1)]
    assert (made["kept_memory"], made["unavailable"]) == (["m"], ["xpos"])


@pytest.mark.parametrize(("ahead", "names"), [(False, {"before"}), (True, {"before", "after"})])
def test_steps_are_taken_and_one_more_if_it_is_asked(
    ahead: bool, names: set[str], loop: Loop
) -> None:
    arrays = {"state": np.array([1.0, 2.0]), "ctrl": np.array([0.5, 1.0])}
    job = {"world": _world(loop), "steps": 3, "fastest": np.inf, "ahead": ahead}
    facts, states = loop.ask("run", arrays, **job)
    assert (facts["taken"], set(states)) == (3, names)
    np.testing.assert_array_equal(states["before"], [1 + 3, 2 + 6])
    np.testing.assert_array_equal(states.get("after", [5, 10]), [5, 10])


def test_steps_end_where_it_is_too_fast(loop: Loop) -> None:
    arrays = {"state": np.zeros(2), "ctrl": np.array([1.0, 0.0])}
    job = {"world": _world(loop), "steps": 9, "fastest": 3.0, "ahead": True}
    facts, states = loop.ask("run", arrays, **job)
    assert (facts["taken"], set(states)) == (2, {"before"})  # 2, 4: beyond 3


def test_what_is_derived_is_of_the_state_that_is_given(loop: Loop) -> None:
    world, state = _world(loop), np.array([1.0, 2.0])
    _, arrays = loop.ask("look", {"state": state}, world=world)
    np.testing.assert_array_equal(arrays["twice"], [2, 4])
    np.testing.assert_array_equal(arrays["now"], [0, 0])


def test_with_a_command_the_state_is_placed_and_derived_of(loop: Loop) -> None:
    arrays = {"state": np.array([1.0, 2.0]), "ctrl": np.zeros(2)}
    _, derived = loop.ask("look", arrays, world=_world(loop))
    np.testing.assert_array_equal(derived["now"], [-1, -2])  # by `forward`


def test_what_an_engine_raises_is_an_answer_in_one_line(loop: Loop) -> None:
    world = _world(loop)
    facts, arrays = loop.ask("look", {"state": np.array([101.0, 0])}, world=world)
    assert (facts, arrays) == ({"error": "too far away"}, {})
    assert "error" not in loop.ask("look", {"state": np.zeros(2)}, world=world)[0]


def test_an_error_without_words_is_told_by_its_kind(loop: Loop) -> None:
    facts, _ = loop.ask("make", model=0)
    assert facts == {"error": "0"}  # KeyError: the number
    facts, _ = loop.ask("nothing of the kind")
    assert facts["error"]


def test_what_nobody_needs_any_more_is_gone(loop: Loop) -> None:
    world = _world(loop)
    facts, _ = loop.ask("look", {"state": np.zeros(2)}, world=world, free=[world])
    assert facts == {"error": str(world)}


def test_the_process_ends_with_its_input(loop: Loop) -> None:
    _world(loop)
    loop.process.stdin.close()  # type: ignore[union-attr]  # it is a pipe
    assert loop.process.wait(10) == 0


@pytest.mark.skipif(not hasattr(select, "poll"), reason="pipes cannot be watched here")
def test_it_ends_in_the_midst_of_steps(loop: Loop) -> None:
    job = {"world": _world(loop), "steps": 10**9, "fastest": np.inf, "ahead": False}
    arrays = {"state": np.zeros(2), "ctrl": np.zeros(2)}
    child_server.send(loop.process.stdin, {**JOB, "verb": "run", **job}, arrays)
    loop.process.stdin.close()  # type: ignore[union-attr]  # it is a pipe
    assert loop.process.wait(10) == 0


def test_a_message_goes_through_a_pipe_as_it_is() -> None:
    inward, outward = os.pipe()
    sent = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([1, 2], dtype=np.int32)}
    with os.fdopen(inward, "rb") as source, os.fdopen(outward, "wb") as out:
        child_server.send(out, {"x": 1}, sent)
        facts, arrays, patience = child_server.receive(source, child_server.SPIN)
    assert facts == {"x": 1}
    for name, array in sent.items():
        assert arrays[name].dtype == array.dtype
        np.testing.assert_array_equal(arrays[name], array)
    assert patience <= child_server.SPIN + child_server.MORE
