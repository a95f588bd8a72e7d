"""A policy's network from its file: what it computes and remembers, and what is none."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from statemachine.errors import BadInputError, MissingEngineError
from statemachine.lab.policy.checks import check_network
from statemachine.lab.policy.network import Network

from .support.files import written
from .support.policies import (
    SIZE,
    constant_network,
    contract,
    linear_network,
    node,
    saved,
    tensor,
)

onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")


def remembering(folder: Path, batch: int | str = 1) -> Path:
    """Write a network that gives the sum of what it was told before, and return its file."""
    return saved(
        folder / "policy.onnx",
        [node("Identity", "before", "actions"), node("Add", "before obs", "after")],
        [tensor("obs", [batch, 2]), tensor("before", [batch, 2])],
        [tensor("actions", [batch, 2]), tensor("after", [batch, 2])],
    )


def test_it_computes_what_its_file_says(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    weights, offset, observation = (random.normal(size=size) for size in ((5, 3), (3,), (5,)))
    network = Network(linear_network(tmp_path, weights, offset.tolist()))
    assert network(observation) == pytest.approx(observation @ weights + offset, abs=1e-5)


def test_its_sizes_are_those_of_the_file(tmp_path: Path) -> None:
    facts = Network(constant_network(tmp_path, [0.0] * 3, 7)).facts
    assert (facts.inputs, facts.outputs, facts.memory) == (7, 3, ())


def test_sizes_that_the_file_leaves_open_are_none(tmp_path: Path) -> None:
    file = saved(
        tmp_path / "policy.onnx",
        [node("Identity", "obs", "actions")],
        [tensor("obs", ["batch", "size"])],
        [tensor("actions", ["batch", "size"])],
    )
    facts = Network(file).facts
    assert (facts.inputs, facts.outputs) == (None, None)


def test_what_its_weights_are_may_stand_in_a_file_beside_it(tmp_path: Path) -> None:
    file = linear_network(tmp_path, np.ones((5, 3)), [0.0] * 3)
    options = {"save_as_external_data": True, "location": "policy.data", "size_threshold": 0}
    onnx.save_model(onnx.load(file), file, **options)
    assert (tmp_path / "policy.data").exists()
    assert Network(file)(np.ones(5)).tolist() == [5.0, 5.0, 5.0]


def test_another_file_has_another_digest(tmp_path: Path) -> None:
    digests = {Network(constant_network(tmp_path, [action])).facts.digest for action in (0.0, 1.0)}
    assert len(digests) == 2


@pytest.mark.parametrize("batch", [1, "batch"])
def test_it_remembers_from_call_to_call(tmp_path: Path, batch: int | str) -> None:
    network = Network(remembering(tmp_path, batch))
    told = [network(np.array((1.0, 2.0))).tolist() for _ in range(3)]
    assert told == [[0.0, 0.0], [1.0, 2.0], [2.0, 4.0]]


def test_a_reset_makes_its_memory_zero(tmp_path: Path) -> None:
    network = Network(remembering(tmp_path))
    network(np.array((1.0, 2.0)))
    network.reset()
    assert network(np.array((1.0, 2.0))).tolist() == [0.0, 0.0]


def test_the_inputs_that_remember_are_named(tmp_path: Path) -> None:
    assert Network(remembering(tmp_path)).facts.memory == ("before",)


def test_two_networks_of_a_file_remember_by_themselves(tmp_path: Path) -> None:
    file = remembering(tmp_path)
    one, other = Network(file), Network(file)
    one(np.array((1.0, 2.0)))
    assert other(np.array((1.0, 2.0))).tolist() == [0.0, 0.0]


def test_an_output_that_nothing_remembers_is_left(tmp_path: Path) -> None:
    """As that of a network that tells a value, too."""
    file = saved(
        tmp_path / "policy.onnx",
        [node("Identity", "obs", "actions"), node("ReduceSum", "obs", "value")],
        [tensor("obs", [1, 2])],
        [tensor("actions", [1, 2]), tensor("value", [1, 1])],
    )
    assert Network(file)(np.array((1.0, 2.0))).tolist() == [1.0, 2.0]


# -- refusals -------------------------------------------------------------------


@pytest.mark.parametrize("text", ["", "no network", "x" * 5000])
def test_a_file_that_is_no_network_is_refused_by_its_name(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadInputError, match=r"policy\.onnx"):
        Network(written(tmp_path / "policy.onnx", text))


@pytest.mark.parametrize("name", ["nothing.onnx", "."])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInputError):
        Network(tmp_path / name)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_is_refused_unopened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BadInputError):
        Network(tmp_path / "pipe")


@pytest.mark.parametrize("kind", ["DOUBLE", "INT64"])
def test_an_input_of_other_numbers_is_refused_by_its_name(tmp_path: Path, kind: str) -> None:
    file = saved(
        tmp_path / "policy.onnx",
        [node("Identity", "seen", "actions")],
        [tensor("seen", [1, 2], kind)],
        [tensor("actions", [1, 2], kind)],
    )
    with pytest.raises(BadInputError, match="'seen'"):
        Network(file)


@pytest.mark.parametrize("kind", ["INT32", "STRING"])
def test_an_action_that_is_no_number_is_refused_by_its_name(tmp_path: Path, kind: str) -> None:
    target = getattr(onnx.TensorProto, kind)
    file = saved(
        tmp_path / "policy.onnx",
        [onnx.helper.make_node("Cast", ["obs"], ["told"], to=target)],
        [tensor("obs", [1, 2])],
        [tensor("told", [1, 2], kind)],
    )
    with pytest.raises(BadInputError, match="'told'"):
        Network(file)


def test_a_pointer_of_git_lfs_is_told(tmp_path: Path) -> None:
    text = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 3\n"
    with pytest.raises(BadInputError, match="git lfs pull"):
        Network(written(tmp_path / "policy.onnx", text))


def _of_unknown_ir(file: Path) -> None:
    model = onnx.load(file)
    model.ir_version = 99
    file.write_bytes(model.SerializeToString())


def _of_unknown_opset(file: Path) -> None:
    model = onnx.load(file)
    model.opset_import[0].version = 99
    file.write_bytes(model.SerializeToString())


@pytest.mark.parametrize("damage", [_of_unknown_ir, _of_unknown_opset])
def test_of_what_onnxruntime_says_the_reason_is_told_alone(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    file = constant_network(tmp_path, [0.0])
    damage(file)
    with pytest.raises(BadInputError, match="99") as caught:
        Network(file)
    assert not re.search(r"ONNXRuntimeError|\.(cc|h):\d|std::", str(caught.value))


def test_onnxruntime_writes_nothing_of_a_failure_itself(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Sizes that the file leaves open are found to be others only when it runs."""
    file = saved(
        tmp_path / "policy.onnx",
        [node("Gemm", "obs w b", "actions")],
        [tensor("obs", ["batch", "size"])],
        [tensor("actions", ["batch", "size"])],
        {"w": np.zeros((4, 2)), "b": np.zeros(2)},
    )
    with pytest.raises(BadInputError, match="Gemm"):
        Network(file)(np.zeros(3))
    assert capfd.readouterr().err == ""


