"""The walking policy of models/quadruped.

python -m tools.policy_training search     searches the gains: about ten minutes on a free processor
python -m tools.policy_training write      writes policy.onnx of the gains that are stored
python -m tools.policy_training faults     walks under each fault of the contract, on each engine
"""

from __future__ import annotations

import argparse
import sys

from .contract import read_contract
from .faults import print_table
from .gait import network_of
from .network import write_onnx
from .robots import SCENE
from .stored import read_gains, write_gains
from .training import search

CONTRACT = SCENE.with_name("contract.yaml")
POLICY = SCENE.with_name("policy.onnx")
GENERATIONS = 61  # Of those looked at, the last before the speeds were met less well.


def main(argv: list[str]) -> None:
    """Do what the first word says."""
    parser = argparse.ArgumentParser(prog="python -m tools.policy_training", description=__doc__)
    parser.add_argument("task", choices=("search", "write", "faults"))
    parser.add_argument("--generations", type=int, default=GENERATIONS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--backend", nargs="+", default=["mujoco", "pybullet"])
    asked = parser.parse_args(argv)
    contract = read_contract(CONTRACT)
    if asked.task == "search":
        for number, (gains, scores) in enumerate(search(contract, asked.generations, asked.seed)):
            print(f"{number:4} best {scores.max():7.2f} mean {scores.mean():7.2f}", flush=True)
            write_gains(gains)
    elif asked.task == "write":
        write_onnx(network_of(read_gains(), contract), contract.joint_names, POLICY)
    else:
        print_table(contract, network_of(read_gains(), contract), asked.backend)


if __name__ == "__main__":
    main(sys.argv[1:])
