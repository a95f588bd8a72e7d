"""What docs/policies.md says of the quadruped and of its faults is what runs give."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from statemachine import load
from statemachine.interface import Data
from statemachine.lab.policy import walk
from statemachine.lab.policy.command import Command
from statemachine.lab.policy.contract_file import read_contract
from statemachine.lab.policy.network import Network
from statemachine.lab.policy.on_model import PolicyOnModel
from statemachine.lab.policy.walk import Walk, all_walked
from statemachine.models import models_dir
from tools.policy_faults import written_with

from .support.requirements import ROOT, need_engine

yaml = pytest.importorskip("yaml")
pytest.importorskip("onnxruntime")
FOLDER = models_dir() / "quadruped"
PAGE = (ROOT / "docs" / "policies.md").read_text("utf-8")
ROWS = {
    cells[0]: cells[1:]
    for line in re.findall(r"^\| (?!contract)(.*) \|$", PAGE, re.MULTILINE)
    for cells in [line.split(" | ")]
}
# What each row is called where faults are put into contracts; "" for none.
ROW_FAULTS = {
    "sound": "",
    "gyroscope in world axes": "gyroscope in world axes",
    "velocity in world axes": "velocity in world axes",
    "quaternion with w last": "xyzw",
    "clock half as fast": "slow clock",
    "joint speeds unscaled": "unscaled joint speeds",
    "angles from zero": "absolute angles",
    "one call late": "delay of 1",
}


def walks(folder: Path, row: str) -> list[Walk]:
    """Return the runs of a contract with the fault of a row, straight on and turning."""
    fields = yaml.safe_load((FOLDER / "contract.yaml").read_text("utf-8"))
    contract = read_contract(written_with(fields, ROW_FAULTS[row], folder))
    network = Network(FOLDER / "policy.onnx")
    policy = PolicyOnModel.of(contract, network, load("quadruped/scene"))
    commands = (Command(0.3), Command(0.3, 0.0, 0.5))
    return [recorded.walk for recorded in all_walked(policy, commands, 10.0)]


def test_the_page_has_a_row_for_each_fault() -> None:
    assert list(ROWS) == list(ROW_FAULTS)


@pytest.mark.slow
@pytest.mark.parametrize("fault", ROWS)
def test_a_row_has_the_speeds_of_the_runs(tmp_path: Path, fault: str) -> None:
    need_engine("mujoco")
    straight, turning = walks(tmp_path, fault)
    assert straight.reached is None or abs(straight.reached[2]) < 0.05
    found: list[float | str] = []
    for run, axis in ((straight, 0), (turning, 0), (turning, 2)):
        found.append("falls" if run.reached is None else run.reached[axis])
    for shown, speed in zip(ROWS[fault], found, strict=True):
        if isinstance(speed, str):
            assert shown in (speed, "wanders")
        elif shown != "wanders":
            assert float(shown) == pytest.approx(speed, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("push", [0.0, 1e-9, -1e-9, 1e-6])
def test_what_wanders_reaches_half_of_the_speed_at_most_or_falls(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, push: float
) -> None:
    need_engine("mujoco")
    put = walk.set_start

    def pushed(data: Data, policy: PolicyOnModel, keyframe: str | None) -> None:
        put(data, policy, keyframe)
        data.qvel[:] = data.qvel + push

    monkeypatch.setattr(walk, "set_start", pushed)
    _, turning = walks(tmp_path, "gyroscope in world axes")
    assert turning.reached is None or turning.reached[0] < 0.15


def test_the_page_names_what_a_fault_may_be() -> None:
    """Each entry of the list once, in its order."""
    numbers = [int(number) for number in re.findall(r"^(\d+)\. \*\*", PAGE, re.MULTILINE)]
    assert numbers == list(range(1, 14))
