"""What an examination tries of a robot beyond loading it: experiments, and what a step costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.errors import BadInputError, DivergedError, UnsupportedError
from statemachine.lab.robots import ExaminedModel, examine, gaps
from statemachine.lab.runs.drive import number_of_steps
from statemachine.lab.runs.scenarios import suitable_scenarios

from .support.files import written
from .support.small_models import mjcf

BODY = '<body><joint name="j" axis="0 1 0"/><geom size=".05" pos="0 0 -.3" mass="1"/></body>'
SERVO = '<actuator><position name="j" joint="j" kp="5" kv="1"/></actuator>'
ROCK = '<geom name="rock" size="1"/>'
TRIED = ("hold", "gravity", "droop", "waves")
SEED = 3


class Engine:
    """An engine by its own functions that counts its steps.

    Attributes:
        steps: Of each call.
        started: The position, the velocity and the command with which it began.
        features: What it can do.
    """

    def __init__(self) -> None:
        self.steps: list[int] = []
        self.started: list[tuple[float, float, float]] = []
        self.features = {"stepper"}

    def can(self, feature: str) -> bool:
        """Return whether it does something."""
        return feature in self.features

    @contextmanager
    def stepper(
        self, _model: sm.Model, qpos: Any, qvel: Any, ctrl: Any
    ) -> Iterator[Callable[[int], None]]:
        """Yield what takes steps."""
        self.started.append((float(qpos[0]), float(qvel[0]), float(ctrl[0])))
        yield self.steps.append


class Lab:
    """An examination on MuJoCo alone, by a clock that is written down here.

    Attributes:
        engine: By which it is told what a step of the engine alone costs.
        ours: How many steps of ours were taken in each turn.
        seeds: With which turns were shuffled.
        recorded: The experiments that were run: name, steps and seed.
        parts: What was told to begin, in order.
    """

    def __init__(self, patch: pytest.MonkeyPatch, folder: Path) -> None:
        self.folder, self.engine = folder, Engine()
        self.ours: list[int] = []
        self.seeds: list[int] = []
        self.recorded: list[tuple[str, int, int]] = []
        self.parts: list[str] = []
        self.first = 0.003  # [s] that three steps are said to take
        self._count = 0
        self._record = examine.record_scenario
        patch.setattr(examine, "backend_names", lambda: ["mujoco"])
        patch.setattr(examine, "raw_engine_of", lambda _: self.engine)
        patch.setattr(examine, "time_interleaved", self._time)
        patch.setattr(examine, "step", self._step)
        patch.setattr(examine, "record_scenario", self._recorded)

    def _step(self, model: sm.Model, data: sm.Data, nstep: int = 1) -> None:
        self._count += 1
        sm.step(model, data, nstep)

    def _time(
        self, ways: Mapping[str, Callable[[], object]], rounds: int, seed: int | None = None
    ) -> dict[str, list[float]]:
        for name, call in ways.items():
            before = self._count
            call()
            if name != "alone":
                self.ours.append(self._count - before)
        if seed is None:
            assert rounds == 2
            return {"": [99.0, self.first]}  # the first call pays for what is loaded once
        self.seeds.append(seed)
        assert rounds == 15
        return {"ours": [2.0, 3.0, 4.0] * 5, "alone": [1.0, 2.0, 1.0] * 5}

    def _recorded(self, scenario: Any, model: sm.Model, seconds: float, seed: int) -> Any:
        steps = number_of_steps(model, seconds)
        self.recorded.append((scenario.name, steps, seed))
        return self._record(scenario, model, seconds=seconds, seed=seed)

    def examined(self, body: str = BODY, rest: str = SERVO, quick: bool = False) -> ExaminedModel:
        """Return what is found of a robot."""
        path = written(self.folder / "robot.xml", mjcf(body, rest))
        empty = ExaminedModel("robot.xml", "", "")
        return examine.examine(path, empty, quick, SEED, lambda _, part: self.parts.append(part))


@pytest.fixture
def lab(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Lab:
    """Return an examination on MuJoCo alone."""
    return Lab(monkeypatch, tmp_path)


def test_every_experiment_is_tried_for_forty_steps(lab: Lab) -> None:
    row = lab.examined()
    assert lab.recorded == [(name, 40, SEED) for name in TRIED]
    assert row.faults == ()


@pytest.mark.parametrize("rest", [SERVO, ""])
def test_an_experiment_runs_that_makes_sense(rest: str, lab: Lab) -> None:
    scenarios = lab.examined(rest=rest).backends["mujoco"].scenarios
    sensible = set(suitable_scenarios(sm.load(lab.folder / "robot.xml"))) & set(TRIED)
    assert list(scenarios) == list(TRIED)
    assert {name for name, said in scenarios.items() if said == "runs"} == sensible
    assert all(scenarios.values())


@pytest.mark.parametrize(
    "error",
    [BadInputError("no such joint"), UnsupportedError("no such joint")],
)
def test_why_an_experiment_makes_no_sense_is_told(
    error: Exception, lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: Any, **__: Any) -> None:
        raise error

    monkeypatch.setattr(examine, "record_scenario", refused)
    row = lab.examined()
    assert row.faults == ()
    assert set(row.backends["mujoco"].scenarios) == set(TRIED)
    assert all("no such joint" in said for said in row.backends["mujoco"].scenarios.values())


def test_an_error_that_nobody_meant_to_raise_is_a_fault_of_its_experiment(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = examine.record_scenario

    def broken(scenario: Any, *arguments: Any, **options: Any) -> Any:
        if scenario.name == "droop":
            raise ZeroDivisionError
        return record(scenario, *arguments, **options)

    monkeypatch.setattr(examine, "record_scenario", broken)
    row = lab.examined()
    [fault] = row.faults
    assert fault.startswith("scenario droop, mujoco: ZeroDivisionError")
    assert list(row.backends["mujoco"].scenarios) == ["hold", "gravity", "waves"]


def test_parts_are_told_before_they_begin(lab: Lab) -> None:
    lab.examined()
    scenarios = [f"scenario {name}, mujoco" for name in TRIED]
    assert lab.parts[-5:] == [*scenarios, "cost, mujoco"]
    assert lab.parts[0] == "loading, mujoco"


def test_a_quick_examination_leaves_out_experiments_and_costs(lab: Lab) -> None:
    row = lab.examined(quick=True)
    assert (lab.recorded, lab.ours) == ([], [])
    assert (row.backends["mujoco"].scenarios, row.backends["mujoco"].cost) == ({}, None)


def test_a_cost_is_the_median_ratio_of_the_turns(lab: Lab) -> None:
    assert lab.examined().backends["mujoco"].cost == 2.0  # of 2, 1.5 and 4
    assert lab.seeds == [SEED]


@pytest.mark.parametrize(
    ("first", "steps"), [(0.003, 5), (0.0009, 17), (1.0, 1), (0.006, 2), (3e-6, 500), (0.0, 500)]
)
def test_a_turn_takes_five_milliseconds_about(first: float, steps: int, lab: Lab) -> None:
    lab.first = first
    lab.examined()
    assert lab.ours == [3, steps]
    assert lab.engine.steps == [steps]


def test_the_engine_alone_begins_as_the_run_does(lab: Lab) -> None:
    keyframe = '<keyframe><key name="home" qpos="0.4" qvel="0.25"/></keyframe>'
    lab.examined(rest=SERVO + keyframe)
    model = sm.load(lab.folder / "robot.xml")
    command = float(gaps.commands(model, 1, SEED)[0, 0])
    assert command != 0
    assert lab.engine.started == [(0.4, 0.25, command)]


def test_what_cannot_move_has_no_cost(lab: Lab) -> None:
    row = lab.examined(ROCK, "")
    assert row.backends["mujoco"].cost is None
    assert lab.ours == []


def test_an_engine_that_is_not_stepped_alone_has_no_cost(lab: Lab) -> None:
    lab.engine.features.clear()
    assert lab.examined().backends["mujoco"].cost is None
    assert lab.ours == []


def test_a_step_that_diverges_costs_the_cost_alone(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverged(*_: Any, **__: Any) -> None:
        raise DivergedError("gone", time=0.0, quantity="qpos", index=0)

    monkeypatch.setattr(examine, "time_interleaved", diverged)
    row = lab.examined()
    assert (row.backends["mujoco"].cost, row.faults) == (None, ())
    assert row.backends["mujoco"].scenarios["hold"] == "runs"


# By the engine itself.


def test_a_step_of_ours_costs_about_what_one_of_the_engine_does(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(examine, "backend_names", lambda: ["mujoco"])
    path = written(tmp_path / "robot.xml", mjcf(BODY, SERVO))
    row = examine.examine(path, ExaminedModel("", "", ""), False, SEED, lambda *_: None)
    found = row.backends["mujoco"]
    assert found.cost is not None
    assert 0.2 < found.cost < 20
    assert (found.equals_engine, found.restores, row.faults) == (True, True, ())
    assert (row.nq, row.nv, row.nu, row.nbody, row.ngeom) == (1, 1, 1, 2, 1)
