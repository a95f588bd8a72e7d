"""Page of two contracts of one policy: what they make of the same states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import significant
from ...show.blocks import Page, Table, TableCell
from ...show.templates import PageContent, render
from .contract_fields import UnreadField
from .page import speed_cells
from .term_gaps import TermGap
from .two_contracts import ContractsResult, EngineContracts
from .walk import Walk

_ACTION = "action"


@dataclass(frozen=True)
class _EnginePart:
    """What is shown of one engine.

    Attributes:
        engine: What came of it.
        gaps: Table of the terms on the same states.
        walks: Table of what came of each contract.
    """

    engine: EngineContracts
    gaps: Table
    walks: Table

    @property
    def moved(self) -> list[str]:
        """Return the terms that differ on the same states."""
        terms = [gap.term for gap in self.engine.gaps if gap.largest > 0.0]
        return [term for term in terms if term != _ACTION]

    @property
    def action(self) -> TermGap | None:
        """Return how far the actions are apart; None where they are equal."""
        actions = [gap for gap in self.engine.gaps if gap.term == _ACTION and gap.largest > 0.0]
        return actions[0] if actions else None


@dataclass(frozen=True)
class ContractsPage(PageContent):
    """What the page of two contracts shows.

    Attributes:
        result: What was computed.
        fields: Table of what the two say otherwise.
        parts: One for each engine.
    """

    template = "contracts.md.j2"
    result: ContractsResult
    fields: Table
    parts: Sequence[_EnginePart]

    @property
    def origin(self) -> str:
        """Return policy, model and engines, with their versions."""
        engines = ", ".join(f"{each.backend} ({each.version})" for each in self.result.engines)
        return f"{self.result.network.file}, {self.result.request.model}, {engines}"

    @property
    def first(self) -> str:
        """Return the name of the first contract's file."""
        return self.result.first.file

    @property
    def second(self) -> str:
        """Return the name of the second contract's file."""
        return self.result.second.file

    @property
    def misspelt(self) -> Sequence[UnreadField]:
        """Return the fields of either contract that nothing reads, and that are near to one."""
        return (*self.result.first.misspelt, *self.result.second.misspelt)

    @property
    def differences(self) -> int:
        """Return how many fields differ."""
        return len(self.result.differences)


def page(result: ContractsResult) -> Page:
    """Return the result as a page."""
    rows = [(each.name, each.first, each.second) for each in result.differences]
    headers = ("field", result.first.file, result.second.file)
    fields = Table(headers, rows, words=frozenset({0, 1, 2}))
    parts: list[_EnginePart] = []
    for engine in result.engines:
        parts.append(_EnginePart(engine, _gaps(engine), _walks(result, engine)))
    return render(ContractsPage(result, fields, parts))


def _gaps(engine: EngineContracts) -> Table:
    """Return the table of the terms that differ on the same states."""
    headers = ("term", "largest", "rms", "rms of the term")
    rows: list[tuple[str, ...]] = []
    for gap in engine.gaps:
        if gap.largest > 0.0:
            sizes = (gap.largest, gap.rms, gap.size)
            rows.append((gap.term, *(significant(size, 2) for size in sizes)))
    return Table(headers, rows)


def _walks(result: ContractsResult, engine: EngineContracts) -> Table:
    """Return the table of what came of each contract."""
    headers = ("contract", "asked", "vx", "vy", "wz", "it")
    rows: list[tuple[str, ...]] = []
    runs = ((result.first.file, engine.first), (result.second.file, engine.second))
    for file, walks in runs:
        rows += [(file, walk.command.words, *_cells(walk)) for walk in walks]
    return Table(headers, rows, words=frozenset({0, 1, 5}))


def _cells(walk: Walk) -> list[str]:
    """Return the speeds of a run, and what came of it."""
    verdict = "agrees" if walk.verdict == "walks" else "differs"
    return [*speed_cells(walk), TableCell(walk.verdict, verdict=verdict)]
