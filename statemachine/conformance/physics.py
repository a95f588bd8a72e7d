"""Physics against closed forms: gravity, servo, friction, contact, free flight, options."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..errors import UnsupportedError
from ..interface import BEHAVIOURS, Array, Data, Model, forward, step
from ..models import resolve
from ..rotations import angle_between, matrix_from_quat
from ._lab import Lab, check, force_on, require, require_close, require_raises

_G = 9.81
_HEAVY = 1e4  # an armature beside which the links weigh nothing [kg·m²]
_PUSH = (2.0, -1.0, -_G)  # a slanted gravity [m/s²]


@check("position servo", "gravity", on="scene")
def check_untouched_ctrl_is_a_command(lab: Lab, model: Model, data: Data) -> None:
    """Check that the servos hold the zero pose from the first step on, with a small droop."""
    step(model, data, 200)
    droop = np.degrees(data.qpos[model.jnt_qposadr[model.joint_id("shoulder_lift")]])
    # At rest kp·droop carries the load; 0.5694 N·m is the arm's weight about the joint.
    require_close(droop, np.degrees(0.5694 / 998.22), 0.002, "droop of shoulder_lift [deg]")
    require(bool(np.abs(data.qvel).max() < 1e-4), "the arm is still moving after a second")


@check("position servo", on="arm")
def check_the_servo_law(lab: Lab, model: Model, data: Data) -> None:
    """Check that qfrc_actuator is clip(kp·(clip(ctrl) - q) - kv·q̇, forcerange), after forward."""
    random = np.random.default_rng(13)
    for scale in (1e-3, 1e-2, 1.0, 5.0):
        data.qpos[:] = random.uniform(-0.3, 0.3, 6)
        data.qvel[:] = random.uniform(-0.2, 0.2, 6)
        data.ctrl[:] = data.qpos + scale * random.uniform(-1, 1, 6)
        forward(model, data)
        require_close(
            data.qfrc_actuator, servo(model, data.qpos, data.qvel, data.ctrl), 1e-9, "qfrc_actuator"
        )


def servo(model: Model, qpos: Array, qvel: Array, ctrl: Array) -> Array:
    """Return the position servo's force (nu,) [N·m], of an arm whose joints are its actuators'."""
    goal = np.clip(ctrl, *model.actuator_ctrlrange.T)
    force = model.actuator_kp * (goal - qpos) - model.actuator_kv * qvel
    return np.clip(force, *model.actuator_forcerange.T)


def check_ctrl_is_clamped_inside(lab: Lab) -> None:
    """Check that a ctrl beyond its range acts as at the range; the array keeps what was written."""
    model = lab.arm
    ends = []
    for excess in (0.0, 5.0):
        data = lab.data(model)
        # Near the end of the range, where a servo that is asked for more pushes harder.
        data.qpos[:] = model.actuator_ctrlrange[:, 1] - 0.002
        data.ctrl[:] = model.actuator_ctrlrange[:, 1] + excess
        step(model, data, 50)
        ends.append(data.qpos.copy())
        require_close(data.ctrl, model.actuator_ctrlrange[:, 1] + excess, 0.0, "ctrl")
    require_close(ends[1], ends[0], 1e-12, "qpos under a ctrl beyond its range")


@check("position servo", "gravity", on="scene", after=400)
def check_forces_balance_at_rest(lab: Lab, model: Model, data: Data) -> None:
    """Check that held by its servos, the arm's forces sum to zero; parts add up to the
    constraint.
    """
    total = data.qfrc_actuator + data.qfrc_passive + data.qfrc_constraint - data.qfrc_bias
    require_close(total, np.zeros(model.nv), 1e-6, "sum of the forces at rest")
    _parts_add_up(data)
    fallen = lab.after(model.replace(actuation=False), 800)
    require(not fallen.qfrc_actuator.any(), "servos that are off exert a force")
    require(abs(fallen.qfrc_contact[1]) > 0.3, "no contact carries the fallen arm")
    _parts_add_up(fallen)


def _parts_add_up(data: Data) -> None:
    parts = data.qfrc_contact + data.qfrc_friction + data.qfrc_limit
    require_close(parts, data.qfrc_constraint, 1e-9, "parts of qfrc_constraint")


@check(on="arm")
def check_dry_friction_saturates(lab: Lab, model: Model, data: Data) -> None:
    """Check that a joint in fast motion feels its full dry friction, against the motion."""
    for sign in (1.0, -1.0):
        data.qvel[:] = sign * 3.0
        forward(model, data)
        require_close(data.qfrc_friction, -sign * model.dof_frictionloss, 1e-6, "qfrc_friction")
        require_close(data.qfrc_passive, -model.dof_damping * data.qvel, 1e-9, "qfrc_passive")


@check("gravity")
def check_limits_stop_a_joint(lab: Lab) -> None:
    """Check that a joint, pushed by gravity, stops at its limit, and with limits off goes on."""
    limp = lab.arm.replace(actuation=False)
    free = limp.replace(limits=False)
    joint = limp.joint_id("shoulder_lift")
    top = limp.jnt_range[joint, 1]
    for model, stops in ((limp, True), (free, False)):
        data = lab.after(model, 1600)
        past = data.qpos[limp.jnt_qposadr[joint]] - top
        require(bool(past < 0.02) is stops, f"{past:.3f} rad beyond the limit, limits {stops}")
        require((data.qfrc_limit[joint] < -0.05) == stops, "no limit force at the limit")


@check("gravity", on="box")
def check_free_fall(lab: Lab, model: Model, data: Data) -> None:
    """Check that a free body falls g·t²/2, within the g·t·h of one timestep; sideways not at
    all.
    """
    start, dof, _ = lab.box_at
    data.qpos[start : start + 3] = (1.0, 1.0, 2.0)
    step(model, data, 60)
    t, h = data.time, model.timestep
    fallen = 2.0 - data.qpos[start + 2]
    require(abs(fallen - _G * t * t / 2) <= _G * t * h, f"fell {fallen:.4f} m in {t:.3f} s")
    require_close(data.qvel[dof + 2], -_G * t, _G * h, "vertical velocity")
    require_close(data.qpos[start : start + 2], (1.0, 1.0), 1e-9, "horizontal position")


@check(on="box", gravity=[0, 0, 0])
def check_free_body_velocity_conventions(lab: Lab, model: Model, data: Data) -> None:
    """Check that linear velocity is in world axes; angular velocity in the body's own axes."""
    start, dof, _ = lab.box_at
    quat = np.array([np.cos(0.6), np.sin(0.6), 0.0, 0.0])  # turned about x by 1.2 rad
    rate, velocity = 0.8, np.array([0.3, -0.2, 0.1])
    data.qpos[start : start + 7] = (1.0, 1.0, 1.0, *quat)
    data.qvel[dof : dof + 6] = (*velocity, 0, 0, rate)  # about z, a principal axis: constant
    step(model, data, 100)
    t, moved = data.time, data.qpos[start : start + 3] - 1.0
    got = matrix_from_quat(data.qpos[start + 3 : start + 7])
    # What single precision rounds in each of a hundred steps adds up.
    within = 1e-6 + 10 * lab.rounding
    require_close(moved, velocity * t, within, "displacement in world axes")
    about_z = np.array([np.cos(rate * t / 2), 0.0, 0.0, np.sin(rate * t / 2)])
    expected = matrix_from_quat(quat) @ matrix_from_quat(about_z)
    require(float(angle_between(got, expected)) < 1e-4, "the spin is not about the body's z axis")


