"""Requests: what was typed becomes one, it checks itself, and Python can make it as well."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine import cli
from statemachine.course.grading.request import CheckRequest, FaultsRequest
from statemachine.course.lessons.request import LessonRequest
from statemachine.errors import StateMachineError
from statemachine.lab.compare import Request, Side
from statemachine.lab.installation.engines import ReleasesRequest
from statemachine.lab.probes.conventions.request import CallsRequest, ConventionsRequest
from statemachine.lab.questions.requests.causes import ExplainRequest
from statemachine.lab.questions.requests.converge import ConvergeRequest
from statemachine.lab.questions.requests.engines import EnginesRequest
from statemachine.lab.questions.requests.gap import CompareRequest
from statemachine.lab.questions.requests.models import ModelsRequest
from statemachine.lab.questions.requests.one_step import OneStepRequest
from statemachine.lab.questions.requests.versions import VersionsRequest
from statemachine.lab.recordings.request import RecordRequest, answer_record
from statemachine.lab.robots.request import RobotsRequest
from statemachine.lab.runs.reporter import QUIET
from statemachine.lab.sweep import Sweep
from statemachine.lab.sweep.questions import SweepEffectsRequest, SweepReportRequest, SweepRequest
from statemachine.lab.sweep.questions import answer as answer_sweep
from statemachine.lab.validate.fingertip_request import FingertipRequest
from statemachine.view.request import ServerSettings, SimulationRequest, TracesRequest

from .support.processes import of_python

HOLD = Request(("hold",))
FINE = Side("so101", options={"timestep": 0.002})
TWO_SIDES = Request(("hold",), sides=(FINE, Side("so101", "pybullet")))
THREE_SIDES = (Side("so101"), Side("so101", "pybullet"), Side("so101", options={"damping": 2.0}))
TYPED: list[tuple[str, Callable[[], object]]] = [
    ("conventions gravity", lambda: ConventionsRequest(("gravity",))),
    ("conventions --calls --backend mujoco", lambda: CallsRequest(("mujoco",))),
    (
        "robots models --seconds 5 --quick",
        lambda: RobotsRequest(("models",), seconds=5.0, quick=True),
    ),
    ("fingertip --poses 20 --seed 3", lambda: FingertipRequest(poses=20, seed=3)),
    ("engines", lambda: ReleasesRequest()),
    ("check step_loop.py --time-limit 2", lambda: CheckRequest("step_loop.py", time_limit=2.0)),
    (
        "lesson hold --seconds 0.3",
        lambda: LessonRequest(
            "hold", "so101/scene", options={"seconds": 0.3, "ctrl": None, "further": False}
        ),
    ),
    (
        "sweep hold --vary kp=1,2 --out d --jobs 2",
        lambda: SweepRequest(Sweep("hold", ["kp=1,2"]), "d", jobs=2),
    ),
    ("view --keyframe held", lambda: SimulationRequest(keyframe="held")),
    ("view a.npz b.npz so101", lambda: TracesRequest(("a.npz", "b.npz"), "so101")),
    ("compare hold", lambda: CompareRequest(HOLD)),
    ("compare hold --tolerance tip=2mm", lambda: CompareRequest(HOLD, {"tip": 0.002})),
    ("compare hold --no-chaos", lambda: CompareRequest(HOLD, uncertainty=None)),
    ("compare hold --why --time-limit 7", lambda: ExplainRequest(HOLD, time_limit=7.0)),
    ("compare hold --one-step", lambda: OneStepRequest(HOLD)),
    ("compare hold --converge", lambda: ConvergeRequest(HOLD)),
    (
        "compare hold --backend mujoco --backend pybullet --backend pybullet:engine",
        lambda: EnginesRequest(HOLD, ("mujoco", "pybullet", "pybullet:engine")),
    ),
    (
        "compare hold so101 so101@pybullet so101 damping=2 --no-chaos",
        lambda: EnginesRequest(HOLD, (), THREE_SIDES, uncertainty=None),
    ),
    ("compare hold --versions 3.3.7", lambda: VersionsRequest(HOLD, "3.3.7")),
    ("compare --models so101 so101/scene", lambda: ModelsRequest(("so101", "so101/scene"))),
    ("compare hold so101 timestep=0.002 so101@pybullet", lambda: CompareRequest(TWO_SIDES)),
]


@pytest.mark.parametrize(("typed", "make"), TYPED, ids=[typed for typed, _ in TYPED])
def test_what_is_typed_is_a_request(
    typed: str, make: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MENAGERIE", raising=False)
    words = typed.split()
    options = cli.options_of_words(words)
    command = importlib.import_module(f"statemachine.cli.{words[0]}")
    requests = importlib.import_module(command.run.__module__)
    assert requests.request_of(options) == make()


REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: ConventionsRequest(("foo",)), "named 'foo'"),
    (lambda: CallsRequest(()), "no engine"),
    (lambda: RobotsRequest(("models",), seconds=0.0), "seconds must"),
    (lambda: RobotsRequest(("models",), jobs=0), "jobs must"),
    (lambda: RobotsRequest(("models",), table=Path("t.foo")), "table ends in"),
    (lambda: FingertipRequest(poses=1), "poses must"),
    (lambda: FingertipRequest(backends=("foo",)), "no backend named 'foo'"),
    (lambda: CheckRequest("a.py", "mujoco:engine"), "judged on mujoco"),
    (lambda: CheckRequest("a.py", time_limit=0.0), "time limit must"),
    (lambda: FaultsRequest("a.py", only=("foo",)), "no fault named 'foo'"),
    (lambda: LessonRequest("foo"), "no lesson named 'foo'"),
    (lambda: LessonRequest("hold", options={"foo": 1}), "lesson hold"),
    (lambda: LessonRequest("hold", backends=("pybullet:engine",)), "keep the contract"),
    (lambda: RecordRequest("foo"), "no experiment named 'foo'"),
    (lambda: RecordRequest("hold", backend="all"), "takes one --backend"),
    (lambda: Sweep("hold", seeds=0), "--seeds must"),
    (lambda: Sweep("hold", every=2), "--every is of a FUNCTION"),
    (lambda: SweepRequest(Sweep("hold"), ""), "has no name"),
    (lambda: SweepEffectsRequest(SweepRequest(Sweep("hold"), None), "x"), "no quantity named 'x'"),
    (lambda: answer_sweep(SweepRequest(Sweep("hold"), None)), "--out DIR"),
    (lambda: SweepReportRequest("d", backends=("a", "b", "c")), "of one engine"),
    (lambda: SimulationRequest(backends=("mujoco",) * 3), "one engine or two"),
    (lambda: TracesRequest(()), "one trace or two"),
    (lambda: ServerSettings(seconds=0.0), "seconds must"),
    (lambda: ServerSettings(speed=0.0), "speed must be from"),
    (lambda: ExplainRequest(HOLD, time_limit=0.0), "--time-limit wants"),
    (lambda: OneStepRequest(Request(("a.npz",))), "--one-step runs"),
    (lambda: VersionsRequest(Request(("hold",), sides=(Side("a"), Side("b"))), "3"), "one model"),
    (lambda: ModelsRequest(("a", "b"), seed=-1), "--seed must"),
    (lambda: ModelsRequest(("a", "a"), ("mujoco", "mujoco")), "two engines, or"),
    # What only Python can ask: argparse has no such value.
    (lambda: Request(("hold",), backends=("mujoco",)), "two backends"),  # pyright: ignore
    (lambda: Request(("hold",), every=0), "every must"),
    (lambda: CompareRequest(HOLD, {"tipp": 0.1}), "no kind of quantity named 'tipp'"),
    (lambda: CompareRequest(HOLD, {"tip": float("nan")}), "tolerance of tip"),
    (lambda: ModelsRequest(("so101",)), "two files"),  # pyright: ignore
    (lambda: Sweep("hold", backends=()), "at least one backend"),
    (lambda: Sweep("hold", seeds=1.5), "--seeds must"),  # pyright: ignore
    (lambda: ServerSettings(port=-1), "port must"),
    (lambda: RobotsRequest(("models",), Path("a" * 2000 + ".csv")), "cannot be written"),
]


@pytest.mark.parametrize(("make", "says"), REFUSED, ids=[says for _, says in REFUSED])
def test_a_request_checks_itself(make: Callable[[], object], says: str) -> None:
    with pytest.raises(StateMachineError) as refusal:
        make()
    assert says in str(refusal.value)


def test_a_function_of_the_users_is_recorded_as_that_of_a_file(tmp_path: Path) -> None:
    def policy(model: sm.Model, data: sm.Data) -> Any:
        return np.full(model.nu, 0.1 * data.time)

    file = tmp_path / "policy.py"
    file.write_text(
        "import numpy as np\n\n\ndef policy(model, data):\n"
        "    return np.full(model.nu, 0.1 * data.time)\n",
        encoding="utf-8",
    )
    of_file = answer_record(RecordRequest(f"{file}:policy", "so101", seconds=0.05))
    of_function = answer_record(RecordRequest(policy, "so101", seconds=0.05))
    assert np.array_equal(of_function.ctrl, of_file.ctrl)
    assert of_function.ctrl.any()
    assert of_function.header.experiment == "policy"


def test_a_function_that_takes_something_else_is_refused() -> None:
    with pytest.raises(
        StateMachineError, match=r"takes \(state\), .* is called with \(model, data\)"
    ):
        answer_record(RecordRequest(lambda state: state, "so101", seconds=0.05))


def test_a_note_that_nobody_hears_is_a_warning() -> None:
    with pytest.warns(UserWarning, match="said"):
        QUIET.note("said")


@pytest.mark.parametrize(
    "module",
    [
        "lab.questions.requests.gap",
        "lab.questions.requests.causes",
        "course.grading.request",
        "course.lessons.request",
        "lab.validate.fingertip_request",
        "lab.probes.conventions.request",
        "lab.robots.request",
        "lab.recordings.request",
        "lab.sweep.questions",
        "view.request",
    ],
)
def test_a_request_imports_no_engine(module: str) -> None:
    engines = "{'mujoco', 'pybullet', 'pinocchio', 'viser', 'rich', 'matplotlib'}"
    code = f"import sys, statemachine.{module}; print({engines} & set(sys.modules))"
    assert of_python("-c", code).stdout.strip() == "set()"
