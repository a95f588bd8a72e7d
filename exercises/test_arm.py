"""Exercise: tests that a wrong arm does not pass.

    statemachine check --faults exercises/test_arm.py

runs these tests on the healthy arm, where all must pass, and then on arms with one fault each:
one reads quaternions in another order, one has its joints shifted, one has a motor that was left
on, and so on. Where no test fails on an arm with a fault, the fault is named, with a hint. Add
tests until each fault makes one fail.

A test is a function whose name begins with test_, as for pytest. Its arguments are what it needs:

    model    the arm on a floor, with a box (sm.load("so101/scene_box"))
    data     a new Data of it: all joints at zero, and nothing derived yet
    backend  the name of the engine that the test runs on

Beside what step_loop.py lists you may need:

    data.xpos[model.body_id("box")]         where the frame of a body is, three numbers [m]
    data.xquat[model.body_id("box")]        how it is turned, a quaternion w x y z
    model.body_names, model.gravity         names of all bodies; gravity [m/s²]
    statemachine conventions velocity       what the six velocities of a free body mean
    models/so101/so101.xml                  the arm's file: where each body is on the one before it

    pytest exercises/test_arm.py

runs them on the healthy arm alone, and shows more of what fails. The arguments come from
conftest.py beside this file; without that, type

    pytest -p statemachine.course.grading.faults.plugin test_arm.py

What should a test expect? Not what the simulator printed yesterday, but what you know without
it: a turn by 90 degrees, a free fall, a circle about an axis, a weight on a spring, two runs that
must agree.
"""

import math

import numpy as np

import statemachine as sm


def test_the_fingertip_is_somewhere(model, data):
    sm.forward(model, data)
    assert np.linalg.norm(data.site_xpos[model.site_id("gripperframe")]) > 0.1


def test_a_command_is_followed(model, data):
    data.ctrl[model.actuator_id("elbow_flex")] = 0.5
    sm.step(model, data, 400)
    angle = data.qpos[model.jnt_qposadr[model.joint_id("elbow_flex")]]
    assert math.isclose(angle, 0.5, abs_tol=0.05)


def test_the_clock(model, data):
    # It looks sensible. On which arm would it fail?
    sm.step(model, data, 400)
    assert math.isclose(data.time, 400 * model.timestep)


# To add: where is the fingertip after a turn of shoulder_pan by 90 degrees? How far does the box
# fall in 0.2 s? What do two equal runs have in common?
