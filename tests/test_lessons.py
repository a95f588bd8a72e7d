"""The path: its code runs as typed, its questions are answered by runs, its claims can fail."""

from __future__ import annotations

import contextlib
import fcntl
import io
import json
import os
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from rich.cells import cell_len
from rich.console import Console

import statemachine as sm
from statemachine.cli import lesson_path, main
from statemachine.course import asking, quiz
from statemachine.course.lessons import LESSONS, MOVED, PATH, _many_worlds, module
from statemachine.course.lessons.request import LessonRequest
from statemachine.course.lessons.session import CodeRun, LessonRun, load_line, page_of_lesson, take
from statemachine.course.quiz import RecordedReader
from statemachine.errors import BadInputError, StateMachineError, UnknownNameError
from statemachine.lab.recordings import record_scenario
from statemachine.lab.runs.interleaved_timing import Ratio
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.show import terminal
from statemachine.show.blocks import Code, Heading, Page, Printed, Question, Table, Text, Verdict
from statemachine.show.pictures import Traces
from statemachine.show.progress import progress

from .support.backends import each_of_both
from .support.claims import assert_has, assert_in, refused
from .support.files import written
from .support.pages import blocks, lesson_result, need_engines_of, shown, with_figures
from .support.processes import Cli, of_python, one_line
from .support.requirements import ROOT

_TIMED = {"time", "objects", "summary", "questions"}  # print wall times
_QUICK: dict[str, dict[str, Any]] = {
    "objects": {"most": 4},
    "time": {"steps": 200},
    "forward": {"further": True, "seconds": 0.4},
}


def _take(name: str, backend: str, **options: Any) -> tuple[Page, Any]:
    """The page of a lesson, and its run; the fields of its result are read as they come."""
    lesson = LESSONS[name]
    taken = take(
        lesson, sm.load(lesson.model, backend=backend), backend, _QUICK.get(name, {}) | options
    )
    return page_of_lesson(lesson, {backend: taken}), taken


def _repage(name: str, backend: str, result: Any) -> Page:
    """The page of a result that was changed."""
    return page_of_lesson(
        LESSONS[name], {backend: LessonRun(result=result, code="", printed="", arm=True)}
    )


def test_the_path_has_ten_lessons_in_the_order_of_the_course() -> None:
    assert [lesson.name for lesson in PATH] == [
        "nowhere", "objects", "state", "forward", "hold", "gravity", "reset", "replay", "time",
        "summary",
    ]  # fmt: skip


@pytest.mark.parametrize("name", MOVED)
def test_a_lesson_that_went_says_where_it_is(cli: Cli, name: str) -> None:
    command = MOVED[name].partition(" --")[0]
    for words in (("lesson", name), ("lesson", "--from", name)):
        one_line(cli(*words), f"statemachine {command}")
    assert command.split()[1] in LESSONS
    refused((UnknownNameError, f"statemachine {command}", lambda: LessonRequest(name)))


@pytest.mark.slow
def test_what_many_worlds_cost(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_many_worlds, "_MOST_APART", 2)
    monkeypatch.setattr(_many_worlds, "_ROUND", 0.002)
    fractions: list[float] = []
    lesson = LESSONS["objects"]
    model = sm.load(lesson.model, backend=backend)
    options = {"most": 4, "worlds": 2, "further": True}
    taken: Any = take(lesson, model, backend, options, progress=fractions.append)
    result, page = taken.result, page_of_lesson(lesson, {backend: taken})
    many, shared = result.further, model.capabilities.shared_model
    assert [cost.n for cost in many.costs] == ([1, 4] if shared else [1])
    rounds = _many_worlds._ROUNDS
    assert all(cost.step > 0 and cost.faster.rounds == rounds for cost in many.costs)
    assert 0 < min(fractions) <= max(fractions) <= 1
    (curves,) = blocks(page, Traces)
    assert list(curves.curves) == [backend]
    if not shared:
        many = with_figures(many, data_bytes=30e6, free_bytes=450e6)
        page = _repage("objects", backend, with_figures(result, further=many))
        assert any("450 MB" in text.text for text in blocks(page, Text))


def test_worlds_that_are_apart_fit_into_the_memory_that_is_free(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_many_worlds, "free_memory", lambda: 5 * 3 * 30e6)
    assert _many_worlds._limit(4096, 30e6) == (5, 5 * 3 * 30e6)


def test_a_row_of_energies_is_in_per_cent_or_in_powers_of_ten() -> None:
    page = _repage("energy", "mujoco", _on_mujoco("energy"))
    rows = [row[1:] for table in blocks(page, Table) for row in table.rows]
    notations = [{"%" in cell for cell in row if cell[0] in "+-"} for row in rows]
    assert {len(notation) for notation in notations} == {1}


@pytest.mark.slow
@pytest.mark.parametrize("name", [lesson.name for lesson in PATH])
def test_the_code_is_typed_run_and_questioned(name: str, backend: str) -> None:
    page, taken = _take(name, backend)
    shown, *_ = blocks(page, Code)
    assert "\n".join(shown.lines) == taken.code.rstrip("\n")
    assert max(map(cell_len, shown.lines)) <= 76  # indented by four
    assert f'backend="{backend}"' in taken.code
    (printed,) = blocks(page, Printed)
    assert printed.by_engine == {backend: taken.printed}
    assert taken.printed.strip()
    assert "Error" not in taken.printed
    question, *_ = blocks(page, Question)
    assert question.right is not None
    assert 2 <= len(question.choices) <= 4
    # A prediction comes before the answer.
    assert page.blocks.index(question) < page.blocks.index(printed)
    assert page.holds


