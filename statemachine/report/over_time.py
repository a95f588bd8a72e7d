"""What a page shows of two runs over time, where it has a slider: the scene, and charts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..compare import Agreement, Series
from ..compare.series import NORMAL, normal_forces, total_forces
from ..interface import Array
from ..measures import same_pairs
from ..measures.text import capital, figure, on, quantity, reading, short_time
from ..page import Interactive
from ..runs import Trace
from .events import Event
from .finding import name_of


@dataclass(frozen=True, eq=False)
class QuantityChart(Interactive):
    """One quantity over time: how far apart it is, and both sides.

    Attributes:
        curve: Both sides at common moments.
        found: The figures of the comparison.
        labels: What the sides are called.
        said: What it shows, for those who do not see it.
        foot: A note under it; "" for none.
        floor: (n,) the width of its chaos floor at the moments of the curve, if that is known.
    """

    curve: Series
    found: Agreement
    labels: tuple[str, str]
    said: str
    foot: str = ""
    floor: Array | None = None

    @property
    def unit(self) -> str:
        """What it is drawn in."""
        return reading(self.curve.unit)[1].strip()


@dataclass(frozen=True, eq=False)
class BothRuns(Interactive):
    """Two runs in one picture, moment by moment.

    Attributes:
        one: The run that is drawn solid.
        two: The run that is drawn as a ghost over it.
        labels: What they are called; short: for short.
        site: The site whose way is drawn; "" for none.
        until: The last moment [s].
        start: The moment to begin at [s].
        moments: Those that must be among the ones shown [s].
        events: First touches among them are marked.
        charts: What is followed.
        lead: Of these, the ones that are spoken, by number.
    """

    one: Trace
    two: Trace
    labels: tuple[str, str]
    short: tuple[str, str]
    site: str
    until: float
    start: float
    moments: tuple[float, ...]
    events: tuple[Event, ...]
    charts: tuple[QuantityChart, ...]
    lead: tuple[int, ...]


def chart_of(
    curve: Series,
    found: Agreement,
    labels: tuple[str, str],
    foot: str = "",
    floor: Array | None = None,
) -> QuantityChart:
    """The chart of a quantity."""
    name = name_of(curve.name)
    since = "never left" if found.since is None else f"left at {short_time(found.since)}"
    said = (
        f"{name}, difference over time: at most {quantity(found.max, curve.unit)} at "
        f"{short_time(found.at)}, settled at {quantity(found.settled, curve.unit)}; tolerance "
        f"{quantity(found.tolerance, curve.unit)}, {since}."
    )
    return QuantityChart(name, curve, found, labels, said, foot, floor)


def foot_of(curve: Series, one: Trace, two: Trace, labels: tuple[str, str]) -> str:
    """Under a chart of the energy by what it was computed; of a force its other figure."""
    if curve.kind == "energy":
        by = [trace.header.energy_by or trace.header.backend for trace in (one, two)]
        masses = "from the masses, the armature and the gravity of the model"
        if by[0] == by[1]:
            return f"For both sides computed by {by[0]}, {masses}."
        return f"Computed by {by[0]} and by {by[1]}, {masses}."
    if curve.kind == "force":
        pair = curve.name.removesuffix(NORMAL)
        normal, total = (
            [_most(forces, pair) for forces in (of_one, same_pairs(of_one, kind(two)))]
            for kind in (normal_forces, total_forces)
            for of_one in (kind(one),)
        )
        each = [
            f"{capital(on(label))} it is at most {normal[k]} N; the whole force, friction added as "
            f"vectors, is at most {total[k]} N."
            for k, label in enumerate(labels)
        ]
        return f"Drawn is the sum of the normal forces. {' '.join(each)}"
    return ""


def _most(forces: Mapping[str, Array], pair: str) -> str:
    """The largest force of a pair of bodies [N]."""
    return figure(float(forces[pair].max()) if pair in forces else 0.0)
