"""The page of releases of an engine, each compared with the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import NONE, command, listed, quantity, sentence, short_time
from ...show import report_template as template
from ...show.blocks import Block, Code, Items, Page, Table
from ...show.pictures import Bars
from ...show.report_template import slots_of
from ..compare import Comparison, Request
from ..compare.stillness import nothing_moved
from .compared_names import name_of
from .finding import leading
from .requests.versions import VersionsResult


@dataclass(frozen=True)
class _NextRelease:
    """A release of MuJoCo and the next one, compared.

    Attributes:
        release: The version.
        next: That of the next one.
        backends: What to type for both.
        comparison: Of the two.
    """

    release: str
    next: str
    backends: tuple[str, str]
    comparison: Comparison

    @classmethod
    def of(cls, comparison: Comparison) -> _NextRelease:
        """Return what a comparison is of."""
        left, right = comparison.left.trace.header, comparison.right.trace.header
        return cls(
            release=left.provenance.versions[left.backend],
            next=right.provenance.versions[right.backend],
            backends=(left.backend, right.backend),
            comparison=comparison,
        )

    @property
    def tolerances(self) -> float:
        """How many tolerances the leading gap is."""
        worst = leading(self.comparison)
        return worst.max / worst.tolerance if worst.tolerance else 0.0

    def cells(self) -> tuple[str, ...]:
        """Return the row of the two."""
        worst = leading(self.comparison)
        outcome = self.comparison.outcome
        verdict = outcome if outcome in ("agrees", "nothing moved") else "DIFFERS"
        if not worst.max:
            return (self.release, self.next, "nothing differs", NONE, NONE, NONE, verdict)
        largest, tolerance = (quantity(v, worst.unit) for v in (worst.max, worst.tolerance))
        return (
            self.release,
            self.next,
            name_of(worst.name),
            largest,
            short_time(worst.at),
            tolerance,
            verdict,
        )


def page(result: VersionsResult, details: bool = False) -> Page:
    """Return the page of releases, each compared with the next, and commands that ask why.

    Args:
        result: What was found.
        details: Whether all of it is shown, and not the first screen alone.
    """
    run = result.request.run
    pairs = [_NextRelease.of(comparison) for comparison in result.comparisons]
    slots = slots_of(_releases_of(pairs), _changes_of(pairs, run))
    return template.page("lab/questions/versions", experiment=run.experiment, **slots)


@dataclass(frozen=True)
class _Releases:
    """What is compared, and how far apart it is.

    Attributes:
        first: The first release.
        last: The last one.
        until: The last moment that is compared [s].
        steps: A row for each release and the next.
        bars: How far each release is from the next.
        read: What a release reads in the file that the next does not, or the other way round.
    """

    first: str
    last: str
    until: float
    steps: Table
    bars: Bars
    read: Items


def _releases_of(pairs: Sequence[_NextRelease]) -> _Releases:
    return _Releases(
        first=pairs[0].release,
        last=pairs[-1].next,
        until=max(pair.comparison.until for pair in pairs),
        steps=_releases_table(pairs),
        bars=_releases_bars(pairs),
        read=Items(_notes_of(pairs)),
    )


def _notes_of(pairs: Sequence[_NextRelease]) -> list[str]:
    """Return what is noted of each release and the next, as sentences."""
    return [sentence(note) for pair in pairs for note in pair.comparison.notes]


def _releases_table(pairs: Sequence[_NextRelease]) -> Table:
    return Table(
        ("release", "next", "quantity", "largest", "at", "tolerance", "verdict"),
        [pair.cells() for pair in pairs],
        "From release to release",
        words=frozenset({0, 1, 2, 6}),
    )


def _releases_bars(pairs: Sequence[_NextRelease]) -> Bars:
    return Bars(
        "How far a release is from the next",
        "largest gap [tolerances]",
        [f"{pair.release} to {pair.next}" for pair in pairs],
        {"farthest beyond its tolerance": [pair.tolerances for pair in pairs]},
    )


@dataclass(frozen=True)
class _Changes:
    """Between which releases the motion changes.

    Attributes:
        why: Commands that ask why it does.
        same: True where it does nowhere; else None.
        differs: False where it does; else None.
        pairs: Between which; None for none.
        still: False where nothing moves on some of them, and the rest agrees; else None.
        nothing: What is said of that; "" else.
    """

    why: list[Block]
    same: bool | None = None
    differs: bool | None = None
    pairs: str | None = None
    still: bool | None = None
    nothing: str = ""


def _changes_of(pairs: Sequence[_NextRelease], request: Request) -> _Changes:
    what = request.what[0]
    model = request.model if request.model else request.scenario().model
    changed = [pair for pair in pairs if pair.comparison.outcome in ("differs", "ended")]
    still = [pair for pair in pairs if pair.comparison.outcome == "nothing moved"]
    if not changed and still:
        return _Changes([], still=False, nothing=nothing_moved(still[0].comparison.motion))
    if not changed:
        return _Changes([], same=True)
    why: list[Block] = []
    for pair in changed:
        sides = [f"{model}@{backend}" for backend in pair.backends]
        why.append(Code([command(["statemachine", "compare", what, *sides, "--why"])]))
    releases = [f"MuJoCo {pair.release} and {pair.next}" for pair in changed]
    return _Changes(why, differs=False, pairs=listed(releases))
