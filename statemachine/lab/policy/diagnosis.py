"""Which part of a contract is wrong: each named change, and what comes of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from ...errors import BadInputError, UnsupportedError
from ...interface import Model
from ...show.blocks import only_on_pages
from ..runs.drive import Progress
from ..runs.reporter import QUIET, Reporter
from .command import Command, usual_commands
from .contract import Contract
from .contract_file import read_contract
from .hypotheses import ContractHypothesis, HypothesisKind, hypotheses_of
from .network import Network, NetworkFacts
from .on_model import PolicyOnModel
from .request import PolicyRequest, on_each_engine, opened_network
from .term_gaps import TermGap, term_gaps
from .walk import RecordedWalk, Walk, all_walked

# By how much the outcome must get better: a part of it, and at least so much. `cost_of` says in
# what; a sound contract that tracks within three fifths of the tolerance cannot get better by that.
PART_OF_COST: Final = 0.4
LEAST_GAIN: Final = 0.15
# Two changes whose costs are nearer are equally good.
_TIE: Final = 0.04
_PER_TOLERANCE: Final = 0.25  # cost of a speed that is off by all that is tolerated


@dataclass(frozen=True)
class TriedHypothesis:
    """A change of a contract, and what comes of it on an engine.

    Attributes:
        kind: Which sort of fault it would mend.
        term: Name of the term that it changes; "" for none.
        before: What the contract says; "" where `after` says it all.
        after: What was run.
        walks: What came of it, one for each command; empty where it could not be run.
        cost: As of `cost_of`; None where it could not be run.
        gaps: How far terms and action are from those of the contract as it is, on the same
            states: those of its first run; empty where none differs.
        refusal: Why it could not be run; "" otherwise.
    """

    kind: HypothesisKind
    term: str
    before: str
    after: str
    walks: tuple[Walk, ...]
    cost: float | None
    gaps: tuple[TermGap, ...] = ()
    refusal: str = ""


@dataclass(frozen=True)
class EngineDiagnosis:
    """Which change of a contract makes a policy walk on an engine.

    Attributes:
        backend: As it is typed behind --backend.
        version: Of the engine.
        walks: What comes of the contract as it is, one for each command.
        cost: Of these, as of `cost_of`.
        tried: The changes, the best first.
        named: The changes that mend it equally well, the best first; empty where none does.
    """

    backend: str
    version: str
    walks: tuple[Walk, ...]
    cost: float
    tried: tuple[TriedHypothesis, ...]
    named: tuple[TriedHypothesis, ...]

    @property
    @only_on_pages
    def walks_well(self) -> bool:
        """Tell whether it walks as it is asked in each run, with the contract as it is."""
        return all(walk.verdict == "walks" for walk in self.walks)


@dataclass(frozen=True)
class DiagnosisResult:
    """Which part of a contract is wrong.

    Attributes:
        request: What was asked.
        contract: As it was read.
        network: What the file of the policy says.
        commands: The speeds that were asked for.
        engines: One for each engine.
    """

    request: PolicyRequest
    contract: Contract = field(metadata={"json": False})
    network: NetworkFacts
    commands: tuple[Command, ...]
    engines: tuple[EngineDiagnosis, ...]

    @property
    def holds(self) -> bool:
        """Tell whether no change makes it better on any engine, and it walks on each."""
        return all(engine.walks_well and not engine.named for engine in self.engines)


def cost_of(walks: Sequence[Walk], seconds: float) -> float:
    """Return how badly a policy does: 0 where it does as it is asked, 2 where it falls at once.

    A run that falls costs 1, and as much more as of its time is left. One that does not costs the
    error of its speeds, 0.25 where that is all that is tolerated, at most 1. It is the mean over
    the runs.

    Args:
        walks: One for each command.
        seconds: How long each was to last [s].
    """
    costs: list[float] = []
    for walk in walks:
        if walk.ending == "walked":
            costs.append(min(1.0, _PER_TOLERANCE * walk.error))
        else:
            costs.append(1.0 + max(0.0, 1.0 - walk.seconds / seconds))
    return float(np.mean(costs))


def diagnose(request: PolicyRequest, reporter: Reporter = QUIET) -> DiagnosisResult:
    """Run a policy with each named change of its contract, and say which makes it walk.

    Raises:
        BadInputError: The contract, the network and the model do not fit together.
        MissingEngineError: An engine or the extra `policy` is not installed.
        StateMachineError: The model cannot be loaded.
    """
    contract = read_contract(request.contract)
    network = opened_network(request, contract)
    commands = request.commands or usual_commands(contract)

    def compute(model: Model, backend: str, progress: Progress) -> EngineDiagnosis:
        runs = _Runs(network, model, commands, request.seconds, request.keyframe)
        return _diagnosed(contract, runs, backend, progress)

    what = f"changes of {Path(request.contract).name}"
    engines = on_each_engine(request, what, compute, reporter)
    return DiagnosisResult(
        request=request,
        contract=contract,
        network=network.facts,
        commands=commands,
        engines=engines,
    )


@dataclass(frozen=True)
class _Runs:
    """What the runs of all changes share.

    Attributes:
        network: The policy.
        model: Of the engine, as its file has it.
        commands: The speeds that are asked for, one run each.
        seconds: Of each run [s].
        keyframe: Where it starts; None for the usual one.
    """

    network: Network
    model: Model
    commands: Sequence[Command]
    seconds: float
    keyframe: str | None

    def of(self, policy: PolicyOnModel) -> list[RecordedWalk]:
        """Return the runs of a policy."""
        return all_walked(policy, self.commands, self.seconds, self.keyframe)

    def on_model(self, contract: Contract) -> PolicyOnModel:
        """Return the policy on the model, as a contract wants it."""
        return PolicyOnModel.of(contract, self.network, self.model)


def _diagnosed(
    contract: Contract, runs: _Runs, backend: str, progress: Progress
) -> EngineDiagnosis:
    """Return which change of a contract makes a policy walk on one engine.

    Args:
        contract: As it is.
        runs: What is run.
        backend: As it is typed.
        progress: Told the fraction that is done.
    """
    policy = runs.on_model(contract)
    recorded = runs.of(policy)
    walks = tuple(run.walk for run in recorded)
    cost = cost_of(walks, runs.seconds)
    hypotheses = hypotheses_of(contract)
    tried: list[TriedHypothesis] = []
    for number, hypothesis in enumerate(hypotheses):
        progress((1 + number) / (1 + len(hypotheses)))
        tried.append(_tried(hypothesis, policy, runs, recorded[-1]))
    tried.sort(key=_sorting_cost)
    return EngineDiagnosis(
        backend=backend,
        version=runs.model.engine_version,
        walks=walks,
        cost=cost,
        tried=tuple(tried),
        named=named_of(tried, cost),
    )


def _tried(
    hypothesis: ContractHypothesis, policy: PolicyOnModel, runs: _Runs, recorded: RecordedWalk
) -> TriedHypothesis:
    """Return what comes of a change.

    Args:
        hypothesis: The change.
        policy: With the contract as it is.
        runs: What is run.
        recorded: A run of that, on whose states terms are compared.
    """
    facts = (hypothesis.kind, hypothesis.term, hypothesis.before, hypothesis.after)
    try:
        changed = runs.on_model(hypothesis.contract)
    except (BadInputError, UnsupportedError) as error:
        return TriedHypothesis(*facts, walks=(), cost=None, refusal=str(error))
    walks = tuple(run.walk for run in runs.of(changed))
    gaps = term_gaps(policy, changed, recorded.calls, recorded.walk.command.vector)
    return TriedHypothesis(
        *facts,
        walks=walks,
        cost=cost_of(walks, runs.seconds),
        gaps=tuple(gap for gap in gaps if gap.largest > 0.0),
    )


def _sorting_cost(tried: TriedHypothesis) -> float:
    return np.inf if tried.cost is None else tried.cost


def named_of(tried: Sequence[TriedHypothesis], cost: float) -> tuple[TriedHypothesis, ...]:
    """Return the changes that mend a contract equally well, the best first; none if none does.

    Args:
        tried: The best first.
        cost: Of the contract as it is.
    """
    best = _sorting_cost(tried[0])
    if cost - best < max(LEAST_GAIN, PART_OF_COST * cost):
        return ()
    return tuple(each for each in tried if _sorting_cost(each) <= best + _TIE)
