"""The arithmetic of shares: which causes count, whether they add up, and means over orders."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...interface import Array
from .game import Game, Subset

Order = Sequence[str]
Range = tuple[float, float]  # the least and the largest value, as parts of the gap

ADDS_UP = 0.01  # of the gap: causes that interact by less add up
_DUMMY = 1e-7  # of the gap: a cause that takes away less, first and last, takes away nothing
_SURE = 2.0  # standard errors to either side: the range of an estimate


def active_causes(
    game: Game, causes: Sequence[str], alone: Mapping[str, float], last: Mapping[str, float]
) -> list[str]:
    """Return the causes that may take something away.

    Left out are those that take away nothing, first and last. Where what is not known, NaN, may
    take something, it stays. Where those that are left out do something together, all stay.
    """
    active = [
        cause
        for cause in causes
        if cause in game.needs.values()
        or not (abs(alone[cause]) <= _DUMMY and abs(last[cause]) <= _DUMMY)
    ]
    total = game(frozenset(causes))
    if not (math.isnan(total) or abs(game(frozenset(active)) - total) <= _DUMMY):
        return list(causes)
    return active


def none_for_nan(parts: Mapping[str, float]) -> dict[str, float | None]:
    """Return parts by cause, None where one is not known."""
    return {cause: None if math.isnan(part) else part for cause, part in parts.items()}


def adds_up(total: float, alone: Sequence[float], last: Sequence[float]) -> bool:
    """Tell whether causes take away as much first as last.

    Together they have to take away as much as all of them do.
    """
    are_additive = (abs(first - then) <= ADDS_UP for first, then in zip(alone, last, strict=True))
    return abs(sum(alone) - total) <= ADDS_UP and all(are_additive) and any(alone)


def scaled(shares: dict[str, float], total: float) -> dict[str, float]:
    """Return shares that nearly add up, with what they lack spread over them by their size."""
    missing = total - sum(shares.values())
    size = sum(abs(share) for share in shares.values())
    return {c: share + missing * (abs(share) / size) for c, share in shares.items()}


def all_sets(game: Game, active: Sequence[str], most: int) -> list[Subset]:
    """Return all sets that can be, the smaller ones first; none where there are more than `most`.

    They are in one order everywhere, else the last bits of their sums would be chance.
    """
    sets: dict[Subset, None] = {frozenset(): None}
    smaller = list(sets)
    while smaller and len(sets) <= most:
        larger = (s | {cause} for s in smaller for cause in active if cause not in s)
        smaller = list(dict.fromkeys(subset for subset in larger if game.can_be(subset)))
        sets |= dict.fromkeys(smaller)
    return list(sets) if len(sets) <= most else []


def exact_shares(game: Game, active: Sequence[str], sets: Sequence[Subset]) -> dict[str, float]:
    """Return the shares over all orders that can be run; NaN where there is none.

    The weight of a set is the number of orders that lead to it, and from it to all causes, and
    come by no set that could not be run.

    Args:
        game: In which all the sets were evaluated.
        active: The causes.
        sets: All sets of them that can be, the smaller ones first.
    """
    begins: dict[Subset, int] = {frozenset(): 1}
    ends: dict[Subset, int] = {}
    for s in sets[1:]:
        if not game.failed(s):
            begins[s] = sum(begins.get(s - {c}, 0) for c in s)
    if not game.failed(sets[-1]):
        ends[sets[-1]] = 1
    for s in reversed(sets[:-1]):
        if not game.failed(s):
            ends[s] = sum(ends.get(s | {c}, 0) for c in active if c not in s)
    orders = ends[frozenset()]
    if not orders:
        return dict.fromkeys(active, math.nan)
    shares = dict.fromkeys(active, 0.0)
    for before in sets[:-1]:
        for cause in active:
            after = before | {cause}
            if cause not in before and before in begins and after in ends:
                weight = begins[before] * ends[after] / orders
                shares[cause] += weight * game.effect(cause, before)
    return shares


def sets_of(pair: tuple[Order, Order]) -> list[Subset]:
    """Return the sets that two orders come by, from none to all of their causes."""
    sets: list[Subset] = []
    for order in pair:
        sets += [frozenset(order[:number]) for number in range(len(order) + 1)]
    return sets


def pair_mean(game: Game, active: Sequence[str], pair: tuple[Order, Order]) -> list[float]:
    """Return what each cause takes away in two orders, in the mean; NaN where a set has no value.

    Args:
        game: In which sets were evaluated; none is for this.
        active: The causes.
        pair: Two orders of them.
    """
    sums = dict.fromkeys(active, 0.0)
    for order in pair:
        for number, cause in enumerate(order):
            sums[cause] += game.evaluated_effect(cause, frozenset(order[:number]))
    return [sums[cause] / 2 for cause in active]


def range_of(share: float, error: float, effects: Iterable[float]) -> Range | None:
    """Return between what a share lies; None where nothing is known of it.

    Args:
        share: The share; NaN where it is not known.
        error: Its standard error; 0 where it is no estimate.
        effects: What the cause takes away in some orders; NaN where that is not known.
    """
    if not math.isnan(share) and math.isfinite(error):
        return share - _SURE * error, share + _SURE * error
    values = [value for value in (share, *effects) if not math.isnan(value)]
    return (min(values), max(values)) if values else None


def standard_errors(pairs: Array) -> Array:
    """Return the standard error of the mean of each column (pairs, causes)."""
    if len(pairs) < 2:
        return np.full(pairs.shape[1], math.inf)
    return np.std(pairs, axis=0, ddof=1) / math.sqrt(len(pairs))
