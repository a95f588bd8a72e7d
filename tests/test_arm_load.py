"""Friction in loaded gears, a clock that is off, noise that is not the same everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import statemachine as sm
from statemachine.interface import Array
from statemachine.lab.identification.considered import UNCERTAIN_RATE, considered_shifts
from statemachine.lab.identification.fit import Fit, fit
from statemachine.lab.identification.linear_refit import LinearRefit
from statemachine.lab.identification.load_friction import load_friction_profile
from statemachine.lab.identification.loaded_servos import LoadedServos
from statemachine.lab.identification.parameters import ArmParameters
from statemachine.lab.identification.refinements import Refinement, tried_refinements
from statemachine.lab.identification.residuals import Residuals
from statemachine.lab.identification.simulation import ArmSimulation
from statemachine.lab.identification.starts import Fits
from statemachine.lab.identification.verdicts import fitted_parameters

from .support.arm_fits import COUNT, FPS, SOFT, arm_parameters, objective_of, swings, vector

pytest.importorskip("scipy")
NOISE = 0.6 * COUNT
TRUE = {"kp": SOFT, "viscous": -0.8, "delay": 0.045}
KINDS = ("kp", "viscous", "friction", "delay")
PART = 0.12  # of the force that is lost


@pytest.fixture(scope="module")
def parameters() -> ArmParameters:
    return arm_parameters()


@pytest.fixture(scope="module")
def true(parameters: ArmParameters) -> Array:
    return vector(parameters, TRUE)


@pytest.fixture(scope="module")
def motion(parameters: ArmParameters) -> ArmSimulation:
    return ArmSimulation.of_motion(parameters, swings(parameters, 4.0, rate=1.0), FPS)


def fits_of(motion: ArmSimulation, true: Array, angles: Array) -> Fits:
    """Return the fit of the model to angles (K, n) that are measured with noise."""
    state = angles + np.random.default_rng(0).normal(0.0, NOISE, angles.shape)
    recording = replace(motion.recording, state=state)
    objective = objective_of(motion.parameters, recording, KINDS, NOISE)
    best = fit(replace(objective, fixed=true), true, derivatives="exact")
    return Fits((best,) * 3, Residuals.of(best.errors, recording))


@pytest.fixture(scope="module")
def clean(motion: ArmSimulation, true: Array) -> Fits:
    return fits_of(motion, true, motion.angles(true))


@pytest.fixture(scope="module")
def loaded(motion: ArmSimulation, true: Array) -> Fits:
    return fits_of(motion, true, with_changing_friction(motion, true))


def with_changing_friction(motion: ArmSimulation, true: Array) -> Array:
    """Return angles (K, n) of MuJoCo whose dry friction is set anew before each step."""
    parameters = motion.parameters
    steps = 64
    options = {key: value[0] for key, value in parameters.options(true[None]).items()}
    timestep = 1.0 / (FPS * steps)
    arm = parameters.model.replace(timestep=timestep, integrator="euler", contacts=False, **options)
    without = np.array(arm.dof_frictionloss)
    angles: list[Array] = []
    with sm.make_data(arm) as data:
        data.qpos[:] = motion.state[0]
        for command in motion.action[:-1]:
            data.ctrl[:] = command
            for _ in range(steps):
                angles.append(data.qpos.copy())
                force = arm.actuator_kp * (data.ctrl - data.qpos) - arm.actuator_kv * data.qvel
                arm.raw.dof_frictionloss[:] = without + PART * np.abs(force)
                sm.step(arm, data)
        angles.append(data.qpos.copy())
    moments = np.arange(len(motion.action)) / FPS - true[parameters.of_kind("delay")[0]]
    times = np.arange(len(angles)) * timestep
    return np.stack([np.interp(moments, times, column) for column in np.transpose(angles)], axis=1)


# The servos.


def lost_by(parameters: ArmParameters, told: float, history: Array) -> Array:
    """Return what servos of the model lose of the commands of two steps, (2, n)."""
    servos = LoadedServos(parameters, PART, timestep=0.01)
    angles = np.repeat(history[None, :, None], 6, axis=2)
    return servos.lost(
        parameters.options(np.zeros((1, len(parameters)))), told + 0 * angles[:, 1:], angles
    )[0]


@pytest.mark.parametrize(("told", "speed"), [(0.001, 0.5), (0.001, -0.5), (0.4, 0.5)])
def test_a_part_of_the_force_is_lost_against_the_motion(
    parameters: ArmParameters, told: float, speed: float
) -> None:
    history = speed * 0.01 * np.arange(-1.0, 2.0)
    kp, kv = parameters.model.actuator_kp, parameters.model.actuator_kv
    limit = parameters.model.actuator_forcerange[:, 1]
    force = np.minimum(np.abs(kp * told - kv * speed), limit)
    expected = -np.sign(speed) * PART * force / kp
    assert lost_by(parameters, told, history)[1] == pytest.approx(expected)


def test_nothing_is_lost_at_rest(parameters: ArmParameters) -> None:
    assert not lost_by(parameters, 0.1, np.zeros(3)).any()


def test_commands_of_a_world_that_diverged_stay_finite(parameters: ArmParameters) -> None:
    assert np.isfinite(lost_by(parameters, 0.1, np.full(3, np.nan))).all()


def test_the_arm_moves_as_with_friction_that_is_set_at_each_step(
    motion: ArmSimulation, true: Array
) -> None:
    angles = replace(motion, load_friction=PART).angles(true)
    expected = with_changing_friction(motion, true)
    effect = np.abs(angles - motion.angles(true)).max(axis=0)
    assert (np.abs(angles - expected).max(axis=0) < 0.1 * effect + 0.2 * COUNT).all()


# On a fit.


def load_of(fits: Fits) -> Refinement:
    (found,) = [each for each in tried_refinements(fits) if "load" in each.hypothesis.name]
    return found


def test_friction_of_the_load_is_found_where_it_is(loaded: Fits) -> None:
    found = load_of(loaded)
    assert found.fits_better
    assert found.hypothesis.size == pytest.approx(PART, abs=0.04)


def test_without_it_none_fits_better(clean: Fits) -> None:
    assert not load_of(clean).fits_better


def test_gains_that_stand_in_for_it_are_not_determined(
    loaded: Fits, true: Array, parameters: ArmParameters
) -> None:
    found = load_of(loaded)
    false: list[str] = []
    said = fitted_parameters(loaded, True, (), [found])
    for each, number in zip(said, loaded.best.objective.free, strict=True):
        truth = parameters.each[number].figure(float(true[number]))
        if each.kind != "friction" and each.verdict == "determined":
            false += [each.kind] * (not each.low <= truth <= each.high)
    assert false == []
    assert any("friction of the load fits as well" in each.reasons for each in said)


def test_a_profile_says_where_a_fit_with_it_ends(clean: Fits) -> None:
    profile = load_friction_profile(LinearRefit.of(clean.best))
    place = 2
    objective = clean.best.objective
    simulation = replace(objective.simulation, load_friction=float(profile.sizes[place]))
    end = fit(replace(objective, simulation=simulation), clean.best.vector, derivatives="exact")
    assert profile.ends[place].cost == pytest.approx(end.cost, abs=0.3)


# A clock.


def best_at(motion: ArmSimulation, true: Array, rate: float) -> Fit:
    """Return the best fit of a recording whose rate is other than it says, without noise."""
    recording = replace(motion.recording, fps=rate * FPS)
    angles = replace(motion, recording=recording).angles(true)
    recorded = replace(motion.recording, state=angles)
    objective = objective_of(motion.parameters, recorded, KINDS, NOISE)
    return fit(replace(objective, fixed=true), true, derivatives="exact")


def test_what_a_clock_moves_is_what_a_fit_to_another_rate_moves(
    motion: ArmSimulation, true: Array
) -> None:
    best = best_at(motion, true, 1.0)
    other = best_at(motion, true, 1.0 - UNCERTAIN_RATE)
    free = best.objective.free
    moved = (other.vector - best.vector)[free]
    deviations = 1.0 / np.sqrt(np.diag(best.information))
    assert considered_shifts(best)[0] == pytest.approx(moved, abs=0.3 * float(deviations.max()))


def test_a_faster_clock_shows_less_viscous_friction_of_light_joints(
    motion: ArmSimulation, true: Array
) -> None:
    """The speed of a wrist is faster by the rate, and weight and inertia hardly matter there."""
    best = best_at(motion, true, 1.0)
    kinds = [best.objective.parameters.each[number].kind for number in best.objective.free]
    viscous = considered_shifts(best)[0][[kind == "viscous" for kind in kinds]]
    assert viscous[-3:] == pytest.approx(-UNCERTAIN_RATE, abs=0.5 * UNCERTAIN_RATE)


def test_intervals_are_as_wide_as_what_is_uncertain_makes_them(clean: Fits) -> None:
    shifts = np.linspace(0.0, 0.1, len(clean.best.objective.free)) * np.array([[3.0], [4.0]])
    widened = replace(clean, considered=shifts).deviations
    assert widened == pytest.approx(np.hypot(clean.deviations, 5.0 / 3.0 * shifts[0]))


def test_a_payload_elsewhere_moves_what_a_payload_does(motion: ArmSimulation, true: Array) -> None:
    """Of one of 100 g, further out by what is uncertain; without a payload nothing moves."""
    heavy = true.copy()
    heavy[motion.parameters.of_kind("payload")] = 0.1
    best, without = best_at(motion, heavy, 1.0), best_at(motion, true, 1.0)
    assert np.abs(considered_shifts(best)[1:]).max() > 1e-3
    assert np.abs(considered_shifts(without)[1:]).max() < 1e-6


# Noise.


def test_noise_that_is_larger_where_a_figure_shows_makes_its_interval_wider(clean: Fits) -> None:
    """As that of frames that are read late: it grows with the speed, of all joints together."""
    best = clean.best
    number = 0
    slopes = best.jacobian[: best.errors.size, number].reshape(best.errors.shape)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(slopes), 1))
    size = np.sqrt(np.square(best.errors).mean() / np.square(slopes).mean())
    together = replace(best, errors=signs * size * slopes)
    uneven = replace(clean, each=(together,) * 3)
    assert uneven.deviations[number] > 1.2 * clean.deviations[number]


def test_even_noise_is_not_taken_for_more(clean: Fits) -> None:
    by_information = np.sqrt(np.diag(clean.covariance))
    assert clean.deviations == pytest.approx(by_information, rel=0.3)
