"""A model as a contract wants it: who integrates the gains, limits, joints, and the timestep."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine import load
from statemachine.errors import BadInputError, UnsupportedError
from statemachine.interface import Model
from statemachine.lab.policy.on_model import PolicyOnModel

from .support.backends import BOTH
from .support.policies import (
    KD,
    KP,
    LIMIT,
    constant_network,
    motors,
    on_model,
    robot,
    run,
    servos,
)
from .support.requirements import need_engine

pytest.importorskip("yaml")
pytest.importorskip("onnxruntime")
ACTUATORS = "control.actuators"
KIND = f"{ACTUATORS}.kind"
EXPLICIT = {KIND: "explicit_pd"}
EACH = [*BOTH, pytest.param("motrix", marks=pytest.mark.slow)]
each = pytest.mark.parametrize("backend", EACH)
AIR = "0 0 0"  # gravity


def loaded(folder: Path, backend: str, **robot_has: Any) -> Model:
    need_engine(backend)
    return load(robot(folder, **robot_has), backend=backend)


def adapted_to(
    folder: Path, model: Model, changes: dict[str, Any] | None = None, action: float = 0.0
) -> PolicyOnModel:
    """Return a policy that always acts the same, on a model."""
    return on_model(folder, model, constant_network(folder, [action, action]), changes)


def names(policy: PolicyOnModel) -> list[str]:
    return [change.name for change in policy.driven.changes]


# -- what the contract says as the file has it -----------------------------------


@each
def test_nothing_changes_where_the_file_has_it_so(tmp_path: Path, backend: str) -> None:
    model = loaded(tmp_path, backend)
    policy = adapted_to(tmp_path, model, {"model.effort_limit": LIMIT, "model.armature": 0.01})
    assert policy.driven.model is model
    assert policy.driven.changes == ()


def test_what_a_contract_does_not_say_is_as_in_the_file(tmp_path: Path) -> None:
    changes = {ACTUATORS: {}, "timing.sim_dt": None}
    driven = adapted_to(tmp_path, loaded(tmp_path, "mujoco"), changes).driven
    assert (driven.kind, driven.changes) == ("implicit_pd", ())
    assert (driven.kp.tolist(), driven.kd.tolist()) == ([KP, KP], [KD, KD])
    assert driven.limit.tolist() == [LIMIT, LIMIT]


# -- what it says otherwise -------------------------------------------------------


@each
def test_gains_are_those_of_the_contract(tmp_path: Path, backend: str) -> None:
    changes = {f"{ACTUATORS}.kp": [30.0, 40.0], f"{ACTUATORS}.kd": 0.7}
    policy = adapted_to(tmp_path, loaded(tmp_path, backend), changes)
    model = policy.driven.model
    assert model.actuator_kp.tolist() == [40.0, 30.0]
    assert model.actuator_kv == pytest.approx([0.7, 0.7])
    assert names(policy) == ["kp", "kd"]


@pytest.mark.parametrize("backend", BOTH)
def test_force_limits_are_those_of_the_contract(tmp_path: Path, backend: str) -> None:
    changes = {"model.effort_limit": {"left": 3.0, "right": None}}
    policy = adapted_to(tmp_path, loaded(tmp_path, backend), changes)
    limits = policy.driven.model.actuator_forcerange
    assert limits.tolist() == [[-3.0, 3.0], [-np.inf, np.inf]]
    assert names(policy) == ["force limit"]


@each
def test_armature_and_damping_are_those_of_the_contract(tmp_path: Path, backend: str) -> None:
    changes = {"model.armature": [0.02, 0.03], "model.joint_damping": 0.1}
    policy = adapted_to(tmp_path, loaded(tmp_path, backend), changes)
    model = policy.driven.model
    assert model.dof_armature[6:] == pytest.approx([0.03, 0.02])
    assert model.dof_damping[6:] == pytest.approx([0.1, 0.1])
    assert names(policy) == ["armature", "damping"]


@pytest.mark.parametrize("backend", BOTH)
def test_friction_is_that_of_the_contract(tmp_path: Path, backend: str) -> None:
    policy = adapted_to(tmp_path, loaded(tmp_path, backend), {"model.joint_friction": 0.2})
    assert policy.driven.model.dof_frictionloss[6:] == pytest.approx([0.2, 0.2])
    assert names(policy) == ["friction"]


@each
def test_the_timestep_is_that_of_the_contract(tmp_path: Path, backend: str) -> None:
    policy = adapted_to(tmp_path, loaded(tmp_path, backend), {"timing.sim_dt": 0.004})
    assert policy.driven.model.timestep == pytest.approx(0.004)
    assert names(policy) == ["timestep"]


def test_a_change_tells_file_and_contract_of_the_joints_that_differ(tmp_path: Path) -> None:
    changes = {f"{ACTUATORS}.kp": [KP, 40.0]}
    (change,) = adapted_to(tmp_path, loaded(tmp_path, "mujoco"), changes).driven.changes
    assert (change.joints, change.file, change.contract) == (1, (KP, KP), (40.0, 40.0))


def test_the_model_of_the_file_stays_as_it_was(tmp_path: Path) -> None:
    model = loaded(tmp_path, "mujoco")
    adapted_to(tmp_path, model, {f"{ACTUATORS}.kp": 99.0, "model.effort_limit": 1.0})
    assert model.actuator_kp.tolist() == [KP, KP]
    assert model.actuator_forcerange[0].tolist() == [-LIMIT, LIMIT]


# -- who integrates the gains -----------------------------------------------------


@pytest.mark.parametrize("backend", BOTH)
def test_motors_become_servos(tmp_path: Path, backend: str) -> None:
    """And move the robot as the servos of a file do, bit by bit."""
    limit = {"model.effort_limit": LIMIT}
    of_motors = adapted_to(
        tmp_path, loaded(tmp_path, backend, actuators=motors()), limit, action=0.5
    )
    end = run(of_motors, 50).end
    assert names(of_motors) == ["servos"]
    of_servos = adapted_to(tmp_path, loaded(tmp_path, backend), limit, action=0.5)
    assert run(of_servos, 50).end == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize("backend", BOTH)
def test_servos_become_motors(tmp_path: Path, backend: str) -> None:
    limit = {"model.effort_limit": LIMIT, **EXPLICIT}
    of_servos = adapted_to(tmp_path, loaded(tmp_path, backend), limit, action=0.5)
    end = run(of_servos, 50).end
    assert names(of_servos) == ["servos"]
    of_motors = adapted_to(
        tmp_path, loaded(tmp_path, backend, actuators=motors()), limit, action=0.5
    )
    assert run(of_motors, 50).end == pytest.approx(end, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("actuators", "kind"), [(motors(), "implicit_pd"), (servos(), "explicit_pd")]
)
def test_motrix_refuses_to_make_one_of_the_other(tmp_path: Path, actuators: str, kind: str) -> None:
    model = loaded(tmp_path, "motrix", actuators=actuators)
    with pytest.raises(UnsupportedError, match="motrix"):
        adapted_to(tmp_path, model, {KIND: kind, "model.effort_limit": LIMIT})


def gap_of_kinds(folder: Path, backend: str, timestep: float) -> float:
    """Return the largest gap of an angle between servos and torques from outside [rad]."""
    model = loaded(folder, backend, timestep=timestep, gravity=AIR)
    ends: list[np.ndarray] = []
    for kind in ("implicit_pd", "explicit_pd"):
        changes = {KIND: kind, "timing.sim_dt": timestep}
        ends.append(run(adapted_to(folder, model, changes, 0.3), round(0.05 / timestep)).end)
    return float(np.abs(ends[0] - ends[1])[7:].max())


@pytest.mark.parametrize("backend", BOTH)
def test_torques_from_outside_are_servos_where_the_timestep_is_short(
    tmp_path: Path, backend: str
) -> None:
    """The gap is of first order: a quarter of the timestep, a quarter of the gap."""
    gaps = [gap_of_kinds(tmp_path, backend, timestep) for timestep in (0.001, 0.00025)]
    assert gaps[0] > 1e-4
    assert gaps[1] == pytest.approx(gaps[0] / 4, rel=0.25)


def test_with_long_steps_torques_from_outside_shake_where_servos_hold(tmp_path: Path) -> None:
    """kd · timestep / inertia is 0.5 · 0.02 / 0.003: above 2, where explicit steps diverge."""
    ends: list[float] = []
    for kind in ("implicit_pd", "explicit_pd"):
        model = loaded(tmp_path, "mujoco", joint="", gravity=AIR)
        policy = adapted_to(tmp_path, model, {KIND: kind, "timing.sim_dt": 0.02}, 0.1)
        ends.append(float(np.abs(run(policy, 40).qvel[-10:, 6:]).max()))
    assert ends[0] < 1.0
    assert ends[1] > 20.0


def test_torques_from_outside_keep_within_the_limit(tmp_path: Path) -> None:
    changes = {**EXPLICIT, "model.effort_limit": [2.0, 3.0]}
    policy = adapted_to(tmp_path, loaded(tmp_path, "mujoco"), changes, action=9.0)
    assert run(policy, 1).ctrl[0].tolist() == [3.0, 2.0]


def first_torques(policy: PolicyOnModel) -> list[float]:
    """Return what a servo of each leg does in the first step [N·m]."""
    import mujoco

    raw = policy.driven.model.raw
    data = mujoco.MjData(raw)
    data.ctrl[:] = run(policy, 1).ctrl[0]
    mujoco.mj_forward(raw, data)
    return data.qfrc_actuator[6:].tolist()


@pytest.mark.parametrize("kind", ["implicit_pd", "explicit_pd"])
@pytest.mark.parametrize(
    "actuators",
    [
        pytest.param(motors(), id="motors"),
        pytest.param(servos(), id="servos"),
        pytest.param(motors().replace("<motor", '<general gainprm="2"'), id="motors with a gain"),
    ],
)
def test_a_limit_of_the_contract_replaces_each_of_the_file(
    tmp_path: Path, kind: str, actuators: str
) -> None:
    """That of the force, of the command of a motor, and of the joint."""
    joint = 'armature="0.01" actuatorfrcrange="-1 1"'
    model = loaded(tmp_path, "mujoco", actuators=actuators, joint=joint)
    policy = adapted_to(tmp_path, model, {KIND: kind, "model.effort_limit": 12.0}, action=9.0)
    assert first_torques(policy) == [12.0, 12.0]


@pytest.mark.parametrize("kind", ["implicit_pd", "explicit_pd"])
def test_without_one_the_least_limit_of_the_file_acts(tmp_path: Path, kind: str) -> None:
    model = loaded(tmp_path, "mujoco", joint='armature="0.01" actuatorfrcrange="-3 3"')
    policy = adapted_to(tmp_path, model, {KIND: kind}, action=9.0)
    assert policy.driven.limit.tolist() == [3.0, 3.0]
    assert first_torques(policy) == [3.0, 3.0]


def test_a_gain_of_motors_does_not_multiply_torques(tmp_path: Path) -> None:
    """kp · 0.2 and kp · 0.1, though a motor of the file gives two for one."""
    actuators = motors().replace("<motor", '<general gainprm="2"')
    model = loaded(tmp_path, "mujoco", actuators=actuators)
    assert first_torques(adapted_to(tmp_path, model, EXPLICIT)) == pytest.approx([4.0, 2.0])


# -- refusals -------------------------------------------------------------------


@each
def test_gears_are_refused(tmp_path: Path, backend: str) -> None:
    model = loaded(tmp_path, backend, actuators=motors(rest='gear="2"'))
    with pytest.raises(BadInputError, match=r"robot\.xml has gears"):
        adapted_to(tmp_path, model)


@pytest.mark.parametrize("missing", ["kp", "kd"])
def test_motors_need_gains(tmp_path: Path, missing: str) -> None:
    model = loaded(tmp_path, "mujoco", actuators=motors())
    with pytest.raises(BadInputError, match=ACTUATORS):
        adapted_to(tmp_path, model, {f"{ACTUATORS}.{missing}": None})


def test_servos_beside_motors_are_refused(tmp_path: Path) -> None:
    both = motors().split("/>")[0] + "/>" + servos().split("/>")[1] + "/>"
    model = loaded(tmp_path, "mujoco", actuators=both)
    with pytest.raises(BadInputError, match="by servos and by others"):
        adapted_to(tmp_path, model)


def test_a_timestep_that_is_no_part_of_a_call_is_refused(tmp_path: Path) -> None:
    model = loaded(tmp_path, "mujoco", timestep=0.003)
    with pytest.raises(BadInputError, match=r"timing\.sim_dt"):
        adapted_to(tmp_path, model, {"timing.sim_dt": None})
