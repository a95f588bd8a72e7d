"""What a user varies of a robot: mass, friction and gains, each against a closed form."""

from __future__ import annotations

import numpy as np

from ..interface import Data, Model, forward, make_data, step
from ._lab import Lab, require, require_close

_G = 9.81


def check_mass_scales_weight_and_inertia(lab: Lab) -> None:
    """Every mass doubled: weights and the force for an acceleration double, a fall does not."""
    lab.rests_on("mass", "gravity", "armature", "damping", "frictionloss")
    limp = lab.arm.replace(actuation=False, armature=0, damping=0, frictionloss=0)
    heavy = limp.replace(mass=2 * limp.body_mass)
    require_close(heavy.body_mass, 2 * limp.body_mass, 0.0, "body_mass")
    require_close(limp.body_mass, lab.arm.body_mass, 0.0, "body_mass of the Model before")
    bias, fall = [], []
    for model in (limp, heavy):
        with make_data(model) as data:
            data.qpos[:], data.qvel[:] = (0.1, -0.5, 0.7, 0.3, -0.2, 0.4), 0.5
            forward(model, data)
            bias.append(data.qfrc_bias.copy())
            fall.append(data.qacc.copy())
    require_close(bias[1], 2 * bias[0], 1e-9, "qfrc_bias of twice the mass")
    require_close(fall[1], fall[0], 1e-6 * np.abs(fall[0]).max(), "qacc of twice the mass")
    box = lab.box.body_id("box")
    mass = lab.box.body_mass.copy()
    mass[box] = 0.25
    model = lab.box.replace(mass=mass)
    with make_data(model) as data:
        step(model, data, 300)
        forward(model, data)
        dof = int(model.jnt_dofadr[model.joint_id("box")])
        weight = float(data.qfrc_contact[dof + 2])
    require_close(weight, 0.25 * _G, 0.02 * 0.25 * _G, "what the floor carries of a heavier box")


def check_friction_slows_what_slides(lab: Lab) -> None:
    """On a floor of friction μ a box pushed by a = 5 m/s² accelerates by a - μ·g, or not at all."""
    lab.rests_on("friction", "gravity")
    push, seconds = 5.0, 0.4
    for friction in (0.1, 0.3, 0.8):
        model = lab.box.replace(gravity=[push, 0, -_G], friction=friction)
        require_close(model.geom_friction[:, 0], np.full(model.ngeom, friction), 0.0, "friction")
        with make_data(model) as data:
            start, dof = _box_alone(model, data)
            step(model, data, round(seconds / model.timestep))
            speed, place = float(data.qvel[dof]), float(data.qpos[start])
        expected = max(push - friction * _G, 0.0) * seconds
        require_close(speed, expected, 0.03 * push * seconds, f"speed on friction {friction}")
        if not expected:
            require(abs(place - 1.0) < 0.01, f"the box crept {place - 1.0:.3f} m")


def _box_alone(model: Model, data: Data) -> tuple[int, int]:
    """Put the box on the floor, far from the arm; where it starts in qpos and qvel."""
    box = model.joint_id("box")
    start, dof = int(model.jnt_qposadr[box]), int(model.jnt_dofadr[box])
    data.qpos[start : start + 7] = (1.0, 1.0, 0.03, 1, 0, 0, 0)
    return start, dof


def check_gains_are_those_of_the_servo(lab: Lab) -> None:
    """At rest a servo is off by load / kp; moving, kv times its speed is taken off its force."""
    lab.rests_on("kp", "kv", "position servo", "gravity")
    joint = lab.scene.joint_id("shoulder_lift")
    for kp in (250.0, 998.22, 4000.0):
        model = lab.scene.replace(kp=kp)
        require_close(model.actuator_kp, np.full(model.nu, kp), 0.0, "actuator_kp")
        require_close(model.actuator_kv, lab.scene.actuator_kv, 0.0, "actuator_kv beside kp")
        with make_data(model) as data:
            step(model, data, 1600)
            forward(model, data)
            droop, load = float(data.qpos[joint]), float(data.qfrc_bias[joint])
            # Dry friction may carry a part of the load.
            stuck = float(data.qfrc_friction[joint])
        require_close(droop, (stuck - load) / kp, 1e-6, f"droop under kp {kp}")
        require(abs(load + 0.5694) < 0.01, f"the load is {load:.4f} N·m")
    model = lab.arm.replace(kp=10.0, kv=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    with make_data(model) as data:
        data.qvel[:], data.ctrl[:] = 0.1, 0.05
        forward(model, data)
        force = 10.0 * 0.05 - np.arange(1.0, 7.0) * 0.1
        require_close(data.qfrc_actuator, force, 1e-9, "qfrc_actuator with a kv of each")
