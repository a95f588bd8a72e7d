"""Two contracts of one policy: their terms on the same states, and what comes of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...interface import Model
from ...models import AnyPath
from ..runs.drive import Progress, progress_of_stage
from ..runs.reporter import QUIET, Reporter
from .command import Command, usual_commands
from .contract import Contract
from .contract_differences import FieldDifference, field_differences
from .contract_file import read_contract
from .hypotheses import HypothesisKind, hypotheses_of
from .network import NetworkFacts
from .on_model import PolicyOnModel
from .request import PolicyRequest, on_each_engine, opened_network
from .term_gaps import TermGap, term_gaps
from .walk import RecordedWalk, Walk, all_walked


@dataclass(frozen=True)
class EngineContracts:
    """What comes of two contracts on one engine.

    Attributes:
        backend: As it is typed behind --backend.
        version: Of the engine.
        first: What comes of the first, one for each command.
        second: What comes of the second.
        gaps: How far the terms are apart on the states of the runs of the first: of each term the
            run with the largest difference; the last is the action.
    """

    backend: str
    version: str
    first: tuple[Walk, ...]
    second: tuple[Walk, ...]
    gaps: tuple[TermGap, ...]


@dataclass(frozen=True)
class ContractsResult:
    """What two contracts of one policy make of the same states.

    Attributes:
        request: What was asked; its contract is the first.
        against: The file of the second.
        first: The first contract, as it was read.
        second: The second.
        network: What the file of the policy says.
        commands: The speeds that were asked for.
        differences: What the two say otherwise.
        kinds: The named changes that make one of the other; empty where none alone does.
        engines: One for each engine.
    """

    request: PolicyRequest
    against: AnyPath
    first: Contract = field(metadata={"json": False})
    second: Contract = field(metadata={"json": False})
    network: NetworkFacts
    commands: tuple[Command, ...]
    differences: tuple[FieldDifference, ...]
    kinds: tuple[HypothesisKind, ...]
    engines: tuple[EngineContracts, ...]

    @property
    def holds(self) -> bool:
        """Tell whether both make the same of the same states, and say nothing otherwise."""
        return not self.differences


def compare_contracts(
    request: PolicyRequest, against: AnyPath, reporter: Reporter = QUIET
) -> ContractsResult:
    """Compute the terms of two contracts on the same states, and run the policy by both.

    Args:
        request: Its contract is the first.
        against: The file of the second.
        reporter: Told how it gets on.

    Raises:
        BadInputError: A contract, the network and the model do not fit together.
        MissingEngineError: An engine or the extra `policy` is not installed.
        StateMachineError: The model cannot be loaded.
    """
    first, second = read_contract(request.contract), read_contract(against)
    network = opened_network(request, first, second)
    commands = request.commands or usual_commands(first)

    def compute(model: Model, backend: str, progress: Progress) -> EngineContracts:
        policies = [PolicyOnModel.of(contract, network, model) for contract in (first, second)]
        runs: list[list[RecordedWalk]] = []
        for number, policy in enumerate(policies):
            stage = progress_of_stage(progress, 0.5 * number, 0.5)
            runs.append(all_walked(policy, commands, request.seconds, request.keyframe, stage))
        return EngineContracts(
            backend=backend,
            version=model.engine_version,
            first=_walks_of(runs[0]),
            second=_walks_of(runs[1]),
            gaps=_largest_gaps(policies[0], policies[1], runs[0]),
        )

    what = f"{Path(request.contract).name} and {Path(against).name}"
    engines = on_each_engine(request, what, compute, reporter)
    return ContractsResult(
        request=request,
        against=against,
        first=first,
        second=second,
        network=network.facts,
        commands=commands,
        differences=field_differences(first, second),
        kinds=_kinds(first, second),
        engines=engines,
    )


def _walks_of(runs: Sequence[RecordedWalk]) -> tuple[Walk, ...]:
    return tuple(run.walk for run in runs)


def _largest_gaps(
    first: PolicyOnModel, second: PolicyOnModel, runs: Sequence[RecordedWalk]
) -> tuple[TermGap, ...]:
    """Return of each term the gap of the run in which it is the largest."""
    largest: dict[str, TermGap] = {}
    for run in runs:
        for gap in term_gaps(first, second, run.calls, run.walk.command.vector):
            known = largest.get(gap.term)
            if known is None or gap.rms > known.rms:
                largest[gap.term] = gap
    return tuple(largest.values())


def _kinds(first: Contract, second: Contract) -> tuple[HypothesisKind, ...]:
    """Return the named changes that make one of the contracts of the other."""
    kinds: dict[HypothesisKind, None] = {}
    for one, other in ((first, second), (second, first)):
        for hypothesis in hypotheses_of(one):
            if not field_differences(hypothesis.contract, other):
                kinds[hypothesis.kind] = None
    return tuple(kinds)
