"""The part of a contract that training needs, as arrays over all terms of the observation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from statemachine.lab.policy import contract_file

from .network import Floats


@dataclass(frozen=True)
class Contract:
    """What the policy sees and does: names and figures in the order of the policy.

    Attributes:
        joint_names: Of the n_act joints that it drives.
        default: (n_act,) angles where it starts [rad].
        action_scale: (n_act,) [rad].
        terms: Of the observation: each with its size.
        term_scale: (n_obs,) by which each number of the observation is multiplied.
        policy_dt: From one call to the next [s].
        decimation: Steps of the engine between two calls.
        period: Of the clock [s].
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
    """Return the contract of a file, which has one clock."""
    contract = contract_file.read_contract(path)
    [clock] = [term.clock for term in contract.terms if term.clock is not None]
    assert contract.timing.decimation is not None
    return Contract(
        joint_names=contract.joints,
        default=contract.default_joint_pos,
        action_scale=contract.action.scale,
        terms=tuple((term.id, term.dim) for term in contract.terms),
        term_scale=np.concatenate([term.scale for term in contract.terms]),
        policy_dt=contract.timing.policy_dt,
        decimation=contract.timing.decimation,
        period=clock.period,
    )
