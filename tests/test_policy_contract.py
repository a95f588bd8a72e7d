"""A policy's contract is read from its file, or refused with the field that is wrong."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.errors import BadInputError
from statemachine.lab.policy.contract_file import read_contract

from .support.files import written
from .support.policies import content, contract, contract_file, with_terms

pytest.importorskip("yaml")
POLICY = "policy_io.observation_groups.policy"
TERMS = f"{POLICY}.terms"
ACTION = "control.actions.joint_pos"
ACTUATORS = "control.actuators"
VELOCITY = "policy_io.commands.base_velocity"
NAN, INFINITE = float("nan"), float("inf")
PERIOD = {"period": 0.5}

# What a field is set to, None where it is removed.
WRONG = [
    ("policy_io.joints.names", None),
    ("policy_io.joints.names", []),
    ("policy_io.joints.names", "left"),
    ("policy_io.joints.names", ["left", "left"]),
    ("policy_io.joints.names", ["left", 2]),
    ("control.default_joint_pos", None),
    ("control.default_joint_pos", [0.1]),
    ("control.default_joint_pos", [0.1, "0.2"]),
    ("control.default_joint_pos", [0.1, NAN]),
    ("control.default_joint_pos", [0.1, True]),
    ("control.default_joint_pos", INFINITE),
    ("control.default_joint_pos", {"left": 0.1}),
    ("control.default_joint_pos", {"left": 0.1, "right": NAN}),
    ("control.default_joint_pos", {"left": 0.1, "right": None}),
    (TERMS, None),
    (TERMS, []),
    (TERMS, "base_ang_vel"),
    (f"{TERMS}[0]", [3]),
    (f"{TERMS}[0].id", [{}]),
    (f"{TERMS}[0].id", [{"id": "base_angular_velocity"}]),
    (f"{TERMS}[0].id", [{"id": 3}]),
    (f"{TERMS}[0].dim", [{"id": "base_ang_vel", "dim": 4}]),
    (f"{TERMS}[0].dim", [{"id": "joint_pos_rel", "dim": 3}]),
    (f"{TERMS}[0].dim", [{"id": "gait_phase", "dim": 1, "params": PERIOD}]),
    (f"{TERMS}[0].dim", [{"id": "base_ang_vel", "dim": 0}]),
    (f"{TERMS}[0].scale", [{"id": "base_ang_vel", "scale": [1.0, 2.0]}]),
    (f"{TERMS}[0].scale", [{"id": "base_ang_vel", "scale": NAN}]),
    (f"{TERMS}[0].clip", [{"id": "base_ang_vel", "clip": [1.0, -1.0]}]),
    (f"{TERMS}[0].clip", [{"id": "base_ang_vel", "clip": [-1.0, 0.0, 1.0]}]),
    (f"{TERMS}[0].source_name", [{"id": "base_ang_vel", "source_name": 3}]),
    (f"{TERMS}[1].source_name", [{"id": "base_ang_vel"}, {"id": "base_ang_vel"}]),
    (f"{TERMS}[0].params", [{"id": "base_ang_vel", "params": 3}]),
    (f"{TERMS}[0].params.frame", [{"id": "base_ang_vel", "params": {"frame": "local"}}]),
    (f"{TERMS}[0].params.site", [{"id": "base_ang_vel", "params": {"site": 3}}]),
    (f"{TERMS}[0].params.lag", [{"id": "last_action", "params": {"lag": 2}}]),
    (f"{TERMS}[0].params.index", [{"id": "last_action", "params": {"index": [0]}}]),
    (f"{TERMS}[0].params.joints", [{"id": "joint_pos_rel", "params": {"joints": ["left"]}}]),
    (f"{TERMS}[0].params.default", [{"id": "joint_pos_rel", "params": {"default": [0.1]}}]),
    (f"{TERMS}[0].params.value", [{"id": "constant"}]),
    (f"{TERMS}[0].params.value", [{"id": "constant", "params": {"value": []}}]),
    (f"{TERMS}[0].params.value", [{"id": "constant", "params": {"value": [NAN]}}]),
    (f"{TERMS}[0].params.period", [{"id": "gait_phase"}]),
    (f"{TERMS}[0].params.period", [{"id": "gait_phase", "params": {"period": 0.0}}]),
    (f"{TERMS}[0].params.offset", [{"id": "gait_phase", "params": {**PERIOD, "offset": NAN}}]),
    (
        f"{TERMS}[0].params.clock_offset_steps",
        [{"id": "gait_phase", "params": {**PERIOD, "clock_offset_steps": 0.5}}],
    ),
    (f"{TERMS}[0].params.gate", [{"id": "gait_phase", "params": {**PERIOD, "gate": 1}}]),
    (f"{TERMS}[0].params.stand", [{"id": "gait_phase", "params": {**PERIOD, "stand": 1}}]),
    (
        f"{TERMS}[0].params.stand_threshold",
        [{"id": "gait_phase", "params": {**PERIOD, "stand_threshold": "0.1"}}],
    ),
    (f"{POLICY}.history.length", 0),
    (f"{POLICY}.history.length", 1.5),
    (f"{POLICY}.history.layout", "major"),
    (f"{POLICY}.history.order", "oldest"),
    (f"{POLICY}.history.init", "first"),
    (f"{POLICY}.history.chunks", 2),
    (f"{POLICY}.history.first_frame", 1),
    (f"{POLICY}.clip_then_scale", "yes"),
    ("policy_io.imu.frame", "local"),
    ("policy_io.imu.quat_order", "zyx"),
    ("policy_io.imu.site", 3),
    ("policy_io.imu.rotation_in_root", [0.0, 1.0, 0.0, 0.0]),
    ("policy_io.imu.rotation_in_root", [1.0, 0.0, 0.0]),
    (f"{VELOCITY}.limit.vz", [0.0, 1.0]),
    (f"{VELOCITY}.limit.vx", [1.0, 0.0]),
    (f"{VELOCITY}.limit.vx", 3),
    (f"{VELOCITY}.shaping", "exponential"),
    (f"{VELOCITY}.gate", 0.1),
    (f"{ACTION}.scale", [1.0, 2.0, 3.0]),
    (f"{ACTION}.offset", "default"),
    (f"{ACTION}.clip", [1.0, -1.0]),
    (f"{ACTION}.clip", [[-1.0, 1.0]]),
    (f"{ACTION}.clip", [[-1.0, 1.0], [1.0, -1.0]]),
    (f"{ACTION}.clip", [[-1.0, 1.0], [-1.0, NAN]]),
    (f"{ACTION}.clip", [[-1.0, 1.0], [-1.0, "1"]]),
    (f"{ACTION}.clip", [[-1.0, 1.0], [-1.0]]),
    (f"{ACTION}.clip_stage", "raw"),
    (f"{ACTION}.filter", "lowpass"),
    (f"{ACTION}.delay_steps", -1),
    (f"{ACTUATORS}.kind", "servo"),
    (f"{ACTUATORS}.kp", -1.0),
    (f"{ACTUATORS}.kp", [20.0, NAN]),
    (f"{ACTUATORS}.kd", {"left": 1.0, "right": -1.0}),
    ("model.effort_limit", -5.0),
    ("model.effort_limit", {"left": 5.0}),
    ("model.armature", -0.1),
    ("model.joint_damping", -0.1),
    ("model.joint_friction", "0.1"),
    ("timing.policy_dt", None),
    ("timing.policy_dt", 0.0),
    ("timing.policy_dt", NAN),
    ("timing.policy_dt", INFINITE),
    ("timing.policy_dt", "0.02"),
    ("timing.policy_dt", True),
    ("timing.sim_dt", 0.003),
    ("timing.sim_dt", 0.04),
    ("timing.sim_dt", 0.0),
    ("timing.sim_dt", 1e-320),
    ("timing.policy_dt", 1.5),
    ("timing.decimation", 1_000_000),
    (f"{POLICY}.history.length", 1_000_000_000),
    (f"{ACTION}.delay_steps", 1e300),
    (f"{ACTUATORS}.kp", 10**400),
    ("timing.decimation", 5),
    ("timing.decimation", 0),
    ("timing", 3),
]


def changes_of(field: str, value: object) -> dict[str, Any]:
    """Return the change that makes a field wrong; of a term, the list of terms is given."""
    return {TERMS: value} if field.startswith(f"{TERMS}[") else {field: value}


@pytest.mark.parametrize(("field", "value"), WRONG)
def test_a_wrong_field_is_refused_by_its_name(tmp_path: Path, field: str, value: object) -> None:
    with pytest.raises(BadInputError) as caught:
        contract(tmp_path, changes_of(field, value))
    assert f"contract.yaml: {field}" in str(caught.value)


@pytest.mark.parametrize("missing", ["kp", "kd"])
def test_torques_from_outside_need_gains(tmp_path: Path, missing: str) -> None:
    changes = {f"{ACTUATORS}.kind": "explicit_pd", f"{ACTUATORS}.{missing}": None}
    with pytest.raises(BadInputError, match=rf"{ACTUATORS}\.{missing} is missing"):
        contract(tmp_path, changes)


@pytest.mark.parametrize(
    ("changes", "nearest"),
    [
        ({"timing.policy_dt": None, "timing.policydt": 0.02}, "policydt"),
        ({"control.default_joint_pos": {"left": 0.1, "rihgt": 0.2}}, "rihgt"),
        (with_terms({"id": "base_angvel"}), "base_ang_vel"),
        ({f"{ACTUATORS}.kind": "explict_pd"}, "explicit_pd"),
        ({f"{VELOCITY}.limit": {"vxx": [0.0, 1.0]}}, "vx"),
    ],
)
def test_a_misspelt_name_is_answered_with_the_nearest(
    tmp_path: Path, changes: dict[str, Any], nearest: str
) -> None:
    with pytest.raises(BadInputError) as caught:
        contract(tmp_path, changes)
    assert str(caught.value).split("Did you mean ")[1].startswith(f"{nearest}?")


@pytest.mark.parametrize("key", [1, None, True])
def test_a_field_whose_name_is_no_text_is_unread(tmp_path: Path, key: object) -> None:
    fields = {**content(), key: "what"}
    read = read_contract(contract_file(tmp_path, fields))
    assert [field.name for field in read.unread] == [str(key)]


@pytest.mark.parametrize("field", ["timing", "kp"])
def test_a_key_that_stands_twice_is_refused_with_its_line(tmp_path: Path, field: str) -> None:
    file = contract_file(tmp_path, content())
    lines = file.read_text("utf-8").splitlines()
    number = next(i for i, line in enumerate(lines) if line.strip().startswith(f"{field}:"))
    indent = lines[number][: len(lines[number]) - len(lines[number].lstrip())]
    lines.append(f"{indent}{field}: 1")  # the sections of kp and timing: the last, the whole
    written(file, "\n".join(lines))
    says = rf"contract\.yaml: '{field}' stands twice in a table, again in line {len(lines)}"
    with pytest.raises(BadInputError, match=says):
        read_contract(file)


def test_a_key_that_an_alias_merges_may_stand_for_another(tmp_path: Path) -> None:
    file = contract_file(tmp_path, content())
    merged = "first: &first {a: 1}\nsecond: {<<: *first, a: 2}\n"
    written(file, file.read_text("utf-8") + merged)
    assert [field.name for field in read_contract(file).unread] == ["first", "second"]


def test_nothing_of_a_whole_contract_is_unread(tmp_path: Path) -> None:
    changes = {"source.robot": "r", "timing.target_hold": "zoh", f"{ACTUATORS}.integrator": "x"}
    assert contract(tmp_path, changes).unread == ()


# -- files ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("a: [1", id="no YAML"),
        pytest.param("a:\t- b\n\t- c", id="tabs"),
        pytest.param("!!python/object/apply:os.getcwd []", id="an object of Python"),
        pytest.param("", id="nothing"),
        pytest.param("- 1", id="a list"),
        pytest.param("[" * 1500, id="deep"),
        pytest.param("&a [*a]", id="itself in a list"),
        pytest.param("a: &a {b: *a}", id="itself"),
        pytest.param("schema: gaitkeeper/contract/v2", id="another version"),
        pytest.param("a: 1", id="no schema"),
        pytest.param("a: 2001-02-30", id="no date"),
        pytest.param("#" * 2_000_001, id="huge"),
    ],
)
def test_a_file_that_is_no_contract_is_refused_by_its_name(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadInputError, match=r"contract\.yaml"):
        read_contract(written(tmp_path / "contract.yaml", text))


def test_aliases_that_repeat_each_other_are_refused_at_once(tmp_path: Path) -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    for number in range(1, 12):
        repeated = ", ".join([f"*a{number - 1}"] * 10)
        lines.append(f"a{number}: &a{number} [{repeated}]")
    lines += ["schema: gaitkeeper/contract/v3", "policy_io: {joints: {names: *a11}}"]
    with pytest.raises(BadInputError, match="repeat"):
        read_contract(written(tmp_path / "contract.yaml", "\n".join(lines)))


def test_a_file_of_other_letters_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "contract.yaml"
    file.write_bytes(b"a: \xff\xfe")
    with pytest.raises(BadInputError, match=r"contract\.yaml"):
        read_contract(file)


@pytest.mark.parametrize("name", ["nothing.yaml", "."])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInputError):
        read_contract(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_is_refused_unopened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BadInputError):
        read_contract(tmp_path / "pipe")


# -- accepted forms -------------------------------------------------------------


@pytest.mark.parametrize("form", [[0.3, 0.4], {"left": 0.4, "right": 0.3, "tail": 1.0}])
def test_numbers_of_joints_may_be_a_list_or_a_table(tmp_path: Path, form: object) -> None:
    read = contract(tmp_path, {"control.default_joint_pos": form})
    assert read.default_joint_pos.tolist() == [0.3, 0.4]


def test_one_number_stands_for_all_joints(tmp_path: Path) -> None:
    read = contract(tmp_path, {f"{ACTION}.scale": 2, f"{ACTION}.offset": 0.1})
    assert read.action.targets(np.array((1.0, -1.0))).tolist() == [2.1, -1.9]


def test_actions_start_from_the_default_pose_where_no_offset_is_given(tmp_path: Path) -> None:
    assert contract(tmp_path).action.targets(np.zeros(2)).tolist() == [0.1, 0.2]


def test_actions_are_angles_where_no_scale_is_given(tmp_path: Path) -> None:
    read = contract(tmp_path, {f"{ACTION}.scale": None})
    assert read.action.scale.tolist() == [1.0, 1.0]


@pytest.mark.parametrize("form", [[-0.3, 0.3], [[-0.3, 0.3], [-0.3, 0.3]]])
def test_targets_are_clipped_by_a_pair_or_by_one_of_each_joint(
    tmp_path: Path, form: object
) -> None:
    read = contract(tmp_path, {f"{ACTION}.clip": form})
    assert read.action.targets(np.array((9.0, -9.0))).tolist() == [0.3, -0.3]


def test_no_target_is_clipped_where_the_stage_is_none(tmp_path: Path) -> None:
    read = contract(tmp_path, {f"{ACTION}.clip": [-0.3, 0.3], f"{ACTION}.clip_stage": "none"})
    assert read.action.clip is None


@pytest.mark.parametrize(
    ("sim_dt", "decimation", "steps"),
    [(0.005, None, 4), (None, 8, 8), (0.005, 4, 4), (None, None, None), (0.02, None, 1)],
)
def test_the_steps_of_a_call_are_told_by_either_field(
    tmp_path: Path, sim_dt: float | None, decimation: int | None, steps: int | None
) -> None:
    changes = {"timing.sim_dt": sim_dt, "timing.decimation": decimation}
    assert contract(tmp_path, changes).timing.decimation == steps


def test_a_joint_whose_force_limit_is_null_has_none(tmp_path: Path) -> None:
    limits = contract(tmp_path, {"model.effort_limit": {"left": None, "right": 5}})
    assert limits.servos.effort_limit is not None
    assert limits.servos.effort_limit.tolist() == [5.0, INFINITE]


def test_the_size_of_the_observation_counts_terms_and_moments(tmp_path: Path) -> None:
    terms = with_terms(
        {"id": "base_lin_vel"},
        {"id": "joint_vel_rel"},
        {"id": "gait_phase", "params": PERIOD},
        {"id": "gait_phase_legs", "params": PERIOD},
        {"id": "constant", "params": {"value": [1.0, 2.0]}},
    )
    assert contract(tmp_path, {**terms, f"{POLICY}.history.length": 3}).observation_size == 39


def test_what_a_contract_does_not_say_of_servos_is_none(tmp_path: Path) -> None:
    servos = contract(tmp_path, {ACTUATORS: {}}).servos
    told = (servos.kind, servos.kp, servos.kd, servos.effort_limit, servos.armature)
    assert told == (None,) * 5


def test_an_angle_is_told_from_the_default_of_its_own_joint(tmp_path: Path) -> None:
    term = {"id": "joint_pos_rel", "params": {"joints": ["left", "right"]}}
    (read,) = contract(tmp_path, with_terms(term)).terms
    assert read.reference is not None
    assert read.reference.tolist() == [0.2, 0.1]


def test_the_gyroscope_takes_frame_and_site_of_the_sensor(tmp_path: Path) -> None:
    changes = {"policy_io.imu": {"frame": "world", "site": "imu"}}
    term = contract(tmp_path, changes).terms[0]
    assert (term.frame, term.site) == ("world", "imu")


def test_a_velocity_takes_neither(tmp_path: Path) -> None:
    changes = {"policy_io.imu": {"frame": "world", "site": "imu"}}
    (term,) = contract(tmp_path, {**changes, **with_terms({"id": "base_lin_vel"})}).terms
    assert (term.frame, term.site) == ("body", "")


def test_a_contract_is_no_reader_of_figures_of_provenance(tmp_path: Path) -> None:
    file = contract_file(tmp_path, {**content(), "provenance": {"timing.policy_dt": "file"}})
    assert read_contract(file).unread == ()


def test_a_file_that_is_no_yaml_is_told_by_its_line(tmp_path: Path) -> None:
    file = written(tmp_path / "contract.yaml", "a: 1\n b: [2\n")
    with pytest.raises(BadInputError, match=r"line 2, column 3: mapping values") as refused:
        read_contract(file)
    assert "unicode string" not in str(refused.value)
