"""What a user varies of a robot: mass, friction, gains and latency, each against a closed form."""

from __future__ import annotations

import numpy as np

from ..interface import Array, Data, Model, forward, get_state, set_state, step
from ._lab import Lab, check, require, require_close, require_equal, run_commands, run_ctrl

_G = 9.81


@check("mass", "gravity", "armature", "damping", "frictionloss")
def check_mass_scales_weight_and_inertia(lab: Lab) -> None:
    """Check that with every mass doubled weights and forces double, and a fall stays the same."""
    limp = lab.arm.replace(actuation=False, armature=0, damping=0, frictionloss=0)
    heavy = limp.replace(mass=2 * limp.body_mass)
    require_close(heavy.body_mass, 2 * limp.body_mass, 0.0, "body_mass")
    require_close(limp.body_mass, lab.arm.body_mass, 0.0, "body_mass of the Model before")
    bias, fall = [], []
    for model in (limp, heavy):
        data = lab.data(model)
        data.qpos[:], data.qvel[:] = (0.1, -0.5, 0.7, 0.3, -0.2, 0.4), 0.5
        forward(model, data)
        bias.append(data.qfrc_bias.copy())
        fall.append(data.qacc.copy())
    require_close(bias[1], 2 * bias[0], 1e-9, "qfrc_bias of twice the mass")
    require_close(fall[1], fall[0], 1e-6 * np.abs(fall[0]).max(), "qacc of twice the mass")
    (_, dof, box), mass = lab.box_at, lab.box.body_mass.copy()
    mass[box] = 0.25
    weight = float(lab.after(lab.box.replace(mass=mass), 300).qfrc_contact[dof + 2])
    require_close(weight, 0.25 * _G, 0.02 * 0.25 * _G, "what the floor carries of a heavier box")


@check("friction", "gravity")
def check_friction_slows_what_slides(lab: Lab) -> None:
    """Check that on a floor of friction μ a box pushed by a = 5 m/s² accelerates by a - μ·g, or
    not at all.
    """
    push, seconds = 5.0, 0.4
    for friction in (0.1, 0.3, 0.8):
        model = lab.box.replace(gravity=[push, 0, -_G], friction=friction)
        require_close(model.geom_friction[:, 0], np.full(model.ngeom, friction), 0.0, "friction")
        data, (start, dof, _) = lab.data(model), lab.box_at
        data.qpos[start : start + 7] = (1.0, 1.0, 0.03, 1, 0, 0, 0)  # far from the arm
        step(model, data, round(seconds / model.timestep))
        speed, place = float(data.qvel[dof]), float(data.qpos[start])
        expected = max(push - friction * _G, 0.0) * seconds
        require_close(speed, expected, 0.03 * push * seconds, f"speed on friction {friction}")
        if not expected:
            require(abs(place - 1.0) < 0.01, f"the box crept {place - 1.0:.3f} m")


@check("kp", "kv", "position servo", "gravity")
def check_gains_are_those_of_the_servo(lab: Lab) -> None:
    """Check that at rest a servo is off by load / kp; moving, kv times its speed is taken off
    its force.
    """
    joint = lab.scene.joint_id("shoulder_lift")
    for kp in (250.0, 998.22, 4000.0):
        model = lab.scene.replace(kp=kp)
        require_close(model.actuator_kp, np.full(model.nu, kp), 0.0, "actuator_kp")
        require_close(model.actuator_kv, lab.scene.actuator_kv, 0.0, "actuator_kv beside kp")
        data = lab.after(model, 1600)
        droop, load = float(data.qpos[joint]), float(data.qfrc_bias[joint])
        # Dry friction may carry a part of the load.
        stuck = float(data.qfrc_friction[joint])
        require_close(droop, (stuck - load) / kp, 1e-6, f"droop under kp {kp}")
        require(abs(load + 0.5694) < 0.01, f"the load is {load:.4f} N·m")
    model = lab.arm.replace(kp=10.0, kv=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    data = lab.data(model)
    data.qvel[:], data.ctrl[:] = 0.1, 0.05
    forward(model, data)
    force = 10.0 * 0.05 - np.arange(1.0, 7.0) * 0.1
    require_close(data.qfrc_actuator, force, 1e-9, "qfrc_actuator with a kv of each")


@check("latency", "gravity", "position servo")
def check_latency_delays_a_command(lab: Lab) -> None:
    """Check that under a latency of k steps the arm does what it does without, k steps later.

    Weightless and at rest nothing else distinguishes the moments. A latency is rounded up.
    """
    arm = lab.arm.replace(gravity=[0, 0, 0])
    commands = np.random.default_rng(3).uniform(-0.1, 0.1, (40, arm.nu))
    h = arm.timestep

    def poses(model: Model) -> Array:
        return run_commands(model, lab.data(model), commands)

    prompt = poses(arm)
    for latency, late in ((h, 1), (0.03, 6), (2.5 * h, 3), (0.0, 0)):
        model = arm.replace(latency=latency)
        require_close(model.actuator_delay, np.full(arm.nu, late * h), 1e-12, "actuator_delay")
        late_poses = poses(model)
        require_close(late_poses[:late], np.zeros((late, arm.nq)), 1e-9, f"before {latency} s")
        require_close(late_poses[late:], prompt[: 40 - late], 1e-9, f"{late} steps late")
    finer = arm.replace(latency=h, substeps=5)
    require_close(finer.actuator_delay, np.full(arm.nu, h), 1e-12, "actuator_delay of substeps")
    require_close(poses(finer)[1:], poses(arm.replace(substeps=5))[:-1], 1e-9, "5 substeps late")
    latencies = np.zeros(arm.nu)
    latencies[2] = 2 * h
    late_poses = poses(arm.replace(latency=latencies, contacts=False))
    require(bool(np.abs(late_poses[0, [0, 1, 3, 4, 5]]).min() > 1e-6), "all joints were late")


@check("latency", "position servo", on="arm", latency=0.04)
def check_a_state_has_the_commands_on_their_way(lab: Lab, model: Model, data: Data) -> None:
    """Check that with a latency, two restores have one future, whatever was commanded after the
    State.
    """
    other = lab.data(model)
    run_ctrl(model, data, 20, seed=1)
    state = get_state(model, data)
    futures = []
    for run, seed in ((data, 2), (other, 3), (data, 4)):
        run_ctrl(model, run, 12, seed=seed)
        set_state(model, run, state)
        futures.append(run_ctrl(model, run, 12, seed=5))
    require_equal(futures[1:], [futures[0]] * 2, "qpos after a restore")
    # The command on its way, not the one that was written last, moves the arm at first.
    start = state["qpos"]
    paths = []
    for ctrl in (0.3, -0.3):
        set_state(model, data, state)
        data.ctrl[:] = ctrl
        step(model, data, 8)
        paths.append(data.qpos.copy())
    require_equal(paths[0], paths[1], "8 steps under commands that come after 8")
    require(bool(np.abs(paths[0] - start).max() > 1e-6), "nothing was on its way")


@check("latency", "position servo", on="box", keyframe=0, latency=0.1)
def check_a_keyframe_holds_under_latency(lab: Lab, model: Model, data: Data) -> None:
    """Check that the command before a reset was that of the keyframe: the held box stays held."""
    start, arm = data.qpos.copy(), model.jnt_qposadr[model.actuator_jntid]
    step(model, data, 20)
    require_close(data.qpos[arm], start[arm], 0.01, "the arm in the first 0.1 s")
    require(len(data.contacts) > 0, "the box is no longer held")
