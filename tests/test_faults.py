"""`statemachine check --faults`: faults that are really there, and tests judged by them."""

from __future__ import annotations

import importlib.util
import math
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rich.cells import cell_len

import statemachine as sm
from statemachine import cli as command_line
from statemachine.course.grading.faults import FAULTS, Fault, run
from statemachine.course.grading.faults.examination import Examination, FailedTest, FaultTrial
from statemachine.course.grading.faults.patches import PATCHES
from statemachine.course.grading.faults.run import examine
from statemachine.course.grading.page import faults_page
from statemachine.errors import BadInputError, EngineError, UnsupportedError

from .support.backends import each_of_both
from .support.claims import assert_has, refused
from .support.files import written_all
from .support.motions import opened
from .support.pages import shown
from .support.processes import of_python
from .support.requirements import ROOT, need_engine

EXERCISE = ROOT / "exercises" / "test_arm.py"
SOLUTION = ROOT / "teaching" / "solutions" / "test_arm.py"
# The test of the solution that was written against each fault.
WRITTEN_AGAINST = {
    "xyzw": "test_a_quarter_turn_as_a_quaternion",
    "com-for-frame": "test_a_link_begins_at_its_own_joint",
    "joints-shifted": "test_pan_turns_the_fingertip_about_the_axis_of_the_base",
    "degrees": "test_pan_turns_the_fingertip_about_the_axis_of_the_base",
    "no-forward": "test_after_a_step_the_fingertip_is_that_of_the_state_before",
    "forward-steps": "test_forward_takes_no_time_and_moves_nothing",
    "step-and-forward": "test_after_a_step_the_fingertip_is_that_of_the_state_before",
    "one-step-short": "test_ten_steps_are_ten_steps",
    "motor-left-on": "test_an_arm_without_servos_falls",
    "gains-doubled": "test_a_servo_is_a_spring_that_carries_the_arm",
    "gravity-up": "test_the_box_falls_as_everything_does",
    "spin-in-world": "test_a_turned_box_spins_about_its_own_axis",
    "reset-keeps-ctrl": "test_reset_forgets_the_command",
    "no-replay": "test_the_same_start_and_commands_give_the_same_bits",
}

Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Tests of a student, in a folder of their own."""

    return lambda text: written_all(tmp_path / "student", {"test_mine.py": text}) / "test_mine.py"


# The faults.


def test_every_fault_has_a_patch_and_a_test() -> None:
    assert list(FAULTS) == list(PATCHES) == list(WRITTEN_AGAINST)


@pytest.mark.slow
@each_of_both  # for which the faults are made
def test_the_solution_passes_and_catches_every_fault(backend: str) -> None:
    # A fault that changed nothing would survive here.
    found = examine(SOLUTION, backend)
    assert_has(found, failures=(), idle=(), holds=True)
    caught = {trial.fault.name: {f.test for f in trial.caught_by} for trial in found.trials}
    assert list(caught) == list(FAULTS)
    for name, test in WRITTEN_AGAINST.items():
        assert test in caught[name], name


@each_of_both  # for which the faults are made
def test_the_model_does_not_give_its_faults_away(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def facts() -> list[bytes]:
        model = sm.load("so101", backend=backend)
        names = ("gravity", "actuator_kp", "actuator_kv", "dof_frictionloss")
        models = (model, model.replace(timestep=0.002))
        return [getattr(each, name).tobytes() for each in models for name in names]

    healthy = facts()
    for name in ("gravity-up", "gains-doubled", "motor-left-on"):
        PATCHES[name](monkeypatch)
    assert facts() == healthy


@each_of_both  # for which the faults are made
def test_a_fault_in_the_model_is_in_its_variants_too(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    PATCHES["gravity-up"](monkeypatch)
    model = sm.load("so101/scene_box", backend=backend)
    for change, up in (({"timestep": 0.002}, 9.81), ({"gravity": [0, 0, -1.62]}, 1.62)):
        variant = model.replace(**change)
        with sm.make_data(variant) as data:
            data.qpos[8] = 1.0
            sm.step(variant, data, 10)
            assert data.qvel[8] == pytest.approx(10 * variant.timestep * up, abs=1e-9)
        assert variant.gravity[2] < 0


@pytest.mark.parametrize("name", ["joints-shifted", "degrees", "spin-in-world"])
def test_rounding_does_not_give_a_fault_away(
    name: str, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    PATCHES[name](monkeypatch)
    model = sm.load("so101/scene_box", backend=backend)
    runs = set()
    for calls, steps in ((1, 12), (12, 1)):
        with opened(model, "pickup", qvel=np.linspace(-0.7, 0.9, model.nv)) as (_, data):
            data.qpos[8] += 0.5
            before = [array.tobytes() for array in (data.qpos, data.qvel, data.ctrl)]
            sm.forward(model, data)
            assert [array.tobytes() for array in (data.qpos, data.qvel, data.ctrl)] == before
            for _ in range(calls):
                sm.step(model, data, steps)
            runs.add(data.qpos.tobytes())
    assert len(runs) == 1


def test_the_short_step_keeps_the_clock_right(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    PATCHES["one-step-short"](monkeypatch)
    with opened(sm.load("so101", backend=backend), nstep=7) as (model, data):
        assert math.isclose(data.time, 7 * model.timestep)


# The judgement.


@pytest.mark.slow
@pytest.mark.parametrize("plugin", [(), ("-p", "statemachine.course.grading.faults.plugin")])
def test_pytest_alone_runs_the_exercise(plugin: tuple[str, ...]) -> None:
    words = ("-m", "pytest", "-q", "-p", "no:cacheprovider", *plugin, EXERCISE)
    of_python(*words, folder=EXERCISE.parent, code=0)


@pytest.mark.slow
def test_the_exercise_begins_with_missed_faults_and_an_idle_test() -> None:
    found = examine(EXERCISE, only=("xyzw", "degrees", "no-forward"))
    missed = (FAULTS["xyzw"],)
    assert_has(found, failures=(), idle=("test_the_clock",), caught=2, missed=missed, holds=False)


HANGS_OR_FALLS = """
import os, time
import pytest
import statemachine as sm

