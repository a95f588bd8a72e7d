"""Shares of a gap that do not depend on an order: Shapley values.

The share of a cause is the mean, over all orders in which causes can be brought to the same, of
what it takes away when its turn comes (L. S. Shapley, 1953). Where a cause needs another, only
those orders count in which it comes later (U. Faigle and W. Kern, 1992). Where causes add up the
share is what each takes away alone. Else it is computed over all sets of causes, or estimated from
drawn orders, in pairs, with the standard error of the mean. The shares add up to what all causes
take away together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

Method = Literal["nothing", "one at a time", "all sets", "drawn orders"]
Subset = frozenset[str]
Needs = Mapping[str, str]  # of a cause the one that has to be brought to the same before it

ADDS_UP = 0.01  # of the gap: causes that interact by less add up
_DUMMY = 1e-7  # of the gap: a cause that takes away less, first and last, takes away nothing
_PRECISE = 0.01  # of the gap: a standard error that is small enough
_FEWEST, _FAILURES = 4, 10  # pairs of orders before their spread is believed; that could not be run


@dataclass(frozen=True)
class Shares:
    """How a gap is divided among its causes, each as a part of the gap.

    Attributes:
        method: How they were computed.
        share: By cause; error: its standard error, 0 where it is no estimate.
        alone: What it takes away if it is the only one, None where that cannot be, or be run.
        last: What it takes away if it comes after all others, None as for `alone`.
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


class _Game:
    """The gap with sets of causes brought to the same, as parts of the first gap."""

    def __init__(
        self,
        value: Callable[[Subset], float | None],
        gap: float,
        ahead: Callable[[Iterable[Subset]], None],
        needs: Needs,
    ) -> None:
        self._value, self._gap, self._ahead, self.needs = value, gap, ahead, needs
        self._parts: dict[Subset, float | None] = {frozenset(): 1.0}

    def __call__(self, brought: Subset) -> float | None:
        if brought not in self._parts:
            gap = self._value(brought)
            self._parts[brought] = None if gap is None else gap / self._gap
        return self._parts[brought]

    def can_be(self, brought: Subset) -> bool:
        """Whether all that the causes of a set need is in it."""
        return all(self.needs[c] in brought for c in brought if c in self.needs)

    @property
    def evaluated(self) -> int:
        """How many sets were run."""
        return len(self._parts)

    def expect(self, wanted: Iterable[Subset]) -> None:
        """Say which sets are evaluated next."""
        sets = dict.fromkeys(filter(self.can_be, wanted))
        self._ahead(brought for brought in sets if brought not in self._parts)

    def takes(self, cause: str, before: Subset) -> float | None:
        """What a cause takes away after others; None where it cannot come there, or be run."""
        if not self.can_be(before) or not self.can_be(before | {cause}):
            return None
        first, then = self(before), self(before | {cause})
        return None if first is None or then is None else first - then

    @property
    def impossible(self) -> tuple[tuple[str, ...], ...]:
        return tuple(sorted(tuple(sorted(s)) for s, part in self._parts.items() if part is None))


def shapley(
    causes: Sequence[str],
    value: Callable[[Subset], float | None],
    gap: float,
    *,
    budget: int = 200,
    seed: int = 0,
    ahead: Callable[[Iterable[Subset]], None] = lambda _sets: None,
    needs: Needs = MappingProxyType({}),
) -> Shares:
    """Divide a gap among its causes.

    Args:
        causes: Their names.
        value: The gap with a set of them brought to the same; None where that cannot be run.
        gap: That of the empty set, above zero.
        budget: How many sets may be evaluated: all of them where there are no more, else as far as
            orders are drawn.
        seed: Of the orders.
        ahead: Told which sets are evaluated next, where that is known of several.
        needs: Of a cause the one that has to be brought to the same before it.
    """
    game, everything = _Game(value, gap, ahead, needs), frozenset(causes)
    if causes:
        ones = [frozenset({cause}) for cause in causes]
        game.expect([*ones, *(everything - one for one in ones), everything])
    alone = {cause: game.takes(cause, frozenset()) for cause in causes}
    last = {cause: game.takes(cause, everything - {cause}) for cause in causes}
    share: dict[str, float | None] = dict.fromkeys(causes, 0.0)
    error = dict.fromkeys(causes, 0.0)
    needed = set(needs.values())
    active = [c for c in causes if c in needed or not _is_dummy(alone[c]) or not _is_dummy(last[c])]
    if not _takes_all(game, active, everything):
        active = list(causes)  # some do nothing alone and nothing last, but something together
    method: Method = "nothing"
    orders = 0
    if active and _adds_up(game, active, alone, last, everything):
        method = "one at a time"
        share |= _scaled({c: (_number(alone[c]) + _number(last[c])) / 2 for c in active}, game)
    elif active and (levels := _levels(game, active, budget)):
        method = "all sets"
        game.expect(subset for level in levels for subset in level)
        share |= _exact(game, active, levels)
    elif active:
        method = "drawn orders"
        drawn = _drawn(game, active, budget, np.random.default_rng(seed))
        orders = 2 * len(drawn[active[0]])
        for c in active:
            means = drawn[c]
            share[c] = float(np.mean(means)) if means else None
            enough = len(means) > 1
            error[c] = float(np.std(means, ddof=1) / math.sqrt(len(means))) if enough else math.inf
    return Shares(method, share, error, alone, last, orders, game.impossible)


