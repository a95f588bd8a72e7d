"""What is particular to the MuJoCo backend: other models than the arm, options, states."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    BadInputError,
    DivergedError,
    ForeignStateError,
    UnknownNameError,
)

from .support.claims import overlapping, refused
from .support.motions import after, opened
from .support.processes import in_its_own_python
from .support.requirements import ROOT
from .support.small_models import GEOM, loaded


def test_options_go_off_and_on_again(mujoco_scene: sm.Model) -> None:
    for option, flag in (("actuation", "ACTUATION"), ("contacts", "CONTACT"), ("limits", "LIMIT")):
        off = mujoco_scene.replace(**{option: False})
        on = off.replace(**{option: True})
        flags, others, before = (m.raw.opt.disableflags for m in (off, on, mujoco_scene))
        assert flags - others == int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))
        assert others == before
        assert mujoco_scene.replace(**{option: True}).raw is not mujoco_scene.raw


def test_too_many_substeps_in_one_call_are_refused() -> None:
    with opened(sm.load("so101").replace(substeps=1000)) as (model, data):
        refused((BadInputError, "too large", lambda: sm.step(model, data, 2**31 - 1)))
        assert data.time == 0.0


def test_one_number_is_for_the_joints_and_not_for_a_free_body(mujoco_box: sm.Model) -> None:
    for option in ("armature", "damping", "frictionloss"):
        each = [k / 10 for k in range(12)]
        for given, expected in ((0.7, [0.7] * 6 + [0.0] * 6), (each, each)):
            changed = mujoco_box.replace(**{option: given})
            assert getattr(changed, f"dof_{option}").tolist() == expected


def test_inverse_weights_follow_the_armature(mujoco_arm: sm.Model) -> None:
    heavy = mujoco_arm.replace(armature=10.0)
    assert heavy.raw.dof_invweight0[0] < mujoco_arm.raw.dof_invweight0[0] / 5
    assert heavy.raw.dof_M0[0] > 10.0


def test_a_replaced_model_is_what_a_file_would_have_given(tmp_path: Path) -> None:
    body = f"<body><joint name='j' type='slide' axis='0 0 1' armature='{{}}'/>{GEOM}</body>"
    light = loaded(tmp_path, body.format("0"), name="a.xml").replace(armature=2.0)
    heavy = loaded(tmp_path, body.format("2"), name="b.xml")
    assert np.array_equal(after(light, 50), after(heavy, 50))


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
@pytest.mark.parametrize("jacobian", ["dense", "sparse"])
@pytest.mark.parametrize("solver", ["Newton", "CG", "PGS"])
@overlapping
def test_parts_of_the_constraint_force_add_up(
    tmp_path: Path, cone: str, jacobian: str, solver: str
) -> None:
    model = loaded(
        tmp_path,
        "<geom type='plane' size='1 1 1'/>"
        f"<body pos='0 0 0.09'><freejoint/>{GEOM}</body>"
        f"<body pos='1 0 0.5'><joint name='a' axis='0 1 0' frictionloss='0.3' range='-1 1'/>"
        f"<geom size='0.05' pos='0.3 0 0' mass='1'/>"
        f"<body pos='0.3 0 0'><joint name='b' axis='0 1 0'/>"
        "<geom size='0.05' pos='0.3 0 0'/></body>"
        "</body>",
        f"<option cone='{cone}' jacobian='{jacobian}' solver='{solver}'/>"
        "<compiler angle='radian' autolimits='true'/>"
        "<tendon><fixed name='t' frictionloss='0.2' range='-0.05 0.05' limited='true'>"
        "<joint joint='a' coef='1'/><joint joint='b' coef='1'/></fixed></tendon>"
        "<equality><joint joint1='b' polycoef='0.1 0 0 0 0'/></equality>",
    )
    with opened(model, nstep=60, derived=True) as (_, data):
        parts = {
            n: getattr(data, f"qfrc_{n}") for n in ("contact", "friction", "limit", "equality")
        }
        assert all(np.abs(part).max() > 1e-3 for part in parts.values()), parts
        assert np.abs(sum(parts.values()) - data.qfrc_constraint).max() < 1e-9


def test_contact_forces_are_the_engines(tmp_path: Path) -> None:
    with opened(sm.load("so101/scene_box"), 0, nstep=10) as (model, data):
        contacts, wrench = data.contacts, np.zeros(6)
        assert len(contacts) == data.raw.ncon > 0
        assert contacts.torque.any()
        for k in range(len(contacts)):
            mujoco.mj_contactForce(model.raw, data.raw, k, wrench)
            assert np.array_equal(contacts.force[k], wrench[:3])
            assert np.array_equal(contacts.torque[k], wrench[3:])
        refused((ValueError, "read-only", lambda: contacts.dist.fill(0)))


def test_a_zero_quaternion_of_a_ball_joint_is_refused(tmp_path: Path) -> None:
    with opened(loaded(tmp_path, f"<body><joint name='b' type='ball'/>{GEOM}</body>")) as (
        model,
        data,
    ):
        data.qpos[:] = (0.5, -0.5, 0.5, -0.5)  # adds up to zero, and is a rotation
        sm.step(model, data)
        data.qpos[:] = -0.0
        refused(
            (BadInputError, "joint 'b'", lambda: sm.step(model, data)),
            (BadInputError, "joint 'b'", lambda: setattr(data, "qpos", np.zeros(4))),
        )


def test_bad_entries_are_called_by_their_joint() -> None:
    with opened(sm.load("so101/scene_box")) as (model, data):
        for name, index, joint in (("qpos", 12, "box"), ("qvel", 6, "box"), ("qvel", 5, "gripper")):
            sm.reset(model, data)
            getattr(data, name)[index] = np.nan
            refused(
                (
                    BadInputError,
                    rf"{name}\[{index}\] \({joint}\)",
                    lambda: sm.forward(model, data),
                ),
                (DivergedError, rf"\({joint}\)", lambda: sm.step(model, data)),
            )
            assert data.time > 0
            assert f"{name}[{index}]" in repr(data)


def test_closing_gives_the_memory_back_and_keeps_the_last_values() -> None:
    data = sm.make_data(sm.load("so101"))
    view = data.qpos
    data.qpos[1] = 0.25
    data.close()
    assert data.qpos[1] == 0.25
    assert data.qpos.base is None
    refused(*((ValueError, "read-only", partial(x.fill, 1.0)) for x in (view, data.qpos)))


def test_states_of_models_that_differ_in_names_only_are_told_apart(tmp_path: Path) -> None:
    text = "<body><joint name='{}' type='{}' axis='0 0 1'/>" + GEOM + "</body>"
    models = [
        loaded(tmp_path, text.format(name, kind), actuator, name=f"{name}{kind}{len(actuator)}.xml")
        for name, kind, actuator in (
            ("a", "hinge", ""),
            ("b", "hinge", ""),
            ("a", "slide", ""),
            ("a", "hinge", "<actuator><motor name='x' joint='a'/></actuator>"),
            ("a", "hinge", "<actuator><motor name='yy' joint='a'/></actuator>"),
        )
    ]
    states = [sm.get_state(model, sm.make_data(model)) for model in models]
    assert len({state.fingerprint for state in states}) == len(models)
    with opened(models[0]) as (model, data):
        refused((ForeignStateError, "", lambda: sm.set_state(model, data, states[1])))
    assert states[0]["ctrl"].shape == (0,)


def test_hidden_parts_of_a_state_must_be_numbers_and_nobody_is_no_model() -> None:
    with opened(sm.load("so101")) as (model, data):
        data.raw.xfrc_applied[1, 0] = np.nan
        refused(
            (BadInputError, "state", lambda: sm.get_state(model, data)),
            (TypeError, "", lambda: sm.step(None, data)),  # pyright: ignore[reportArgumentType]
        )


def test_an_actuator_on_a_tendon_drives_no_joint(tmp_path: Path) -> None:
    model = loaded(
        tmp_path,
        f"<body><joint name='j'/>{GEOM}</body>",
        "<tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon>"
        "<actuator><position tendon='t' kp='3'/><position joint='j' kp='0'/></actuator>",
    )
    assert (model.actuator_jntid.tolist(), model.actuator_kp[0]) == ([-1, 0], 3)
    assert np.isnan(model.actuator_kp[1])


@pytest.mark.slow
def test_ctrl_c_in_a_bulk_step_that_diverges_does_not_end_the_process() -> None:
    code = """