@pytest.fixture
def nowhere(model, data):
    sm.forward(model, data)
    return not data.site_xpos.any()

def test_before(model):
    assert model.nq == 13

def test_hard(nowhere):
    if nowhere:
        {what}

def test_after(model):
    assert model.nv == 12
"""


@pytest.mark.parametrize(
    ("what", "why"),
    [
        pytest.param("time.sleep(600)", "took longer than", marks=pytest.mark.slow),
        ("os.abort()", "crashed the process (SIGABRT)"),
        pytest.param("os._exit(0)", "ended the process with code 0", marks=pytest.mark.slow),
        pytest.param("raise RuntimeError('lost')", "RuntimeError: lost", marks=pytest.mark.slow),
    ],
)
def test_what_ends_under_a_fault_has_caught_it(
    what: str, why: str, write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "CPU_FACTOR", 1.0)
    monkeypatch.setattr(run, "MORE_CPU", 10.0)
    monkeypatch.setattr(run, "MORE_CLOCK", 10.0)
    found = examine(write(HANGS_OR_FALLS.format(what=what)), only=("no-forward", "xyzw"))
    caught, survived = found.trials
    assert not survived.caught
    assert [failure.test for failure in caught.caught_by] == ["test_hard"]
    assert why in caught.caught_by[0].why


OUT_OF_ORDER = """
import os

def test_first(request):
    request.session.items[1:] = request.session.items[:0:-1]

def test_fine():
    pass

def test_ends():
    os._exit(0)
"""


def test_the_test_that_ends_all_is_the_one_that_was_running(write: Write) -> None:
    found = examine(write(OUT_OF_ORDER))
    assert [failure.test for failure in found.failures] == ["test_ends"]


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("assert 1 == 2, 'as it must'", "line 2: as it must"),
        ("raise SystemExit(0)", "line 2: SystemExit: 0"),
        ("import os; os.abort()", "crashed the process (SIGABRT): Fatal Python error"),
        ("import os; os._exit(0)", "ended the process with code 0"),
        (
            "import _pytest.runner as r; del r.TestReport",
            "with code 3: NameError: name 'TestReport'",
        ),
        ("import pytest; pytest.exit('enough')", "ended the process with code"),
        pytest.param("while True: pass", "took longer than 10 s", marks=pytest.mark.slow),
        # It prints what a run that passed would, and what is written in the record.
        (
            "print('1 passed in 0.01s\\n{\"ended\": \"test_it\"}', flush=True); assert False, 'no'",
            "no",
        ),
    ],
)
def test_tests_that_fail_on_the_healthy_arm_are_told(body: str, why: str, write: Write) -> None:
    found = examine(write(f"def test_it():\n    {body}\ndef test_fine(): pass\n"), seconds=10)
    (failure,) = found.failures
    assert failure.test == "test_it"
    assert why in failure.why
    assert "\n" not in failure.why
    assert (found.trials, found.holds) == ((), False)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def test_x(:", r"test_mine.py cannot be imported: line 1: .*syntax"),
        ("\nimport nothing_of_this_name", "cannot be imported: line 2: ModuleNotFoundError"),
        ("import sys; sys.exit(0)", "cannot be imported: it ended the process"),
        ("import os; os._exit(0)", "cannot be imported: it ended the process with code 0"),
        ("import time; time.sleep(60)", "cannot be imported: it took longer than 2 s"),
        ("x = 1", "no tests in test_mine.py: a test is a function"),
        ("import pytest\n@pytest.mark.skip\ndef test_x(): pass", "each was skipped"),
    ],
)
def test_a_file_that_is_no_test_file_is_refused(text: str, message: str, write: Write) -> None:
    refused(
        (BadInputError, message, lambda: examine(write(text), clock=2 if "sleep" in text else 300))
    )


# By the faults that are put in: tests that pass, and nothing in their process tells of a fault.
CATCH_NOTHING = {
    "test_nothing": "def test_nothing(): assert True",
    "words": """import os, sys
