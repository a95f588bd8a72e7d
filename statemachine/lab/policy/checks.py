"""Whether contract, network and model fit together, and what is odd about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Model
from ...measures.text import few
from .binding import Binding
from .command import Command
from .contract import AXES, Contract
from .network import NetworkFacts

NoteKind = Literal[
    "unread", "misspelt", "start elsewhere", "outside limits", "command outside limits"
]
_SAME: Final = 0.01  # [rad] of a joint: poses that are nearer are one


@dataclass(frozen=True)
class ContractNote:
    """Something odd about a contract and a model, and no fault.

    Attributes:
        kind: What it is.
        names: Of fields, joints or axes.
        value: The largest difference [rad]; None where there is none to tell.
        nearest: The field that one which nothing reads may mean; "" of other notes.
    """

    kind: NoteKind
    names: tuple[str, ...]
    value: float | None = None
    nearest: str = ""


def check_network(contract: Contract, facts: NetworkFacts) -> None:
    """Check that a network takes the observation of a contract, and gives an action for it.

    Raises:
        BadInputError: The sizes differ; the message adds the terms up.
    """
    if facts.inputs not in (None, contract.observation_size):
        sizes = " + ".join(f"{term.name} {term.dim}" for term in contract.terms)
        total = str(contract.observation_size)
        if contract.history.length > 1:
            sizes = f"({sizes}) × {contract.history.length} of the history"
        raise BadInputError(
            f"{facts.file} takes {facts.inputs} numbers, and {contract.file} observes {total}: "
            f"{sizes}"
        )
    if facts.outputs not in (None, len(contract.joints)):
        raise BadInputError(
            f"{facts.file} gives {facts.outputs} numbers, and {contract.file} drives "
            f"{len(contract.joints)} joints: {few(contract.joints)}"
        )


def notes_of(
    contract: Contract,
    model: Model,
    binding: Binding,
    start: Array | None,
    commands: Sequence[Command],
) -> list[ContractNote]:
    """Return what is odd about a contract and a model, and no fault.

    Args:
        contract: The contract.
        model: As its file has it.
        binding: Where the joints of the contract are in it.
        start: qpos (nq,) in which runs start; None for the default state.
        commands: The speeds that are asked for.
    """
    notes: list[ContractNote] = []
    unknown = tuple(field.name for field in contract.unread if not field.nearest)
    if unknown:
        notes.append(ContractNote("unread", unknown))
    for field in contract.misspelt:
        notes.append(ContractNote("misspelt", (field.name,), nearest=field.nearest))
    if start is not None:
        apart = np.abs(start[binding.qpos] - contract.default_joint_pos)
        if apart.max() > _SAME:
            names = tuple(np.array(contract.joints)[apart > _SAME].tolist())
            notes.append(ContractNote("start elsewhere", names, float(apart.max())))
    outside = _outside_limits(contract, model)
    if outside is not None:
        notes.append(outside)
    axes = _axes_outside_limits(contract, commands)
    if axes:
        notes.append(ContractNote("command outside limits", axes))
    return notes


def _outside_limits(contract: Contract, model: Model) -> ContractNote | None:
    """Return the joints whose default angle is outside of their limits."""
    joints = [model.joint_id(joint) for joint in contract.joints]
    low, high = model.jnt_range[joints].T
    default = contract.default_joint_pos
    beyond = np.maximum(low - default, default - high)
    beyond[~model.jnt_limited[joints]] = 0.0
    names = tuple(np.array(contract.joints)[beyond > _SAME].tolist())
    if not names:
        return None
    return ContractNote("outside limits", names, float(beyond.max()))


def _axes_outside_limits(contract: Contract, commands: Sequence[Command]) -> tuple[str, ...]:
    """Return the axes on which a policy is asked for more than its contract allows."""
    axes: list[str] = []
    for number, axis in enumerate(AXES):
        low, high = contract.command_limits.get(axis, (-np.inf, np.inf))
        speeds = [float(command.vector[number]) for command in commands]
        if min(speeds) < low or max(speeds) > high:
            axes.append(axis)
    return tuple(axes)