@check("gravity", on="box", after=300)
def check_contact_carries_the_weight(lab: Lab, model: Model, data: Data) -> None:
    """Check that a resting box has four or more contacts, normals up, whose forces sum to m·g."""
    _, dof, body = lab.box_at
    total, touching, normals = force_on(model, data, body)
    require(len(touching) >= 3, f"the box rests on {len(touching)} points")
    require(bool((normals[:, 2] > 0.99).all()), "the normal does not point up")
    mass_g = data.qfrc_bias[dof + 2]
    require_close(mass_g, 0.096 * _G, 1e-9, "weight of the box")
    require_close(total, (0.0, 0.0, mass_g), 0.02 * mass_g, "force of the floor on the box")
    require(bool((np.abs(data.contacts.dist) < 0.002).all()), "surfaces are not together")


@check(on="box", after=300, gravity=_PUSH)
def check_contact_forces_lean_against_a_push(lab: Lab, model: Model, data: Data) -> None:
    """Check that under slanted gravity the floor's force on a box is -m·g, its tangent part too."""
    _, _, body = lab.box_at
    total, touching, _ = force_on(model, data, body)
    place = data.contacts.pos[touching].mean(axis=0)
    require_close(
        total, -0.096 * np.array(_PUSH), 0.03 * 0.096 * _G, "force of the floor on a pushed box"
    )
    off = np.abs(place[:2] - data.xpos[body, :2]).max()
    require(bool(off < 0.02), "contacts are not below the box")
    require(abs(place[2]) < 0.002, f"contacts are {place[2]:.4f} m above the floor")


