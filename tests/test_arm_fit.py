"""A fit of an arm to a recording whose truth is known: what it finds, and how sure it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from statemachine.interface import Array
from statemachine.lab.identification.fit import fit, starting_points
from statemachine.lab.identification.hypotheses import tried_hypotheses, tried_reading
from statemachine.lab.identification.identify import FittedArm, fitted_model
from statemachine.lab.identification.motions import MOTIONS, middle_and_width, motion_informations
from statemachine.lab.identification.parameters import ArmParameters
from statemachine.lab.identification.recorded_gap import FitSplit
from statemachine.lab.identification.residuals import Residuals
from statemachine.lab.identification.shares import cause_shares, gap_of
from statemachine.lab.identification.simulation import ArmSimulation
from statemachine.lab.identification.starts import (
    Fits,
    fits_from_starts,
    gone_on,
    informations_beside,
    least_certain,
)
from statemachine.lab.identification.verdicts import fitted_parameters

from .support.arm_fits import (
    COUNT,
    SOFT,
    arm_parameters,
    objective_of,
    recording_of,
    swings,
    vector,
)

pytest.importorskip("scipy")
NOISE = 0.6 * COUNT
TRUE = {"kp": SOFT, "delay": 0.045}


@pytest.fixture(scope="module")
def parameters() -> ArmParameters:
    return arm_parameters()


@pytest.fixture(scope="module")
def true(parameters):
    return vector(parameters, TRUE)


@pytest.fixture(scope="module")
def recording(parameters, true):
    return recording_of(parameters, swings(parameters, 2.0), true, NOISE)


@pytest.fixture(scope="module")
def objective(parameters, recording):
    return objective_of(parameters, recording, ("kp", "delay"), NOISE)


@pytest.fixture(scope="module")
def fits(objective) -> Fits:
    return fits_from_starts(objective, starts=3, seed=0)


# The fit.


def test_costs_are_the_same_however_many_are_simulated_together(objective, parameters):
    vectors = np.random.default_rng(0).normal(0.0, 0.1, (50, len(parameters)))
    vectors = np.clip(vectors, parameters.low, parameters.high)
    assert objective.costs(vectors)[47:] == pytest.approx(objective.costs(vectors[47:]), rel=1e-9)


def test_gains_and_delay_are_found(fits, true):
    assert fits.best.vector[:6] == pytest.approx(true[:6], abs=0.15)
    assert fits.best.vector[-2] == pytest.approx(true[-2], abs=0.002)


@pytest.mark.slow
def test_mujocos_own_least_squares_ends_at_the_same_place(objective, fits):
    # mujoco.minimize, which mujoco.sysid fits with: other code, the same residuals.
    minimize = pytest.importorskip("mujoco.minimize")
    weighed = replace(fits.best.objective, free=objective.free)
    scale = weighed.prior_deviations

    def residual(points):
        columns = []
        for point in points.T:
            values = point * scale
            columns.append(
                weighed.residuals(values, weighed.simulation.angles(weighed.vector(values)))
            )
        return np.stack(columns, axis=1)

    low, high = weighed.parameters.low[weighed.free], weighed.parameters.high[weighed.free]
    start = starting_points(objective, 1, 0)[0][weighed.free]
    found, _ = minimize.least_squares(
        start / scale,
        residual,
        bounds=(low / scale, high / scale),
        eps=1e-4,
        max_iter=40,
        verbose=minimize.Verbosity.SILENT,
    )
    cost = 0.5 * np.square(residual(found[:, None])).sum()
    assert fits.best.cost == pytest.approx(cost, abs=0.1)
    apart = (found * scale - fits.best.vector[weighed.free]) / np.sqrt(np.diag(fits.covariance))
    assert np.abs(apart).max() < 0.3


def test_what_is_not_fitted_stays_as_the_model_has_it(fits, parameters):
    held = np.setdiff1d(np.arange(len(parameters)), fits.best.objective.free)
    assert not fits.best.vector[held].any()


def test_the_deviations_are_those_of_the_errors_that_are_made(fits, true):
    free = fits.best.objective.free
    off = (fits.best.vector - true)[free] / fits.deviations
    assert np.sqrt(np.square(off).mean()) < 2.5


def test_starts_from_elsewhere_end_at_the_same_place(fits):
    ends = np.array([each.vector for each in fits.as_good])
    assert len(ends) >= 2
    assert np.ptp(ends, axis=0).max() < 0.05


def test_the_best_fit_comes_first(fits):
    costs = [each.cost for each in fits.each]
    assert costs == sorted(costs)


def test_the_same_seed_gives_the_same_fit(objective):
    ends = [fit(objective, point).vector for point in starting_points(objective, 1, 5) * 2]
    assert np.array_equal(ends[0], ends[1])


def test_starting_points_are_those_that_fit_least_badly(objective):
    few, more = starting_points(objective, 2, 0), starting_points(objective, 2, 1)
    assert not np.array_equal(few[0], more[0])
    costs = []
    for point in few:
        angles = objective.simulation.angles_of_each(point[None])[0]
        costs.append(np.square(objective.residuals(point[objective.free], angles)).sum())
    assert costs == sorted(costs)


def test_a_fit_weighed_as_it_was_is_the_same(fits):
    again = fits.best.weighed(fits.best.objective)
    assert again.cost == pytest.approx(fits.best.cost)
    assert again.jacobian == pytest.approx(fits.best.jacobian)


def test_half_the_noise_weighs_four_times(fits):
    best = fits.best
    half = replace(best.objective, deviation=best.objective.deviation / 2)
    prior = (
        0.5 * np.square(best.vector[best.objective.free] / best.objective.prior_deviations).sum()
    )
    assert best.weighed(half).cost - prior == pytest.approx(4 * (best.cost - prior), rel=1e-6)


def test_the_jacobian_is_how_residuals_change(objective, true):
    values = true[objective.free]
    jacobian = objective.jacobian(values)
    step = np.zeros(len(values))
    step[1] = 0.01
    ends = []
    for place in (values - step, values + step):
        angles = objective.simulation.angles_of_each(objective.vector(place)[None])[0]
        ends.append(objective.residuals(place, angles))
    slope = (ends[1] - ends[0]) / 0.02
    assert jacobian[:, 1] == pytest.approx(slope, abs=0.02 * np.abs(slope).max())


def test_a_rough_jacobian_has_of_each_joint_what_its_own_parameters_change(objective, true):
    values = true[objective.free]
    exact, rough = objective.jacobian(values, with_error=True), objective.rough_jacobian(values)
    joints = len(objective.parameters.joints)
    frames = len(objective.simulation.state)
    of_data = [each[: frames * joints].reshape(frames, joints, -1) for each in (exact, rough)]
    for joint in range(joints):  # the gains come first, in the order of the joints
        own = of_data[0][:, joint, joint]
        assert of_data[1][:, joint, joint] == pytest.approx(own, abs=0.2 * np.abs(own).max())
        others = np.delete(of_data[1][:, :, joint], joint, axis=1)
        assert not others.any()
    assert of_data[1][:, :, -1] == pytest.approx(of_data[0][:, :, -1])  # the delay is of all
    assert rough[frames * joints :] == pytest.approx(exact[frames * joints :])


def test_a_rough_fit_ends_at_the_same_place(objective, fits):
    start = starting_points(objective, 1, 0)[0]
    end = fit(fits.best.objective, start, derivatives="rough")
    apart = (end.vector - fits.best.vector)[objective.free] / fits.deviations
    assert np.abs(apart).max() < 1.0


def test_a_start_that_the_best_does_not_help_goes_on_by_itself(objective, fits):
    # As if nothing changed the angles: no step of the best one leads anywhere.
    blind = np.zeros_like(fits.best.jacobian)
    blind[-len(objective.free) :] = fits.best.jacobian[-len(objective.free) :]
    best = replace(fits.best, near_jacobian=blind)
    start = fits.best.vector.copy()
    start[objective.free[:6]] += 0.3
    end = fit(fits.best.objective, start, runs=1)
    assert end.cost > fits.best.cost + 100.0
    assert gone_on(end, best).cost < fits.best.cost + 1.0


# What is left.


def test_noise_alone_is_at_the_floor(fits):
    assert fits.residuals.at_floor
    assert fits.residuals.floor == pytest.approx(NOISE, rel=0.1)


def test_a_slow_error_of_the_model_is_above_the_floor(recording):
    random = np.random.default_rng(0)
    noise = random.normal(0.0, NOISE, recording.state.shape)
    slow = 2 * NOISE * np.sin(np.arange(len(noise)) / 10)[:, None]
    assert Residuals.of(noise, recording).at_floor
    assert not Residuals.of(noise + slow, recording).at_floor


def test_an_error_that_changes_from_frame_to_frame_is_no_noise_where_it_is_large(recording):
    errors = np.random.default_rng(0).normal(0.0, 0.1, recording.state.shape)
    assert not Residuals.of(errors, recording).at_floor


def test_angles_that_are_no_numbers_are_never_at_the_floor(recording):
    assert not Residuals.of(np.full(recording.state.shape, np.nan), recording).at_floor


def test_elsewhere_more_is_left_where_the_fit_is_uncertain(recording):
    # An error of the model of twice the noise, which is to be expected of an uncertain fit alone.
    random = np.random.default_rng(0)
    slow = 2 * NOISE * np.sin(np.arange(len(recording.state)) / 10)[:, None]
    left = Residuals.of(random.normal(0.0, NOISE, recording.state.shape) + slow, recording)
    assert not left.holds(np.zeros(6))
    assert not left.holds(np.full(6, 0.2 * NOISE))
    assert left.holds(np.full(6, 2 * NOISE))


def test_what_a_recording_hardly_tells_makes_other_angles_uncertain(parameters, fits):
    # Of slow swings the delay is told less than of fast ones, which depend on it more.
    predicted: list[float] = []
    for rate in (0.2, 2.0):
        motion = ArmSimulation.of_motion(parameters, swings(parameters, 2.0, rate), 30.0)
        angles = motion.angles(fits.best.vector)
        predicted.append(float(of_held_out(fits, motion, angles).predicted().max()))
    assert predicted[0] < predicted[1]


def test_of_the_last_frames_alone_only_these_count(parameters, fits):
    motion = ArmSimulation.of_motion(parameters, swings(parameters, 2.0), 30.0)
    angles = motion.angles(fits.best.vector)
    whole = of_held_out(fits, motion, angles).predicted()
    last = of_held_out(fits, motion, angles, first=40).predicted()
    first = of_held_out(fits, replace_frames(motion, 40), angles[:40]).predicted()
    together = np.sqrt((40 * first**2 + 20 * last**2) / 60)
    assert together == pytest.approx(whole, rel=1e-6)


def of_held_out(fits: Fits, motion: ArmSimulation, angles: Array, first: int = 0) -> FittedArm:
    """Return a fitted arm whose held-out recording is a motion, from a frame on."""
    split = FitSplit(motion.recording, motion.recording, first, "all")
    return FittedArm(fits, motion, split, angles, angles)


def replace_frames(motion: ArmSimulation, frames: int) -> ArmSimulation:
    """Return the simulation of the first frames of a motion."""
    recording = motion.recording
    shorter = replace(recording, action=recording.action[:frames], state=recording.state[:frames])
    return replace(motion, recording=shorter)


def test_a_still_joint_may_be_off_by_less_than_a_count(recording):
    still = replace(recording, state=np.zeros_like(recording.state))
    assert Residuals.of(np.full(still.state.shape, 0.6 * COUNT), still).at_floor
    assert not Residuals.of(np.full(still.state.shape, 1.5 * COUNT), still).at_floor


# What is said of each parameter.


def test_what_is_told_holds_and_agrees_is_determined(fits):
    verdicts = {each.kind: each.verdict for each in fitted_parameters(fits, True, ())}
    assert verdicts["delay"] == "determined"


def test_nothing_is_determined_that_does_not_hold_elsewhere(fits):
    said = fitted_parameters(fits, False, ())
    assert {each.verdict for each in said} == {"cannot tell"}
    assert all("does not hold elsewhere" in each.reasons for each in said)


def test_nothing_is_determined_where_more_than_noise_is_left(fits):
    left = replace(fits.residuals, rms=2 * fits.residuals.rms)
    said = fitted_parameters(replace(fits, residuals=left), True, ())
    assert all("residual above the floor" in each.reasons for each in said)


@pytest.mark.parametrize(("worse", "told"), [(1, True), (2, False)])
def test_most_starts_are_to_end_as_well_as_the_best(worse, told, fits):
    best = fits.best
    elsewhere = replace(best, cost=best.cost + 10.0)
    some = replace(fits, each=(*[best] * (4 - worse), *[elsewhere] * worse))
    said = fitted_parameters(some, True, ())
    assert any(each.verdict == "determined" for each in said) == told


def test_a_start_as_good_and_elsewhere_is_no_agreement(fits):
    elsewhere = fits.best.vector.copy()
    elsewhere[0] += 1.0
    other = replace(fits.best, vector=elsewhere)
    said = fitted_parameters(replace(fits, each=(fits.best, other, fits.best)), True, ())
    assert "starts disagree" in said[0].reasons
    assert "starts disagree" not in said[1].reasons


def test_the_interval_reaches_to_a_start_that_is_as_good(fits):
    elsewhere = fits.best.vector.copy()
    elsewhere[0] += 1.0
    other = replace(fits.best, vector=elsewhere)
    said = fitted_parameters(replace(fits, each=(fits.best, other, fits.best)), True, ())
    assert said[0].high == pytest.approx(said[0].fitted * np.e)


def test_of_a_vertical_axis_the_offset_is_not_told(parameters, recording):
    objective = objective_of(parameters, recording, ("kp", "delay", "offset"), NOISE)
    best = fit(objective, vector(parameters, TRUE))
    residuals = Residuals.of(best.errors, recording)
    said = fitted_parameters(Fits((best, best, best), residuals), True, ())
    of_pan = next(each for each in said if each.kind == "offset" and each.joint == "shoulder_pan")
    assert of_pan.posterior_by_prior == pytest.approx(1.0, abs=0.01)
    assert of_pan.reasons == ("too little information",)


def test_what_only_the_force_limit_tells_is_not_told_of_a_weaker_arm(parameters):
    # Gains, friction and armature of the gripper have a common scale, which only shows where its
    # servo reaches the limit of its force: here it does, and with three quarters of them not.
    at_limit = vector(parameters, {"kp": SOFT, "viscous": -0.8})
    at_limit[[5, 11, 17, 23]] += 0.8
    recording = recording_of(parameters, swings(parameters, 2.0, rate=1.0), at_limit)
    kinds = ("kp", "viscous", "friction", "armature")
    best = fit(objective_of(parameters, recording, kinds, NOISE), at_limit)
    residuals = Residuals.of(best.errors, recording)
    prior = best.objective.prior_deviations
    of_best = least_certain([best.information], prior)[5]
    fits = Fits((best, best, best), residuals, informations_beside(best))
    assert fits.deviations[5] > 2.0 * of_best
    said = fitted_parameters(fits, True, ())
    assert said[5].high > 1.4 * said[5].fitted


def test_a_joint_that_the_recording_shows_not_to_be_weaker_stays_as_sure(parameters):
    # Far beyond the limit of its force, a weaker gripper would move otherwise.
    beyond = vector(parameters, {"kp": SOFT, "viscous": -0.8})
    beyond[[5, 11, 17, 23]] += 1.3
    recording = recording_of(parameters, swings(parameters, 2.0, rate=1.0), beyond)
    kinds = ("kp", "viscous", "friction", "armature")
    best = fit(objective_of(parameters, recording, kinds, NOISE), beyond)
    fits = Fits((best,), Residuals.of(best.errors, recording), informations_beside(best))
    of_best = least_certain([best.information], best.objective.prior_deviations)[5]
    assert of_best < 0.1
    assert fits.deviations[5] < 1.5 * of_best


# What other motions would tell.


def test_each_motion_adds_information(fits):
    for motion in motion_informations(fits.best):
        assert np.linalg.eigvalsh(motion.information).min() > 0.0


def test_motions_stay_within_the_joints_ranges(parameters, fits):
    low, high = np.array(parameters.model.jnt_range).T
    middle, width = middle_and_width(parameters, np.zeros(6))
    assert (middle - width > low).all()
    assert (middle + width < high).all()


@pytest.mark.parametrize("name", MOTIONS)
def test_a_motion_goes_no_further_than_its_width(name):
    shape = MOTIONS[name](np.arange(300) / 30.0, 6)
    assert shape.shape == (300, 6)
    assert np.abs(shape).max() <= 1.0


# Causes.


@pytest.fixture(scope="module")
def shares(fits, parameters, recording):
    return {
        each.cause: each for each in cause_shares(fits, ArmSimulation.of(parameters, recording))
    }


@pytest.mark.slow
def test_delay_and_gains_stand_in_for_each_other(shares):
    assert shares["gains"].alone + shares["delay"].alone > 1.1
    assert shares["gains"].share + shares["delay"].share > 0.9


@pytest.mark.slow
def test_shares_add_up_to_what_all_take_away(shares):
    assert 0.95 < sum(each.share for each in shares.values()) <= 1.0


def test_the_gap_of_the_truth_is_its_noise(parameters, recording, true):
    gap = gap_of(ArmSimulation.of(parameters, recording), true)
    assert gap == pytest.approx(NOISE, rel=0.2)


# Other readings.


def test_no_sign_is_tried_where_only_noise_is_left(fits):
    assert tried_hypotheses(fits, saturated=0.0) == ()


@pytest.mark.slow
def test_the_other_sign_of_a_lifting_joint_fits_better_where_it_is_the_true_one(
    parameters, recording
):
    turned = np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    wrong = replace(recording, action=recording.action * turned, state=recording.state * turned)
    objective = objective_of(parameters, wrong, ("kp", "delay", "payload"), NOISE)
    found = fits_from_starts(objective, starts=2, seed=0)
    verdicts = {each.name: each.verdict for each in tried_hypotheses(found, saturated=0.0)}
    assert verdicts["the other sign of shoulder_lift"] == "fits better"
    assert verdicts["the other sign of elbow_flex"] != "fits better"


def test_a_reading_whose_angles_are_no_nearer_does_not_fit_better(fits):
    objective = fits.best.objective
    far = replace(fits, residuals=replace(fits.residuals, rms=2 * fits.residuals.rms))
    near = replace(fits, residuals=replace(fits.residuals, rms=0.5 * fits.residuals.rms))
    assert tried_reading("other", objective, far, cost=1e6).verdict == "fits better"
    assert tried_reading("other", objective, near, cost=1e6).verdict == "cannot tell"


def test_where_viscous_friction_acts_is_tried_at_the_force_limit(fits):
    (tried,) = tried_hypotheses(fits, saturated=0.5)
    assert "viscous" in tried.name


# The fitted model.


def test_the_fitted_model_has_the_fitted_gains(fits, parameters):
    model = fitted_model(parameters, fits.best.vector)
    expected = parameters.model.actuator_kp * np.exp(fits.best.vector[:6])
    assert model.actuator_kp == pytest.approx(expected)
