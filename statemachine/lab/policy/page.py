"""Page of a policy on engines: whether it walks, and how."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ...measures.command_lines import folded_command
from ...measures.text import NO_NUMBER, percent, significant
from ...show.blocks import Page, Table, TableCell
from ...show.templates import PageContent, render
from .adapted import ContractChange
from .checks import ContractNote
from .command import LEAST_TOLERANCE, LEAST_TURN_TOLERANCE, RELATIVE_TOLERANCE
from .contract import AXES
from .request import EngineWalks, PolicyResult, words_of_request
from .walk import Walk

# What came of a run, and which way its worst speed is off.
_WalkOutcome = Literal["falls", "diverges", "too slow", "too fast", "not asked"]


@dataclass(frozen=True)
class _EngineWalk:
    """A run on an engine, and the speed that is farthest from the one asked for.

    Attributes:
        backend: As it is typed behind --backend.
        walk: What came of it.
    """

    backend: str
    walk: Walk

    @property
    def outcome(self) -> _WalkOutcome:
        """Return what came of it."""
        if self.walk.verdict == "falls":
            return "falls"
        if self.walk.verdict == "diverges":
            return "diverges"
        if self.asked == 0.0:
            return "not asked"
        return "too slow" if self.reached / self.asked < 1.0 else "too fast"

    @property
    def axis(self) -> str:
        """Return the axis whose speed is farthest from the one asked for."""
        return self.walk.worst_axis

    @property
    def asked(self) -> float:
        """Return the speed that was asked for on that axis."""
        return float(getattr(self.walk.command, self.axis))

    @property
    def reached(self) -> float:
        """Return the speed that was reached on it."""
        assert self.walk.reached is not None
        return self.walk.reached[AXES.index(self.axis)]

    @property
    def off(self) -> float:
        """Return how far it is off, as a part of the speed that was asked for."""
        return abs(self.reached / self.asked - 1.0)

    @property
    def tolerance(self) -> float:
        """Return how far it may be off [m/s or rad/s]."""
        return self.walk.command.tolerances[AXES.index(self.axis)]

    @property
    def tolerated(self) -> float:
        """Return how far it may be off, as a part of the speed that was asked for."""
        return self.tolerance / abs(self.asked)

    @property
    def unit(self) -> str:
        """Return the unit of the speeds."""
        return "rad/s" if self.axis == "wz" else "m/s"


@dataclass(frozen=True)
class _Change:
    """What the contract says otherwise than the model's file.

    Attributes:
        change: The change.
    """

    change: ContractChange

    @property
    def name(self) -> str:
        """Return which property."""
        return self.change.name

    @property
    def is_of_servos(self) -> bool:
        """Tell whether it is who computes the torques."""
        return self.change.file is None

    @property
    def file(self) -> str:
        """Return the values in the file."""
        return _range(self.change.file, self.change.unit)

    @property
    def contract(self) -> str:
        """Return the values in the contract."""
        return _range(self.change.contract, self.change.unit)


@dataclass(frozen=True)
class PolicyPage(PageContent):
    """What the page of a policy shows.

    Attributes:
        result: What was computed.
        told: The runs that did not do as they were asked; where all did, that whose speed is
            farthest from the one asked for.
        refused: The engines that refused the contract.
        walks: Table with a row for each engine and command.
        changes: What the contract says otherwise than the model's file.
        next_command: What to type next; "" for nothing.
    """

    template = "policy.md.j2"
    result: PolicyResult
    told: Sequence[_EngineWalk]
    refused: Sequence[EngineWalks]
    walks: Table
    changes: Sequence[_Change]
    next_command: str

    @property
    def origin(self) -> str:
        """Return contract, model and engines, with their versions."""
        result = self.result
        engines = ", ".join(
            f"{engine.backend} ({engine.provenance.versions[engine.provenance.backend]})"
            for engine in result.engines
        )
        model = result.engines[0].provenance.model_file
        return f"{result.contract.file}, {model}, {engines}"

    @property
    def policy(self) -> str:
        """Return the name of the policy's file."""
        return self.result.network.file

    @property
    def model_file(self) -> str:
        """Return the name of the model's file."""
        return self.result.engines[0].provenance.model_file.rpartition("/")[2]

    @property
    def contract_file(self) -> str:
        """Return the name of the contract's file."""
        return self.result.contract.file

    @property
    def backends(self) -> list[str]:
        """Return the engines."""
        return [engine.backend for engine in self.result.engines]

    @property
    def is_on_several(self) -> bool:
        """Tell whether it ran on several engines."""
        return len(self.result.engines) > 1

    @property
    def seconds(self) -> float:
        """Return how long each run is [s]."""
        return self.result.request.seconds

    @property
    def commands(self) -> int:
        """Return the number of runs on each engine."""
        return len(self.result.commands)

    @property
    def relative_tolerance(self) -> float:
        """Return how far a speed may be off, as a part of the one asked for."""
        return RELATIVE_TOLERANCE

    @property
    def least_tolerance(self) -> float:
        """Return how far it may be off at least [m/s]."""
        return LEAST_TOLERANCE

    @property
    def least_turn_tolerance(self) -> float:
        """Return how far it may be off at least, turning [rad/s]."""
        return LEAST_TURN_TOLERANCE

    @property
    def notes(self) -> Sequence[ContractNote]:
        """Return what else is odd about the contract and the model."""
        return [note for note in self.result.notes if note.kind != "misspelt"]

    @property
    def decimation(self) -> int:
        """Return the number of steps of the engine between two calls."""
        timing = self.result.contract.timing
        timestep = self.result.engines[0].provenance.timestep
        return timing.decimation or round(timing.policy_dt / timestep)


