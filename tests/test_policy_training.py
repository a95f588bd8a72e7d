"""The walking policy of our own: it is what its training wrote, it walks, and each term counts."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from statemachine.lab.policy import contract_file
from statemachine.lab.policy.observation import Observer, RobotState
from tools.policy_training.__main__ import CONTRACT, POLICY
from tools.policy_training.contract import read_contract
from tools.policy_training.evolution import Evolution
from tools.policy_training.faults import STRAIGHT, TURNING, outcome
from tools.policy_training.gait import GAINS, network_of
from tools.policy_training.network import Network, write_onnx
from tools.policy_training.observation import FAULTS, Fault, Seen, observe
from tools.policy_training.stored import read_gains, write_gains
from tools.policy_training.training import search
from tools.policy_training.walking import Walked, change

from .support.requirements import need_engine

THE_CONTRACT = read_contract(CONTRACT)
BY_NAME = {fault.name: fault for fault in FAULTS}


@pytest.fixture(scope="module")
def network() -> Network:
    return network_of(read_gains(), THE_CONTRACT)


def test_the_file_computes_what_the_gains_say(network: Network) -> None:
    onnxruntime = pytest.importorskip("onnxruntime")
    session = onnxruntime.InferenceSession(POLICY.as_posix())
    observations = np.random.default_rng(0).normal(size=(20, THE_CONTRACT.n_obs))
    for row in observations.astype(np.float32):
        (actions,) = session.run(None, {"obs": row[None]})
        assert actions[0] == pytest.approx(network.actions(row), abs=1e-4)


def test_training_observes_what_the_product_observes() -> None:
    draw = np.random.default_rng(0)
    n, calls = 12, 7
    qpos, qvel = draw.normal(size=(n, 19)), draw.normal(size=(n, 18))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1)[:, None]
    command, last = draw.normal(size=(n, 3)), draw.normal(size=(n, 12))
    joints = draw.permutation(12)
    phase = 2 * np.pi * calls * THE_CONTRACT.policy_dt / THE_CONTRACT.period
    seen = observe(THE_CONTRACT, Seen(qpos, qvel, command, last, phase, joints))
    observer = Observer.of(contract_file.read_contract(CONTRACT), {})
    for row in range(n):
        state = RobotState(
            quat=qpos[row, 3:7],
            lin_vel=qvel[row, :3],
            ang_vel=qvel[row, 3:6],
            joint_pos=qpos[row, 7 + joints],
            joint_vel=qvel[row, 6 + joints],
            command=command[row],
            last_action=last[row],
            calls=calls,
        )
        expected = np.concatenate([*observer.values(state).values()])
        assert seen[row] == pytest.approx(expected, abs=1e-12)


def test_the_file_is_written_again_byte_by_byte(network: Network, tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    write_onnx(network, THE_CONTRACT.joint_names, tmp_path / "policy.onnx")
    assert (tmp_path / "policy.onnx").read_bytes() == POLICY.read_bytes()


def test_the_gains_are_read_as_they_are_written(tmp_path: Path) -> None:
    gains = np.random.default_rng(0).normal(size=len(GAINS)).round(4)
    write_gains(gains, tmp_path / "gains.toml")
    assert read_gains(tmp_path / "gains.toml").tolist() == gains.tolist()


def test_the_evolution_finds_the_top_of_a_hill() -> None:
    top = np.arange(5.0)
    evolution = Evolution(np.zeros(5), np.ones(5), 12, np.random.default_rng(0))
    for _ in range(120):
        candidates = evolution.ask()
        evolution.tell(-np.square((candidates - top) * [1, 3, 10, 30, 100]).sum(axis=1))
    assert evolution.mean == pytest.approx(top, abs=1e-3)


@pytest.mark.slow
def test_the_same_seed_searches_the_same() -> None:
    first, second = (next(search(THE_CONTRACT, 1, seed=3)) for _ in range(2))
    assert np.array_equal(first[0], second[0])
    assert np.array_equal(first[1], second[1])
    assert not np.array_equal(first[1], next(search(THE_CONTRACT, 1, seed=4))[1])


@pytest.mark.parametrize("command", [STRAIGHT, (0.5, 0.0, 0.0), (0.0, 0.0, 0.6), TURNING])
def test_it_walks_as_it_is_asked(network: Network, command: tuple[float, float, float]) -> None:
    """Within a fifth, and within a tenth of the highest speed where none is asked."""
    walked = outcome(THE_CONTRACT, network, "mujoco", command)
    allowed = np.maximum(0.2 * np.abs(command), [0.05, 0.05, 0.06])
    assert walked.upright[0] == 10
    assert (np.abs(walked.speeds[0] - command) <= allowed).all()


@pytest.mark.slow
def test_the_speeds_of_the_readme_are_reached(network: Network) -> None:
    text = CONTRACT.with_name("README.md").read_text("utf-8")
    rows = re.findall(r"^\| ([-\d., ]+) \| ([-\d., ]+) \|", text, re.MULTILINE)
    assert len(rows) == 7
    for row in rows:
        asked, reached = ([float(word) for word in cell.split(",")] for cell in row)
        x, y, turn = asked
        walked = outcome(THE_CONTRACT, network, "mujoco", (x, y, turn))
        assert walked.speeds[0] == pytest.approx(reached, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["pybullet", "motrix"])
@pytest.mark.parametrize("command", [STRAIGHT, TURNING])
def test_it_walks_on_another_engine(
    network: Network, backend: str, command: tuple[float, float, float]
) -> None:
    need_engine(backend)
    walked = outcome(THE_CONTRACT, network, backend, command)
    assert walked.upright[0] == 10
    assert walked.speeds[0, 0] > 0.5 * command[0]
    assert walked.speeds[0, 2] >= 0.5 * command[2] - 0.1


# On MuJoCo a clock twice as fast changes the speeds by a tenth only: the policy sees its velocity.
SHOWING = [fault for fault in FAULTS if fault.name != "clock twice as fast"]


@pytest.fixture(scope="module")
def sound(network: Network) -> Walked:
    need_engine("mujoco")
    return outcome(THE_CONTRACT, network, "mujoco", TURNING)


# `python -m tools.policy_training faults` shows it on PyBullet, too.
@pytest.mark.slow
@pytest.mark.parametrize("fault", SHOWING, ids=lambda fault: fault.name)
def test_a_fault_changes_the_walk_when_it_turns(
    network: Network, sound: Walked, fault: Fault
) -> None:
    spoiled = outcome(THE_CONTRACT, network, "mujoco", TURNING, fault)
    assert spoiled.upright[0] < 10 or change(sound, spoiled, np.array([TURNING]))[0] > 0.1


@pytest.mark.parametrize("name", ["gyro in world axes", "velocity in world axes"])
def test_wrong_axes_do_not_show_while_it_walks_straight_on(network: Network, name: str) -> None:
    sound = outcome(THE_CONTRACT, network, "mujoco", STRAIGHT)
    spoiled = outcome(THE_CONTRACT, network, "mujoco", STRAIGHT, BY_NAME[name])
    assert spoiled.upright[0] == 10
    assert change(sound, spoiled, np.array([STRAIGHT]))[0] < 0.1
