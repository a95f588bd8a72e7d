"""One solution of exercises/test_arm.py: every fault is caught, on both engines.

    statemachine check --faults teaching/solutions/test_arm.py

Each test knows its answer without the simulator: from a drawing, from school physics, or
because two ways to the same place must end there.
"""

import math

import numpy as np
import pytest

import statemachine as sm

HALF = math.sqrt(0.5)  # cosine and sine of 45 degrees: half of a quarter turn


def place_of(model, joint):
    """Return where a joint's numbers begin in qpos and in qvel."""
    number = model.joint_id(joint)
    return model.jnt_qposadr[number], model.jnt_dofadr[number]


def fingertip(model, data):
    """Return a copy: what `data.site_xpos` shows changes with the next step."""
    return data.site_xpos[model.site_id("gripperframe")].copy()


@pytest.fixture
def weightless(model):
    """Return the scene without gravity, where a spin lasts."""
    return model.replace(gravity=[0, 0, 0])


# Where things are.


def test_pan_turns_the_fingertip_about_the_axis_of_the_base(model, data):
    sm.forward(model, data)
    x, y, z = fingertip(model, data)
    axis_x, axis_y, _ = data.xpos[model.body_id("shoulder")]
    data.qpos[place_of(model, "shoulder_pan")[0]] = math.pi / 2
    sm.forward(model, data)
    # The axis points down, so seen from above it is a quarter turn clockwise: dx, dy -> dy, -dx.
    expected = axis_x + (y - axis_y), axis_y - (x - axis_x), z
    assert fingertip(model, data) == pytest.approx(expected, abs=1e-9)


def test_a_link_begins_at_its_own_joint(model, data):
    # So turning that joint leaves the origin of the link where it is; its centre of mass moves.
    sm.forward(model, data)
    before = data.xpos[model.body_id("upper_arm")].copy()
    data.qpos[place_of(model, "shoulder_lift")[0]] = 1.0
    sm.forward(model, data)
    assert data.xpos[model.body_id("upper_arm")] == pytest.approx(before, abs=1e-9)


def test_a_quarter_turn_as_a_quaternion(model, data):
    start, _ = place_of(model, "box")
    data.qpos[start + 3 : start + 7] = HALF, 0, 0, HALF  # w x y z: about z
    sm.forward(model, data)
    assert data.xquat[model.body_id("box")] == pytest.approx((HALF, 0, 0, HALF), abs=1e-9)


# What changes when.


def test_forward_takes_no_time_and_moves_nothing(model, data):
    data.qvel[:6] = 0.5
    before = data.time, data.qpos.tolist(), data.qvel.tolist()
    sm.forward(model, data)
    assert (data.time, data.qpos.tolist(), data.qvel.tolist()) == before


def test_after_a_step_the_fingertip_is_that_of_the_state_before(model, data):
    data.qvel[place_of(model, "shoulder_pan")[1]] = 2.0
    sm.forward(model, data)
    before = fingertip(model, data)
    sm.step(model, data)
    assert fingertip(model, data) == pytest.approx(before, abs=1e-9)
    sm.forward(model, data)
    assert np.linalg.norm(fingertip(model, data) - before) > 1e-3


def test_ten_steps_are_ten_steps(model, data):
    data.ctrl[:] = 0.4
    sm.step(model, data, 10)
    with sm.make_data(model) as other:
        other.ctrl[:] = 0.4
        for _ in range(10):
            sm.step(model, other)
        assert data.qpos == pytest.approx(other.qpos, abs=1e-9)
        assert data.time == pytest.approx(other.time)


def test_reset_forgets_the_command(model, data):
    data.ctrl[:] = 0.4
    sm.step(model, data, 10)
    sm.reset(model, data)
    assert data.ctrl.tolist() == [0.0] * model.nu
    sm.reset(model, data, keyframe=0)
    assert data.ctrl.tolist() == model.keyframes[0].ctrl.tolist()


# What forces do.


def test_the_box_falls_as_everything_does(model, data):
    (start, _), steps = place_of(model, "box"), 40
    data.qpos[start + 2] = 2.0
    sm.step(model, data, steps)
    # z = 2 - g·t²/2; in steps that change first the speed, then the place, t² is t·(t + h).
    time = steps * model.timestep
    fallen = 9.81 * time * (time + model.timestep) / 2
    assert data.qpos[start + 2] == pytest.approx(2.0 - fallen, abs=1e-9)


def test_an_arm_without_servos_falls(model):
    limp = model.replace(actuation=False)
    with sm.make_data(limp) as data:
        sm.forward(limp, data)
        before = fingertip(limp, data)
        sm.step(limp, data, 80)
        sm.forward(limp, data)
        assert fingertip(limp, data)[2] < before[2] - 0.02


def test_a_servo_is_a_spring_that_carries_the_arm(model, data):
    # Nothing moves after two seconds: kp times the sag carries the weight, but for dry friction.
    sm.step(model, data, 400)
    sm.forward(model, data)
    spring = model.actuator_kp * (data.ctrl - data.qpos[:6])
    weight = data.qfrc_bias[:6]
    assert np.abs(weight).max() > 0.3
    assert np.all(np.abs(spring - weight) < model.dof_frictionloss[:6] + 0.01)


def test_a_turned_box_spins_about_its_own_axis(weightless):
    with sm.make_data(weightless) as data:
        (q, v), half = place_of(weightless, "box"), 0.25  # of the angle [rad]
        data.qpos[q + 2 : q + 7] = 1.0, HALF, HALF, 0, 0  # a metre up; a quarter turn about x
        data.qvel[v + 5] = 1.0  # rad/s about its own z, for half a second
        sm.step(weightless, data, 100)
        # (HALF + HALF·i)·(cos + sin·k), first about z, then about x; i·k = -j.
        c, s = HALF * math.cos(half), HALF * math.sin(half)
        assert data.qpos[q + 3 : q + 7] == pytest.approx((c, c, -s, s), abs=1e-6)


def test_the_same_start_and_commands_give_the_same_bits(model):
    runs = []
    for _ in range(2):
        with sm.make_data(model) as data:
            for k in range(50):
                data.ctrl[:] = 0.3 * math.sin(0.1 * k)
                sm.step(model, data)
            runs.append(data.qpos.tobytes() + data.qvel.tobytes())
    assert runs[0] == runs[1]
