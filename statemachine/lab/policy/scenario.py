"""A policy as what is run on any side of a comparison: a controller like a function of the user's.

A side keeps its own servos, gains, limits and timestep: a difference there is a cause.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Model, make_data, reset
from ...measures.text import milliseconds
from ...models import AnyPath
from ..runs.controllers import is_policy
from ..runs.drive import Controller
from ..runs.scenarios import Scenario
from .binding import bind
from .checks import check_network
from .command import Command, speeds_of, typed_speeds, usual_commands
from .contract import Contract, ObservedTerm
from .contract_file import read_contract
from .controller import PolicyController
from .network import Network
from .on_model import PolicyOnModel

_SECONDS: Final = 4.0


def policy_scenario(
    file: str,
    contract: AnyPath,
    command: Sequence[float] | None = None,
    keyframe: str | None = None,
    names: Mapping[str, str] | None = None,
) -> Scenario:
    """Return what a policy does on any robot that it fits.

    Each run has a controller of its own, which begins at the reset.

    Args:
        file: An ONNX file.
        contract: What it expects of the simulator: a YAML file.
        command: (3,) speeds that it is asked for, vx, vy [m/s], wz [rad/s]; None for straight on.
        keyframe: Where it starts; None for "home" if there is one, else for the default state with
            the joints in the pose of the contract.
        names: Joints and sites of the contract that have other names in some models.

    Raises:
        BadInputError: The contract or the network cannot be read, or they do not fit together; the
            controller raises it where they do not fit a model.
        MissingEngineError: The extra `policy` is not installed.
    """
    expected = read_contract(contract)
    network = Network(file)
    check_network(expected, network.facts)
    speeds = usual_commands(expected)[0]
    if command is not None:
        speeds = Command(*speeds_of(command))
    renamed = dict(names or {})

    def controller_of(model: Model, _seed: int) -> Controller:
        contract_there = _by_names_of(expected, model, renamed)
        policy = PolicyOnModel.as_filed(contract_there, network.with_own_memory(), model)
        return PolicyController(policy, speeds.vector)

    def start_of(model: Model) -> Array:
        binding = bind(_by_names_of(expected, model, renamed), model)
        with make_data(model) as data:
            reset(model, data)
            qpos = np.array(data.qpos)
        qpos[binding.qpos] = expected.default_joint_pos
        return qpos

    name = Path(file).name
    description = _description(name, expected, speeds)
    return Scenario(
        name=name,
        description=description,
        model="",
        seconds=_SECONDS,
        controller=controller_of,
        general_description=description,
        needs=lambda _model: None,
        keyframe=keyframe,
        is_user_function=True,
        is_policy=True,
        start=start_of,
    )


def _description(name: str, contract: Contract, command: Command) -> str:
    """Return what happens where a policy is run, in a sentence."""
    every = milliseconds(contract.timing.policy_dt)
    return (
        f"{name} is called every {every}, as {contract.file} says, and asked for {command.vx:g} "
        f"m/s forward, {command.vy:g} m/s to the left and {command.wz:g} rad/s."
    )


def check_contract(
    words: Sequence[str], contract: AnyPath | None, command: Sequence[float] | None
) -> None:
    """Check that a policy has a contract, and nothing else has one.

    Args:
        words: What is run, as it is typed.
        contract: The file; None without.
        command: (3,) speeds that are asked for; None for the usual ones.

    Raises:
        BadInputError: It is not so.
    """
    policies = [Path(word).name for word in words if is_policy(word)]
    if policies and contract is None:
        raise BadInputError(
            f"{policies[0]} needs a contract, a file that says what the policy expects of the "
            "simulator: --contract FILE"
        )
    for name, value in (("contract", contract), ("command", command)):
        if value is not None and not policies:
            raise BadInputError(f"{name} goes with POLICY.onnx, and {words[0]} is no policy")


def options_of_policy(
    contract: AnyPath | None, command: Sequence[float] | None
) -> list[tuple[str, object, object]]:
    """Return the options of a command that runs a policy, as `measures.text.command` takes them."""
    options: list[tuple[str, object, object]] = []
    if contract is not None:
        options.append(("--contract", Path(contract).name, None))
    if command is not None:  # in one word: speeds that begin with a minus would be an option
        options.append((f"--command={typed_speeds(command)}", True, False))
    return options


def _by_names_of(contract: Contract, model: Model, names: Mapping[str, str]) -> Contract:
    """Return a contract by the names that its joints and sites have in a model.

    Args:
        contract: What the policy expects.
        model: What is run.
        names: By names of the contract, those that stand for them where a model lacks these.
    """
    joints = _present(contract.joints, model.joint_names, names)
    terms: list[ObservedTerm] = []
    for term in contract.terms:
        (site,) = _present((term.site,), model.site_names, names)
        term_joints = _present(term.joints, model.joint_names, names)
        terms.append(replace(term, site=site, joints=term_joints))
    return replace(contract, joints=joints, terms=tuple(terms))


def _present(
    wanted: Sequence[str], known: Sequence[str], names: Mapping[str, str]
) -> tuple[str, ...]:
    """Return names, where a model lacks one that which stands for it."""
    return tuple(name if name in known else names.get(name, name) for name in wanted)