@pytest.mark.slow
@pytest.mark.parametrize("name", [lesson.name for lesson in PATH if lesson.name not in _TIMED])
def test_what_is_shown_is_what_a_student_would_see(name: str, tmp_path: Path) -> None:
    _, taken = _take(name, "mujoco")
    assert of_python("-c", taken.code, folder=tmp_path, code=0).stdout == taken.printed


_BEAM = """<mujoco><worldbody><body name="beam"><joint name="swing" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 .4 0 0" size=".03"/></body></worldbody></mujoco>"""


def _without_rate(printed: str) -> str:
    """Return what a program printed, without the one figure that is another in each run."""
    return re.sub(r"\d+(?= times real time)", "…", printed)


@pytest.mark.slow
@pytest.mark.parametrize("name", [lesson.name for lesson in PATH])
def test_the_program_of_a_lesson_runs_as_it_is_printed(name: str, cli: Cli, tmp_path: Path) -> None:
    """Nothing else is printed, and it prints the figures of the page; times are this run's own."""
    program = cli("lesson", name, "--code", code=0).stdout
    lesson = LESSONS[name]
    taken = take(lesson, sm.load(lesson.model, backend="mujoco"), "mujoco")
    printed = of_python("-", typed=program, folder=tmp_path, code=0).stdout
    assert program == taken.code
    assert _without_rate(printed) == _without_rate(taken.printed)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--json", "--code prints the code alone: leave out --json"),
        ("--calls", "leave out --calls"),
        ("--plot a.svg", "leave out --plot"),
        ("--record a.json", "leave out --record"),
        ("--backend mujoco --backend pybullet", "takes one --backend"),
    ],
)
def test_a_program_is_printed_alone_and_for_one_engine(here: Cli, words: str, says: str) -> None:
    done = here("lesson", "state", "--code", *words.split())
    assert (done.returncode, done.stdout) == (2, "")
    assert says in done.stderr


@pytest.mark.usefixtures("bullet")
def test_a_program_is_written_for_what_was_asked(here: Cli, tmp_path: Path) -> None:
    file = written(tmp_path / "beam.xml", _BEAM)
    words = ("--backend", "pybullet", "--model", str(file), "--value", ".3")
    program = here("lesson", "forward", "--code", *words, code=0).stdout
    assert f'model = sm.load("{file}", backend="pybullet")' in program
    assert "model.joint_id('swing')" in program
    assert "] = 0.3\n" in program
    assert not re.search(r"^ +(?:import|model)", program, re.M)


def test_an_error_in_the_code_ends_the_lesson() -> None:
    code = "import statemachine as sm\nprint(1)\nsm.step(1, 2)\nprint(2)\n"
    with CodeRun(code, sm.load("so101")) as play, pytest.raises(TypeError):
        play()
    assert play.printed == "1\n"


def test_a_lesson_sees_the_lines_of_its_code_and_each_step(arm: sm.Model) -> None:
    code = (
        "import statemachine as sm\nmodel = sm.load('so101')\ndata = sm.make_data(model)\n"
        "data.ctrl[1] = 0.1\nsm.step(model, data, 3)\nprint(data.time)\n"
    )

    times: list[float] = []

    def each_step(model: sm.Model, data: sm.Data) -> None:
        times.append(data.time)
        sm.step(model, data)

    with CodeRun(code, arm) as watched, CodeRun(code, arm) as alone:
        lines = list(watched.lines(each_step))
        alone()
        assert lines == code.splitlines()
        assert times == [0.0, 0.005, 0.01]
        assert watched.names["model"] is arm
        data, other = (play.worlds[0][1] for play in (watched, alone))
        assert np.array_equal(data.qpos, other.qpos)  # three steps, or one call for three
    refused((StateMachineError, "closed", lambda: sm.step(arm, data)))


# The lesson on a recording fits for seconds.
_SLOW = {"recording"}
_RUNS = [pytest.param(name, marks=[pytest.mark.slow] if name in _SLOW else []) for name in LESSONS]