def page(result: PolicyResult, details: bool = False) -> Page:
    """Return the result as a page.

    Args:
        result: What was computed.
        details: Whether lateral way, height and power of each run are shown.
    """
    content = PolicyPage(
        result=result,
        told=_told(result),
        refused=[engine for engine in result.engines if engine.refusal],
        walks=_table_of_walks(result, details),
        changes=[_Change(change) for change in result.engines[0].changes],
        next_command=_next_command(result, details),
    )
    return render(content)


def _told(result: PolicyResult) -> list[_EngineWalk]:
    """Return the runs that the verdict tells of."""
    walks: list[_EngineWalk] = []
    for engine in result.engines:
        walks += [_EngineWalk(engine.backend, walk) for walk in engine.walks]
    if result.holds:
        return [max(walks, key=lambda each: each.walk.error)]
    return [each for each in walks if each.walk.verdict != "walks"]


def _table_of_walks(result: PolicyResult, details: bool) -> Table:
    """Return the table with a row for each engine and command."""
    headers = ["engine", "asked", "vx", "vy", "wz", "it", "at a limit"]
    if details:
        headers = ["engine", "asked", "it", "to the left", "turned", "height", "power"]
    rows: list[list[str]] = []
    for engine in result.engines:
        for walk in engine.walks:
            cells = [engine.backend, walk.command.words]
            rows.append(cells + (_details(walk) if details else _speeds(walk)))
    words = {headers.index(name) for name in ("engine", "asked", "it")}
    return Table(headers, rows, words=frozenset(words))


def _speeds(walk: Walk) -> list[str]:
    """Return what a row shows of a run."""
    return [*speed_cells(walk), _outcome(walk), percent(walk.at_limit)]


def speed_cells(walk: Walk) -> list[str]:
    """Return the speeds that a run reached, a cell each; dashes where it ended before."""
    if walk.reached is None:
        return [NO_NUMBER] * len(AXES)
    return [f"{speed:z.2f}" for speed in walk.reached]


def _details(walk: Walk) -> list[str]:
    """Return what a row of the details shows of a run."""
    height = NO_NUMBER if walk.height is None else f"{walk.height:.3f} m"
    return [
        _outcome(walk),
        f"{walk.lateral:z.2f} m",
        f"{math.degrees(walk.turned):z.0f}°",
        height,
        f"{walk.power:.0f} W",
    ]


def _outcome(walk: Walk) -> str:
    """Return what came of a run, in words."""
    verdict = "agrees" if walk.verdict == "walks" else "differs"
    text: str = walk.verdict
    if walk.ending != "walked":
        text = f"{walk.verdict} at {walk.seconds:.1f} s"
    return TableCell(text, verdict=verdict)


def _range(values: tuple[float, float] | None, unit: str) -> str:
    """Return the least and the largest of values, once where they are equal."""
    if values is None:
        return ""
    low, high = (significant(value, 3) for value in values)
    text = low if low == high else f"{low} to {high}"
    return f"{text} {unit}"


def _next_command(result: PolicyResult, details: bool) -> str:
    """Return what to type next; "" for nothing."""
    words = words_of_request(result.request)
    if not result.holds:
        return folded_command([*words, "--faults"])
    return "" if details else folded_command([*words, "--details"])
