"""Page of the changes of a contract: which makes the policy walk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.command_lines import folded_command
from ...measures.text import NO_NUMBER, significant
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from .diagnosis import LEAST_GAIN, PART_OF_COST, DiagnosisResult, EngineDiagnosis, TriedHypothesis
from .request import words_of_request
from .term_gaps import TermGap
from .walk import Walk

_TINY = 1e-12  # of a term that is zero
_ROWS = 5  # of the table of an engine, without details


@dataclass(frozen=True)
class _EnginePart:
    """What is shown of one engine.

    Attributes:
        engine: What came of it.
        table: Of the changes, the best first.
    """

    engine: EngineDiagnosis
    table: Table

    @property
    def is_sound(self) -> bool:
        """Tell whether it walks as it is asked, and no change makes it better."""
        return self.engine.walks_well and not self.engine.named

    @property
    def best(self) -> TriedHypothesis:
        """Return the change that makes it walk best."""
        return self.engine.tried[0]

    @property
    def others(self) -> list[str]:
        """Return the other sorts of changes that mend it equally well."""
        kinds = dict.fromkeys(each.kind for each in self.engine.named)
        return [kind for kind in kinds if kind != self.best.kind]

    @property
    def cost(self) -> float:
        """Return the cost of the contract as it is."""
        return self.engine.cost

    @property
    def best_cost(self) -> float:
        """Return the cost with the best change."""
        return 0.0 if self.best.cost is None else self.best.cost


@dataclass(frozen=True)
class DiagnosisPage(PageContent):
    """What the page of the changes of a contract shows.

    Attributes:
        result: What was computed.
        parts: One for each engine.
        next_command: What to type next; "" for nothing.
    """

    template = "diagnosis.md.j2"
    result: DiagnosisResult
    parts: Sequence[_EnginePart]
    next_command: str

    @property
    def origin(self) -> str:
        """Return policy, model and engines, with their versions."""
        engines = ", ".join(f"{each.backend} ({each.version})" for each in self.result.engines)
        return f"{self.result.network.file}, {self.result.request.model}, {engines}"

    @property
    def contract_file(self) -> str:
        """Return the name of the contract's file."""
        return self.result.contract.file

    @property
    def seconds(self) -> float:
        """Return how long each run is [s]."""
        return self.result.request.seconds

    @property
    def least_gain(self) -> float:
        """Return how much a change must take off the cost, at least."""
        return LEAST_GAIN

    @property
    def part_of_cost(self) -> float:
        """Return which part of the cost it must take off, at least."""
        return PART_OF_COST

    @property
    def commands(self) -> list[str]:
        """Return the speeds that were asked for."""
        return [each.words for each in self.result.commands]


def page(result: DiagnosisResult, details: bool = False) -> Page:
    """Return the result as a page.

    Args:
        result: What was computed.
        details: Whether all changes are shown, or the best.
    """
    parts: list[_EnginePart] = []
    for engine in result.engines:
        tried = engine.tried if details else engine.tried[:_ROWS]
        parts.append(_EnginePart(engine, _table(tried, engine)))
    following = ""
    if not details:
        following = folded_command([*words_of_request(result.request), "--faults", "--details"])
    return render(DiagnosisPage(result, parts, following))


def _table(tried: Sequence[TriedHypothesis], engine: EngineDiagnosis) -> Table:
    """Return the table of changes: what each is, what comes of it, and which term it moves."""
    headers = ("change", "of", "to", "it then", "cost", "moves most")
    rows: list[tuple[str, ...]] = [
        ("none", NO_NUMBER, NO_NUMBER, _outcome(engine.walks), f"{engine.cost:.2f}", NO_NUMBER)
    ]
    for each in tried:
        cost = NO_NUMBER if each.cost is None else f"{each.cost:.2f}"
        outcome = _outcome(each.walks) if each.walks else "refused"
        rows.append((each.kind, each.term or NO_NUMBER, each.after, outcome, cost, _moved(each)))
    return Table(headers, rows, words=frozenset({0, 1, 2, 3, 5}), wide=frozenset({5}))


def _outcome(walks: Sequence[Walk]) -> str:
    """Return what comes of runs, the worst first."""
    for verdict in ("diverges", "falls", "wrong speed"):
        count = sum(walk.verdict == verdict for walk in walks)
        if count:
            return verdict if count == len(walks) else f"{verdict} ({count} of {len(walks)})"
    return "walks"


def _moved(tried: TriedHypothesis) -> str:
    """Return the term that a change moves most, on the same states."""
    terms = [gap for gap in tried.gaps if gap.term != "action"]
    if not terms:
        return NO_NUMBER
    worst = max(terms, key=_relative)
    return f"{worst.term} by {significant(worst.rms, 2)}"


def _relative(gap: TermGap) -> float:
    """Return a gap in parts of the term."""
    return gap.rms / max(gap.size, _TINY)
