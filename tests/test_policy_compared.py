"""A policy is a controller like any function: it runs on two sides, and its outcomes are told."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml

import statemachine as sm
from statemachine import lab
from statemachine.cli import parser_of
from statemachine.cli.compare.requests import request_of
from statemachine.errors import BadInputError
from statemachine.interface import Array, Model
from statemachine.lab.compare.outcomes import (
    DISTANCE,
    FELL,
    FORWARD,
    LATERAL,
    OUTCOMES,
    TRACKING,
    WORK,
    outcomes_of_run,
)
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.compare.typed_command import typed_command
from statemachine.lab.policy.scenario import policy_scenario
from statemachine.lab.questions.compare_verdict import headline_of
from statemachine.lab.questions.policy_outcomes import outcomes_table
from statemachine.lab.questions.requests.gap import CompareRequest, CompareResult
from statemachine.lab.questions.sides_outcomes import sides_outcomes
from statemachine.lab.recordings import Trace, record_scenario
from statemachine.lab.recordings.request import RecordRequest, answer_record
from statemachine.lab.runs.walking import headings, lateral_way, mean_speeds
from statemachine.measures import parse_tolerances
from statemachine.measures.text import quantity
from statemachine.models import models_dir

from .support.policies import GO1_CONTRACT
from .support.requirements import SHARED, need_engine, shared

FOLDER = models_dir() / "quadruped"
POLICY, CONTRACT = str(FOLDER / "policy.onnx"), str(FOLDER / "contract.yaml")
SCENE = "quadruped/scene"
AHEAD = (0.3, 0.0, 0.0)
TURNING = (0.2, 0.0, 0.4)


@pytest.fixture(autouse=True)
def runtime() -> Any:
    """Return the package that runs networks."""
    return pytest.importorskip("onnxruntime")


def _recorded(
    model: str | Path = SCENE,
    seconds: float = 0.5,
    backend: str = "mujoco",
    command: tuple[float, float, float] = AHEAD,
) -> Trace:
    return answer_record(
        RecordRequest(POLICY, model, backend, seconds=seconds, contract=CONTRACT, command=command)
    )


def _recorded_with(kp: float) -> Trace:
    scenario = policy_scenario(POLICY, CONTRACT, AHEAD)
    return record_scenario(scenario, sm.load(SCENE, kp=kp), seconds=1.0)


# The same run by plain MuJoCo and onnxruntime, from what contract.yaml says.


def _raw_run(runtime: Any, seconds: float, command: tuple[float, float, float]) -> Array:
    """Return qpos (n, nq) at the beginning of each step, and at the end."""
    contract = yaml.safe_load(Path(CONTRACT).read_text("utf-8"))
    names = contract["policy_io"]["joints"]["names"]
    actions, control = contract["control"]["actions"]["joint_pos"], contract["control"]
    default, scale, offset = (
        np.array([table[name] for name in names])
        for table in (control["default_joint_pos"], actions["scale"], actions["offset"])
    )
    session = runtime.InferenceSession(POLICY)
    model = mujoco.MjModel.from_xml_path(str(FOLDER / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    joints = [model.joint(name) for name in names]
    qpos_at, qvel_at = ([int(j.qposadr[0]) for j in joints], [int(j.dofadr[0]) for j in joints])
    last, rows = np.zeros(len(names)), [data.qpos.copy()]
    for step in range(round(seconds / model.opt.timestep)):
        if step % contract["timing"]["decimation"] == 0:
            mat = np.zeros(9)
            mujoco.mju_quat2Mat(mat, data.qpos[3:7])
            world_of_trunk = mat.reshape(3, 3)
            phase = 2 * np.pi * (step * model.opt.timestep % 0.4) / 0.4
            observation = [
                2.0 * world_of_trunk.T @ data.qvel[:3],
                0.25 * data.qvel[3:6],
                world_of_trunk.T @ [0, 0, -1],
                np.array([2.0, 2.0, 0.25]) * command,
                data.qpos[qpos_at] - default,
                0.05 * data.qvel[qvel_at],
                last,
                [np.sin(phase), np.cos(phase)],
            ]
            given = np.concatenate(observation)[None].astype(np.float32)
            last = session.run(None, {"obs": given})[0][0].astype(np.float64)
            for name, target in zip(names, offset + scale * last, strict=True):
                data.ctrl[_actuator_of(model, name)] = target
        mujoco.mj_step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


def _actuator_of(model: mujoco.MjModel, joint: str) -> int:
    (actuator,) = np.flatnonzero(model.actuator_trnid[:, 0] == model.joint(joint).id)
    return int(actuator)


def test_a_recorded_run_is_that_of_plain_mujoco(runtime: Any) -> None:
    ours, raw = _recorded(command=TURNING).qpos, _raw_run(runtime, 0.5, TURNING)
    assert ours == pytest.approx(raw, abs=1e-5)


@pytest.mark.parametrize("backend", ["mujoco", "pybullet", "motrix"])
def test_a_policy_commands_the_same_bits_twice(backend: str) -> None:
    need_engine(backend)
    first, second = (_recorded(seconds=0.2, backend=backend) for _ in range(2))
    assert first.qpos.tobytes() == second.qpos.tobytes()


# What each side keeps, and what a policy finds by names.


def _written(folder: Path, change: Callable[[ET.Element], None], name: str = "changed.xml") -> Path:
    """Write the robot on its floor as one file, changed, and return that file."""
    robot = ET.fromstring((FOLDER / "quadruped.xml").read_text("utf-8"))
    world = robot.find("worldbody")
    assert world is not None
    ET.SubElement(world, "geom", type="plane", size="0 0 1", contype="1", conaffinity="0")
    change(robot)
    path = folder / name
    path.write_text(ET.tostring(robot, encoding="unicode"), "utf-8")
    return path


def _without_keyframes(robot: ET.Element) -> None:
    for keyframe in robot.findall("keyframe"):
        robot.remove(keyframe)


def _with_motors(robot: ET.Element) -> None:
    for servo in robot.iter("position"):
        servo.tag = "motor"
        servo.attrib.pop("kp", None)
        servo.attrib.pop("kv", None)
        servo.attrib.pop("inheritrange", None)
        servo.attrib["gear"] = "1"


def _with_legs_in_reverse(robot: ET.Element) -> None:
    _without_keyframes(robot)
    trunk = robot.find("worldbody/body")
    assert trunk is not None
    legs = trunk.findall("body")
    for leg in legs:
        trunk.remove(leg)
    trunk.extend(reversed(legs))


def _with_other_names(robot: ET.Element) -> None:
    for element in robot.iter():
        for key in ("name", "joint"):
            if element.tag in ("joint", "position") and key in element.attrib:
                element.attrib[key] = f"my_{element.attrib[key]}"


def test_motors_get_the_torques_of_the_contract_s_gains(tmp_path: Path) -> None:
    trace = _recorded(_written(tmp_path, _with_motors), seconds=0.1)
    servo = _recorded(_written(tmp_path, lambda _: None), seconds=0.1)
    joints = slice(7, None)
    row = 3  # of the first call of the policy, whose targets hold
    torque = 60.0 * (servo.ctrl[0] - trace.qpos[row, joints]) - 1.5 * trace.qvel[row, 6:]
    assert trace.ctrl[row] == pytest.approx(torque)


def test_a_side_keeps_its_own_gains() -> None:
    model = sm.load(SCENE, kp=20.0)
    policy_scenario(POLICY, CONTRACT).controller(model, 0)
    assert model.actuator_kp.tolist() == [20.0] * 12


def test_joints_are_found_by_their_names_whatever_their_order(tmp_path: Path) -> None:
    usual = _recorded(_written(tmp_path, _without_keyframes))
    other = _recorded(_written(tmp_path, _with_legs_in_reverse))
    assert other.header.joints != usual.header.joints
    for name in usual.header.joints[1:]:
        at, there = (
            trace.header.jnt_qposadr[trace.header.joints.index(name)] for trace in (usual, other)
        )
        assert other.qpos[:, there] == pytest.approx(usual.qpos[:, at], abs=1e-6)


def test_joints_have_other_names_on_the_right_where_these_are_named(tmp_path: Path) -> None:
    usual = _written(tmp_path, lambda _: None, "usual.xml")
    other = _written(tmp_path, _with_other_names, "other.xml")
    joints = sm.load(usual).joint_names[1:]
    names = {name: f"my_{name}" for name in joints}
    result = lab.compare(
        usual,
        other,
        what=POLICY,
        contract=CONTRACT,
        names=names,
        seconds=0.2,
        chaos=False,
    )
    assert result.finding.is_same


def test_without_a_keyframe_it_starts_in_the_pose_of_the_contract(tmp_path: Path) -> None:
    trace = _recorded(_written(tmp_path, _without_keyframes), seconds=0.02)
    angles = {"hip": 0.0, "thigh": 0.7, "knee": -1.4}
    expected = [angles[name.partition("_")[2]] for name in trace.header.joints[1:]]
    assert trace.qpos[0, 7:] == pytest.approx(expected)


def test_both_sides_start_alike_without_a_keyframe(tmp_path: Path) -> None:
    file = str(_written(tmp_path, _without_keyframes))
    result = lab.compare(
        file, f"{file} kp=60", what=POLICY, contract=CONTRACT, seconds=0.1, chaos=False
    )
    assert result.finding.is_same


# What is asked without sense is refused in one line.


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: Request((POLICY,), model=SCENE), "policy.onnx needs a contract"),
        (lambda: RecordRequest(POLICY, SCENE), "policy.onnx needs a contract"),
        (lambda: Request(("hold",), contract=CONTRACT), "contract goes with POLICY.onnx"),
        (lambda: Request(("hold",), command=AHEAD), "command goes with POLICY.onnx"),
        (lambda: Request((POLICY,), contract=CONTRACT, every=2), "every is of a function"),
        (
            lambda: lab.compare(SCENE, what=POLICY, contract=CONTRACT, command=(0.3, 0.0)),
            "three numbers",
        ),
        (
            lambda: lab.compare(SCENE, what=POLICY, contract=CONTRACT, timestep=0.003),
            re.escape("6.66667 steps of 3 ms on mujoco: write timestep=0.00285714"),
        ),
        (lambda: lab.compare("so101", what=POLICY, contract=CONTRACT), "floating base"),
    ],
)
def test_it_is_refused(ask: Callable[[], object], message: str) -> None:
    with pytest.raises(BadInputError, match=message):
        ask()


def test_the_command_that_is_printed_asks_the_same() -> None:
    sides = Side(SCENE), Side(SCENE, "pybullet", options={"kp": 40})
    run = Request((POLICY,), sides=sides, contract=CONTRACT, command=(-0.2, 0.0, 0.1))
    words = typed_command(run).words[1:]
    asked = request_of(parser_of(["compare"]).parse_args(words))
    assert isinstance(asked, CompareRequest)
    assert asked.run == run


# What came of it.


def _poses(way: Array, angles: Array) -> Array:
    """Return poses (n, 7) of places (n, 2) and headings (n,)."""
    poses = np.zeros((len(way), 7))
    poses[:, :2], poses[:, 2] = way, 0.3
    poses[:, 3], poses[:, 6] = np.cos(angles / 2), np.sin(angles / 2)
    return poses


def test_speeds_on_a_circle_are_those_along_it() -> None:
    time = np.linspace(0.0, 20.0, 2001)
    turn, radius = 0.8, 2.0
    angles = 1.0 + turn * time
    poses = _poses(radius * np.stack([np.sin(angles), -np.cos(angles)], axis=1), angles)
    speeds = mean_speeds(poses, 20.0)
    assert speeds is not None
    assert speeds.forward == pytest.approx(turn * radius, rel=1e-5)
    assert speeds.left == pytest.approx(0.0, abs=1e-9)
    assert speeds.turn == pytest.approx(turn)
    assert headings(poses[:, 3:])[-1] == pytest.approx(angles[-1])  # turns counted


def test_what_goes_to_the_left_of_its_heading_has_a_lateral_way() -> None:
    heading = np.radians(120.0)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-ahead[1], ahead[0]])
    way = np.linspace(0.0, 1.0, 50)[:, None] * (3.0 * ahead + 0.25 * left)
    assert lateral_way(_poses(way, np.full(50, heading))) == pytest.approx(0.25)


def test_work_is_force_times_speed_of_the_servos() -> None:
    scenario = policy_scenario(POLICY, CONTRACT, AHEAD)
    model = sm.load(SCENE)
    trace = record_scenario(scenario, model, seconds=1.0)
    powers = trace["qfrc_actuator"][:-1, 6:] * trace.qvel[:-1, 6:]
    expected = 0.004 * powers[powers > 0].sum()
    assert outcomes_of_run(trace, 1.0)[WORK] == pytest.approx(expected)


def test_outcomes_of_a_policy_are_told_of_a_policy_alone() -> None:
    of_policy = outcomes_of_run(_recorded(), 0.5)
    assert {*of_policy} == {*OUTCOMES} - {"tracking error of slides"}

    def stand(model: Model, _data: object) -> Array:
        return model.keyframes[0].ctrl

    trace = answer_record(RecordRequest(stand, SCENE, keyframe="home", seconds=0.1))
    assert {*outcomes_of_run(trace, 0.1)} == {FELL, DISTANCE, TRACKING}


def test_a_speed_has_a_tolerance_that_can_be_typed() -> None:
    assert parse_tolerances(["forward-speed=0.05m/s"]) == {"forward speed": 0.05}


@pytest.fixture(scope="module")
def compared() -> CompareResult:
    """Return the policy on its robot, and on one with half the gain."""
    pytest.importorskip("onnxruntime")
    return lab.compare(
        SCENE,
        f"{SCENE} kp=30",
        what=POLICY,
        contract=CONTRACT,
        command=AHEAD,
        seconds=1.0,
        chaos=False,
    )


def test_outcomes_are_among_the_quantities(compared: CompareResult) -> None:
    names = {agreement.name for agreement in compared.comparison.agreements}
    assert {FELL, FORWARD, LATERAL, WORK} <= names


def test_an_outcome_has_the_value_of_each_side(compared: CompareResult) -> None:
    forward = compared.comparison.outcome_named(FORWARD)
    assert forward is not None
    left, right = (outcomes_of_run(trace, 1.0)[FORWARD] for trace in compared.run.traces)
    assert (forward.left, forward.right) == (left, right)
    assert forward.left != forward.right


def test_the_table_of_outcomes_has_a_row_for_each(compared: CompareResult) -> None:
    table = outcomes_table(compared.comparison)
    assert [row[0] for row in table.rows] == [
        outcome.name for outcome in compared.comparison.outcomes
    ]


def test_the_verdict_begins_with_what_came_of_the_policy(compared: CompareResult) -> None:
    comparison = compared.comparison
    forward = comparison.outcome_named(FORWARD)
    assert forward is not None
    headline = headline_of(compared.finding, comparison, None)
    for speed in (forward.left, forward.right):
        assert quantity(speed, "m/s") in headline.lead


def test_a_policy_has_an_open_loop_beside_the_closed_one(compared: CompareResult) -> None:
    assert compared.run.commands == "its own"
    assert compared.played is not None
    closed = compared.comparison.outcome_named(FORWARD)
    opened = compared.played.outcome_named(FORWARD)
    assert closed is not None
    assert opened is not None
    assert opened.right != closed.right


def test_of_several_sides_each_has_its_outcomes(compared: CompareResult) -> None:
    comparison = compared.comparison
    (speeds,) = (
        each.values for each in sides_outcomes({(0, 2): comparison}, 3) if each.name == FORWARD
    )
    forward = comparison.outcome_named(FORWARD)
    assert forward is not None
    assert speeds == (forward.left, None, forward.right)


@pytest.mark.slow
def test_a_speed_that_differs_has_causes() -> None:
    result = lab.why(
        SCENE,
        f"{SCENE} kp=30",
        what=POLICY,
        contract=CONTRACT,
        command=AHEAD,
        seconds=1.0,
        quantity=FORWARD,
        chaos=False,
    )
    left, right = (outcomes_of_run(_recorded_with(kp), 1.0)[FORWARD] for kp in (60.0, 30.0))
    assert left is not None
    assert right is not None
    assert result.gap == pytest.approx(abs(left - right))


@pytest.mark.slow
def test_a_gain_that_differs_is_named_the_cause() -> None:
    result = lab.why(
        SCENE,
        f"{SCENE} kp=30",
        what=POLICY,
        contract=CONTRACT,
        command=AHEAD,
        seconds=1.0,
        chaos=False,
    )
    (row,) = result.to_dict()["share"]
    assert row == pytest.approx(1.0)


# A public policy: that of the Go1, of MuJoCo Playground.


def _go1(folder: Path, backend: str, timestep: float | None = None) -> dict[str, float | None]:
    """Return what comes of the Go1's policy in 2 s, asked for 0.8 m/s forward."""
    go1 = shared(SHARED / "policies" / "go1" / "policy.onnx")
    contract = folder / "go1.yaml"
    contract.write_text(GO1_CONTRACT, "utf-8")
    asked = RecordRequest(
        str(go1),
        go1.with_name("scene.xml"),
        backend,
        seconds=2.0,
        timestep=timestep,
        contract=contract,
        command=(0.8, 0.0, 0.0),
    )
    return outcomes_of_run(answer_record(asked), 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["mujoco", "pybullet", "motrix"])
def test_the_go1_walks_as_fast_as_it_is_asked(tmp_path: Path, backend: str) -> None:
    need_engine(backend)
    outcomes = _go1(tmp_path, backend)
    assert outcomes[FELL] is None
    assert outcomes[FORWARD] == pytest.approx(0.8, abs=0.08)


@pytest.mark.slow
def test_the_go1_falls_on_pybullet_as_it_comes(tmp_path: Path) -> None:
    need_engine("pybullet")
    assert _go1(tmp_path, "pybullet:engine", timestep=0.004)[FELL] is not None