def test_a(request):
    words = [*sys.argv, *os.environ, *request.config.invocation_params.args]
    assert not any(word in ("--fault", "STATEMACHINE_FAULT", "xyzw", "degrees") for word in words)
""",
    "modules": "import sys\nSEEN = set(sys.modules)\n"
    "def test_a(): assert 'statemachine.course.grading.faults.patches' in SEEN\n",
}


@pytest.mark.slow
@pytest.mark.parametrize("what", CATCH_NOTHING)
def test_what_does_not_look_at_the_arm_catches_nothing(what: str, write: Write) -> None:
    found = examine(write(CATCH_NOTHING[what]), only=["xyzw", "degrees"])
    assert (found.failures, found.caught, len(found.idle)) == ((), 0, 1)


@pytest.mark.slow
@pytest.mark.parametrize("line", ["not json", '{"began": 5}', "[" * 100_000, '{"tests": [1]}'])
def test_a_forged_record_is_refused(line: str, write: Write) -> None:
    text = (
        "import sys\ndef test_a():\n    path = sys.argv[sys.argv.index('--record') + 1]\n"
        f"    open(path, 'a').write({line!r} + chr(10))\n"
    )
    refused((BadInputError, "wrote into the record", lambda: examine(write(text), only=["xyzw"])))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_test_starts_no_process(write: Write) -> None:
    text = "import os\ndef test_a(): assert os.fork() >= 0\ndef test_b(): assert False, 'no'\n"
    found = examine(write(text), only=["xyzw"])
    refused = "line 2: PermissionError: it starts another process: not here"
    assert found.failures == (
        FailedTest(test="test_a", why=refused),
        FailedTest(test="test_b", why="line 3: no"),
    )


@pytest.mark.slow
def test_a_fault_that_cannot_be_put_in_is_not_caught(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(FAULTS, "unheard-of", Fault("unheard-of", "", ""))
    call = partial(examine, write("def test_x(): pass"), only=["unheard-of"])
    refused((EngineError, r"before the tests: .*unheard-of", call))


@pytest.mark.slow
def test_another_pytests_settings_do_not_disturb(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write("import helper\nopen('left', 'w').close()\ndef test_x(): assert helper.ONE == 1")
    beside = {
        "helper.py": "ONE = 1",  # a module of the student's own is found
        "random.py": "raise RuntimeError('not the one of Python')",
        "conftest.py": "raise RuntimeError('a conftest')",
        "pytest.ini": "[pytest]\naddopts = --no-such-option\n",
    }
    written_all(path.parent, beside)
    odd = path.parent.rename(path.parent.with_name("with [brackets] and blanks")) / path.name
    monkeypatch.setenv("PYTEST_ADDOPTS", "--no-such-option")
    monkeypatch.setenv("PYTEST_PLUGINS", "no_such_plugin")
    assert examine(odd, only=["xyzw"]).failures == ()
    assert {entry.name for entry in odd.parent.iterdir()} == {path.name, *beside}


def test_a_backend_into_which_no_fault_can_be_put_is_unsupported() -> None:
    call = partial(examine, EXERCISE, "motrix")
    error = refused((UnsupportedError, "backends of mujoco and pybullet", call))
    assert_has(error, backend="motrix", feature="check --faults")


@pytest.mark.slow
def test_the_tests_of_a_student_run_on_a_healthy_arm_of_any_engine(write: Write) -> None:
    need_engine("motrix")
    file = write("def test_engine(model): assert model.backend == 'motrix'")
    plugin = "statemachine.course.grading.faults.plugin"
    words = ("-p", "no:cacheprovider", "-p", plugin, "--engine", "motrix", file)
    of_python("-m", "pytest", "-q", *words, folder=file.parent, code=0)


# The page and the command.


def test_the_page_keeps_to_its_columns() -> None:
    name = "test_" + "a_name_that_goes_on_and_on_" * 4
    one = FailedTest(test=name, why="why")
    trials = tuple(
        FaultTrial(fault, (one,) * (k % 3 * 6)) for k, fault in enumerate(FAULTS.values())
    )
    page = faults_page(Examination("test_x.py", "mujoco", "4", (name, "test_b"), (), trials))
    assert not page.holds
    text = shown(page)
    assert max(map(cell_len, text.splitlines())) <= 80
    assert FAULTS["xyzw"].hint in " ".join(text.split())


def test_without_pytest_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    right = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == "pytest" else right(name)
    )
    assert command_line.main(["check", "--faults", str(EXERCISE)]) == 3
    assert "[faults]" in capsys.readouterr().err
