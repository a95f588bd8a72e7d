"""Shares of a gap that do not depend on an order: Shapley values.

The share of a cause is the mean, over all orders in which causes can be equalized, of what it
takes away when its turn comes (L. S. Shapley, 1953). Where a cause needs another, only those orders
count in which it comes later (U. Faigle and W. Kern, 1992). Where causes add up the share is what
each takes away alone. Else it is computed over all sets of causes, or estimated from drawn orders,
in pairs, with the standard error of the mean. The shares add up to what all causes take away
together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from ...interface import Array

Method = Literal["nothing", "one at a time", "all sets", "drawn orders"]
Subset = frozenset[str]
Needs = Mapping[str, str]  # of a cause the one that has to be equalized before it

ADDS_UP = 0.01  # of the gap: causes that interact by less add up
_DUMMY = 1e-7  # of the gap: a cause that takes away less, first and last, takes away nothing
_PRECISE = 0.01  # of the gap: a standard error that is small enough
_FEWEST, _FAILURES = 4, 10  # pairs of orders before their spread is believed; that could not be run


class _Game:
    """The gap with sets of causes equalized, as parts of the first gap.

    What cannot be run, or cannot be, is NaN.
    """

    def __init__(
        self,
        value: Callable[[Subset], float | None],
        gap: float,
        ahead: Callable[[Iterable[Subset]], None],
        needs: Needs,
    ) -> None:
        self._value, self._gap, self._ahead, self.needs = value, gap, ahead, needs
        self.parts: dict[Subset, float] = {frozenset(): 1.0}

    def __call__(self, equalized: Subset) -> float:
        if equalized not in self.parts:
            gap = self._value(equalized)
            self.parts[equalized] = math.nan if gap is None else gap / self._gap
        return self.parts[equalized]

    def can_be(self, equalized: Subset) -> bool:
        """Tell whether all that the causes of a set need is in it."""
        return all(self.needs[c] in equalized for c in equalized if c in self.needs)

    def expect(self, wanted: Iterable[Subset]) -> None:
        """Say which sets are evaluated next."""
        possible = dict.fromkeys(subset for subset in wanted if self.can_be(subset))
        self._ahead(subset for subset in possible if subset not in self.parts)

    def impossible(self) -> tuple[tuple[str, ...], ...]:
        """Return the sets that could not be run, sorted."""
        failed = [tuple(sorted(subset)) for subset, part in self.parts.items() if math.isnan(part)]
        return tuple(sorted(failed))

    def takes(self, cause: str, before: Subset) -> float:
        """Return what a cause takes away after others."""
        if not self.can_be(before) or not self.can_be(before | {cause}):
            return math.nan
        return self(before) - self(before | {cause})


@dataclass(frozen=True)
class Division:
    """A gap that was divided among its causes.

    Attributes:
        method: How the parts of the gap were computed.
        share: The Shapley value of each cause, as a part of the gap; None where it is not known.
        error: Its standard error, 0 where it is not an estimate.
        alone: What each takes away if it is the only one; None where that cannot be, or be run.
        last: What each takes away if it comes after all others; None as for `alone`.
        orders: How many orders were drawn.
        impossible: Sets of causes that could not be run, sorted.
    """

    method: Method
    share: dict[str, float | None]
    error: dict[str, float]
    alone: dict[str, float | None]
    last: dict[str, float | None]
    orders: int
    impossible: tuple[tuple[str, ...], ...]


def shapley(
    causes: Sequence[str],
    value: Callable[[Subset], float | None],
    gap: float,
    *,
    budget: int = 200,
    seed: int = 0,
    ahead: Callable[[Iterable[Subset]], None] = lambda _sets: None,
    needs: Needs = MappingProxyType({}),
) -> Division:
    """Divide a gap among its causes.

    Args:
        causes: Their names.
        value: The gap with a set of them equalized; None where that cannot be run.
        gap: That of the empty set, above zero.
        budget: How many sets may be evaluated: all of them where there are no more, else as far as
            orders are drawn.
        seed: Of the orders.
        ahead: Told which sets are evaluated next, where that is known of several.
        needs: Of a cause the one that has to be equalized before it.
    """
    game, everything = _Game(value, gap, ahead, needs), frozenset(causes)
    if causes:
        ones = [frozenset({cause}) for cause in causes]
        game.expect([*ones, *(everything - one for one in ones), everything])
    alone = {cause: game.takes(cause, frozenset()) for cause in causes}
    last = {cause: game.takes(cause, everything - {cause}) for cause in causes}
    share, error = dict.fromkeys(causes, 0.0), dict.fromkeys(causes, 0.0)
    active = _active(game, causes, alone, last)
    method: Method = "nothing"
    orders = 0
    if active:
        sets = _all_sets(game, active, budget)
        whole = 1.0 - game(everything)
        if _adds_up(whole, [alone[c] for c in active], [last[c] for c in active]):
            method = "one at a time"
            means = {c: (alone[c] + last[c]) / 2 for c in active}
            share |= _scaled(means, 1.0 - game(frozenset(active)))
        elif sets:
            method = "all sets"
            game.expect(sets)
            share |= _exact(game, active, sets)
        else:
            method = "drawn orders"
            drawn = _drawn(game, active, budget, np.random.default_rng(seed))
            orders = 2 * len(drawn)
            share |= _means(drawn, active)
            error |= dict(zip(active, _errors(drawn).tolist(), strict=True))
    return Division(
        method=method,
        share=_known(share),
        error=error,
        alone=_known(alone),
        last=_known(last),
        orders=orders,
        impossible=game.impossible(),
    )


def _active(
    game: _Game, causes: Sequence[str], alone: Mapping[str, float], last: Mapping[str, float]
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
    whole = game(frozenset(causes))
    if not (math.isnan(whole) or abs(game(frozenset(active)) - whole) <= _DUMMY):
        return list(causes)
    return active


def _means(drawn: Array, active: Sequence[str]) -> dict[str, float]:
    """Return the mean of what each cause takes away (pairs, causes); NaN if nothing was drawn."""
    if not len(drawn):
        return dict.fromkeys(active, math.nan)
    return {cause: float(drawn[:, k].mean()) for k, cause in enumerate(active)}


def _known(parts: Mapping[str, float]) -> dict[str, float | None]:
    """Return parts by cause, None where one is not known."""
    return {cause: None if math.isnan(part) else part for cause, part in parts.items()}


def _adds_up(whole: float, alone: Sequence[float], last: Sequence[float]) -> bool:
    """Tell whether causes take away as much first as last.

    Together they have to take away as much as all of them do.
    """
    apart = (abs(first - then) <= ADDS_UP for first, then in zip(alone, last, strict=True))
    return abs(sum(alone) - whole) <= ADDS_UP and all(apart) and any(alone)


def _scaled(shares: dict[str, float], whole: float) -> dict[str, float]:
    """Return shares that nearly add up, with what they lack spread over them by their size."""
    lacking = whole - sum(shares.values())
    size = sum(abs(share) for share in shares.values())
    return {c: share + lacking * (abs(share) / size) for c, share in shares.items()}


def _all_sets(game: _Game, active: Sequence[str], budget: int) -> list[Subset]:
    """Return all sets that can be, the smaller ones first.

    There are none where there would be more than the budget. They are in one order everywhere, else
    the last bits of their sums would be chance.
    """
    sets: dict[Subset, None] = {frozenset(): None}
    smaller = list(sets)
    while smaller and len(sets) <= budget:
        larger = (s | {cause} for s in smaller for cause in active if cause not in s)
        smaller = list(dict.fromkeys(subset for subset in larger if game.can_be(subset)))
        sets |= dict.fromkeys(smaller)
    return list(sets) if len(sets) <= budget else []


def _exact(game: _Game, active: Sequence[str], sets: Sequence[Subset]) -> dict[str, float]:
    """Return the shares over all orders.

    The weight of a set is the number of orders that lead to it, and from it to all causes.
    """
    begins: dict[Subset, int] = {frozenset(): 1}
    ends: dict[Subset, int] = {frozenset(active): 1}
    for s in sets[1:]:
        begins[s] = sum(begins.get(s - {c}, 0) for c in s)
    for s in reversed(sets[:-1]):
        ends[s] = sum(ends.get(s | {c}, 0) for c in active if c not in s)
    shares = dict.fromkeys(active, 0.0)
    for before in sets[:-1]:
        for cause in active:
            after = before | {cause}
            if cause not in before and after in ends:
                weight = begins[before] * ends[after] / ends[frozenset()]
                shares[cause] += weight * game.takes(cause, before)
    return shares


def _drawn(game: _Game, active: Sequence[str], budget: int, random: np.random.Generator) -> Array:
    """Return what each cause takes away (pairs, causes), the means over pairs of orders.

    Pairs are drawn until they are precise enough. The second order of a pair is the reverse of
    the first, unless a cause needs another.
    """
    pairs: list[list[float]] = []
    start, failed = len(game.parts), 0
    while failed < _FAILURES:
        order = _order(game, active, random)
        other = _order(game, active, random) if game.needs else order[::-1]
        orders = order, other
        game.expect(
            frozenset(sequence[:n]) for sequence in orders for n in range(len(sequence) + 1)
        )
        left, right = (_along(game, sequence) for sequence in orders)
        pair = [(left[cause] + right[cause]) / 2 for cause in active]
        if math.isnan(sum(pair)):
            failed += 1
        else:
            pairs.append(pair)
        precise = len(pairs) >= _FEWEST and _errors(np.array(pairs)).max() <= _PRECISE
        if precise or len(game.parts) - start >= budget:
            break
    return np.array(pairs, dtype=np.float64).reshape(-1, len(active))


def _errors(pairs: Array) -> Array:
    """Return the standard error of the mean of each column (pairs, causes)."""
    if len(pairs) < 2:
        return np.full(pairs.shape[1], math.inf)
    return np.std(pairs, axis=0, ddof=1) / math.sqrt(len(pairs))


def _order(game: _Game, active: Sequence[str], random: np.random.Generator) -> list[str]:
    """Draw an order in which every cause comes after what it needs.

    Each such order is as likely as the others.
    """
    while True:
        order = [active[int(k)] for k in random.permutation(len(active))]
        place = {cause: k for k, cause in enumerate(order)}
        if all(place[game.needs[c]] < place[c] for c in order if c in game.needs):
            return order


def _along(game: _Game, order: Sequence[str]) -> dict[str, float]:
    """Return what each takes away in an order; NaN from where a set cannot be run."""
    parts = dict.fromkeys(order, math.nan)
    for k, cause in enumerate(order):
        parts[cause] = game.takes(cause, frozenset(order[:k]))
        if math.isnan(parts[cause]):
            break
    return parts