@check(on="box")
def check_depth_of_a_contact(lab: Lab, model: Model, data: Data) -> None:
    """Check that of a box one millimetre in the floor, every contact's distance is minus that."""
    start, _, body = lab.box_at
    data.qpos[start + 2] = 0.029
    forward(model, data)
    _, touching, _ = force_on(model, data, body)
    require(len(touching) >= 3, f"{len(touching)} contacts")
    depths = data.contacts.dist[touching]
    require_close(depths, np.full(len(touching), -0.001), 2e-4, "contacts.dist")


@check(on="arm", timestep=1e-6)
def check_acceleration_is_the_rate_of_velocity(lab: Lab, model: Model, data: Data) -> None:
    """Check that qacc is what a very short step does to qvel, in the air and under servo force."""
    random = np.random.default_rng(21)
    for _ in range(4):
        data.qpos[:] = random.uniform(-0.5, 0.5, 6)
        data.qvel[:] = random.uniform(-1, 1, 6)
        data.ctrl[:] = data.qpos + random.uniform(-0.002, 0.002, 6)
        forward(model, data)
        expected, before = data.qacc.copy(), data.qvel.copy()
        step(model, data)
        rate = (data.qvel - before) / model.timestep
        require_close(rate, expected, 0.02 * np.abs(expected).max(), "change of qvel over h")


@check("position servo", on="arm", armature=_HEAVY, gravity=[0, 0, 0], frictionloss=0.0)
def check_a_force_accelerates_by_the_armature(lab: Lab, model: Model, data: Data) -> None:
    """Check that with an armature far beyond the links' inertia, qacc is force over armature."""
    data.ctrl[:] = 0.001
    forward(model, data)
    expected = servo(model, data.qpos, data.qvel, data.ctrl) / _HEAVY
    require_close(data.qacc, expected, 1e-4 * np.abs(expected).max(), "qacc")
    require_close(model.dof_armature, np.full(6, _HEAVY), 0.0, "dof_armature")


def check_facts_are_the_files(lab: Lab) -> None:
    """Check that ranges, gains and joint parameters of the Model are those that the file states."""
    model = lab.arm
    root = ElementTree.parse(resolve("so101")).getroot()
    ranges = [joint.get("range", "").split() for joint in root.findall(".//worldbody//joint")]
    servos = root.findall("actuator/position")
    require_close(model.jnt_range, np.array(ranges, dtype=float), 0.0, "jnt_range")
    require(bool(model.jnt_limited.all()), "jnt_limited")
    ends = [servo.get("ctrlrange", "").split() for servo in servos]
    require_close(model.actuator_ctrlrange, np.array(ends, dtype=float), 0.0, "actuator_ctrlrange")
    driven = [model.joint_names[joint] for joint in model.actuator_jntid]
    require(driven == [servo.get("joint") for servo in servos], f"actuator_jntid: {driven}")
    joint, gains = root.find("default/default/joint"), root.find("default/default/position")
    for element, names in (
        (joint, ("dof_damping", "dof_frictionloss", "dof_armature")),
        (gains, ("actuator_kp", "actuator_kv")),
    ):
        stated = {} if element is None else element.attrib
        for name in names:
            value = np.full(6, float(stated.get(name.partition("_")[2], "nan")))
            require_close(getattr(model, name), value, 0.0, name)


