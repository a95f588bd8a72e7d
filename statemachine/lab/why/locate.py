"""Where what no cause explains comes from: something is left out on both sides.

That makes another motion, whose gap may be smaller for that reason alone, so that it counts only
where it takes away more than half of what was left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

from .gap import Measure, size_of
from .settings import FEATURES, Feature
from .trials import Trials

_NOTHING = 1e-6  # of the gap: what is less is left alone
_LEAST, _LEAST_SET = 0.5, 0.05  # of what was left: less does not count; of a setting
_STILL = 0.1  # of the left's own motion: less is no motion any more


@dataclass(frozen=True)
class Localisation:
    """A part of a gap that goes when something is left out on both sides, or chosen.

    Attributes:
        name: What was left out, or "integrator".
        without: What a run without it is, in words; of an integrator, the one that was chosen.
        values: The integrators of the two sides as they come; None of what was left out.
        share: The part of the gap that went.
        alone: Of an integrator, the part that goes as the sides come; None if that could not be
            run, and of what was left out.
        gap: What was left of the gap, in its unit.
        is_still: Whether nothing moves any more, so that there can be no gap.
        side: Of a setting of one side, chosen while nothing was left out, that side: "left" or
            "right"; "" of the others.
    """

    name: str
    without: str
    values: tuple[str, str] | None
    share: float
    alone: float | None
    gap: float
    is_still: bool
    side: Literal["left", "right", ""] = field(default="", metadata={"json": False})


@dataclass(frozen=True)
class Remainder:
    """What is left of a gap with the causes equalized.

    Attributes:
        trials: The runs.
        equalized: The causes that are equalized.
        quantity: What the gap is measured in.
        measure: Which figure of it.
        gap: As the sides come, above zero, in the unit of the quantity.
        left: With the causes equalized.
        bound: What rounding and chaos make of it: no more is looked for.
    """

    trials: Trials
    equalized: frozenset[str]
    quantity: str
    measure: Measure
    gap: float
    left: float
    bound: float

    def size(
        self, equalized: frozenset[str], without: frozenset[str], integrator: str
    ) -> float | None:
        """Return the gap without some features; None if that could not be run."""
        gaps = self.trials.gaps(equalized, without, integrator)
        return size_of(gaps[self.quantity], self.measure) if gaps else None

    def is_still(self, without: frozenset[str]) -> bool:
        """Tell whether hardly anything moves on the left without some features."""
        moved = self.trials.extent(self.quantity, without)
        return moved < _STILL * self.trials.extent(self.quantity)


def locate(remainder: Remainder) -> Iterator[Localisation]:
    """Leave features out on both sides, each on top of those that count.

    The integrator comes first, of the sides that have several, and is tried again once something is
    left out: what differs by it may be hidden by what was left. Where only one side has several it
    is a setting, which need not take away half if nothing else does either.

    Yields:
        The parts of the gap, as they are found.
    """
    is_found = False
    for part in _located(remainder, _LEAST):
        is_found = True
        yield part
    if not is_found:
        yield from _located(remainder, _LEAST_SET)


def _located(remainder: Remainder, least: float) -> Iterator[Localisation]:
    """Leave features out, and yield the parts of the gap that go.

    Args:
        remainder: What is left of the gap.
        least: What a setting of one side has to take away of what was left.
    """
    trials = remainder.trials
    without, integrator = frozenset[str](), ""
    left, enough = remainder.left, max(_NOTHING * remainder.gap, remainder.bound)
    for feature in _choices(trials):
        if left <= enough:
            break
        more = without | {feature.name} if feature else without
        integrators = [integrator] if feature or integrator else trials.setup.integrators
        rest, best = _best(remainder, more, integrators, left, enough)
        is_setting = len(trials.setup.selects) == 1 and not more
        if left - rest <= (least if is_setting else _LEAST) * left:
            continue
        without, integrator = more, best
        share = (left - rest) / remainder.gap
        if feature is None:
            yield _by_integrator(remainder, best, without, share, rest, is_setting)
        else:
            still = remainder.is_still(without)
            yield Localisation(feature.name, feature.without, None, share, None, rest, still)
        left = rest


def _choices(trials: Trials) -> list[Feature | None]:
    """Return what is tried in turn: a feature is left out, or an integrator is chosen (None)."""
    choices: list[Feature | None] = [None]
    for feature in FEATURES:
        if trials.setup.can_be_without(feature):
            choices += [feature, None]
    return choices


def _best(
    remainder: Remainder,
    without: frozenset[str],
    integrators: Sequence[str],
    left: float,
    enough: float,
) -> tuple[float, str]:
    """Return the smallest gap that an integrator leaves, and the integrator.

    Of those that leave nothing none is better: the first by name is taken.
    """
    rests: list[tuple[float, str]] = []
    for integrator in integrators:
        rest = remainder.size(remainder.equalized, without, integrator)
        if rest is not None:
            rests.append((rest, integrator))
    return min(rests, key=lambda pair: (max(pair[0], enough), pair[1]), default=(left, ""))


def _by_integrator(
    remainder: Remainder,
    integrator: str,
    without: frozenset[str],
    share: float,
    gap: float,
    is_setting: bool,
) -> Localisation:
    """Return the part of a gap that goes when both sides run with one integrator."""
    setup = remainder.trials.setup
    gap_alone = remainder.size(frozenset(), frozenset(), integrator)
    side: Literal["left", "right", ""] = ""
    if is_setting:
        side = "right" if setup.selects[0] else "left"
    return Localisation(
        name="integrator",
        without=integrator,
        values=(setup.integrator_of(0), setup.integrator_of(1)),
        share=share,
        alone=None if gap_alone is None else 1.0 - gap_alone / remainder.gap,
        gap=gap,
        is_still=remainder.is_still(without),
        side=side,
    )
