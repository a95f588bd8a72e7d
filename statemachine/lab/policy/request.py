"""A policy on each engine: what is asked, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

from ...backends.chosen import chosen_backends
from ...errors import BadInputError, UnsupportedError
from ...installed import DEFAULT
from ...interface import Model
from ...models import AnyPath
from ...program import NAME
from ..runs.drive import Progress
from ..runs.each_backend import on_each_backend
from ..runs.provenance import Provenance, provenance
from ..runs.reporter import QUIET, Reporter
from ..runs.robot import home_keyframe
from .adapted import ContractChange
from .binding import bind
from .checks import ContractNote, check_network, notes_of
from .command import Command, usual_commands
from .contract import Contract
from .contract_file import read_contract
from .floor import check_floor
from .network import Network, NetworkFacts
from .on_model import PolicyOnModel
from .walk import Walk, all_walked, check_length

R = TypeVar("R")  # what is computed on an engine
SECONDS = 10.0  # of a run
_LONGEST = 600.0  # [s]


@dataclass(frozen=True)
class PolicyRequest:
    """Question how a policy walks on engines.

    Attributes:
        policy: An ONNX file.
        contract: What it expects of the simulator: a YAML file.
        model: A name or a file of a robot, with the ground that it walks on.
        backends: As `parse_backend` reads them; "all" for those that are installed.
        commands: The speeds that it is asked for, one run each; empty for straight on and turning,
            as fast as the contract allows.
        seconds: Of each run [s].
        keyframe: Where it starts; None for "home" if there is one.
        menagerie: A menagerie folder to look the model's name up in.
    """

    policy: AnyPath
    contract: AnyPath
    model: AnyPath
    backends: tuple[str, ...] = (DEFAULT,)
    commands: tuple[Command, ...] = ()
    seconds: float = SECONDS
    keyframe: str | None = None
    menagerie: AnyPath | None = None

    def __post_init__(self) -> None:
        if not self.backends:
            raise BadInputError("no backend is named: name one, or all")
        chosen_backends(self.backends)
        if not 0.0 < self.seconds <= _LONGEST:
            raise BadInputError(
                f"seconds are above 0 and at most {_LONGEST:g}; got {self.seconds:g}"
            )


@dataclass(frozen=True)
class EngineWalks:
    """How a policy walks on one engine.

    Attributes:
        backend: As it is typed behind --backend.
        provenance: What it was computed with.
        changes: What the contract says otherwise than the model's file, and what was run.
        walks: One for each command; empty where it was refused.
        refusal: Why it was refused; "" otherwise.
    """

    backend: str
    provenance: Provenance
    changes: tuple[ContractChange, ...]
    walks: tuple[Walk, ...]
    refusal: str = ""

    @property
    def holds(self) -> bool:
        """Tell whether it does as it is asked, in each run."""
        return not self.refusal and all(walk.verdict == "walks" for walk in self.walks)


@dataclass(frozen=True)
class PolicyResult:
    """How a policy walks on engines.

    Attributes:
        request: What was asked.
        contract: As it was read.
        network: What the file of the policy says.
        commands: The speeds that were asked for.
        notes: What is odd about the contract and the model, and no fault, on the first engine with
            something odd.
        engines: One for each engine.
    """

    request: PolicyRequest
    contract: Contract = field(metadata={"json": False})
    network: NetworkFacts
    commands: tuple[Command, ...]
    notes: tuple[ContractNote, ...]
    engines: tuple[EngineWalks, ...]

    @property
    def holds(self) -> bool:
        """Tell whether it does as it is asked on each engine."""
        return all(engine.holds for engine in self.engines)


def answer(request: PolicyRequest, reporter: Reporter = QUIET) -> PolicyResult:
    """Run a policy on each engine, once for each command.

    Raises:
        BadInputError: The contract, the network and the model do not fit together.
        MissingEngineError: An engine or the extra `policy` is not installed.
        StateMachineError: The model cannot be loaded.
    """
    contract = read_contract(request.contract)
    check_length(contract, request.seconds)
    network = opened_network(request, contract)
    commands = request.commands or usual_commands(contract)

    def compute(model: Model, backend: str, progress: Progress) -> _EngineAnswer:
        source = provenance(model, onnxruntime=network.facts.version)
        start = _start_of(model, request.keyframe)
        notes = notes_of(contract, model, bind(contract, model), start, commands)
        try:
            policy = PolicyOnModel.of(contract, network, model)
        except UnsupportedError as error:
            return _EngineAnswer(EngineWalks(backend, source, (), (), str(error)), notes)
        recorded = all_walked(policy, commands, request.seconds, request.keyframe, progress)
        walks = tuple(run.walk for run in recorded)
        return _EngineAnswer(EngineWalks(backend, source, policy.driven.changes, walks), notes)

    answers = on_each_engine(request, Path(request.policy).name, compute, reporter)
    notes = [each.notes for each in answers if each.notes]
    return PolicyResult(
        request=request,
        contract=contract,
        network=network.facts,
        commands=commands,
        notes=tuple(notes[0]) if notes else (),
        engines=tuple(each.walks for each in answers),
    )


@dataclass(frozen=True)
class _EngineAnswer:
    """What came of a question on one engine.

    Attributes:
        walks: How the policy walks.
        notes: What is odd about the contract and the model.
    """

    walks: EngineWalks
    notes: Sequence[ContractNote]


def opened_network(request: PolicyRequest, *contracts: Contract) -> Network:
    """Return the network of a question, which takes what each contract observes.

    Raises:
        BadInputError: It cannot be read, or it does not fit a contract.
        MissingEngineError: The extra `policy` is not installed.
    """
    network = Network(request.policy)
    for contract in contracts:
        check_network(contract, network.facts)
    return network


def on_each_engine(
    request: PolicyRequest,
    what: str,
    compute: Callable[[Model, str, Progress], R],
    reporter: Reporter,
) -> tuple[R, ...]:
    """Return what is computed on each engine of a question; the rest as of `on_each_backend`.

    Raises:
        BadInputError: The model has no floor.
    """

    def compute_on_floor(model: Model, backend: str, progress: Progress) -> R:
        check_floor(model)
        return compute(model, backend, progress)

    results = on_each_backend(
        request.backends, what, request.model, request.menagerie, compute_on_floor, reporter
    )
    return tuple(results.values())


def _start_of(model: Model, keyframe: str | None) -> np.ndarray | None:
    """Return the qpos (nq,) of the keyframe in which runs start; None for the default state."""
    key = home_keyframe(model) if keyframe is None else keyframe
    return None if key is None else model.keyframes[model.key_id(key)].qpos


def words_of_request(request: PolicyRequest) -> list[str]:
    """Return how a question is typed."""
    words = [NAME, "policy", str(request.policy), str(request.model)]
    words += ["--contract", str(request.contract)]
    for backend in request.backends if request.backends != (DEFAULT,) else ():
        words += ["--backend", backend]
    for asked in request.commands:
        words.append(f"--command={asked.words}")
    if request.seconds != SECONDS:
        words += ["--seconds", f"{request.seconds:g}"]
    if request.keyframe is not None:
        words += ["--keyframe", request.keyframe]
    return words
