"""What the battery has on record of MotrixSim, and each cause of it, tried."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.backends import parse_backend
from statemachine.installed import require
from statemachine.interface import Data, make_data
from statemachine.interface.records import Array
from statemachine.lab.validate.battery import run_case
from statemachine.lab.validate.case import (
    FEW_TIMESTEPS,
    GRAVITY,
    SINGLE,
    Case,
    rounded,
)
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.contact_impact import HEIGHT, SPRING
from statemachine.lab.validate.contact_incline import DIAGONAL, FRICTION, Incline
from statemachine.lab.validate.run import Run, Samples
from statemachine.lab.validate.soft_contact import SoftContact
from statemachine.lab.validate.variants import OWN, Variant
from statemachine.lab.validate.verdict import CaseMeasurement, Status, judgement_of
from statemachine.processes.stderr_capture import stderr_capture

from .support.files import written
from .support.requirements import need_engine

RECORDS = {name: case.expectation("motrix", OWN) for name, case in CASES.items()}
ROUNDED = [name for name, record in RECORDS.items() if record and record.rounded is not None]
SCALES = (1.0, 2.5)  # of a record of rounding [unit of the error]
EXACT_DIAGONAL = '<option><flag diagexact="enable"/></option>'


@pytest.fixture
def motrix() -> Variant:
    """MotrixSim; without it a test does not run."""
    need_engine("motrix")
    return Variant(parse_backend("motrix"), OWN)


@pytest.fixture
def mujoco() -> Variant:
    """MuJoCo, whose joints step as MotrixSim's do."""
    need_engine("mujoco")
    return Variant(parse_backend("mujoco"), "implicitfast")


def measured(case: Case, variant: Variant, timestep: float) -> float:
    """Return what a case gives at one timestep."""
    (measurement,) = run_case(case, variant, (timestep,)).measurements
    assert measurement.measured is not None
    return measurement.measured


def with_text(case: Case, old: str, new: str) -> Case:
    """Return a case with something else in its file."""
    assert old in case.mjcf
    return replace(case, mjcf=case.mjcf.replace(old, new))


# The records


def test_each_case_has_a_record_of_motrix_alone() -> None:
    assert [name for name, case in CASES.items() if "motrix *" not in case.expected] == []


def test_what_is_wrong_on_motrix_has_its_cause_in_a_sentence() -> None:
    wrong = [record for record in RECORDS.values() if record and record.verdict == "wrong"]
    assert len(wrong) == 8
    assert all(record.note for record in wrong)


def runs(errors: list[float | None], steps: list[int]) -> list[CaseMeasurement]:
    return [
        CaseMeasurement(timestep, error, error, None, count, 1e-6)
        for timestep, error, count in zip(FEW_TIMESTEPS, errors, steps, strict=True)
    ]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(
    ("parts", "status"),
    [
        ([0.0, 0.0, 0.0], "as expected"),
        ([-1.0, 0.5, -1.0], "as expected"),
        ([1.01, 0.0, 0.0], "worse"),
        ([0.0, 0.0, -1.01], "worse"),
        ([0.0, math.nan, 0.0], "worse"),
        ([0.0, None, 0.0], "worse"),
    ],
)
def test_a_record_of_rounding_bounds_the_error_of_each_run_by_its_steps(
    scale: float, parts: list[float | None], status: Status
) -> None:
    steps = [200, 500, 1000]
    errors: list[float | None] = []
    for part, count in zip(parts, steps, strict=True):
        errors.append(None if part is None else part * scale * SINGLE * count)
    case = replace(CASES["armature"], timesteps=FEW_TIMESTEPS)
    assert judgement_of(case, runs(errors, steps), rounded(scale)).status == status


def test_a_model_that_is_refused_is_worse_than_a_record_of_rounding() -> None:
    assert judgement_of(CASES["armature"], [], rounded()).status == "worse"


def test_no_order_is_read_out_of_rounding() -> None:
    errors = runs([4e-6, 2e-6, 1e-6], [200, 500, 1000])
    assert judgement_of(CASES["armature"], errors, None).order == pytest.approx(0.85, abs=0.1)
    assert judgement_of(CASES["armature"], errors, rounded()).order is None


# Single precision: MuJoCo, its state rounded at each step


