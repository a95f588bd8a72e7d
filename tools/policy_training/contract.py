"""The part of the contract that training needs, read from contract.yaml."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from .network import Floats


@dataclass(frozen=True)
class Contract:
    """What the policy sees and does: names and figures in the order of the policy.

    `default` and `action_scale` (n_act,) [rad]; `term_scale` (n_obs,); `terms` with their sizes.
    """

    joint_names: tuple[str, ...]
    default: Floats
    action_scale: Floats
    terms: tuple[tuple[str, int], ...]
    term_scale: Floats
    policy_dt: float
    decimation: int
    period: float

    @property
    def n_obs(self) -> int:
        """Return how many numbers the policy sees."""
        return len(self.term_scale)

    def columns(self) -> dict[str, list[int]]:
        """Return each term's places in the observation."""
        places: dict[str, list[int]] = {}
        first = 0
        for name, size in self.terms:
            places[name] = list(range(first, first + size))
            first += size
        return places


def read_contract(path: Path) -> Contract:
    """Return the contract of a file."""
    page = yaml.safe_load(path.read_text())
    names = page["policy_io"]["joints"]["names"]
    terms = page["policy_io"]["observation_groups"]["policy"]["terms"]
    scales = [value for term in terms for value in term["scale"]]
    control = page["control"]
    [clock] = [term for term in terms if term["id"] == "gait_phase"]
    return Contract(
        joint_names=tuple(names),
        default=np.array([control["default_joint_pos"][name] for name in names]),
        action_scale=np.array([control["actions"]["joint_pos"]["scale"][name] for name in names]),
        terms=tuple((term["id"], term["dim"]) for term in terms),
        term_scale=np.array(scales),
        policy_dt=page["timing"]["policy_dt"],
        decimation=page["timing"]["decimation"],
        period=clock["params"]["period"],
    )