def test_an_input_that_no_output_feeds_is_refused(tmp_path: Path) -> None:
    file = saved(
        tmp_path / "policy.onnx",
        [node("Add", "obs more", "actions")],
        [tensor("obs", [1, 2]), tensor("more", [1, 2])],
        [tensor("actions", [1, 2])],
    )
    with pytest.raises(BadInputError, match="2 inputs and 1 outputs"):
        Network(file)


def test_an_observation_of_another_size_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"policy\.onnx"):
        Network(constant_network(tmp_path, [0.0]))(np.zeros(SIZE + 1))


def test_without_onnxruntime_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = constant_network(tmp_path, [0.0])
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(MissingEngineError, match="policy"):
        Network(file)


def test_a_network_of_the_contract_s_sizes_fits(tmp_path: Path) -> None:
    check_network(contract(tmp_path), Network(constant_network(tmp_path, [0.0, 0.0])).facts)


def test_another_size_of_the_observation_is_added_up(tmp_path: Path) -> None:
    facts = Network(constant_network(tmp_path, [0.0, 0.0], SIZE + 2)).facts
    with pytest.raises(BadInputError) as caught:
        check_network(contract(tmp_path), facts)
    assert "base_ang_vel 3 + joint_pos_rel 2 + last_action 2 + velocity_commands 3" in str(
        caught.value
    )


def test_another_number_of_actions_is_refused(tmp_path: Path) -> None:
    facts = Network(constant_network(tmp_path, [0.0] * 3)).facts
    with pytest.raises(BadInputError, match="gives 3 numbers"):
        check_network(contract(tmp_path), facts)
