"""Derived values: zero when fresh, stale after a write, one state behind after a step."""

from __future__ import annotations

import numpy as np

from ..interface import POSES, Data, JointType, Model, forward, get_state, reset, set_state, step
from ..kinematics import Kinematics
from ..measures.quantities import derived_arrays
from ..rotations import matrix_from_quat
from ._lab import (
    TARGET,
    Lab,
    check,
    inputs_of,
    require,
    require_close,
    require_equal,
    run_ctrl,
    run_on,
    same,
    snapshot,
)


@check(on="box")
def check_fresh_and_reset_are_zero(lab: Lab, model: Model, data: Data) -> None:
    """Check that on a fresh Data, and after a reset of either kind, everything derived is zero."""
    for situation in ("fresh", "reset", "keyframe"):
        if situation != "fresh":
            data.ctrl[0] = 0.3
            step(model, data, 20)
            forward(model, data)
            reset(model, data, keyframe=0 if situation == "keyframe" else None)
        for name, array in snapshot(data).items():
            require(not array.any(), f"{name} is not zero on a {situation} Data")
        require(len(data.contacts) == 0, f"a {situation} Data has contacts")


@check(on="box", keyframe=0)
def check_shapes(lab: Lab, model: Model, data: Data) -> None:
    """Check that derived arrays have the documented shapes, before and after a forward."""
    for _ in range(3):
        n = len(data.contacts)
        shapes = {
            "xpos": (model.nbody, 3),
            "xquat": (model.nbody, 4),
            "site_xpos": (model.nsite, 3),
            "site_xmat": (model.nsite, 9),
            "contacts.geom": (n, 2),
            "contacts.dist": (n,),
            "contacts.pos": (n, 3),
            "contacts.frame": (n, 3, 3),
            "contacts.force": (n, 3),
            "contacts.torque": (n, 3),
        }
        for name, array in snapshot(data).items():
            expected = shapes.get(name, (model.nv,))
            require(array.shape == expected, f"{name}: shape {array.shape}, expected {expected}")
        forward(model, data)
    require(len(data.contacts) > 0, "keyframe 0 has no contacts")


@check("position servo", on="held")
def check_a_write_marks_nothing_dirty(lab: Lab, model: Model, data: Data) -> None:
    """Check that after a write to any input, everything derived still says what it said."""
    before = snapshot(data)
    data.qpos[0] += 0.3
    data.qpos[6:9] += 0.1
    data.qvel[:] = 0.5
    data.ctrl[:] = 0.0
    same(before, snapshot(data), "after a write")
    forward(model, data)
    after = snapshot(data)
    for name in ("xpos", "site_xpos", "xquat", "qfrc_actuator"):
        if name in before:
            require(not np.array_equal(before[name], after[name]), f"forward left {name} alone")


@check("position servo", on="held")
def check_a_step_leaves_values_of_the_state_before(lab: Lab, model: Model, data: Data) -> None:
    """Check that after a step, poses and contacts are those of the state that it started from."""
    data.ctrl[0] += 0.5
    for nstep in (1, 1, 7):
        if nstep > 1:
            step(model, data, nstep - 1)
        before = get_state(model, data)
        step(model, data)
        left = snapshot(data)
        other = lab.data(model)
        set_state(model, other, before)
        forward(model, other)
        expected = snapshot(other)
        names = list(POSES)
        if model.capabilities.exact_restore:
            # Elsewhere a restored Data may find the same contact at other points.
            names += ["contacts.dist", "contacts.pos"]
        for name in names:
            require_close(left[name], expected[name], lab.rounding, f"{name} after a step")
    forward(model, data)
    gap = np.abs(data.site_xpos - left["site_xpos"]).max()
    require(bool(gap > 1e-6), "the arm did not move, so the check says nothing")


@check("position servo", on="held")
def check_forward_changes_no_input(lab: Lab, model: Model, data: Data) -> None:
    """Forward takes no time, touches no input, and twice is the same as once."""
    before = inputs_of(model, data)
    forward(model, data)
    once = snapshot(data)
    forward(model, data)
    same(once, snapshot(data), "a second forward")
    require_equal(inputs_of(model, data), before, "inputs after forward")


