"""Commands of a recording, played into an arm with other parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import statemachine as sm
from statemachine.lab.identification.parameters import ArmParameters
from statemachine.lab.identification.simulation import ArmSimulation

from .support.arm_fits import COUNT, FPS, SOFT, arm_parameters, recording_of, swings, vector


@pytest.fixture(scope="module")
def parameters() -> ArmParameters:
    return arm_parameters()


@pytest.fixture(scope="module")
def motion(parameters) -> ArmSimulation:
    return ArmSimulation.of_motion(parameters, swings(parameters, 1.0), FPS)


SOFT_ARM = {"kp": SOFT, "viscous": -0.8}


def test_angles_have_a_row_for_each_frame(motion, parameters):
    assert motion.angles(vector(parameters, SOFT_ARM)).shape == (30, 6)


def test_the_first_angles_are_those_that_were_measured(motion, parameters):
    first = motion.angles(vector(parameters, SOFT_ARM))[0]
    assert first == pytest.approx(motion.state[0])


def test_the_same_vector_gives_the_same_bits(motion, parameters):
    soft = vector(parameters, SOFT_ARM)
    assert np.array_equal(motion.angles(soft), motion.angles(soft))


def test_worlds_do_not_know_of_each_other(motion, parameters):
    soft, stiff = vector(parameters, SOFT_ARM), vector(parameters, {})
    together = motion.angles_of_each(np.stack([soft, stiff]))
    assert np.array_equal(together[1], motion.angles_of_each(stiff[None])[0])


def test_richardson_takes_away_most_of_the_error_of_a_step(motion, parameters):
    soft = vector(parameters, SOFT_ARM)
    truth = 2.0 * motion._played(soft[None], 256)[0] - motion._played(soft[None], 128)[0]
    coarse = np.abs(motion._played(soft[None], 8)[0] - truth).max()
    assert np.abs(motion.angles(soft) - truth).max() < coarse / 10


def test_a_delay_of_whole_frames_is_the_angle_of_frames_before(motion, parameters):
    soft = vector(parameters, SOFT_ARM)
    late = vector(parameters, {**SOFT_ARM, "delay": 2 / FPS})
    assert motion.angles(late)[5:] == pytest.approx(motion.angles(soft)[3:-2], abs=1e-12)


def test_a_delay_between_steps_lies_between(motion, parameters):
    angles = [
        motion.angles_of_each(vector(parameters, {**SOFT_ARM, "delay": delay})[None])[0]
        for delay in (0.0500, 0.0505, 0.0510)
    ]
    assert angles[1] == pytest.approx((angles[0] + angles[2]) / 2, abs=1e-5)


def test_before_a_late_measurement_the_arm_is_where_it_began(motion, parameters):
    late = motion.angles(vector(parameters, {**SOFT_ARM, "delay": 0.1}))
    assert late[:3] == pytest.approx(np.tile(motion.state[0], (3, 1)))


def test_an_offset_alone_shifts_what_no_force_pulls_at(parameters):
    # The axis of the pan is vertical: the same commands and angles, by a constant.
    action = swings(parameters, 1.0)
    motion = ArmSimulation.of_motion(parameters, action, FPS)
    soft = vector(parameters, SOFT_ARM)
    shifted = soft.copy()
    shifted[parameters.of_kind("offset")[0]] = 0.05
    assert motion.angles(shifted)[:, 0] == pytest.approx(motion.angles(soft)[:, 0], abs=1e-9)


def test_an_offset_of_a_lifting_joint_changes_how_gravity_pulls(parameters):
    motion = ArmSimulation.of_motion(parameters, swings(parameters, 1.0), FPS)
    soft = vector(parameters, SOFT_ARM)
    shifted = soft.copy()
    shifted[parameters.of_kind("offset")[1]] = 0.05
    assert np.abs(motion.angles(shifted) - motion.angles(soft)).max() > COUNT / 2


def test_angles_are_smooth_in_the_parameters(motion, parameters):
    # With implicitfast they are not, where servos reach their limit: fits end in the dents.
    soft = vector(parameters, {"kp": -1.5, "viscous": 0.0})
    way = vector(parameters, {"kp": 0.1, "viscous": 0.1})
    points = np.linspace(0.0, 1.0, 21)
    angles = motion.angles_of_each(soft + points[:, None] * way)
    bend = np.abs(np.diff(angles, 3, axis=0)).max()
    assert bend < 0.02 * COUNT


def test_what_diverges_has_no_angles_and_ends_no_other_world(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text(
        "<mujoco><worldbody><body><joint name='hip' armature='0.1' frictionloss='0.1' damping='1'/>"
        "<geom size='0.1'/></body></worldbody>"
        "<actuator><position joint='hip' kp='100' kv='1'/></actuator></mujoco>"
    )
    parameters = ArmParameters.of(sm.load(file), ["hip"])
    action = np.full((60, 1), 0.3)
    action[0] = 0.0
    motion = ArmSimulation.of_motion(parameters, action, FPS)
    calm = np.zeros(len(parameters))
    wild = calm.copy()
    wild[parameters.of_kind("kp")] = 12.0
    angles = motion.angles_of_each(np.stack([wild, calm]))
    assert np.isnan(angles[0]).all()
    assert np.isfinite(angles[1]).all()


def test_a_recording_that_starts_at_rest_counts_from_its_first_frame(motion):
    assert motion.first_frame == 0


def test_of_a_recording_that_starts_in_motion_the_first_half_second_does_not_count(parameters):
    recording = recording_of(parameters, swings(parameters, 2.0), vector(parameters, SOFT_ARM))
    later = replace(recording, action=recording.action[20:], state=recording.state[20:])
    assert ArmSimulation.of(parameters, later).first_frame == 15


def test_a_recording_in_motion_starts_with_its_velocity(parameters):
    recording = recording_of(parameters, swings(parameters, 2.0), vector(parameters, SOFT_ARM))
    later = replace(recording, action=recording.action[20:], state=recording.state[20:])
    measured = (recording.state[21] - recording.state[20]) * FPS
    simulation = ArmSimulation.of(parameters, later)
    assert simulation.first_velocity == pytest.approx(measured, abs=0.15)


def test_the_other_sign_turns_commands_and_angles(motion, parameters):
    signs = np.array([1, -1, 1, 1, 1, 1])
    other = replace(motion, signs=signs)
    assert np.array_equal(other.state[:, 1], -motion.state[:, 1])
    assert np.array_equal(other.action[:, 1], -motion.action[:, 1])


def test_a_stiff_servo_is_at_its_limit_more_often_than_a_soft_one(motion, parameters):
    stiff = motion.saturated(vector(parameters, {"kp": 0.5}))
    soft = motion.saturated(vector(parameters, {"kp": SOFT, "viscous": -0.8}))
    assert stiff.max() > soft.max()
