"""Shares of a gap that do not depend on an order: Shapley values.

The share of a cause is the mean, over all orders in which causes can be brought to the same, of
what it takes away when its turn comes (L. S. Shapley, 1953). Where causes add up that is what each
takes away alone. Else it is computed over all sets of causes, or estimated from drawn orders, each
together with its reverse, with the standard error of the mean.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Method = Literal["nothing", "one at a time", "all sets", "drawn orders"]
Value = Callable[[frozenset[str]], float | None]
Ahead = Callable[[Iterable[frozenset[str]]], None]

ADDS_UP = 0.01  # of the gap: causes that interact by less add up
_DUMMY = 1e-7  # of the gap: a cause that takes away less, first and last, takes away nothing
_ALL_SETS = 5  # causes: 32 sets
_PRECISE = 0.01  # of the gap: a standard error that is small enough


@dataclass(frozen=True)
class Shares:
    """How a gap is divided among its causes, each as a part of the gap.

    Attributes:
        method: How they were computed.
        share: By cause; error: its standard error, 0 where it is no estimate.
        alone: What it takes away if it is the only one, None where that cannot be run.
        last: What it takes away if it comes after all others.
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
        self, causes: Sequence[str], value: Value, gap: float, ahead: Ahead | None
    ) -> None:
        self.causes, self._value, self._gap, self._ahead = list(causes), value, gap, ahead
        self._known: dict[frozenset[str], float | None] = {frozenset(): 1.0}
        self.evaluated = 0

    def __call__(self, brought: frozenset[str]) -> float | None:
        if brought not in self._known:
            self.evaluated += 1
            found = self._value(brought)
            self._known[brought] = None if found is None else found / self._gap
        return self._known[brought]

    def expect(self, wanted: Iterable[frozenset[str]]) -> None:
        """Say which sets are evaluated next."""
        if self._ahead is not None:
            self._ahead(brought for brought in wanted if brought not in self._known)

    def takes(self, cause: str, before: frozenset[str]) -> float | None:
        """What a cause takes away after others."""
        first, then = self(before), self(before | {cause})
        return None if first is None or then is None else first - then

    @property
    def impossible(self) -> tuple[tuple[str, ...], ...]:
        return tuple(sorted(tuple(sorted(s)) for s, v in self._known.items() if v is None))


def shapley(
    causes: Sequence[str],
    value: Value,
    gap: float,
    *,
    budget: int = 200,
    seed: int = 0,
    ahead: Ahead | None = None,
) -> Shares:
    """Divide a gap among its causes.

    Args:
        causes: Their names.
        value: The gap with a set of them brought to the same; None where that cannot be run.
        gap: That of the empty set, above zero.
        budget: How many sets may be evaluated, as far as orders are drawn.
        seed: Of the orders.
        ahead: Told which sets are evaluated next, where that is known of several.
    """
    game, everything = _Game(causes, value, gap, ahead), frozenset(causes)
    if causes:
        ones = [frozenset({cause}) for cause in causes]
        game.expect([*ones, *(everything - one for one in ones), everything])
    alone = {cause: game.takes(cause, frozenset()) for cause in causes}
    last = {cause: game.takes(cause, everything - {cause}) for cause in causes}
    share: dict[str, float | None] = dict.fromkeys(causes, 0.0)
    error = dict.fromkeys(causes, 0.0)
    active = [c for c in causes if not _is_dummy(alone[c]) or not _is_dummy(last[c])]
    method: Method = "nothing"
    orders = 0
    if active and _adds_up(game, active, alone, last, everything):
        method = "one at a time"
        share |= {c: (_known(alone[c]) + _known(last[c])) / 2 for c in active}
    elif active and len(active) <= _ALL_SETS:
        method = "all sets"
        sizes = range(len(active) + 1)
        game.expect(frozenset(s) for n in sizes for s in itertools.combinations(active, n))
        share |= {c: _exact(game, c, active) for c in active}
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


def _known(value: float | None) -> float:
    assert value is not None  # `_adds_up` has seen to it
    return value


def _is_dummy(part: float | None) -> bool:
    return part is not None and abs(part) <= _DUMMY


def _adds_up(
    game: _Game,
    active: Sequence[str],
    alone: dict[str, float | None],
    last: dict[str, float | None],
    everything: frozenset[str],
) -> bool:
    whole = game(everything)
    if whole is None or any(alone[c] is None or last[c] is None for c in active):
        return False
    together = abs(sum(_known(alone[c]) for c in active) - (1.0 - whole))
    apart = max(abs(_known(alone[c]) - _known(last[c])) for c in active)
    return together <= ADDS_UP and apart <= ADDS_UP


def _exact(game: _Game, cause: str, active: Sequence[str]) -> float | None:
    """Over all sets of the others; None where one of them cannot be run."""
    others, total = [c for c in active if c != cause], 0.0
    for size in range(len(others) + 1):
        weight = 1.0 / (len(active) * math.comb(len(others), size))
        for chosen in itertools.combinations(others, size):
            takes = game.takes(cause, frozenset(chosen))
            if takes is None:
                return None
            total += weight * takes
    return total


def _drawn(
    game: _Game, active: Sequence[str], budget: int, random: np.random.Generator
) -> dict[str, list[float]]:
    """For each cause the means over an order and its reverse, until they are precise enough."""
    found: dict[str, list[float]] = {cause: [] for cause in active}
    start, failed = game.evaluated, 0
    while failed < 10:
        order = [active[int(k)] for k in random.permutation(len(active))]
        orders = order, order[::-1]
        game.expect(frozenset(each[:n]) for each in orders for n in range(len(each) + 1))
        there, back = _along(game, order), _along(game, order[::-1])
        if there is None or back is None:
            failed += 1
        else:
            for cause in active:
                found[cause].append((there[cause] + back[cause]) / 2)
        pairs = len(found[active[0]])
        if pairs >= 4:
            errors = [np.std(means, ddof=1) / math.sqrt(pairs) for means in found.values()]
            if max(errors) <= _PRECISE:
                break
        if game.evaluated - start >= budget:
            break
    return found


def _along(game: _Game, order: Sequence[str]) -> dict[str, float] | None:
    """What each takes away in an order; None where a set cannot be run."""
    found, before = dict[str, float](), frozenset[str]()
    for cause in order:
        takes = game.takes(cause, before)
        if takes is None:
            return None
        found[cause] = takes
        before |= {cause}
    return found
