"""What an attribution found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ...measures import Deviation
from ...runs.provenance import Provenance

# Rounding, after it has grown for some seconds: less than this is no gap to be explained.
ROUNDING = {"rad": 1e-8, "m": 1e-9}
_NOTHING: Mapping[str, float] = {}
UNEXPLAINED = 0.05  # of the gap: where more stays, the answer is no


def bounds_of(units: Mapping[str, str], floors: Mapping[str, float]) -> dict[str, float]:
    """What rounding and chaos make of a run, by quantity: a gap that is no larger says nothing.

    Args:
        units: Of the quantities.
        floors: The chaos floor of each; empty where it is not known.
    """
    return {name: max(ROUNDING[unit], floors.get(name, 0.0)) for name, unit in units.items()}


def telling(
    gaps: Mapping[str, float],
    bounds: Mapping[str, float],
    preferred: str,
    tolerances: Mapping[str, float] = _NOTHING,
) -> str:
    """The quantity that a gap is explained in.

    It is the preferred one where that is beyond its tolerance, or where none is. Else it is the
    one that is farthest beyond, among those that are more than rounding and chaos make of a run.

    Args:
        gaps: By quantity.
        bounds: What rounding and chaos make, by quantity.
        preferred: The quantity that an experiment is about.
        tolerances: By quantity; none for the bounds.
    """
    beyond = {
        name: gap / tolerances.get(name, bounds[name])
        for name, gap in gaps.items()
        if gap > bounds[name]
    }
    most = max(beyond, key=beyond.__getitem__, default=preferred)
    if preferred in beyond and (beyond[preferred] > 1 or beyond[most] <= 1):
        return preferred
    return most


Way = Literal["parity", "off", "one side", "alike", "none"]


@dataclass(frozen=True)
class FactorTrial:
    """One factor brought to the same, alone or on top of others, and what became of the gap.

    Attributes:
        factor: Its name.
        way: "parity": two takes one's setting, or one two's; "off": left out on both;
            "one side": tried on one alone, since the other has nothing to set; "alike":
            the same engine with the same setting, nothing to bring; "none": it cannot be.
        had: What one and two had, in a few words.
        did: What was done, in a few words.
        gaps: The gap in each quantity after it; empty if there is none.
        worst: Of these, that of the attribution's quantity; None if there is none.
        explains: The part of the first gap that it took away: below zero if it made it wider;
            None where nothing was run, or in a rung that stands only with the next.
        moved: How far one's own motion is then from its motion as it comes [unit]; above
            zero, the gap is that of another motion.
        put_back: The gap if all is as at the end of the settings of the ladder, and this
            factor alone is as it came; None where nothing was set.
        along: The factors that went back with it, since they cannot be without it.
        note: Why there is no gap, or what else is to be said.
    """

    factor: str
    way: Way
    had: tuple[str, str]
    did: str
    gaps: dict[str, Deviation]
    worst: float | None
    explains: float | None
    moved: float | None
    put_back: float | None = None
    along: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class FirstTouch:
    """The first contact of anything, and how far apart the runs were until then.

    Attributes:
        time: Since the start [s]; 0 if something touches from the start.
        what: What touched what.
        before: The gap of the runs as they come, at the moments until then.
        moments: How many these are.
    """

    time: float
    what: str
    before: float
    moments: int


@dataclass(frozen=True)
class Detection:
    """Which contacts two engines find at the same states, those of the first one's run.

    Attributes:
        moments: From how many states.
        differing: At how many of them the pairs that touch, or how deep, are not the same.
        first: The first of these, since the start [s]; None if there is none.
        where: The pair that differs most.
        depth: By how much [m]; of a pair that one of them does not find, all of its depth.
    """

    moments: int
    differing: int
    first: float | None
    where: str
    depth: float


@dataclass(frozen=True)
class Attribution:
    """How much of the gap between two simulations each of their differences explains.

    Attributes:
        experiment, says, seconds: What was run.
        one, two: The sides; two is brought to one. names: what they are called for short.
        quantity: What the gap is measured in; unit: of it.
        first: The gap in each quantity, as they come.
        alone: Each factor by itself; empty where the gap is rounding.
        ladder: All of them, each added to those before; what is left telescopes to `left`.
        left: What stays unexplained, in `unit`.
        negligible: Gaps below this are taken for rounding, in `unit`.
        floor: The chaos floor, in `unit`: how far one is from itself, started and commanded anew
            with rounding, and with what is not known of the start.
        extent: How far one moves from where it starts, in `unit`.
        touch: The first contact; None without one.
        moments: How many moments the runs are compared at; between: whether rows had to be
            interpolated there.
        order: How the ladder was ordered, and why.
        runs: How many runs it took.
        detection: Which contacts both find at equal states; None where nothing touches, or one of
            them does not tell.
    """

    experiment: str
    says: str
    seconds: float
    one: str
    two: str
    names: tuple[str, str]
    quantity: str
    unit: str
    first: dict[str, Deviation]
    alone: tuple[FactorTrial, ...]
    ladder: tuple[FactorTrial, ...]
    left: float
    negligible: float
    floor: float
    extent: float
    touch: FirstTouch | None
    moments: int
    between: bool
    order: tuple[str, str]
    runs: int
    provenance: tuple[Provenance, Provenance]
    detection: Detection | None = None

    @property
    def gap(self) -> float:
        """The gap as they come, in `unit`."""
        return self.first[self.quantity].worst

    @property
    def settings_same(self) -> float:
        """The gap where all settings are the same and nothing is left out."""
        rungs = [trial for trial in self.ladder if trial.way in ("parity", "one side")]
        known = [trial.worst for trial in rungs if trial.worst is not None]
        return known[-1] if known else self.gap

    def last(self, trial: FactorTrial) -> float | None:
        """The part of the gap that a factor explains if it comes last of the settings."""
        if trial.put_back is None or not self.gap:
            return None
        return (trial.put_back - self.settings_same) / self.gap

    @property
    def explained(self) -> float:
        """The part of it that goes where settings are brought to the same."""
        return (self.gap - self.settings_same) / self.gap if self.gap else 0.0

    @property
    def located(self) -> float:
        """The part that goes only where something is left out on both sides."""
        return (self.settings_same - self.left) / self.gap if self.gap else 0.0

    @property
    def unexplained(self) -> float:
        """The part of it that nothing took away."""
        return self.left / self.gap if self.gap else 0.0
