"""A small robot with two legs, contracts for it, and networks, each made by a test."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.interface import Array, Data, Model, make_data, reset, step
from statemachine.lab.policy.contract import Contract
from statemachine.lab.policy.contract_file import read_contract
from statemachine.lab.policy.controller import PolicyController
from statemachine.lab.policy.network import Network
from statemachine.lab.policy.on_model import PolicyOnModel

from .files import written

# The model has the left leg first, and the contracts the right one.
JOINTS = ("right", "left")
KP, KD, LIMIT = 20.0, 0.5, 8.0
_LEG = """<body name="{name}_leg" pos="0 {y} 0"><joint name="{name}" axis="0 1 0" {joint}/>
<geom type="box" size="0.01 0.01 0.1" pos="0 0 -0.1" mass="0.4"/></body>"""


def robot(
    folder: Path,
    actuators: str = "",
    joint: str = 'armature="0.01"',
    timestep: float = 0.002,
    gravity: str = "0 0 -9.81",
) -> Path:
    """Write the robot, and return its file.

    Args:
        folder: Where it is written.
        actuators: "" for servos with the gains and the limit above.
        joint: Further attributes of the joints.
        timestep: [s].
        gravity: [m/s²].
    """
    text = f"""<mujoco><option timestep="{timestep}" gravity="{gravity}" integrator="implicitfast"/>
<worldbody><geom name="floor" type="plane" size="0 0 1"/>
<body name="trunk" pos="0 0 0.3"><freejoint name="root"/>
<geom type="box" size="0.1 0.05 0.03" mass="2"/>
<site name="imu" pos="0.1 0.02 0.03" euler="0 0 90"/>
{_LEG.format(name="left", y=0.08, joint=joint)}{_LEG.format(name="right", y=-0.08, joint=joint)}
</body></worldbody><actuator>{actuators or servos()}</actuator></mujoco>"""
    return written(folder / "robot.xml", text)


def servos(kp: float = KP, kd: float = KD, limit: float = LIMIT, rest: str = "") -> str:
    """Return the servos of both legs."""
    return "".join(
        f'<position name="{name}" joint="{name}" kp="{kp}" kv="{kd}" '
        f'forcerange="-{limit} {limit}" {rest}/>'
        for name in ("left", "right")
    )


def motors(limit: float = LIMIT, rest: str = "") -> str:
    """Return motors of both legs."""
    return "".join(
        f'<motor name="{name}" joint="{name}" ctrlrange="-{limit} {limit}" {rest}/>'
        for name in ("left", "right")
    )


def content(changes: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return what stands in a contract for the robot.

    Args:
        changes: What a field is set to, by "section.field"; a number counts in a list. None
            removes it.
    """
    fields = copy.deepcopy(_CONTENT)
    for path, value in (changes or {}).items():
        *sections, last = path.split(".")
        section: Any = fields
        for key in sections:
            section = section[int(key)] if key.isdigit() else section.setdefault(key, {})
        if value is None:
            section.pop(last, None)
        else:
            section[int(last) if last.isdigit() else last] = value
    return fields


_CONTENT: dict[str, Any] = {
    "schema": "gaitkeeper/contract/v3",
    "timing": {"policy_dt": 0.02, "sim_dt": 0.002},
    "policy_io": {
        "joints": {"names": list(JOINTS)},
        "observation_groups": {
            "policy": {
                "terms": [
                    {"id": "base_ang_vel"},
                    {"id": "joint_pos_rel"},
                    {"id": "last_action"},
                    {"id": "velocity_commands"},
                ]
            }
        },
    },
    "control": {
        "default_joint_pos": [0.1, 0.2],
        "actions": {"joint_pos": {"scale": 0.5}},
        "actuators": {"kind": "implicit_pd", "kp": KP, "kd": KD},
    },
}
SIZE = 10  # of that observation


def contract_file(folder: Path, fields: Any) -> Path:
    """Write a contract, and return its file."""
    yaml = pytest.importorskip("yaml")
    return written(folder / "contract.yaml", yaml.safe_dump(fields, sort_keys=False))


def contract(folder: Path, changes: dict[str, Any] | None = None) -> Contract:
    """Return a contract for the robot that was written and read; changes as of `content`."""
    return read_contract(contract_file(folder, content(changes)))


def with_terms(*terms: dict[str, Any]) -> dict[str, Any]:
    """Return the change of `content` that gives an observation these terms."""
    return {"policy_io.observation_groups.policy.terms": list(terms)}


def constant_network(folder: Path, action: Sequence[float], inputs: int = SIZE) -> Path:
    """Write a network that always gives the same action, and return its file."""
    return linear_network(folder, np.zeros((inputs, len(action))), action)