@check("position servo", on="box", keyframe=0)
def check_the_box_is_held(lab: Lab, model: Model, data: Data) -> None:
    """Check that from keyframe 0, under a command that moves the arm, both jaws keep the box."""
    box, jaws = model.body_id("box"), {model.body_id(n) for n in ("gripper", "moving_jaw_so101_v1")}
    data.ctrl[:2] += (0.4, -0.2)
    start = data.qpos.copy()
    for k in range(600):
        step(model, data)
        pairs = model.geom_bodyid[data.contacts.geom]
        touching = set(pairs[(pairs == box).any(axis=1)].ravel().tolist()) - {box}
        require(touching >= jaws, f"step {k}: the box touches {touching}, not both jaws")
        require(0 not in touching, f"step {k}: the box touches the floor")
    require(bool(np.abs(data.qpos[:2] - start[:2]).min() > 0.1), "the arm did not move")


@check("gravity")
def check_options_do_what_they_say(lab: Lab) -> None:
    """Check that each option that the capability record lists has its effect, and no other
    Model's.
    """
    base, options = lab.scene, lab.scene.capabilities.options
    limp = base.replace(actuation=False)

    def lift_after(model: Model, steps: int) -> float:
        return float(lab.after(model, steps).qpos[1])

    fall = lift_after(limp, 60)
    require(fall > 0.05, f"with the servos off the arm fell only {fall:.4f} rad")
    slower = 0.8 * fall
    # Of a Model, an option with its value, steps, and between what the shoulder then is [rad].
    cases: list[tuple[Model, str, Any, int, float, float]] = [
        (limp, "gravity", [0, 0, 0], 60, -1e-6, 1e-6),
        (limp, "armature", 0.2, 60, -np.inf, slower),
        (limp, "damping", 5.0, 60, -np.inf, slower),
        (limp, "frictionloss", 0.3, 60, -np.inf, slower),
        (limp, "contacts", False, 400, 0.6, np.inf),
    ]
    for integrator in base.capabilities.integrators:
        cases.append((base, "integrator", integrator, 20, -0.01, 0.01))
    for model, name, value, steps, least, most in cases:
        if name in options:
            lift = lift_after(model.replace(**{name: value}), steps)
            require(least < lift < most, f"{name} {value}: {lift:.4f} rad after {steps} steps")
    if "substeps" in options:
        fine = limp.replace(substeps=10)
        require(fine.timestep == limp.timestep, "substeps changed the timestep")
        finer, small = lift_after(fine, 60), lift_after(limp.replace(timestep=0.0005), 600)
        require_close(finer, small, 1e-9, "ten substeps against a tenth of the timestep")
        require(finer != fall, "substeps changed nothing")
    require(base.timestep == 0.005 and lift_after(base, 60) < 0.001, "replace changed its Model")


def check_unsupported_is_said(lab: Lab) -> None:
    """Check that what the capability record does not list raises UnsupportedError, with the
    facts.
    """
    model = lab.arm
    for name in {"armature", "substeps", "limits"} - set(model.capabilities.options):
        error = require_raises(UnsupportedError, lambda n=name: model.replace(**{n: 1}))
        facts = getattr(error, "backend", ""), getattr(error, "feature", "")
        require(facts == (model.backend, name), str(error))
    behaviours = model.capabilities.behaviours
    require(behaviours.keys() == set(BEHAVIOURS), f"the record speaks of {sorted(behaviours)}")
    for name, behaviour in behaviours.items():
        known = ("native", "emulated", "unsupported")
        require(behaviour.support in known and bool(behaviour.note), f"the record on {name}")
