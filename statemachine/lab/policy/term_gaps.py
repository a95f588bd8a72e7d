"""What two contracts make of the same states: term by term, and the action."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...interface import Array
from .controller import PolicyCall
from .observation import Observer, Stack
from .on_model import PolicyOnModel


@dataclass(frozen=True)
class TermGap:
    """How far a term is from the same term by another contract, on the same states.

    Attributes:
        term: Its name; "action" for what the network gives.
        largest: Largest difference of an entry, scaled as the network is given it.
        rms: Root mean square of the difference.
        size: Root mean square of the term by the first contract.
    """

    term: str
    largest: float
    rms: float
    size: float


def term_gaps(
    first: PolicyOnModel, second: PolicyOnModel, calls: Sequence[PolicyCall], command: Array
) -> tuple[TermGap, ...]:
    """Return how far the terms of two contracts are apart on the states of one run.

    Two runs of their own would be in other states from the first step on, and all their terms
    would differ.

    Args:
        first: The policy of the run, by its contract.
        second: The same policy by the other contract.
        calls: Of the run: its states, and the action before each.
        command: (3,) speeds that were asked for.
    """
    one = _observed(first, calls, command)
    other = _observed(second, calls, command)
    gaps: list[TermGap] = []
    for name, values in one.items():
        if name not in other or other[name].shape != values.shape:
            continue
        apart = other[name] - values
        gaps.append(
            TermGap(
                term=name,
                largest=float(np.abs(apart).max()),
                rms=float(np.sqrt(np.mean(apart**2))),
                size=float(np.sqrt(np.mean(values**2))),
            )
        )
    return tuple(gaps)


def _observed(
    policy: PolicyOnModel, calls: Sequence[PolicyCall], command: Array
) -> dict[str, Array]:
    """Return each term (k, dim), and the action (k, n), on the states of a run."""
    contract, binding, network = policy.contract, policy.binding, policy.network
    observer, stack = Observer.of(contract, binding.mounts), Stack(contract.history)
    rows: dict[str, list[Array]] = {term.name: [] for term in contract.terms}
    actions: list[Array] = []
    network.reset()
    for number, call in enumerate(calls):
        state = binding.state_of(call.qpos, call.qvel, command, call.last_action, number)
        values = observer.values(state)
        for name, value in values.items():
            rows[name].append(value)
        actions.append(network(stack.add(values)))
    observed = {name: np.array(values) for name, values in rows.items()}
    observed["action"] = np.array(actions)
    return observed
