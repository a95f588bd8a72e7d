"""Put each fault into a contract, and print which change of the contract is named for it.

python -m tools.policy_faults POLICY.onnx CONTRACT.yaml MODEL --backend mujoco --backend pybullet
"""

from __future__ import annotations

import argparse
import copy
import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from statemachine.errors import EngineWarning
from statemachine.lab.policy.command import Command
from statemachine.lab.policy.diagnosis import EngineDiagnosis, diagnose
from statemachine.lab.policy.request import PolicyRequest

Contract = dict[str, Any]
Fault = Callable[[Contract], None]


def terms_of(contract: Contract) -> list[dict[str, Any]]:
    """Return the terms of the observation, to be changed."""
    return contract["policy_io"]["observation_groups"]["policy"]["terms"]


def term_of(contract: Contract, name: str) -> dict[str, Any]:
    """Return a term of the observation, to be changed."""
    return next(term for term in terms_of(contract) if term["id"] == name)


def _imu(key: str, value: str) -> Fault:
    def fault(contract: Contract) -> None:
        contract["policy_io"].setdefault("imu", {})[key] = value

    return fault


def _parameter(term: str, key: str, value: object) -> Fault:
    def fault(contract: Contract) -> None:
        parameters = term_of(contract, term).get("params") or {}
        term_of(contract, term)["params"] = {**parameters, key: value}

    return fault


def _scale(term: str, value: float) -> Fault:
    def fault(contract: Contract) -> None:
        term_of(contract, term)["scale"] = value

    return fault


def _swapped_legs(contract: Contract) -> None:
    """Read the joints of the other half of the list."""
    joints = contract["policy_io"]["joints"]["names"]
    half = len(joints) // 2
    for name in ("joint_pos_rel", "joint_vel_rel"):
        _parameter(name, "joints", joints[half:] + joints[:half])(contract)


def _action_scale(contract: Contract) -> None:
    action = contract["control"]["actions"]["joint_pos"]
    scale = action["scale"]
    if isinstance(scale, Mapping):
        action["scale"] = {joint: 4.0 * value for joint, value in scale.items()}
    else:
        action["scale"] = 4.0 * scale


def _delay(calls: int) -> Fault:
    def fault(contract: Contract) -> None:
        contract["control"]["actions"]["joint_pos"]["delay_steps"] = calls

    return fault


def _slow_policy(contract: Contract) -> None:
    """Call the policy half as often."""
    timing = contract["timing"]
    timing["policy_dt"] *= 2
    timing["decimation"] *= 2


def _slow_clock(contract: Contract) -> None:
    term_of(contract, "gait_phase")["params"]["period"] *= 2


# The term that a contract must have for it ("" for any), the name
# of the change that mends it, and how it is written.
FAULTS: Mapping[str, tuple[str, str, Fault]] = {
    "xyzw": ("", "quaternion order", _imu("quat_order", "xyzw")),
    "gyroscope in world axes": ("", "gyroscope frame", _imu("frame", "world")),
    "velocity in world axes": ("", "velocity frame", _parameter("base_lin_vel", "frame", "world")),
    "swapped legs": ("", "swapped legs", _swapped_legs),
    "gravity upwards": ("", "gravity sign", _scale("projected_gravity", -1.0)),
    "absolute angles": ("", "absolute angles", _parameter("joint_pos_rel", "default", 0.0)),
    "no last action": ("", "term left out", _scale("last_action", 0.0)),
    "no command": ("", "term left out", _scale("velocity_commands", 0.0)),
    "no velocity": ("", "term left out", _scale("base_lin_vel", 0.0)),
    "no clock": ("gait_phase", "term left out", _scale("gait_phase", 0.0)),
    "slow clock": ("gait_phase", "clock", _slow_clock),
    "unscaled joint speeds": ("gait_phase", "speed scale", _scale("joint_vel_rel", 1.0)),
    "action x4": ("", "action scale", _action_scale),
    "delay of 1": ("", "delay", _delay(1)),
    "delay of 2": ("", "delay", _delay(2)),
    "half the rate": ("", "policy rate", _slow_policy),
}


def faulty(contract: Contract, fault: str) -> Contract:
    """Return a contract with a fault; "" for none."""
    changed = copy.deepcopy(contract)
    if fault:
        FAULTS[fault][2](changed)
    return changed


def applies(contract: Contract, fault: str) -> bool:
    """Tell whether a contract can have a fault."""
    needed = FAULTS[fault][0]
    return not needed or any(term["id"] == needed for term in terms_of(contract))


def written_with(contract: Contract, fault: str, folder: Path) -> Path:
    """Write a contract with a fault, and return its file."""
    file = folder / "contract.yaml"
    file.write_text(yaml.safe_dump(faulty(contract, fault)), "utf-8")
    return file


def is_named(engine: EngineDiagnosis, fault: str) -> bool:
    """Tell whether the change that mends a fault is among the best; "" for none at all."""
    if not fault:
        return not engine.named
    return FAULTS[fault][1] in [each.kind for each in engine.named]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each backend and fault; return how many are not named."""
    parser = argparse.ArgumentParser("python -m tools.policy_faults", description=__doc__)
    parser.add_argument("policy")
    parser.add_argument("contract", type=Path)
    parser.add_argument("model")
    parser.add_argument("--backend", action="append")
    parser.add_argument("--command", type=float, nargs=3)
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args(arguments)
    warnings.simplefilter("ignore", EngineWarning)
    contract = yaml.safe_load(options.contract.read_text("utf-8"))
    commands = () if options.command is None else (Command(*options.command),)
    missed = 0
    for backend in options.backend or ["mujoco"]:
        for fault in ("", *(name for name in FAULTS if applies(contract, name))):
            with tempfile.TemporaryDirectory() as folder:
                request = PolicyRequest(
                    policy=options.policy,
                    contract=written_with(contract, fault, Path(folder)),
                    model=options.model,
                    backends=(backend,),
                    commands=commands,
                    seconds=options.seconds,
                )
                (engine,) = diagnose(request).engines
            found = is_named(engine, fault)
            missed += not found
            kinds = ", ".join(dict.fromkeys(each.kind for each in engine.named)) or "none"
            costs = f"{engine.cost:.2f} -> {engine.tried[0].cost:.2f}"
            mark = " " if found else "!"
            print(f"{mark} {backend:10}{fault or 'sound':26}{costs:16}{kinds}", flush=True)
    return missed


if __name__ == "__main__":
    sys.exit(main())