@pytest.mark.parametrize("name", _RUNS)
def test_the_run_of_a_lesson_is_the_one_that_is_seen(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    need_engines_of(name)
    played: list[str] = []
    lines = CodeRun.lines

    def once(self: CodeRun, *watch: Any) -> Iterator[str]:
        played.append(self._code)
        return lines(self, *watch)

    monkeypatch.setattr(CodeRun, "lines", once)
    _, taken = _take(name, "mujoco")
    assert played.count(taken.code) == 1


@pytest.mark.parametrize(
    ("lesson", "of", "name"),
    [
        ("hold", lambda found: found.qpos[-1], "hold"),
        ("gravity", lambda found: found.servos_on.qpos, "droop"),
        ("gravity", lambda found: found.servos_off.qpos, "gravity"),
        ("gravity", lambda found: found.longer["no contacts"].qpos, "fall"),
    ],
)
def test_a_lesson_runs_what_is_compared(
    lesson: str, of: Callable[[Any], np.ndarray], name: str, scene: sm.Model
) -> None:
    seconds = 0.5 if lesson == "gravity" else 2.0
    options = {"longer": seconds, "further": True} if lesson == "gravity" else {}
    found = of(lesson_result(lesson, scene, seconds=seconds, **options))
    trace = record_scenario(SCENARIOS[name], scene, seconds=seconds)
    assert found.tobytes() == trace.qpos[-1].tobytes()


def test_the_line_that_loads_a_model() -> None:
    assert load_line("a", "b", "c d") == 'sm.load("a", backend="b", menagerie=\'c d\')'
    assert eval(load_line('x"y\\z', "b"), {"sm": type("S", (), {"load": lambda m, **_: m})})


def _without_lag(further: Any) -> Any:
    """As if each step left what belongs to the state after it."""
    lag = further.lag
    return with_figures(further, lag=with_figures(lag, of_before=dict.fromkeys(lag.of_before, 0)))


def _anew(further: Any) -> Any:
    """As if a call made the inputs anew."""
    return with_figures(further, effects=with_figures(further.effects, same_arrays=False))


Change = Callable[[Any], Any]
# For each claim a result that belies it: the page must say so.
_BELIED: dict[str, tuple[str, Change]] = {
    "worlds disturb each other": ("objects", lambda r: with_figures(r, alone=False)),
    "the model changes": ("objects", lambda r: with_figures(r, constant=False)),
    "a fresh arm is somewhere": ("nowhere", lambda r: with_figures(r, first=r.second)),
    "a fresh Data is not empty": ("nowhere", lambda r: with_figures(r, empty=False)),
    "forward changes what is stored": ("nowhere", lambda r: with_figures(r, stored=False)),
    "forward computes something else": ("nowhere", lambda r: with_figures(r, repeats=False)),
    "qpos is a copy": (
        "forward",
        lambda r: with_figures(r, written=with_figures(r.written, view=r.written.copy)),
    ),
    "the engine has another array": (
        "forward",
        lambda r: with_figures(r, written=with_figures(r.written, in_engine=0.0)),
    ),
    "an array is made anew": ("forward", lambda r: with_figures(r, further=_anew(r.further))),
    "a program prints something else": (
        "summary",
        lambda r: with_figures(r, changed_lines=("replay",)),
    ),
    "readings 3 and 4 are equal": ("forward", lambda r: with_figures(r, equal=((2, 3),))),
    "a step leaves what is new": (
        "forward",
        lambda r: with_figures(r, further=_without_lag(r.further)),
    ),
    "a reset forgets the time": (
        "reset",
        lambda r: with_figures(r, restored=("qpos", "qvel", "ctrl")),
    ),
    "a reset computes": ("reset", lambda r: with_figures(r, empty=False)),
    "a reset has another future": ("reset", lambda r: with_figures(r, same_future=False)),
    "time passes by itself": ("time", lambda r: with_figures(r, passed=0.2)),
    "pacing changes the physics": ("time", lambda r: with_figures(r, identical=False)),
    "a run does not repeat": ("replay", lambda r: with_figures(r, second_run=r.first_run + 1)),
    "forces do not balance": (
        "gravity",
        lambda r: with_figures(
            r,
            servos_on=with_figures(
                r.servos_on, forces=with_figures(r.servos_on.forces, actuator=0.0)
            ),
        ),
    ),
}


@cache
def _on_mujoco(name: str) -> Any:
    """What a lesson finds on MuJoCo."""
    return _take(name, "mujoco")[1].result


@pytest.mark.parametrize("claim", _BELIED)
def test_a_result_that_belies_a_claim_fails_it(claim: str) -> None:
    name, change = _BELIED[claim]
    result = _on_mujoco(name)
    assert _repage(name, "mujoco", result).holds
    assert not _repage(name, "mujoco", change(result)).holds


def _ended_equal(result: Any) -> Any:
    """As if the first broken run ended in the same bits."""
    first, *others = result.breaks
    return with_figures(result, breaks=(with_figures(first, end=0.0, close=True), *others))


def test_a_difference_that_dies_out_is_no_fault_of_the_lesson() -> None:
    page = _repage("replay", "mujoco", _ended_equal(_on_mujoco("replay")))
    assert page.holds
    assert "In 1 of 2 broken runs" in shown(page)


def test_writing_the_number_that_stands_there_is_no_fault_of_the_lesson() -> None:
    page, taken = _take("forward", "mujoco", value=0.0)
    assert taken.result.written.copy == 0.0
    assert page.holds


_QUIET = Ratio("null", 1.0, 0.99, 1.01, 20)


@pytest.mark.parametrize(
    ("name", "changes", "right"),
    [
        ("forward", lambda _: {}, 1),
        ("forward", lambda _: {"equal": ((2, 3),)}, 2),
        ("forward", lambda _: {"equal": ()}, None),
        ("nowhere", lambda _: {}, 0),
        ("nowhere", lambda result: {"first": result.second}, 1),
        ("summary", lambda _: {}, 1),
        ("summary", lambda _: {"changed_lines": ("replay", "time")}, None),
        ("time", lambda _: {"passed": 0.2}, 1),
        ("gravity", lambda _: {}, 2),
        ("gravity", lambda result: {"servos_on": result.servos_off}, 0),
    ],
)
def test_the_right_choice_is_computed(name: str, changes: Change, right: int | None) -> None:
    result = _on_mujoco(name)
    page = _repage(name, "mujoco", with_figures(result, **changes(result)))
    assert blocks(page, Question)[0].right == right


def _rate(median: float, rounds: int = 20) -> Ratio:
    """So many times real time, give or take a tenth of it."""
    return Ratio("real time", median, 0.9 * median, 1.1 * median, rounds)


@pytest.mark.parametrize(
    ("rate", "right"),
    [
        (_rate(0.5), 0),
        (_rate(4.0), 1),
        (_rate(90.0), 2),
        (_rate(1.05), None),  # slower than the real world, or faster?
        (_rate(9.5), None),
        (_rate(90.0, rounds=4), None),  # too few to tell
    ],
)
def test_how_many_times_real_time_is_told_if_the_rounds_can_tell_it(
    rate: Ratio, right: int | None
) -> None:
    page = _repage("time", "mujoco", with_figures(_on_mujoco("time"), rate=rate))
    question = blocks(page, Question)[1]
    assert (question.right, question.undecided) == (right, right is None)


@pytest.mark.parametrize(
    ("loop", "right"),
    [
        (Ratio("loop", 0.5, 0.4, 0.6, 20), 0),
        (Ratio("loop", 1.5, 1.4, 1.6, 20), 1),
        (Ratio("loop", 10.0, 9.9, 10.1, 20), 2),
        (Ratio("loop", 1.02, 1.0, 1.04, 20), None),  # within the noise
        (Ratio("loop", 2.0, 1.9, 2.1, 20), None),
        (Ratio("loop", 1.5, 1.4, 1.6, 4), None),
    ],
)
def test_what_a_loop_costs_is_told_if_it_is_more_than_the_noise(
    loop: Ratio, right: int | None
) -> None:
    result = _take("time", "mujoco", further=True)[1].result
    cost = with_figures(
        result.further, loop=loop, null=_QUIET, told_apart=loop.differs_from(_QUIET)
    )
    page = _repage("time", "mujoco", with_figures(result, further=cost))
    question = blocks(page, Question)[2]
    assert (question.right, question.undecided) == (right, right is None)


def test_a_prediction_that_the_runs_cannot_decide_is_not_scored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    open_question = Question("how fast?", ("slow", "fast"), None, "it varies", undecided=True)
    monkeypatch.setattr("builtins.input", Mock(side_effect=["b"]))
    reader = RecordedReader(tmp_path / "mine.json", "time")
    terminal.show(Page("t", "o", [open_question, Text("measured")]), "", reader)
    assert "it varies" in capsys.readouterr().out
    assert_has(json.loads((tmp_path / "mine.json").read_text()), score=0, of=0)


def test_the_code_of_time_counts_the_steps_that_the_page_does() -> None:
    page, taken = _take("time", "mujoco", steps=123)
    assert "sm.step(model, data, 123)" in taken.code
    options = {"steps": 50_001, "realtime": False, "seconds": None}
    long = module("time").code(sm.load("so101"), options, "…")
    assert "for n in [20000] * 2 + [10001]:" in long  # Ctrl-C is heard between
    assert any("123 steps" in text.text for text in blocks(page, Text))


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("forward", lambda r: with_figures(r, equal=())),
        ("state", lambda r: with_figures(r, joints=(with_figures(r.joints[0], qvel_start=1),))),
        ("replay", lambda r: with_figures(r, second_run=r.first_run + 1)),
        ("gravity", lambda r: with_figures(r, servos_on=r.servos_off)),
        ("objects", lambda r: with_figures(r, alone=False)),
        ("time", lambda r: with_figures(r, identical=False)),
    ],
)
def test_an_answer_that_its_run_belies_is_none(part: str, change: Change) -> None:
    result = _on_mujoco("questions")
    answers = with_figures(result.answers, **{part: change(getattr(result.answers, part))})
    page = _repage("questions", "mujoco", with_figures(result, answers=answers))
    assert not page.holds
    assert Counter(question.right is None for question in blocks(page, Question)) == {
        False: 5,
        True: 1,
    }