def linear_network(folder: Path, weights: Array, offset: Sequence[float]) -> Path:
    """Write a network that gives observation · weights + offset, and return its file.

    Args:
        folder: Where it is written.
        weights: (inputs, outputs).
        offset: (outputs,).
    """
    size, outputs = weights.shape
    return saved(
        folder / "policy.onnx",
        [node("Gemm", "obs w b", "actions")],
        [tensor("obs", [1, size])],
        [tensor("actions", [1, outputs])],
        {"w": weights, "b": np.array(offset)},
    )


def node(operation: str, inputs: str, output: str) -> Any:
    """Return a node of a network; the names of its inputs are parted by spaces."""
    onnx = pytest.importorskip("onnx")
    return onnx.helper.make_node(operation, inputs.split(), [output])


def tensor(name: str, shape: Sequence[int | str], kind: str = "FLOAT") -> Any:
    """Return an input or output of a network."""
    onnx = pytest.importorskip("onnx")
    return onnx.helper.make_tensor_value_info(name, getattr(onnx.TensorProto, kind), list(shape))


def saved(
    file: Path,
    nodes: Sequence[Any],
    inputs: Sequence[Any],
    outputs: Sequence[Any],
    numbers: dict[str, Array] | None = None,
) -> Path:
    """Write a network of nodes, with the numbers that it stores by their names."""
    onnx = pytest.importorskip("onnx")
    stored = [
        onnx.numpy_helper.from_array(value.astype(np.float32), name)
        for name, value in (numbers or {}).items()
    ]
    graph = onnx.helper.make_graph(list(nodes), "policy", list(inputs), list(outputs), stored)
    opset = [onnx.helper.make_opsetid("", 17)]
    file.write_bytes(
        onnx.helper.make_model(graph, opset_imports=opset, ir_version=8).SerializeToString()
    )
    return file


def on_model(
    folder: Path, model: Model, network: Path, changes: dict[str, Any] | None = None
) -> PolicyOnModel:
    """Return a policy on a model, with a contract of `content`."""
    pytest.importorskip("onnxruntime")
    return PolicyOnModel.of(contract(folder, changes), Network(network), model)


def started(model: Model) -> Data:
    """Return a Data of the model after a reset."""
    data = make_data(model)
    reset(model, data)
    return data


@dataclass(frozen=True)
class PolicyRun:
    """A run of a policy, step by step.

    Attributes:
        controller: That drove it.
        ctrl: (k, nu) in the model's order.
        qpos: (k, nq) before each step.
        qvel: (k, nv) before each step.
        end: (nq,) positions at the end.
    """

    controller: PolicyController
    ctrl: Array
    qpos: Array
    qvel: Array
    end: Array


def run(policy: PolicyOnModel, steps: int, command: Sequence[float] = (0.0, 0.0, 0.0)) -> PolicyRun:
    """Run a policy from a reset."""
    model = policy.driven.model
    controller = PolicyController(policy, np.array(command))
    rows: list[tuple[Array, Array, Array]] = []
    with started(model) as data:
        for _ in range(steps):
            ctrl = controller(model, data)
            assert ctrl is not None
            rows.append((ctrl, np.array(data.qpos), np.array(data.qvel)))
            data.ctrl = ctrl
            step(model, data)
        end = np.array(data.qpos)
    ctrls, positions, speeds = (np.array(column) for column in zip(*rows, strict=True))
    return PolicyRun(controller, ctrls, positions, speeds, end)


# What the public policy of the Go1 expects, that of MuJoCo Playground.
GO1_CONTRACT = """
schema: gaitkeeper/contract/v3
timing: {policy_dt: 0.02, sim_dt: 0.004}
policy_io:
  joints:
    names: [FR_hip_joint, FR_thigh_joint, FR_calf_joint, FL_hip_joint, FL_thigh_joint,
            FL_calf_joint, RR_hip_joint, RR_thigh_joint, RR_calf_joint, RL_hip_joint,
            RL_thigh_joint, RL_calf_joint]
  imu: {site: imu, frame: body}
  observation_groups:
    policy:
      terms:
        - {id: base_lin_vel, params: {site: imu}}
        - {id: base_ang_vel}
        - {id: projected_gravity}
        - {id: joint_pos_rel}
        - {id: joint_vel_rel}
        - {id: last_action}
        - {id: velocity_commands}
control:
  default_joint_pos: [0.1, 0.9, -1.8, -0.1, 0.9, -1.8, 0.1, 0.9, -1.8, -0.1, 0.9, -1.8]
  actions: {joint_pos: {scale: 0.5}}
  actuators: {kind: implicit_pd}
"""
