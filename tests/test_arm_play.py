"""Play of joints and a tilted base: what an arm may have and its model lacks, on a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from statemachine.lab.identification.fit import Fit, fit
from statemachine.lab.identification.identify import fitted_arm
from statemachine.lab.identification.linear_refit import LinearRefit
from statemachine.lab.identification.parameters import ArmParameters
from statemachine.lab.identification.play import behind_play
from statemachine.lab.identification.play_profiles import play_profiles
from statemachine.lab.identification.recorded_gap import recorded_arm_of
from statemachine.lab.identification.refinements import Refinement, tried_refinements
from statemachine.lab.identification.residuals import Residuals
from statemachine.lab.identification.results import FittedParameter, Hypothesis, RecordingRequest
from statemachine.lab.identification.simulation import ArmSimulation
from statemachine.lab.identification.starts import Fits
from statemachine.lab.identification.tilt import likeliest_tilt, tilted_gravity
from statemachine.lab.identification.verdicts import fitted_parameters
from tools.arm_recordings.arm_truth import Fault
from tools.arm_recordings.recordings import Plan, make, write

from .support.arm_fits import (
    COUNT,
    FPS,
    SOFT,
    arm_parameters,
    objective_of,
    swings,
    vector,
)

pytest.importorskip("scipy")
NOISE = 0.6 * COUNT
TRUE = {"kp": SOFT, "viscous": -0.8, "delay": 0.045}
KINDS = ("kp", "friction", "delay", "offset")
ELBOW = 2
PLAY = np.radians(0.3)


@pytest.fixture(scope="module")
def parameters() -> ArmParameters:
    return arm_parameters()


@pytest.fixture(scope="module")
def motion(parameters) -> ArmSimulation:
    return ArmSimulation.of_motion(parameters, swings(parameters, 4.0, rate=1.0), FPS)


def fits_of(arm: ArmSimulation, true: np.ndarray) -> Fits:
    """Return the fit of the model to what an arm shows that may have play, or be tilted."""
    random = np.random.default_rng(0)
    angles = arm.angles(true)
    state = angles + random.normal(0.0, NOISE, angles.shape)
    recording = replace(arm.recording, state=state)
    objective = objective_of(arm.parameters, recording, KINDS, NOISE)
    objective = replace(objective, fixed=true)
    best = fit(objective, true, derivatives="exact")
    return Fits((best,) * 3, Residuals.of(best.errors, recording))


@pytest.fixture(scope="module")
def true(parameters) -> np.ndarray:
    return vector(parameters, TRUE)


@pytest.fixture(scope="module")
def clean(motion, true) -> Fits:
    return fits_of(motion, true)


@pytest.fixture(scope="module")
def with_play(motion, true) -> Fits:
    play = np.zeros(6)
    play[ELBOW] = PLAY
    return fits_of(replace(motion, play=play), true)


@pytest.fixture(scope="module")
def of_play(with_play) -> tuple[Refinement, ...]:
    return tried_refinements(with_play)


# The operator.


def test_behind_play_a_joint_that_turns_back_is_not_seen_until_it_has_crossed_it():
    there_and_back = np.array([0.0, 1.0, 2.0, 3.0, 2.5, 2.0, 1.0, 0.0])
    shown = behind_play(there_and_back[None, :, None], np.array([1.0]))[0, :, 0]
    assert shown.tolist() == [0.0, 0.5, 1.5, 2.5, 2.5, 2.5, 1.5, 0.5]


def test_motion_within_the_play_is_not_seen():
    within = 0.4 * np.sin(np.arange(50.0))
    assert not behind_play(within[None, :, None], np.array([1.0])).any()


def test_without_play_angles_are_seen_as_they_are():
    angles = np.random.default_rng(0).normal(size=(2, 30, 6))
    assert np.array_equal(behind_play(angles, np.zeros(6)), angles)


def test_each_width_at_once_is_each_width_alone(motion, true):
    widths = np.array([0.0, 0.002, 0.01])
    together = motion.angles_with_play(true, widths)
    for width, angles in zip(widths, together, strict=True):
        alone = replace(motion, play=np.full(6, width)).angles(true)
        assert angles == pytest.approx(alone, abs=1e-12)


def test_play_of_one_joint_leaves_the_others(motion, true):
    play = np.zeros(6)
    play[ELBOW] = PLAY
    change = np.abs(replace(motion, play=play).angles(true) - motion.angles(true)).max(axis=0)
    assert change[ELBOW] == pytest.approx(0.5 * PLAY, rel=0.01)
    assert not np.delete(change, ELBOW).any()


# The refit.


def test_a_refit_takes_back_what_a_parameter_can_change(clean):
    best = clean.best
    of_data = best.jacobian[: best.errors.size, 3].reshape(best.errors.shape)
    end = LinearRefit.of(best).end(1e-6 * of_data * best.objective.deviation)
    assert end.shift == pytest.approx(-1e-6 * np.eye(len(end.shift))[3], abs=1e-8)
    assert end.cost == pytest.approx(best.cost, abs=0.05)


def test_a_refit_cannot_take_back_noise(clean):
    noise = np.random.default_rng(1).normal(0.0, NOISE, clean.best.errors.shape)
    refit = LinearRefit.of(clean.best)
    end = refit.end(noise)
    assert end.cost > 1.5 * clean.best.cost
    assert end.residual == pytest.approx(np.sqrt(2.0) * NOISE, rel=0.1)


def test_a_refit_says_where_a_fit_with_play_ends(clean):
    # Of a width whose refit moves friction little, so that it is linear.
    profile = play_profiles(LinearRefit.of(clean.best))[ELBOW]
    place = 2
    play = np.zeros(6)
    play[ELBOW] = profile.sizes[place]
    objective = clean.best.objective
    other = replace(objective, simulation=replace(objective.simulation, play=play))
    end = fit(other, clean.best.vector, derivatives="exact")
    assert profile.ends[place].cost == pytest.approx(end.cost, abs=0.2)


# Play.


def test_play_is_found_where_it_is_and_nowhere_else(of_play):
    better = [each.hypothesis.name for each in of_play if each.fits_better]
    assert better == ["play of elbow_flex"]


def test_its_width_is_found(of_play):
    assert of_play[ELBOW].hypothesis.size == pytest.approx(PLAY, abs=0.75 * COUNT)


def test_without_play_no_play_fits_better(clean):
    assert not any(each.fits_better for each in tried_refinements(clean))


def friction_of(said: tuple[FittedParameter, ...], joint: str) -> FittedParameter:
    return next(each for each in said if (each.kind, each.joint) == ("friction", joint))


def test_without_trying_play_a_fit_is_sure_of_too_much_friction(with_play, parameters):
    as_it_is = friction_of(fitted_parameters(with_play, True, ()), "elbow_flex")
    figure = parameters.each[parameters.of_kind("friction")[ELBOW]].model
    assert as_it_is.verdict == "determined"
    assert as_it_is.low > 1.5 * figure


def test_friction_that_stands_in_for_play_is_not_determined(with_play, of_play):
    tried = friction_of(fitted_parameters(with_play, True, (), of_play), "elbow_flex")
    assert tried.reasons == ("play fits as well",)


def test_its_interval_reaches_to_the_friction_of_an_arm_with_play(with_play, of_play, parameters):
    tried = friction_of(fitted_parameters(with_play, True, (), of_play), "elbow_flex")
    figure = parameters.each[parameters.of_kind("friction")[ELBOW]].model
    assert tried.low < 1.2 * figure


def test_friction_of_a_joint_without_play_stays_determined(with_play, of_play):
    said = fitted_parameters(with_play, True, (), of_play)
    assert friction_of(said, "shoulder_pan").verdict == "determined"


def refinement(best: Fit, verdict: str, shift: float) -> Refinement:
    """Return a refinement that moves the first parameter by so many standard deviations."""
    deviations = Fits((best,), Residuals.of(best.errors, best.objective.simulation.recording))
    shifts = np.zeros((1, len(best.objective.free)))
    shifts[0, 0] = shift * deviations.deviations[0]
    said = Hypothesis("play of shoulder_pan", 0.0, 0.0, verdict, 0.002)  # pyright: ignore
    return Refinement(said, "play fits as well", shifts)


@pytest.mark.parametrize(
    ("verdict", "shift", "is_told"),
    [
        ("fits better", 0.4, True),
        ("fits better", -0.6, False),
        ("cannot tell", -1.9, True),
        ("cannot tell", 2.1, False),
    ],
)
def test_what_is_as_likely_may_move_a_figure_within_its_interval_alone(
    clean, verdict, shift, is_told
):
    said = fitted_parameters(clean, True, (), [refinement(clean.best, verdict, shift)])
    assert ("play fits as well" not in said[0].reasons) == is_told
    assert "play fits as well" not in said[1].reasons


def test_the_interval_reaches_to_what_play_makes_of_a_figure(clean):
    before = fitted_parameters(clean, True, ())[0]
    after = fitted_parameters(clean, True, (), [refinement(clean.best, "cannot tell", 5.0)])[0]
    assert after.low == before.low
    assert np.log(after.high / after.fitted) == pytest.approx(
        5.0 / 1.96 * np.log(before.high / before.fitted)
    )


WITH_PLAY = ("elbow_flex", "wrist_flex")


@pytest.fixture(scope="module")
def fits_of_recording(tmp_path_factory) -> Fits:
    """Return the fits of a recording of an arm with play at two joints."""
    pytest.importorskip("pyarrow")
    plan = Plan(
        "play", seed=600, fault=Fault(play=tuple((joint, PLAY) for joint in WITH_PLAY)), seconds=5.0
    )
    folder = tmp_path_factory.mktemp("recorded") / plan.name
    write(make(plan), folder)
    arm = recorded_arm_of(RecordingRequest(f"lerobot:{folder}", "so101"))
    return fitted_arm(arm, starts=2, seed=0).fits


@pytest.mark.slow
def test_play_of_a_recording_is_found(fits_of_recording):
    tried = tried_refinements(fits_of_recording)
    better = {each.hypothesis.name for each in tried if each.fits_better}
    assert better == {f"play of {joint}" for joint in WITH_PLAY}


@pytest.mark.slow
@pytest.mark.parametrize("joint", WITH_PLAY)
def test_friction_is_not_determined_of_a_recording_with_play(fits_of_recording, joint):
    refinements = tried_refinements(fits_of_recording)
    said = fitted_parameters(fits_of_recording, True, (), refinements)
    assert "play fits as well" in friction_of(said, joint).reasons


# A tilted base.


@pytest.mark.parametrize(
    ("tilt", "expected"),
    [
        # Turned about y, the front (x) goes down, and gravity pulls to it.
        ((0.0, 0.1), (10 * np.sin(0.1), 0.0, -10 * np.cos(0.1))),
        ((0.1, 0.0), (0.0, -10 * np.sin(0.1), -10 * np.cos(0.1))),
        ((0.0, 0.0), (0.0, 0.0, -10.0)),
    ],
)
def test_gravity_of_a_tilted_base_is_as_strong_and_from_the_side_that_is_low(tilt, expected):
    level = np.array([0.0, 0.0, -10.0])
    assert tilted_gravity(level, np.array(tilt)) == pytest.approx(expected)


TILT = np.radians([3.0, -4.0])


@pytest.fixture(scope="module")
def tilted(motion, true, parameters) -> Fits:
    gravity = tilted_gravity(np.array(parameters.model.gravity), TILT)
    return fits_of(replace(motion, gravity=gravity), true)


@pytest.fixture(scope="module")
def of_tilt(tilted) -> tuple[Refinement, ...]:
    return tried_refinements(tilted)


def test_a_tilted_base_alone_fits_better(of_tilt):
    assert [each.hypothesis.name for each in of_tilt if each.fits_better] == ["a tilted base"]


def test_how_far_a_base_is_tilted_is_found(of_tilt):
    assert of_tilt[-1].hypothesis.size == pytest.approx(np.radians(5.0), abs=np.radians(1.5))


def test_about_which_axis_a_base_is_tilted_is_found(tilted):
    found = likeliest_tilt(LinearRefit.of(tilted.best)).angles
    assert found[0] == pytest.approx(TILT[0], abs=np.radians(0.5))


def test_what_a_tilted_base_changes_is_not_determined(tilted, of_tilt):
    said = fitted_parameters(tilted, True, (), of_tilt)
    assert any("a tilted base fits as well" in each.reasons for each in said)