@pytest.mark.slow
def test_what_catches_the_falling_arm() -> None:
    """Against the course's text: the floor does, and the arm does not settle on it."""
    page, taken = _take("gravity", "mujoco", longer=100.0, further=True)
    touching, free = (taken.result.longer[name] for name in ("contacts", "no contacts"))
    limit = sm.load("so101/scene").jnt_range[1, 1]
    assert free.position[-1] == pytest.approx(limit, abs=1.7e-3)
    assert free.forces.limit == pytest.approx(free.forces.bias, abs=1e-3)
    assert np.degrees(touching.position[4]) == pytest.approx(23.92, abs=0.01)
    assert np.degrees(touching.position[-1]) > 50
    (said,) = (text.text for text in blocks(page, Text) if "catches" in text.text)
    assert_in(said, "the contact", "23.92°", "53.89°")


@each_of_both
@pytest.mark.parametrize("further", [False, True])
def test_forward_computes_what_it_shows(further: bool, backend: str) -> None:
    page, taken = _take("forward", backend, further=further, seconds=0.5)
    found = taken.result.further
    assert (found is not None) == further
    if found is not None:
        assert len(found.lag.time) == 100
        own = {"write", "step"} if backend != "mujoco" else set()
        assert {answer.question for answer in found.itself} == own
    assert bool(blocks(page, Heading)) == further
    said = any("lesson forward --further" in text.text for text in blocks(page, Text))
    assert said is not further
    assert page.holds