def check_forward_perturbs_nothing(lab: Lab) -> None:
    """Check that a run with forwards in between is, bit for bit, the run without, mid-contact
    too.
    """

    def forward_and_read(data: Data) -> None:
        forward(data.model, data)
        derived_arrays(data)

    undisturbed = run_on(lab.moving(), *(1,) * 100)
    for name, call in (
        ("forward", lambda data: forward(data.model, data)),
        ("reading what is derived", derived_arrays),
        ("forward, then reading", forward_and_read),
        ("get_state", lambda data: get_state(data.model, data)),
    ):
        run = run_on(lab.moving(), *(1,) * 100, before_each=call)
        require_equal(run, undisturbed, f"a run with {name} before each step")


@check("position servo", on="held")
def check_forward_depends_on_the_state_alone(lab: Lab, model: Model, data: Data) -> None:
    """Check that another Data, set to the same State, derives the same bits; `freshness` relies
    on it.
    """
    data.ctrl[0] += 0.2
    step(model, data, 3)
    other = lab.data(model)
    set_state(model, other, get_state(model, data))
    for copy in (data, other):
        forward(model, copy)
    same(snapshot(data), snapshot(other), "forward of a restored State")


@check(on="box", keyframe=0)
def check_two_data_are_independent(lab: Lab, model: Model, idle: Data) -> None:
    """Check that Data of one Model share nothing that a step or a write can reach."""
    busy = lab.data(model, keyframe=0)
    forward(model, idle)
    before, derived = inputs_of(model, idle), snapshot(idle)
    run_ctrl(model, busy, 40, seed=1)
    require_equal(inputs_of(model, idle), before, "inputs of the other Data")
    same(derived, snapshot(idle), "the other Data")


@check(on="box")
def check_xquat_is_wxyz(lab: Lab, model: Model, data: Data) -> None:
    """Check that a free body's xquat is the quaternion of its qpos; its xpos the position."""
    quat = np.array([0.5, -0.1, 0.7, 0.5])
    quat /= np.linalg.norm(quat)
    start, _, body = lab.box_at
    data.qpos[start : start + 3] = (0.3, -0.2, 0.5)
    data.qpos[start + 3 : start + 7] = quat
    forward(model, data)
    require_close(data.xpos[body], (0.3, -0.2, 0.5), lab.rounding, "xpos of the box")
    require_close(data.xquat[body], quat, lab.rounding, "xquat of the box, wxyz")


@check(on="arm")
def check_site_and_body_agree(lab: Lab, model: Model, data: Data) -> None:
    """Check that a site is where its definition puts it in the frame of its body."""
    data.qpos[:] = TARGET
    forward(model, data)
    for site in range(model.nsite):
        body = int(model.site_bodyid[site])
        turn = matrix_from_quat(data.xquat[body])
        where = data.xpos[body] + turn @ model.site_pos[site]
        require_close(data.site_xpos[site], where, lab.rounding, "site_xpos")
        mat = turn @ matrix_from_quat(model.site_quat[site])
        require_close(data.site_xmat[site], mat.ravel(), lab.rounding, "site_xmat")


@check(on="arm")
def check_the_witness_agrees(lab: Lab, model: Model, data: Data) -> None:
    """Check that every body's pose is the one that Pinocchio computes from the file of the arm."""
    witness = Kinematics("so101", joint_names=model.joint_names)
    random = np.random.default_rng(7)
    low, high = model.jnt_range.T
    for qpos in random.uniform(low, high, (25, model.nq)):
        data.qpos = qpos
        forward(model, data)
        for name in model.body_names[1:]:
            body, pose = model.body_id(name), witness.pose(qpos, name, kind="body")
            require_close(data.xpos[body], pose.pos, lab.rounding, f"xpos of {name}")
            mat = matrix_from_quat(data.xquat[body])
            require_close(mat, pose.mat, lab.rounding, f"xquat of {name}")


def check_addresses_cover_qpos_and_qvel(lab: Lab) -> None:
    """Check that joints own every slot of qpos and qvel once, in order."""
    model = lab.box
    place = dof = 0
    for joint, name in enumerate(model.joint_names):
        require(model.joint_id(name) == joint, f"joint_id({name!r})")
        require(int(model.jnt_qposadr[joint]) == place, f"jnt_qposadr of {name}")
        require(int(model.jnt_dofadr[joint]) == dof, f"jnt_dofadr of {name}")
        kind = JointType(int(model.jnt_type[joint]))
        place, dof = place + kind.nq, dof + kind.nv
    require((place, dof) == (model.nq, model.nv), "joints do not fill qpos and qvel")