class RoundedRun(Run):
    """A run whose state is rounded to single precision after each step."""

    def advance(self, duration: float) -> float:
        count = round(duration / self.timestep)
        time = sum(super(RoundedRun, self).advance(self.timestep) for _ in self._rounding(count))
        return float(time)

    def sample(self, duration: float, read: Callable[[Data], float | Array]) -> Samples:
        times, values = [self.data.time], [np.array(read(self.data))]
        for _ in self._rounding(round(duration / self.timestep)):
            super().advance(self.timestep)
            times.append(self.data.time)
            values.append(np.array(read(self.data)))
        return Samples(np.array(times), np.array(values))

    def _rounding(self, count: int) -> Any:
        for step in range(count):
            yield step
            for state in (self.data.qpos, self.data.qvel):
                state[:] = state.astype(np.float32)


def rounded_error(name: str, timestep: float) -> tuple[float, int]:
    """Return the error of MuJoCo with a rounded state, and the number of steps."""
    case, variant = CASES[name], Variant(parse_backend("mujoco"), "Euler")
    text = case.model_text(timestep, "Euler")
    with variant.loaded(text, timestep) as model, make_data(model) as data:
        run = RoundedRun(model, data)
        return case.error_of(case.measure(run), case.truth_of(run.time)), run.steps


@pytest.mark.parametrize("name", ["terminal-speed", "speed-limit", "gyroscope"])
def test_mujoco_is_as_far_off_as_motrix_where_its_state_is_rounded(
    name: str, motrix: Variant
) -> None:
    need_engine("mujoco")
    (measurement,) = run_case(CASES[name], motrix, (0.002,)).measurements
    error, _ = rounded_error(name, 0.002)
    assert abs(error) > 1e-7
    assert measurement.error == pytest.approx(error, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in ROUNDED if CASES[name].group != "contact"])
def test_a_rounded_state_makes_no_more_than_the_bound_on_record(name: str) -> None:
    need_engine("mujoco")
    record = RECORDS[name]
    assert record is not None
    for timestep in CASES[name].timesteps:
        error, steps = rounded_error(name, timestep)
        assert abs(error) <= record.bound(steps)


def test_rounding_is_magnified_by_a_turn_about_the_middle_axis(
    motrix: Variant, mujoco: Variant
) -> None:
    case, rolling = CASES["tumbling-flip"], Variant(mujoco.backend, "Euler")
    theirs, ours = (measured(case, each, 0.002) for each in (motrix, rolling))
    error, _ = rounded_error("tumbling-flip", 0.002)
    unrounded = abs(ours / case.true_value - 1.0)
    assert abs(theirs / case.true_value - 1.0) > 10.0 * unrounded
    assert abs(error) > 10.0 * unrounded


# Its own way to step


def test_a_step_turns_a_body_by_twice_the_angle_whose_tangent_is_half_of_it(
    motrix: Variant,
) -> None:
    h = 0.005
    turned = 2.0 * math.atan(10.0 * h / 2.0) / h
    assert measured(CASES["thrown-spin"], motrix, h) == pytest.approx(turned, abs=1e-5)


def bounced(h: float) -> float:
    """Return the height of a bounce of steps that take the speed of damping from their end."""
    height, speed, heights = HEIGHT, 0.0, list[float]()
    fall = math.sqrt(2.0 * HEIGHT / GRAVITY)
    skipped = round(1.15 * fall / h)
    for step in range(skipped + round(1.7 * fall / h)):
        free = speed - h * GRAVITY
        if height < 0.0:
            push = (1.0 - SPRING.impedance) * GRAVITY + SPRING.stiffness * height
            speed = max((speed - h * push) / (1.0 + h * SPRING.damping), free)
        else:
            speed = free
        height += h * speed
        if step >= skipped:
            heights.append(height)
    return max(heights) / HEIGHT


@pytest.mark.parametrize("timestep", [0.005, 0.002, 0.001])
def test_the_damping_of_a_contact_is_implicit(motrix: Variant, timestep: float) -> None:
    assert measured(CASES["bounce"], motrix, timestep) == pytest.approx(bounced(timestep), abs=1e-4)


# Soft constraints


def test_dry_friction_creeps_as_in_mujoco_where_both_its_impedances_are_alike(
    motrix: Variant, mujoco: Variant
) -> None:
    case = CASES["dry-friction-below"]
    alike = with_text(case, "frictionloss=", 'solimpfriction="0.9 0.9 0.001" frictionloss=')
    ratios: list[float] = []
    for each in (case, alike):
        ratios.append(measured(each, motrix, 0.002) / measured(each, mujoco, 0.002))
    assert ratios == pytest.approx([0.9 / 0.95, 1.0], rel=1e-3)