@each_of_both
def test_of_which_moment_a_step_leaves_what(backend: str) -> None:
    """Against the course's figure: of the state before, 9.95 mm behind at worst."""
    page, taken = _take("forward", backend, seconds=2.0)
    lag = taken.result.further.lag
    assert lag.distance.max() == pytest.approx(9.95e-3, abs=0.02e-3)
    assert lag.of_before["site_xpos"] == lag.of_before["contacts"] == 400
    assert lag.of_after["site_xpos"] < 400
    assert any("9.95 mm behind" in verdict.text for verdict in blocks(page, Verdict))
    changes = {change.name: change for change in taken.result.further.changes}
    assert changes["qpos"].write
    assert not any(change.write for change in changes.values() if not change.stored)
    assert not any(change.forward for change in changes.values() if change.stored)
    for name in ("xpos", "site_xpos", "qacc"):
        assert_has(changes[name], forward=True, step=True)
    assert all(changes[name].same for name in ("xpos", "site_xpos", "contacts"))


def test_what_keyframe_0_of_the_public_scene_is(here: Cli, menagerie: Path) -> None:
    done = here("lesson", "reset", "--menagerie", str(menagerie), code=0)
    assert "is mistaken" in " ".join(done.stdout.split())


_SLIDE = """<mujoco><option timestep="0.001"/><worldbody><body><joint name="s" type="slide"/>
    <geom size=".1"/></body></worldbody><actuator><position joint="s" kp="9"/></actuator>
    <keyframe><key time="2"/></keyframe></mujoco>"""


def test_a_slide_is_printed_in_millimetres_and_a_reset_tells_its_own_time(tmp_path: Path) -> None:
    file = written(tmp_path / "slide.xml", _SLIDE)
    model = sm.load(file)
    options = {"joint": "s", "seconds": 0.5, "longer": 0}
    taken: Any = take(LESSONS["gravity"], model, "mujoco", options, str(file))
    assert float(taken.printed.split()[0]) == round(1000 * taken.result.servos_on.position[-1], 2)
    reset = take(LESSONS["reset"], model, "mujoco", {}, str(file))
    page = _repage("reset", "mujoco", reset.result)
    assert any("0.1 s" in text.text for text in blocks(page, Text))
    assert ["0.1 s" in question.choices[1] for question in blocks(page, Question)] == [True]
    both = page_of_lesson(LESSONS["reset"], {"mujoco": reset, "other": reset})
    assert all(table.rows for table in blocks(both, Table))


def test_the_second_engine_is_named_after_what_follows_the_load() -> None:
    line = f"model = {load_line('so101', 'mujoco', 'robots')}.replace(timestep=0.01)"
    taken = with_figures(
        take(LESSONS["reset"], sm.load("so101"), "mujoco"),
        code=f"import statemachine as sm\n\n{line}\n",
    )
    page = page_of_lesson(LESSONS["reset"], {"mujoco": taken, "other": taken})
    (shown,) = blocks(page, Code)
    assert list(shown.lines)[2:] == [f'{line}  # then "other"']


