"""What the judge of demo_gravity says of falls that are written down here, moment by moment."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from statemachine.course.grading.inside.answers import Answer
from statemachine.course.grading.inside.watch import EngineRun, Inputs
from statemachine.course.grading.inside.worlds import ExerciseWorld, FallWorld
from statemachine.course.grading.judges import gravity
from statemachine.course.grading.judges.remarks import OfGravity

from .support.small_models import loaded

ARM = (
    '<body><joint name="pan" axis="0 0 1"/><geom size=".05" mass="1"/>'
    '<body><joint name="shoulder_lift" axis="0 1 0"/><geom size=".05" mass="1"/></body></body>'
)
DRIVES = '<actuator><position joint="pan"/><position joint="shoulder_lift"/></actuator>'
RATE, SECONDS, TIMESTEP = 4, 3, 0.25  # steps of a second
SIZE = RATE * (SECONDS + 1) + 1
MARKS = np.arange(SECONDS + 1) * RATE
LIMP = np.linspace(0.0, 160.0, SIZE)  # [degrees] without servos
# The same at one and two steps after a whole second, and another at the third.
STEPPED = np.array([10.0 * (k // RATE) + (0.0, 5.0, 5.0, 8.0)[k % RATE] for k in range(SIZE)])


@pytest.fixture
def world(tmp_path: Path) -> FallWorld:
    """Return three seconds of an arm with four steps a second."""
    option = f'<option timestep="{TIMESTEP}"/>'
    return ExerciseWorld("", loaded(tmp_path, ARM, DRIVES, option=option), (SECONDS,))


def clock(*short: int) -> np.ndarray:
    """Return the times of all steps [s], where those of some are a bit too little."""
    times = np.array([k * TIMESTEP for k in range(SIZE)])
    times[list(short)] -= 1e-12
    return times


def falls_of(
    servos: np.ndarray, time: np.ndarray | None = None, limp: np.ndarray = LIMP
) -> gravity.Falls:
    """Return the falls along two paths of the joint (steps + 1,) [degrees]."""
    angles = np.zeros((2, SIZE, 2))
    angles[0, :, 1], angles[1, :, 1] = servos, limp
    return gravity.Falls(
        place=1,
        angles=angles,
        speed=np.zeros((2, SIZE)),
        time=clock() if time is None else time,
        marks=MARKS,
        degrees=angles[:, MARKS, 1],
    )


def still(number: int) -> Inputs:
    """Return the inputs of a new Data."""
    return Inputs(number, np.zeros(2), np.zeros(2), np.zeros(2), 0.0)


def remarks_of(
    world: FallWorld, falls: gravity.Falls, servos: np.ndarray, limp: np.ndarray, *steps: int
) -> tuple[str, ...]:
    """Return what is said of both traces, of runs of so many steps each."""
    runs: list[EngineRun] = []
    for number, nstep in enumerate(steps):
        end = replace(still(number), qpos=np.array([0.0, 1.0]))
        runs.append(EngineRun(on_given_model=True, start=still(number), end=end, nstep=nstep))
    answer = Answer((servos, limp), runs=tuple(runs), ends=tuple(run.end for run in runs))
    return gravity.judge(answer, world, falls, falls).remarks


# By the clock: a sum of timesteps may be a bit less than a whole second.

# A step makes less than the tolerance [degrees]; and no moment looks as if it were rounded.
SLOW = 0.001 * math.sqrt(2.0) * np.arange(SIZE)


@pytest.mark.parametrize(
    ("short", "taken", "steps", "second"),
    [
        ((4,), [0, 5, 8, 12], 5, 0),
        ((8,), [0, 4, 9, 12], 5, 1),
        ((12,), [0, 4, 8, 13], 5, 2),
        ((4, 8), [0, 5, 9, 12], 5, 0),
        ((8, 12), [0, 4, 9, 13], 5, 1),
    ],
)
@pytest.mark.parametrize("limp", [0, 1])
def test_what_was_stepped_by_the_clock_is_a_step_off(
    limp: int, short: tuple[int, ...], taken: list[int], steps: int, second: int, world: FallWorld
) -> None:
    paths = (SLOW, LIMP) if limp == 0 else (LIMP, SLOW)
    falls = falls_of(paths[0], clock(*short), paths[1])
    traces = falls.degrees.copy()
    traces[limp] = SLOW[taken]
    before = RATE * (second + 1)
    mistake = OfGravity.BY_THE_CLOCK.filled(
        steps=steps,
        second=second,
        next=second + 1,
        needed=RATE,
        before=before,
        time=float(falls.time[before]),
        timestep=TIMESTEP,
    )
    name = ("servos on", "servos off")[limp]
    said = OfGravity.OF_TRACE.filled(trace=name, mistake=mistake)
    assert remarks_of(world, falls, traces[0], traces[1], 13, 13) == (said,)


def test_what_is_right_by_the_step_is_right_whatever_the_clock_says(world: FallWorld) -> None:
    falls = falls_of(SLOW, clock(8))
    passed = OfGravity.PASSED.filled(
        joint="shoulder_lift", seconds=SECONDS, on=SLOW[12], off=LIMP[12]
    )
    assert remarks_of(world, falls, *falls.degrees, 12, 12) == (passed,)


def test_rounded_degrees_are_not_taken_for_those_by_the_clock(world: FallWorld) -> None:
    falls = falls_of(SLOW, clock(8))
    traces = falls.degrees[0] + 0.0005, falls.degrees[1]
    passed = OfGravity.PASSED.filled(
        joint="shoulder_lift", seconds=SECONDS, on=SLOW[12], off=LIMP[12]
    )
    assert remarks_of(world, falls, *traces, 12, 12) == (passed,)


# Late: the same at several moments, of which what was stepped tells the right one.


def of_servos(falls: gravity.Falls, trace: np.ndarray, mistake: str) -> str:
    """Return what is said of a wrong trace with the servos on; its third second is farthest off."""
    figures = OfGravity.FIGURES.filled(
        trace="servos on", value=f"{trace[3]:g}", second=3, expected=f"{falls.degrees[0, 3]:g}"
    )
    return OfGravity.MISTAKE.filled(figures=figures, mistake=mistake) if mistake else figures


@pytest.mark.parametrize("late", [1, 2])
def test_of_moments_that_are_alike_the_one_counts_that_was_stepped_to(
    late: int, world: FallWorld
) -> None:
    falls = falls_of(STEPPED)
    trace = np.array([0.0, 15.0, 25.0, 35.1])
    falls.angles[0, 13:15, 1] = trace[3]
    remarks = remarks_of(world, falls, trace, falls.degrees[1], 12, 12 + late)
    said = OfGravity.LATE.filled(shift=late * TIMESTEP)
    assert remarks == (of_servos(falls, trace, said),)


@pytest.mark.parametrize("steps", [(12, 12), (13, 14), (12, 16), (12, 11)])
def test_no_moment_is_told_where_what_was_stepped_does_not_tell_it(
    steps: tuple[int, int], world: FallWorld
) -> None:
    falls = falls_of(STEPPED)
    trace = np.array([0.0, 15.0, 25.0, 35.1])
    falls.angles[0, 13:15, 1] = trace[3]
    remarks = remarks_of(world, falls, trace, falls.degrees[1], *steps)
    assert remarks == (of_servos(falls, trace, ""),)


@pytest.mark.parametrize(("steps", "is_told"), [(11, False), (12, False), (13, True), (15, True)])
def test_a_moment_is_told_only_if_a_run_came_to_it(
    steps: int, is_told: bool, world: FallWorld
) -> None:
    falls = falls_of(np.arange(SIZE) ** 2.0)  # no two moments are alike
    trace = np.array([0.0, 25.0, 81.0, 169.0])  # a step late
    said = OfGravity.LATE.filled(shift=TIMESTEP) if is_told else ""
    remarks = remarks_of(world, falls, trace, falls.degrees[1], 11, steps)
    assert remarks == (of_servos(falls, trace, said),)


def test_a_moment_may_be_early(world: FallWorld) -> None:
    falls = falls_of(np.arange(SIZE) ** 2.0)
    trace = np.array([0.0, 9.0, 49.0, 121.0])
    remarks = remarks_of(world, falls, trace, falls.degrees[1], 11, 12)
    assert remarks == (of_servos(falls, trace, OfGravity.EARLY.filled(shift=TIMESTEP)),)


# Runs that are too short for what was returned.


@pytest.mark.parametrize(
    ("steps", "is_short"), [((12, 12), False), ((11, 12), True), ((12,), True)]
)
def test_each_fall_takes_a_run_that_is_long_enough(
    steps: tuple[int, ...], is_short: bool, world: FallWorld
) -> None:
    falls = falls_of(SLOW)
    [said] = remarks_of(world, falls, *falls.degrees, *steps)
    short = OfGravity.SHORT_RUNS.filled(
        steps=", ".join(f"{count} steps" for count in steps),
        seconds=SECONDS,
        needed=12,
        timestep=TIMESTEP,
    )
    assert (said == short) is is_short
