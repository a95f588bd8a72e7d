"""The differences, and how much of the gap each explains, as blocks of a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ...measures import Deviation
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..compare.chaos import CLEAR
from .answer_page import amount, refused
from .explanation import Explanation, FailedSet, Share
from .locate import Localisation
from .shares import ADDS_UP
from .table_page import equalizable_shares, is_beyond, is_noisy, tables, without_effect

_SINGULAR = {"joints": "worst joint", "slides": "worst slide", "ball joints": "worst ball joint"}


@dataclass(frozen=True)
class OtherGap:
    """The gap in a quantity that is not explained.

    Attributes:
        name: Of the quantity.
        gap: How far apart the sides are in it.
    """

    name: str
    gap: Deviation


@dataclass(frozen=True)
class CausesPart(PageContent):
    """How far apart the sides are, and how much of it each difference explains.

    Attributes:
        result: The explanation.
        tables: The differences.
        located: What is said of what was left out.
    """

    template = "why_causes.md.j2"
    result: Explanation
    tables: Sequence[Block]
    located: Sequence[Block]

    @property
    def what(self) -> str:
        """Return a phrase that names what is apart."""
        return what_is_apart(self.result)

    @property
    def gap(self) -> Deviation:
        """Return the gap of the quantity that is explained; of one joint if it is of joints."""
        return shown_gap(self.result)

    @property
    def elsewhere(self) -> tuple[OtherGap, ...]:
        """Return the gaps in the other quantities."""
        result = self.result
        return tuple(
            OtherGap(name.replace(",", ""), gap)
            for name, gap in result.first.items()
            if name != result.quantity
        )

    @property
    def is_negligible(self) -> bool:
        """Tell whether the gap is taken for rounding."""
        return self.result.gap <= self.result.negligible

    @property
    def is_chance(self) -> bool:
        """Tell whether the gap may be chance."""
        return not (self.is_negligible or self.result.verdict.divides)

    @property
    def floor(self) -> str:
        """Return the chaos floor, with its unit."""
        return amount(self.result, self.result.floor)

    @property
    def floor_part(self) -> float:
        """Return the chaos floor as a part of the gap; 0 where that was not divided."""
        result = self.result
        return result.floor / result.gap if result.verdict.divides else 0.0

    @property
    def has_floor(self) -> bool:
        """Tell whether a chaos floor limits the parts of the gap."""
        return self.result.verdict.divides and self.result.floor > 0

    @property
    def is_noisy(self) -> bool:
        """Tell whether parts of the gap may be chance."""
        return is_noisy(self.result)

    @property
    def clear(self) -> float:
        """Return how many times its chaos floor a gap must be to be more than chance."""
        return CLEAR

    @property
    def nothing_differs(self) -> bool:
        """Tell whether nothing differs that is compared."""
        return nothing_differs(self.result)

    @property
    def without_effect(self) -> tuple[str, ...]:
        """Return the names of the differences without an effect."""
        return tuple(
            row.name for row in without_effect(self.result, equalizable_shares(self.result))
        )

    @property
    def adds_up(self) -> float:
        """Return the part of the gap to within which the parts add up."""
        return ADDS_UP

    @property
    def is_beyond(self) -> bool:
        """Tell whether a cause takes away more than all of the gap."""
        return any(is_beyond(row) for row in equalizable_shares(self.result))

    @property
    def refused(self) -> tuple[Share, ...]:
        """Return the causes that cannot be equalized."""
        return tuple(refused(self.result))

    @property
    def first_impossible(self) -> FailedSet | None:
        """Return the smallest set of causes that could not be run; None where all could."""
        return self.result.impossible[0] if self.result.impossible else None


@dataclass(frozen=True)
class LocationNote(PageContent):
    """What is said of one part of the gap that was localised.

    Attributes:
        kind: Which sentence it is.
        place: The part.
        quantity: What the gap is measured in.
        before: What was left out before.
    """

    template = "why_located.md.j2"
    kind: Literal["feature", "still", "integrator", "later integrator"]
    place: Localisation
    quantity: str
    before: tuple[str, ...]


def what_is_apart(result: Explanation) -> str:
    """Return what is up to so far apart, in words."""
    return _SINGULAR.get(result.quantity, f"quantity {result.quantity}")


def shown_gap(result: Explanation) -> Deviation:
    """Return how far the sides are apart as they come: the joint that is farthest, if any is."""
    return result.first[result.quantity] if result.joint_gap is None else result.joint_gap


def nothing_differs(result: Explanation) -> bool:
    """Tell whether nothing differs that is compared."""
    return not (result.shares or result.found_in or result.unread)


def causes(result: Explanation) -> list[Block]:
    """Say how far apart the sides are, and how much of it each difference explains."""
    return render_blocks(CausesPart(result, tables(result), _located(result)))


def _located(result: Explanation) -> list[Block]:
    """Say what was left out on both sides, or which integrator both were given."""
    blocks: list[Block] = []
    for number, place in enumerate(result.found_in):
        before = tuple(row.name for row in result.found_in[:number])
        blocks += render_blocks(
            LocationNote(_kind_of(place, before), place, result.quantity, before)
        )
    return blocks


def _kind_of(
    place: Localisation, before: tuple[str, ...]
) -> Literal["feature", "still", "integrator", "later integrator"]:
    """Return which sentence tells a part that was localised."""
    if place.values:
        return "later integrator" if before else "integrator"
    return "still" if place.is_still else "feature"
