"""Parameters of an arm as one vector, and what of the model they change."""

from __future__ import annotations

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import UnknownNameError, UnsupportedError
from statemachine.lab.identification.parameters import ArmParameters

from .support.arm_fits import arm_parameters, vector


@pytest.fixture(scope="module")
def parameters() -> ArmParameters:
    return arm_parameters()


def test_there_are_five_of_each_joint_and_two_of_the_arm(parameters):
    assert len(parameters) == 5 * 6 + 2


def test_a_vector_of_zeros_is_the_model(parameters):
    options = parameters.options(np.zeros((1, len(parameters))))
    model = parameters.model
    assert options["kp"][0] == pytest.approx(model.actuator_kp)
    assert options["kv"][0] == pytest.approx(model.actuator_kv)
    assert options["damping"][0] == pytest.approx(model.dof_damping)
    assert options["frictionloss"][0] == pytest.approx(model.dof_frictionloss)
    assert options["armature"][0] == pytest.approx(model.dof_armature)
    assert options["mass"][0] == pytest.approx(model.body_mass)


@pytest.mark.parametrize(
    ("kind", "option"),
    [("kp", "kp"), ("friction", "frictionloss"), ("armature", "armature"), ("viscous", "damping")],
)
def test_a_logarithm_is_a_factor_of_the_models_figure(parameters, kind, option):
    as_it_is = parameters.options(np.zeros((1, len(parameters))))[option]
    doubled = parameters.options(vector(parameters, {kind: np.log(2.0)})[None])[option]
    assert doubled == pytest.approx(2.0 * as_it_is)


def test_viscous_friction_scales_the_servos_part_too(parameters):
    options = parameters.options(vector(parameters, {"viscous": np.log(3.0)})[None])
    assert options["kv"][0] == pytest.approx(3.0 * parameters.model.actuator_kv)


def test_viscous_friction_outside_of_the_force_limit_is_all_damping(parameters):
    options = parameters.options(np.zeros((1, len(parameters))), viscous_outside=True)
    assert options["kv"][0] == pytest.approx(np.zeros(6))
    model = parameters.model
    assert options["damping"][0] == pytest.approx(model.dof_damping + model.actuator_kv)


def test_a_payload_is_held_by_the_body_of_the_jaws(parameters):
    options = parameters.options(vector(parameters, {"payload": 0.08})[None])
    more = options["mass"][0] - parameters.model.body_mass
    assert more[parameters.model.body_id("gripper")] == pytest.approx(0.08)
    assert more.sum() == pytest.approx(0.08)


def test_figures_and_entries_are_inverse(parameters):
    for each in parameters.each:
        assert each.value(each.figure(0.25)) == pytest.approx(0.25)


def test_the_entry_of_a_gain_is_its_logarithm(parameters):
    assert parameters.each[0].figure(np.log(0.1)) == pytest.approx(99.822)


def test_the_figure_of_viscous_friction_is_that_of_servo_and_joint(parameters):
    place = parameters.of_kind("viscous")[0]
    assert parameters.each[place].figure(0.0) == pytest.approx(2.731 + 0.6)


def test_causes_share_no_parameter_and_leave_none(parameters):
    places = [
        parameters.of_causes([cause])
        for cause in ("delay", "gains", "friction", "offsets", "inertia")
    ]
    assert sorted(np.concatenate(places).tolist()) == list(range(len(parameters)))


def test_payload_and_armature_are_inertia(parameters):
    kinds = {parameters.each[place].kind for place in parameters.of_causes(["inertia"])}
    assert kinds == {"armature", "payload"}


def test_an_unknown_joint_is_refused(parameters):
    with pytest.raises(UnknownNameError):
        ArmParameters.of(parameters.model, ["shoulder_pan", "hip"])


def test_a_joint_without_friction_is_not_fitted(parameters):
    smooth = parameters.model.replace(frictionloss=0.0)
    with pytest.raises(UnsupportedError, match="has no friction"):
        ArmParameters.of(smooth, smooth.joint_names).check_factors()


def test_the_figures_of_a_joint_without_friction_stay_as_they_are(parameters):
    smooth = parameters.model.replace(frictionloss=0.0)
    options = ArmParameters.of(smooth, smooth.joint_names).options(np.zeros((1, len(parameters))))
    assert options["frictionloss"].tolist() == [[0.0] * 6]
    assert options["kp"].tolist() == [smooth.actuator_kp.tolist()]


def test_a_joint_without_a_servo_is_refused(tmp_path):
    file = tmp_path / "free.xml"
    file.write_text(
        "<mujoco><worldbody><body><joint name='hip' armature='0.1'/><geom size='0.1'/></body>"
        "</worldbody></mujoco>"
    )
    with pytest.raises(UnsupportedError, match="no position servo"):
        ArmParameters.of(sm.load(file), ["hip"])


def test_a_servo_with_a_gear_is_refused(tmp_path):
    file = tmp_path / "geared.xml"
    file.write_text(
        "<mujoco><worldbody><body><joint name='hip' armature='0.1' frictionloss='0.1'/>"
        "<geom size='0.1'/></body></worldbody>"
        "<actuator><position joint='hip' kp='10' kv='1' gear='2'/></actuator></mujoco>"
    )
    with pytest.raises(UnsupportedError, match=r"hip in geared\.xml has gear 2") as refused:
        ArmParameters.of(sm.load(file), ["hip"])
    assert refused.value.feature == "gear"