def _number(value: float | None) -> float:
    assert value is not None  # `_adds_up` has seen to it
    return value


def _is_dummy(part: float | None) -> bool:
    return part is not None and abs(part) <= _DUMMY


def _takes_all(game: _Game, active: Sequence[str], everything: Subset) -> bool:
    """Whether some causes take away what all of them do."""
    part, whole = game(frozenset(active)), game(everything)
    return whole is None or (part is not None and abs(part - whole) <= _DUMMY)


def _scaled(shares: dict[str, float], game: _Game) -> dict[str, float | None]:
    """Shares that nearly add up, with what they lack spread over them by their size."""
    whole = 1.0 - _number(game(frozenset(shares)))
    lacking, size = whole - sum(shares.values()), sum(map(abs, shares.values()))
    return {c: share + lacking * (abs(share) / size) for c, share in shares.items()}


def _adds_up(
    game: _Game,
    active: Sequence[str],
    alone: dict[str, float | None],
    last: dict[str, float | None],
    everything: Subset,
) -> bool:
    whole = game(everything)
    if whole is None or any(alone[c] is None or last[c] is None for c in active):
        return False
    together = abs(sum(_number(alone[c]) for c in active) - (1.0 - whole))
    apart = max(abs(_number(alone[c]) - _number(last[c])) for c in active)
    nothing = not any(_number(alone[c]) for c in active)
    return together <= ADDS_UP and apart <= ADDS_UP and not nothing


def _levels(game: _Game, active: Sequence[str], budget: int) -> list[list[Subset]]:
    """All sets that can be, by size; none of them where there are more than the budget.

    They are in one order everywhere, else the last bits of their sums would be chance.
    """
    levels: list[list[Subset]] = [[frozenset()]]
    count = 1
    for _ in active:
        smaller = levels[-1]
        larger = dict.fromkeys(s | {cause} for s in smaller for cause in active if cause not in s)
        levels.append([subset for subset in larger if game.can_be(subset)])
        count += len(levels[-1])
        if count > budget:
            return []
    return levels


def _exact(
    game: _Game, active: Sequence[str], levels: Sequence[Sequence[Subset]]
) -> dict[str, float | None]:
    """Over all orders, by the number of orders that lead to a set and from it to all causes."""
    begins: dict[Subset, int] = {frozenset(): 1}
    ends: dict[Subset, int] = {frozenset(active): 1}
    for level in levels[1:]:
        begins |= {s: sum(begins.get(s - {c}, 0) for c in s) for s in level}
    for level in reversed(levels[:-1]):
        ends |= {s: sum(ends.get(s | {c}, 0) for c in active if c not in s) for s in level}
    shares = dict.fromkeys(active, 0.0)
    unknown = set[str]()
    for before in (subset for level in levels[:-1] for subset in level):
        for cause in active:
            after = before | {cause}
            if cause in before or after not in ends:
                continue
            takes = game.takes(cause, before)
            if takes is None:
                unknown.add(cause)
            else:
                shares[cause] += begins[before] * ends[after] / ends[frozenset()] * takes
    return {cause: None if cause in unknown else share for cause, share in shares.items()}


def _drawn(
    game: _Game, active: Sequence[str], budget: int, random: np.random.Generator
) -> dict[str, list[float]]:
    """For each cause the means over pairs of orders, until they are precise enough.

    The second order of a pair is the reverse of the first, unless a cause needs another.
    """
    means: dict[str, list[float]] = {cause: [] for cause in active}
    start, failed = game.evaluated, 0
    while failed < _FAILURES:
        order = _order(game, active, random)
        orders = order, _order(game, active, random) if game.needs else order[::-1]
        game.expect(frozenset(each[:n]) for each in orders for n in range(len(each) + 1))
        one, two = (_along(game, each) for each in orders)
        if one is None or two is None:
            failed += 1
        else:
            for cause in active:
                means[cause].append((one[cause] + two[cause]) / 2)
        pairs = len(means[active[0]])
        if pairs >= _FEWEST:
            errors = [np.std(values, ddof=1) / math.sqrt(pairs) for values in means.values()]
            if max(errors) <= _PRECISE:
                break
        if game.evaluated - start >= budget:
            break
    return means


def _order(game: _Game, active: Sequence[str], random: np.random.Generator) -> list[str]:
    """An order in which every cause comes after what it needs, each as likely as the others."""
    while True:
        order = [active[int(k)] for k in random.permutation(len(active))]
        place = {cause: k for k, cause in enumerate(order)}
        if all(place[game.needs[c]] < place[c] for c in order if c in game.needs):
            return order


def _along(game: _Game, order: Sequence[str]) -> dict[str, float] | None:
    """What each takes away in an order; None where a set cannot be run."""
    parts, before = dict[str, float](), frozenset[str]()
    for cause in order:
        takes = game.takes(cause, before)
        if takes is None:
            return None
        parts[cause] = takes
        before |= {cause}
    return parts
