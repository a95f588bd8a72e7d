"""The page of releases of an engine, each compared with the next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ...measures.text import NO_NUMBER, quantity, sentence, short_time
from ...show.blocks import Block, Page, Table
from ...show.first_screen import MOST_ROWS, first_that_fits, with_answer
from ...show.pictures import Bars
from ...show.templates import PageContent, render
from ..compare import Agreement
from ..compare.known_changes_page import ShownChange, known_changes_blocks
from ..compare.sides import Request, Side
from ..compare.stillness import nothing_moved
from ..compare.typed_command import typed_command
from .compared_names import name_of
from .finding import leading
from .requests.versions import ReleasePair, VersionsResult

_MOST_CHANGES = 3  # known ones that one screen has

VersionsState = Literal["differs", "nothing moved", "agrees"]


@dataclass(frozen=True)
class VersionsPage(PageContent):
    """What the page of releases shows.

    Attributes:
        experiment: What was run.
        result: Each release with the next.
        pairs: Table of those that differ most.
        more: How many pairs it does not show.
        more_changed: How many of these differ.
        known_changes: Known changes, those of the pair that differs most first.
        more_changes: How many further ones there are.
        commands: What to type next for each pair that differs, the worst first.
        details: Whether everything is shown.
    """

    template = "versions.md.j2"
    experiment: str
    result: VersionsResult
    pairs: Table
    more: int
    more_changed: int
    known_changes: Sequence[Block]
    more_changes: int
    commands: list[str]
    details: bool

    @property
    def next_command(self) -> str:
        """Return the command to type next; "" where there is none."""
        return self.commands[0] if self.commands else ""

    @property
    def further_commands(self) -> str:
        """Return the commands for further pairs that differ, a line for each."""
        return "\n".join(self.commands[1:])

    @property
    def releases(self) -> list[str]:
        """Return the releases, the oldest first."""
        return [self.result.pairs[0].release, *(pair.next for pair in self.result.pairs)]

    @property
    def until(self) -> float:
        """Return the last moment that is compared [s]."""
        return max(pair.comparison.until for pair in self.result.pairs)

    @property
    def state(self) -> VersionsState:
        """Return in a word whether the motion changes between any two releases."""
        outcomes = {pair.comparison.outcome for pair in self.result.pairs}
        if outcomes & {"differs", "ended"}:
            return "differs"
        return "nothing moved" if "nothing moved" in outcomes else "agrees"

    @property
    def changed(self) -> list[str]:
        """Return the pairs of releases between which the motion changes."""
        return [f"{pair.release} and {pair.next}" for pair in self.result.pairs if pair.is_changed]

    @property
    def several_changed(self) -> bool:
        """Tell whether the motion changes between more than two releases."""
        return len(self.changed) > 1

    @property
    def worst(self) -> ReleasePair:
        """Return the pair of releases that is farthest apart."""
        return _worst_first(self.result.pairs)[0]

    @property
    def worst_gap(self) -> Agreement:
        """Return the coordinate that is farthest beyond its tolerance between these."""
        return leading(self.worst.comparison)

    @property
    def worst_name(self) -> str:
        """Return the name of that coordinate, as a page has it."""
        return name_of(self.worst_gap.name)

    @property
    def still(self) -> str:
        """Return the phrase for a pair in which nothing moved; "" where something did in all."""
        for pair in self.result.pairs:
            if pair.comparison.outcome == "nothing moved":
                return nothing_moved(pair.comparison.motion)
        return ""

    @property
    def bars(self) -> Bars:
        """Return a chart of the gap between each release and the next."""
        pairs = self.result.pairs
        return Bars(
            "How far a release is from the next",
            "largest gap [tolerances]",
            [f"{pair.release} to {pair.next}" for pair in pairs],
            {"farthest beyond its tolerance": [_tolerances(pair) for pair in pairs]},
        )

    @property
    def notes(self) -> list[str]:
        """Return the notes on all pairs, as sentences."""
        pairs = self.result.pairs
        return [sentence(note) for pair in pairs for note in pair.comparison.notes]

    @property
    def notes_hidden(self) -> bool:
        """Tell whether there are notes that are not shown."""
        return bool(self.notes) and not self.details


def page(result: VersionsResult, details: bool = False) -> Page:
    """Return the page of releases, each compared with the next, and the command that asks why.

    Args:
        result: Each release with the next.
        details: Whether every pair is shown, in its order, with what is noted of it.
    """
    changes = _changes(result)
    if details:
        return _page(result, result.pairs, changes, details=True)
    return first_that_fits(_shorter_pages(result, changes))


def _shorter_pages(result: VersionsResult, changes: Sequence[ShownChange]) -> Iterator[Page]:
    """Yield the page with ever fewer pairs, and then with ever fewer known changes."""
    worst = _worst_first(result.pairs)
    most = min(len(worst), MOST_ROWS)
    for known in range(min(len(changes), _MOST_CHANGES), -1, -1):
        for rows in range(most, 0, -1):
            yield _page(result, worst[:rows], changes[:known])


def _page(
    result: VersionsResult,
    pairs: Sequence[ReleasePair],
    changes: Sequence[ShownChange],
    details: bool = False,
) -> Page:
    """Return the page with a row for each of some pairs, and some of the known changes."""
    run = result.request.run
    changed = [pair for pair in _worst_first(result.pairs) if pair.is_changed]
    commands = [typed_command(_on_releases(run, pair)).lines("--why") for pair in changed]
    hidden = [pair for pair in result.pairs if pair not in pairs]
    more_changed = sum(pair.is_changed for pair in hidden)
    more_changes = len(_changes(result)) - len(changes)
    content = VersionsPage(
        experiment=run.experiment,
        result=result,
        pairs=_pairs_table(pairs),
        more=len(hidden),
        more_changed=more_changed,
        known_changes=known_changes_blocks(changes),
        more_changes=more_changes,
        commands=commands,
        details=details,
    )
    return with_answer(render(content))


def _changes(result: VersionsResult) -> list[ShownChange]:
    """Return the known changes of all pairs, those of the pair that differs most first."""
    shown: list[ShownChange] = []
    for pair in _worst_first(result.pairs):
        shown += [ShownChange(pair.release, pair.next, change) for change in pair.changes]
    return shown


def _worst_first(pairs: Sequence[ReleasePair]) -> list[ReleasePair]:
    """Return the pairs, those first whose motion differs most."""
    return sorted(pairs, key=lambda pair: (not pair.is_changed, -_tolerances(pair)))


def _tolerances(pair: ReleasePair) -> float:
    """Return how many tolerances the leading gap between two releases is."""
    worst = leading(pair.comparison)
    return worst.max / worst.tolerance if worst.tolerance else 0.0


def _pairs_table(pairs: Sequence[ReleasePair]) -> Table:
    """Return a row for each pair of releases: the coordinate farthest beyond its tolerance."""
    return Table(
        ("release", "next", "quantity", "largest", "at", "tolerance", "verdict"),
        [_cells(pair) for pair in pairs],
        words=frozenset({0, 1, 2, 6}),
    )


def _cells(pair: ReleasePair) -> tuple[str, ...]:
    """Return the row of a pair of releases."""
    worst, outcome = leading(pair.comparison), pair.comparison.outcome
    verdict = "DIFFERS" if pair.is_changed else outcome
    if not worst.max:
        return pair.release, pair.next, "nothing differs", NO_NUMBER, NO_NUMBER, NO_NUMBER, verdict
    largest, tolerance = quantity(worst.max, worst.unit), quantity(worst.tolerance, worst.unit)
    name, at = name_of(worst.name), short_time(worst.at)
    return pair.release, pair.next, name, largest, at, tolerance, verdict


def _on_releases(run: Request, pair: ReleasePair) -> Request:
    """Return what is run, with the two releases as its sides."""
    model = run.model if run.model else run.scenario().model
    timestep = {name: value for name, value in run.options.items() if name == "timestep"}
    options = {name: value for name, value in run.options.items() if name != "timestep"}
    sides: list[Side] = []
    for side in replace(run, backends=pair.backends).both_sides(model):
        sides.append(replace(side, options=options))
    return replace(run, sides=tuple(sides), model=None, options=timestep)