import os, signal, threading, statemachine as sm
model = sm.load("so101")
data = sm.make_data(model)
data.qvel[0] = 9e9
threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    sm.step(model, data, 20_000)
except (KeyboardInterrupt, sm.errors.DivergedError) as error:
    print("caught", type(error).__name__)
"""
    done = in_its_own_python(code, ROOT)
    assert "caught" in done.stdout, done.stderr
    assert done.returncode in (0, 1, 130, -2)


def test_what_raw_shows_stays_writable() -> None:
    with opened(sm.load("so101"), derived=True) as (model, data):
        data.raw.qacc[:] = 0.0
        mujoco.mj_inverse(model.raw, data.raw)
        assert not data.qacc.flags.writeable
        assert data.qacc.tolist() == [0.0] * 6
        assert not hasattr(data, "site_xpo")


def test_an_option_overrules_a_flag_of_the_file(tmp_path: Path) -> None:
    model = loaded(
        tmp_path,
        f"<body><joint name='j' type='slide' axis='0 0 1'/>{GEOM}</body>",
        "<option><flag gravity='disable' frictionloss='disable'/></option>",
    )
    falling = model.replace(gravity=[0, 0, -5])
    assert after(model, 100) == 0.0
    assert after(falling, 100) < -0.05
    assert abs(after(falling.replace(frictionloss=100.0), 100)) < 0.01


def test_a_model_whose_bodies_sleep_promises_no_exact_restore(tmp_path: Path) -> None:
    model = loaded(
        tmp_path, f"<body><freejoint/>{GEOM}</body>", "<option><flag sleep='enable'/></option>"
    )
    assert not model.capabilities.exact_restore


def test_the_record_of_a_model_with_rk4_says_what_it_breaks(tmp_path: Path) -> None:
    model = loaded(tmp_path, f"<body><joint name='j'/>{GEOM}</body>", "<option integrator='RK4'/>")
    models = (model, model.replace(integrator="implicitfast"))
    records = [each.capabilities.behaviours["stale after a step"] for each in models]
    assert [record.support for record in records] == ["unsupported", "native"]
    refused((UnknownNameError, "implicitfast", lambda: model.replace(integrator="rk4")))
