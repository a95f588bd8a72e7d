"""Exercise: tests that a wrong arm does not pass.

    statemachine check --faults exercises/test_arm.py

runs these tests on the healthy arm, where all must pass, and then on arms that have one fault
each: quaternions in another order, joints shifted, a motor left on, and so on. A fault that no
test catches is named, with a hint. Add tests until all are caught.

A test is a function test_…, as pytest takes it. It gets, if it asks for them:

    model    the arm on a floor, with a box (sm.load("so101/scene_box"))
    data     a new Data of it: zero pose, nothing derived yet
    backend  the name of the engine that it runs on

Beside what step_loop.py names you may need: data.xpos and data.xquat[model.body_id("box")] (where
a body's frame is, and how it is turned: w x y z), model.body_names, model.gravity, and
`statemachine conventions velocity`, which says what the six velocities of a free body mean on an
engine itself (this interface has MuJoCo's everywhere). The arm's file is
models/so101/so101.xml: where each body sits on the one before it.

    pytest exercises/test_arm.py

runs them on the healthy arm alone, and shows more of what fails. What a test asks for comes from
conftest.py beside this file; without it:

    pytest -p statemachine.course.grading.faults.plugin test_arm.py

What to test against? Not what the arm gave you yesterday: what you know without it. A turn by
90 degrees, a free fall, a circle about an axis, a weight on a spring, two runs that must agree.
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
    # It looks sensible. Which fault could it ever catch?
    sm.step(model, data, 400)
    assert math.isclose(data.time, 400 * model.timestep)


# To add: where does a turn of shoulder_pan by 90 degrees take the fingertip? How far does the
# box fall in 0.2 s? What do two equal runs have in common?