@pytest.mark.slow
@pytest.mark.parametrize(
    "body",
    ["", "<body><freejoint/><geom size='.1'/></body>", "<body><joint/><geom size='.1'/></body>"],
)
def test_a_reset_of_a_model_that_lacks_something(cli: Cli, tmp_path: Path, body: str) -> None:
    file = written(tmp_path / "small.xml", f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    for lesson in ("reset", "objects", "state", "time"):
        cli("lesson", lesson, "--model", str(file), code=0)


@pytest.mark.slow
def test_our_keyframe_holds_the_box(backend: str) -> None:
    held, pickup = _take("reset", backend, further=True)[1].result.scenes
    assert_has(held, held=True, on_world=0, robot_steps=held.nstep)
    assert abs(held.rise) < 1e-3
    assert_has(pickup, held=False, on_robot=0)


def test_real_time_is_the_loops_affair(cli: Cli) -> None:
    began = time.monotonic()
    done = cli("lesson", "time", "--realtime", "--seconds", "0.8", code=0)
    assert time.monotonic() - began >= 0.8
    assert_in(done.stdout, "s simulated in", "0.8 s")


@pytest.mark.usefixtures("bullet")
def test_options_may_stand_before_the_name(here: Cli) -> None:
    for words, engine in (
        ("--backend pybullet nowhere", "pybullet"),
        ("nowhere --backend pybullet", "pybullet"),
        ("--backend pybullet nowhere --backend mujoco", "mujoco"),
    ):
        assert f"Printed by {engine}:" in here("lesson", *words.split()).stdout


# --- at a terminal


_MORE = "Enter for more"


def _at_a_terminal(
    *words: str, typed: list[tuple[str, str]], columns: int = 80, lines: int = 24, more: bool = True
) -> str:
    """Run the command on a pseudo-terminal; type each answer when its prompt appears.

    With `more`, Enter is typed wherever it waits for the next screenful.
    """
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm"}
    for name in ("COLUMNS", "LINES"):
        environment.pop(name, None)

    def begin() -> None:  # for Ctrl-C, which a job in the background ignores
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    process = subprocess.Popen(
        [sys.executable, "-m", "statemachine", *words],
        stdin=theirs, stdout=theirs, stderr=theirs, env=environment, start_new_session=True,
        preexec_fn=begin,  # noqa: PLW1509
    )  # fmt: skip
    os.close(theirs)
    seen, answered, waiting, deadline = "", 0, list(typed), time.monotonic() + 600
    try:
        while time.monotonic() < deadline:
            if select.select([ours], [], [], 0.2)[0]:
                try:
                    chunk = os.read(ours, 65536)
                except OSError:  # closed at the other end
                    break
                if not chunk:
                    break
                seen += chunk.decode(errors="replace")
            last = seen[answered:].rpartition("\n")[2]
            if waiting and waiting[0][0] in last:
                # Python loses a Ctrl-C between the prompt that it shows and the read behind it.
                time.sleep(0.5 if waiting[0][1] == "\x03" else 0.0)
                os.write(ours, waiting.pop(0)[1].encode())
                answered = len(seen)
            elif more and _MORE in last:
                os.write(ours, b"\n")
                answered = len(seen)
    finally:
        process.kill()
        process.wait()
        os.close(ours)
    assert (waiting, time.monotonic() < deadline) == ([], True), seen  # it ended by itself
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", seen)


_ASKED = "Your prediction"
_LATER = r"Go on later with: [^\n]*statemachine lesson --from "


def _quick_of_state(cases: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Return cases of which those of the lesson on the state are quick."""
    return [
        case if case[0].startswith("state") else pytest.param(*case, marks=pytest.mark.slow)
        for case in cases
    ]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.parametrize(
    ("words", "typed", "options", "shown", "absent"),
    _quick_of_state(
        [
            (
                "state",
                [(_ASKED, "c\n")],
                {},
                "How many has qvel.*Your pred.*13 12 6.*You predicted it",
                "",
            ),
            ("state", [(_ASKED, "x\n"), (_ASKED, "a\n")], {}, "You predicted a; it is c", ""),
            ("state", [(_ASKED, "\n")], {}, r"Answer: c\) ", "You predicted"),  # passed
            ("state --no-questions", [], {}, "", _ASKED),
            ("state --no-questions", [], {"lines": 9}, "", _MORE),
            ("state", [(_ASKED, "\x03")], {}, "", "13 12 6"),
            # All but the verdict has room.
            (
                *("state", [(_ASKED, "a\n")], {"lines": 200}),
                *(f"You predicted a; it is c((?!Next:).)*{_MORE}.*Next:", f"{_MORE}.*{_MORE}"),
            ),
            ("state", [(_ASKED, "a\n"), (_MORE, "q\n")], {"more": False}, "", "Next:"),
            (
                *("state", [(_ASKED, "a\n"), (_MORE, "x\n")], {}),
                *(f"{_MORE}.*press Enter alone.*{_MORE}", ""),
            ),
            (
                *("hold --further", [(_ASKED, "a\n")], {}),
                *(r"You predicted a; it is c((?!You predicted).)*A result depends", "You had"),
            ),
            (  # two questions, one after the other
                *("time --steps 200", [(_ASKED, "a\n"), (_ASKED, "b\n")], {}),
                *(r"times real time.*You predicted it: a.*You predicted( it: b|\s+b)", "You had"),
            ),
            (  # three are predicted, and not more
                *("questions", [(_ASKED, "a\n")] * 6, {}),
                *(
                    r"(You predicted it.*){3}You had 3 of 6 right\.",
                    "Before you read on|(You predicted it.*){4}",
                ),
            ),
            (  # a long question, which is wrapped
                *("hold", [(_ASKED, "\n")], {"columns": 50}),
                *(
                    rf"Before you read on((?!{_ASKED})[^\n]*\n){{4}}",
                    rf"Before you read on((?!{_ASKED}).)*[^\r\n]{{51}}",
                ),
            ),
            (
                *("--from state", [(_ASKED, "a\n"), (_MORE, "q\n")], {"more": False}),
                *(f"{_LATER}state", "4 of 10"),
            ),
            (
                "--from time",
                [(_ASKED, "q\n")],
                {},
                f"9 of 10.*{_LATER}time",
                "10 of 10",
            ),
            (
                *("--from time --record {tmp_path}/mine.json", [(_ASKED, "q\n")], {}),
                *(rf"{_LATER}time --record\s\S*mine\.json", "10 of 10"),
            ),
            (
                "",
                [
                    *((_ASKED, "b\n"), ("Enter for lesson 2", "\n")),
                    *((_ASKED, "\n"), ("Enter for lesson 3", "q\n")),
                ],
                *({}, f"1 of 10, nowhere: .*2 of 10, objects: .*{_LATER}state", "3 of 10"),
            ),
        ]
    ),
)
def test_what_a_reader_at_a_terminal_is_asked_and_shown(
    tmp_path: Path,
    words: str,
    typed: list[tuple[str, str]],
    options: dict[str, Any],
    shown: str,
    absent: str,
) -> None:
    """A prediction is asked for before the answer, and each page waits for its reader."""
    seen = _at_a_terminal(
        "lesson", *words.format(tmp_path=tmp_path).split(), typed=typed, **options
    )
    assert re.search(shown, seen, re.S)
    assert not absent or not re.search(absent, seen, re.S)


def _screens(seen: str, columns: int) -> list[int]:
    """Rows between one stop and the next; the prompt's own are counted."""
    found = [0]
    for raw in seen.split("\n"):
        line = raw.rstrip("\r").rpartition("\r")[2]  # what a bar of progress left
        found[-1] += max(-(-cell_len(line) // columns), 1)
        if "Your prediction" in line or "(q to stop)" in line:
            found.append(0)
    return found


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.parametrize(
    ("lesson", "columns", "lines"),
    [
        ("state", 80, 24),
        ("state", 40, 24),
        ("state", 80, 9),
        ("state", 40, 7),
        ("state", 120, 30),
        pytest.param("gravity", 80, 24, marks=pytest.mark.slow),
        pytest.param("questions", 80, 24, marks=pytest.mark.slow),
        pytest.param("questions", 40, 8, marks=pytest.mark.slow),
    ],
)
def test_nothing_scrolls_away_unread(lesson: str, columns: int, lines: int) -> None:
    typed = [("Your prediction", "a\n")] * (6 if lesson == "questions" else 1)
    seen = _at_a_terminal("lesson", lesson, typed=typed, columns=columns, lines=lines)
    *screens, _ = _screens(seen, columns)  # the last is the shell's
    # No more than a window, and no line or two above a prompt.
    assert (3 if lines >= 20 else 0) < min(screens) <= max(screens) <= lines
    assert re.search(r"You\s+predicted", seen)


def test_a_verdict_has_no_blanks_behind_it_in_a_terminal() -> None:
    console = Console(force_terminal=True, width=80, file=io.StringIO())
    text = terminal._text(console, [Verdict("True.", True)])
    assert re.sub(r"\x1b\[[0-9;]*m", "", text) == "\n✓ True.\n"


@pytest.mark.parametrize(
    ("rows", "blocks", "ends"),
    [
        ([1] * 23, {0}, [23]),
        ([1] * 24, {0}, [12, 24]),  # not 23 and a line alone
        ([1] * 24, {0, 22}, [12, 24]),  # nor 22 and two
        ([1] * 30, {0, 14}, [14, 30]),  # a block whole
        ([1] * 30, {0, 29}, [15, 30]),
        ([20, *[1] * 10], {1}, [1, 11]),  # under what stands there already
        ([1, 40, 1], {0, 1, 2}, [1, 2, 3]),  # a line that no window has room for
    ],
)
def test_windows_are_filled_evenly(rows: list[int], blocks: set[int], ends: list[int]) -> None:
    assert quiz.windows(rows, blocks, 23) == ends


@pytest.mark.parametrize(
    "figure",
    [
        ["    import time\n", "\n", *["    step()\n"] * 8],
        [" ┌──┐  title\n", *[" │  │\n"] * 8, " └──┘\n"],
        [" +--+\n", *[" |  |\n"] * 8, " +--+\n"],
    ],
)
def test_a_program_and_a_diagram_stay_on_one_screen(figure: list[str]) -> None:
    lines = [*["text\n"] * 9, "\n", *figure, "\n", *["text\n"] * 9]
    begin, end = 10, 10 + len(figure)
    ends = quiz.windows([1] * len(lines), {0}, 15, quiz.cuts(lines))
    assert not {*range(begin + 1, end)} & {*ends}
    # Where it has no room it is cut, and nothing is lost.
    ends = quiz.windows([1] * len(lines), {0}, 5, quiz.cuts(lines))
    assert {*range(begin + 1, end)} & {*ends}
    assert ends[-1] == len(lines)


def test_a_window_does_not_end_at_an_empty_line_of_a_program() -> None:
    lines = ["text\n", "\n", "    first()\n", "\n", "    second()\n", "\n", "text\n"]
    assert quiz.cuts(lines) == {3, 4}


@pytest.mark.parametrize("count", [2, 3, 4])
def test_the_prompt_names_the_last_of_the_letters(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    prompts: list[str] = []
    monkeypatch.setattr("builtins.input", lambda prompt: prompts.append(prompt) or "")
    quiz.Reader().ask(Question("?", tuple("wxyz"[:count]), 0, ""))
    assert [re.findall(r"a-(\w)", prompt) for prompt in prompts] == [["abcd"[count - 1]]]


def test_who_types_something_where_enter_goes_on_is_told_so_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("builtins.input", Mock(side_effect=["what?", ""]))
    quiz.Reader().go_on()
    assert len(capsys.readouterr().out.splitlines()) == 1


def test_a_bar_of_progress_takes_nothing_of_what_is_printed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr("statemachine.show.progress_bar.PATIENCE", -1.0)
    with progress("x") as report:
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            report(0.5)
            print("hello")
        report(1.0)
    assert printed.getvalue() == "hello\n"


def test_answers_that_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    question = Question("?", ("x", "y"), 0, "")
    monkeypatch.setattr("builtins.input", Mock(side_effect=["3", "", "B) "]))
    assert quiz.Reader().ask(question) is None
    assert quiz.Reader().ask(question) == 1

    monkeypatch.setattr("builtins.input", Mock(side_effect=EOFError))
    assert quiz.Reader().ask(question) is None
    refused((asking.Stopped, "", lambda: quiz.Reader().go_on()))
    monkeypatch.setattr("builtins.input", lambda _: "q")
    refused((asking.Stopped, "", lambda: quiz.Reader().ask(question)))


def test_a_lesson_that_says_no_is_the_exit_code_of_the_path(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = []

    def take_lesson(request: LessonRequest) -> tuple[Page, dict[str, Any]]:
        ran.append(request.name)
        return Page("t", "o", [Verdict("v", request.name != "hold")]), {"mujoco": request.name}

    monkeypatch.setattr(lesson_path, "take_lesson", take_lesson)
    assert main(["lesson"]) == 1
    assert ran == [lesson.name for lesson in PATH]
    ran.clear()
    assert main(["lesson", "--from", "gravity", "--json"]) == 0
    assert ran == [lesson.name for lesson in PATH[5:]]
    assert '"gravity": {\n    "mujoco": "gravity"' in capsys.readouterr().out


@pytest.fixture
def short_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every lesson is one question, for somebody at a terminal."""
    monkeypatch.setattr(
        lesson_path,
        "take_lesson",
        lambda _request: (Page("t", "o", [Question("q", ("a", "b"), 0, "because")]), {}),
    )
    monkeypatch.setattr(asking, "can_ask", lambda: True)


@pytest.mark.usefixtures("short_path")
def test_the_path_waits_before_each_lesson(monkeypatch: pytest.MonkeyPatch) -> None:
    prompts: list[str] = []
    monkeypatch.setattr("builtins.input", lambda prompt: prompts.append(prompt) or "")
    monkeypatch.setattr(shutil, "get_terminal_size", lambda **_: os.terminal_size((80, 24)))
    assert main(["lesson", "--from", "time"]) == 0
    assert [prompt for prompt in prompts if "lesson 10" in prompt]


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_what_is_typed_before_a_question_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = pty.openpty()
    with open(theirs) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        monkeypatch.setattr("builtins.input", lambda _: terminal.readline())
        os.write(ours, b"b\n")  # while the run computes
        threading.Timer(0.5, os.write, (ours, b"a\n")).start()
        assert quiz.Reader().ask(Question("?", ("x", "y"), 0, "")) == 0
    os.close(ours)


def test_answers_are_told_where_nobody_is_asked(here: Cli) -> None:
    assert here("lesson", "questions").stdout.count("Answer: ") == 6


_SMALL = {
    "objects": {"worlds": 2},
    "forward": {"further": True, "seconds": 0.005},
    "hold": {"seconds": 0.005},
    "gravity": {"seconds": 0.005, "longer": 0.0},
    "replay": {"steps": 1},
    "time": {"realtime": True, "seconds": 0.005, "steps": 1},
}


@pytest.mark.parametrize("name", _SMALL)
def test_the_code_runs_with_the_smallest_options(name: str) -> None:
    assert _take(name, "mujoco", **_SMALL[name])[1].printed


@pytest.mark.parametrize("steps", [1, 40])
@pytest.mark.parametrize("way", ["extra-step", "late-ctrl"])
def test_broken_code_differs_as_its_page_says(way: str, steps: int) -> None:
    _, taken = _take("replay", "mujoco", steps=steps, **{"break": way})
    assert float(taken.printed.split()[-1]) == taken.result.difference[-1] > 0
    assert max(map(cell_len, taken.code.splitlines())) <= 76


def test_two_worst_joints_are_named() -> None:
    page, taken = _take("hold", "mujoco")
    target, free = taken.result.target, taken.result.without_contacts
    (said,) = (text.text for text in blocks(page, Text) if "without contacts" in text.text)
    for gaps in (taken.result.qpos[-1] - target, free - target):
        joint = int(np.argmax(np.abs(gaps)))
        assert f"{taken.result.joints[joint]}, by {np.degrees(abs(gaps[joint])):.2f}°" in said


@pytest.mark.usefixtures("matplotlib")
def test_pictures_of_a_lesson(tmp_path: Path, here: Cli) -> None:
    words = "lesson", "hold", "--no-questions", "--plot"
    files = [tmp_path / "one.svg", tmp_path / "two.svg"]
    assert [here(*words, file).returncode for file in files] == [0, 0]
    assert files[0].read_bytes() == files[1].read_bytes()


# Predictions that are recorded


ONE = Question("how many?", ("1", "2"), 1, "counted")
NONE = Question("which?", ("x", "y"), None, "neither")


def test_the_first_answer_counts_and_a_session_is_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.json"
    monkeypatch.setattr("builtins.input", Mock(side_effect=["", "a", "b", "b"]))
    reader = RecordedReader(file, "state")
    assert json.loads(file.read_text())["of"] == 0
    assert reader.ask(ONE) is None  # passed: no answer
    assert json.loads(file.read_text())["of"] == 0
    assert reader.ask(ONE) == 0
    again = RecordedReader(file, "state")
    capsys.readouterr()
    assert again.ask(ONE) == 1  # now right, but the first counts
    assert "mine.json keeps: 1" in capsys.readouterr().out
    assert_has(json.loads(file.read_text()), score=0, of=1)
    again.lesson = "reset"
    assert again.ask(NONE) == 1
    answers = [
        {"lesson": "state", "question": "how many?", "predicted": "1", "found": "2",
         "right": False},
        {"lesson": "reset", "question": "which?", "predicted": "y", "found": None,
         "right": False},
    ]  # fmt: skip
    assert_has(json.loads(file.read_text()), score=0, of=2, answers=answers)


@pytest.mark.parametrize(
    "text", ["", "[]", '{"kind": "x"}', '{"kind": "statemachine predictions", "answers": [1]}']
)
def test_another_file_is_not_overwritten(tmp_path: Path, text: str) -> None:
    file = written(tmp_path / "mine.json", text)
    refused((BadInputError, "not a record of predictions", lambda: RecordedReader(file)))
    assert file.read_text() == text


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_lesson_at_a_terminal_is_recorded(tmp_path: Path) -> None:
    file = tmp_path / "mine.json"
    words = ("lesson", "state", "--record", str(file))
    seen = _at_a_terminal(*words, typed=[("Your prediction", "c\n")])
    assert_in(seen, "You predicted it", "mine.json: 1")
    record = json.loads(file.read_text())
    assert (record["score"], record["of"], record["answers"][0]["predicted"]) == (1, 1, "12")


def test_a_file_without_keyframes_has_its_page_of_reset(capsys: pytest.CaptureFixture[str]) -> None:
    assert not sm.load("so101").keyframes
    assert main(["lesson", "reset", "--model", "so101", "--no-questions"]) == 0
    assert "reset" in capsys.readouterr().out