def test_a_mimic_is_as_soft_as_in_mujoco_with_the_exact_inverse_inertia(
    motrix: Variant, mujoco: Variant
) -> None:
    case = CASES["mimic"]
    theirs = measured(case, motrix, 0.002)
    exact = replace(case, mjcf=EXACT_DIAGONAL + case.mjcf)
    assert theirs == pytest.approx(measured(exact, mujoco, 0.002), rel=1e-3)
    assert theirs / measured(case, mujoco, 0.002) > 2.0


def test_a_weld_acts_on_the_inertia_with_the_implicit_damping_of_a_servo(motrix: Variant) -> None:
    case = CASES["weld-payload"]
    inverse_masses = [1.0 / (10.0 + 2000.0 * h) + 1.0 / 90.0 for h in (0.005, 0.002)]
    errors = [measured(case, motrix, h) for h in (0.005, 0.002)]
    assert errors[1] / errors[0] == pytest.approx(inverse_masses[1] / inverse_masses[0], rel=1e-3)


# Friction


@pytest.mark.parametrize(("direction", "factor"), [(0.0, 1.0), (DIAGONAL, math.sqrt(2.0))])
def test_friction_is_larger_along_the_diagonal_of_its_axes(
    motrix: Variant, direction: float, factor: float
) -> None:
    steep = Incline(1.6, direction)
    case = replace(CASES["friction-cone"], measure=steep.cone, gravity=steep.gravity)
    assert measured(case, motrix, 0.002) == pytest.approx(factor * FRICTION, rel=1e-3)


def test_creep_is_of_the_timestep_and_not_of_solref(motrix: Variant) -> None:
    case = CASES["creep-of-solref"]
    softer = with_text(case, 'type="sphere"', 'type="sphere" solref="0.1 1"')
    speed = measured(case, motrix, 0.002)
    assert measured(softer, motrix, 0.002) == pytest.approx(speed, rel=0.01)
    assert measured(case, motrix, 0.005) == pytest.approx(2.5 * speed, rel=0.01)


def test_what_is_left_of_a_skid_is_friction_times_the_depth_of_its_contact(
    motrix: Variant,
) -> None:
    case = CASES["sphere-skids"]
    errors = [measured(case, motrix, h) - case.true_value for h in (0.001, 0.0005)]
    depth = SoftContact().depth_at_rest(-case.gravity[2])
    assert 2.0 * errors[1] - errors[0] == pytest.approx(FRICTION * depth, rel=0.1)


def test_a_stiffer_contact_brings_the_threshold_of_tipping_to_a_hundredth(motrix: Variant) -> None:
    case = CASES["tipping-threshold"]
    stiffer = replace(case, mjcf='<default><geom solref="0.005 1"/></default>' + case.mjcf)
    thresholds = [measured(each, motrix, 0.002) for each in (case, stiffer)]
    assert thresholds == pytest.approx([1.04, 1.01], abs=0.006)


# Forces


def net_force(folder: Path, name: str, steps: int) -> list[float]:
    """Return the vertical net force of all contacts on the bodies of a case, after each step [N].

    It is MotrixSim's own report, of steps of 2 ms.
    """
    mx: Any = require("motrix")
    file = written(folder / "case.xml", CASES[name].model_text(0.002, OWN))
    with stderr_capture():
        scene = mx.load_model(str(file))
    scene.reports.contact_forces = True
    data, forces = mx.SceneData(scene), list[float]()
    for _ in range(steps):
        scene.step(data)
        reported = np.asarray(scene.get_link_net_contact_forces(data)).reshape(-1, 6)
        forces.append(float(reported[:, 2].sum()))
    return forces


def test_the_engines_own_force_on_a_box_at_rest_is_its_weight(
    motrix: Variant, tmp_path: Path
) -> None:
    weight = CASES["resting-force"].true_value
    assert net_force(tmp_path, "resting-force", 500)[-1] == pytest.approx(weight, rel=1.2e-5)


def test_a_stack_never_rests_and_its_mean_force_is_its_weight(
    motrix: Variant, tmp_path: Path
) -> None:
    weight = CASES["stack-force"].true_value
    forces = np.array(net_force(tmp_path, "stack-force", 600)[500:])
    assert np.ptp(forces) > 0.02 * weight
    assert forces.mean() == pytest.approx(weight, rel=0.004)
