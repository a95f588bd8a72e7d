"""What each fault of the contract does to the walk, engine by engine."""

from __future__ import annotations

import numpy as np

from .contract import Contract
from .network import Network
from .observation import FAULTS, SOUND, Fault
from .robots import OneRobot
from .walking import Policies, Walked, change, walk

SECONDS = 10.0
STRAIGHT, TURNING = (0.4, 0.0, 0.0), (0.3, 0.0, 0.5)


def outcome(
    contract: Contract,
    network: Network,
    backend: str,
    command: tuple[float, float, float],
    fault: Fault = SOUND,
) -> Walked:
    """Return how one robot walks on an engine, in the calm."""
    robot = OneRobot(contract, backend)
    return walk(contract, Policies([network]), robot, np.array([command]), SECONDS, fault)


def print_table(contract: Contract, network: Network, backends: list[str]) -> None:
    """Print a line for each engine, command and fault."""
    for backend in backends:
        for command in (STRAIGHT, TURNING):
            sound = outcome(contract, network, backend, command)
            for fault in (SOUND, *FAULTS):
                walked = outcome(contract, network, backend, command, fault)
                speeds = " ".join(f"{value:6.2f}" for value in walked.speeds[0])
                changed = f"{100 * change(sound, walked, np.array([command]))[0]:5.0f} %"
                upright = f"{walked.upright[0]:5.2f} s"
                print(f"{backend:9}{command!s:17}{fault.name:28}{upright}  {speeds}  {changed}")
