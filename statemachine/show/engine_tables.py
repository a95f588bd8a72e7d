"""Tables with a column for each engine, and how far the engines are from each other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Protocol, TypeVar

import numpy as np

from ..interface import Array
from ..measures import largest
from ..measures.text import joint_difference, milliseconds, short_time
from ..release_names import engine_of
from .blocks import Table
from .labels import TableLabels

_SAY = TableLabels(__name__, "engine_tables_labels.md.j2")
R = TypeVar("R")  # the result of a lesson on one engine
Results = Mapping[str, R]  # the results of a lesson, by backend


class Origin(Protocol):
    """What a result was computed with."""

    @property
    def backend(self) -> str:
        """Return what ran the model."""
        ...

    @property
    def versions(self) -> Mapping[str, str]:
        """Return of the package, the engine and what else counts, by name."""
        ...

    @property
    def model_file(self) -> str:
        """Return the model's file and its folder."""
        ...

    @property
    def timestep(self) -> float:
        """Return the simulated time of a step [s]."""
        ...

    @property
    def emulated(self) -> tuple[str, ...]:
        """Return the promises of the contract that the backend keeps instead of its engine."""
        ...


class HasProvenance(Protocol):
    """A result that says what it was computed with."""

    @property
    def provenance(self) -> Origin:
        """Return the model, the versions and the timestep of the run."""
        ...


def origin(results: Mapping[str, HasProvenance]) -> str:
    """Say what a page was computed with: model and engine versions."""
    first = next(iter(results.values())).provenance
    engines = ", ".join(
        f"{engine_of(name)} {result.provenance.versions[result.provenance.backend]}"
        for name, result in results.items()
    )
    return f"{first.model_file} on {engines}, {milliseconds(first.timestep)} a step"


def where(engines: Collection[str], engine: str) -> str:
    """Return the prefix "mujoco: " where several engines are shown, else nothing."""
    return f"{engine}: " if len(engines) > 1 else ""


def by_engine(
    results: Mapping[str, R], rows: Mapping[str, Callable[[R], str]], title: str = ""
) -> Table:
    """Return a table with a column for each engine.

    Args:
        results: By backend.
        rows: By what is shown, the words for it from a result.
        title: Of the table.
    """
    lines = [(row, *map(words, results.values())) for row, words in rows.items()]
    return Table(("", *results), lines, title)


def differences(results: Mapping[str, R], rows: Mapping[str, Callable[[R, R], str]]) -> list[Table]:
    """Return the last table of a page with several engines: each against the first.

    Args:
        results: By backend.
        rows: By what is compared, the words for it from the first's result and another's.

    Returns:
        One table; none of a page with a single engine.
    """
    if len(results) < 2 or not rows:
        return []
    (name, first), *others = results.items()
    lines: list[tuple[str, ...]] = []
    for row, words in rows.items():
        cells = [words(first, result) for _, result in others]
        lines.append((row, *cells))
    headers = ("", *(f"{other} against {name}" for other, _ in others))
    return [Table(headers, lines, title=_SAY("differences"))]


def largest_gap(
    left: Array, right: Array, slides: Sequence[bool], names: Sequence[str], time: Array
) -> str:
    """Say where two runs are farthest apart: by how much, in which joint, and when.

    Args:
        left: (n, k) k joints at n moments [rad; of a slide, m].
        right: The same of the other.
        slides: Which of the joints are slides.
        names: What to call them, "" where that needs not be told.
        time: (n,) of the moments [s]; (0,) where it needs not be told.
    """
    gaps = np.abs(left - right)
    if not gaps.size:
        return "nothing touched"
    size, place = largest(gaps.ravel())
    row, joint = divmod(place, gaps.shape[1])
    text = joint_difference(size, slides[joint])
    if text.startswith("below"):
        return text
    name = f"  {names[joint]}" if names[joint] else ""
    return f"{text}{name} at {short_time(time[row])}" if len(time) else f"{text}{name}"


def emulated(result: HasProvenance, *promises: str) -> str:
    """List the promises of a page that this interface keeps in place of the engine."""
    return ", ".join(promise for promise in promises if promise in result.provenance.emulated)
