"""Shares of a gap that do not depend on an order: Shapley values.

The share of a cause is the mean, over all orders in which causes can be equalized, of what it
takes away when its turn comes (L. S. Shapley, 1953). Where a cause needs another, only those orders
count in which it comes later (U. Faigle and W. Kern, 1992); so it is where a set of causes cannot
be run: only the orders count that come by no such set.

Each cause is taken first and last before anything else: that is a ranking already. Where causes
add up the share is what each takes away alone. Else it is computed over all sets of causes, or
estimated from drawn orders, in pairs, with the standard error of the mean. The shares add up to
what the causes take away together. What is known can be had at any time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from ...interface import Array
from .game import Game, Needs, Subset, runnable
from .shares import (
    Order,
    Range,
    active_causes,
    adds_up,
    all_sets,
    exact_shares,
    none_for_nan,
    pair_mean,
    range_of,
    scaled,
    sets_of,
    standard_errors,
)

Method = Literal[
    "not ranked", "alone and last", "nothing", "one at a time", "all sets", "drawn orders"
]

SETS = 200  # that are evaluated where nobody says how long it may take
_PRECISE = 0.01  # of the gap: a standard error that is small enough
_FEWEST = 4  # pairs of orders before their spread is believed
_FAILURES = 10  # pairs of orders that could not be run, before no more are drawn
_TRIES = 1000  # drawn orders that come by a set that cannot be run, before none is looked for


@dataclass(frozen=True)
class Division:
    """A gap that was divided among its causes, as far as is known.

    Attributes:
        method: How the parts of the gap were computed; "alone and last" where shares are not known
            yet, "not ranked" where not all of these are known either.
        share: The Shapley value of each cause, as a part of the gap; None where it is not known.
        error: Its standard error, 0 where it is not an estimate.
        range: Between what the share lies, as far as is known: the share itself where it is exact,
            two standard errors to either side of an estimate; before that, what was seen of it:
            alone, last, and in pairs of orders. None where nothing was.
        alone: What each takes away if it is the only one; None where that cannot be, or was not
            run.
        last: What each takes away if it comes after all others; None as for `alone`.
        orders: How many orders were drawn.
        unavailable: Causes without a share, since no set of causes with one of them could be run,
            or none with the others.
        failures: Sets of causes that could not be run, the smaller ones first.
    """

    method: Method
    share: dict[str, float | None]
    error: dict[str, float]
    range: dict[str, Range | None]
    alone: dict[str, float | None]
    last: dict[str, float | None]
    orders: int
    unavailable: tuple[str, ...]
    failures: tuple[Subset, ...]

    def is_over(self, cause: str) -> bool:
        """Tell whether no more can be known of the share of a cause."""
        return cause in self.unavailable or self.method not in ("not ranked", "alone and last")


def shapley(
    causes: Sequence[str],
    value: Callable[[Subset], float | None],
    gap: float,
    *,
    sets: int = SETS,
    seed: int = 0,
    ahead: Callable[[Iterable[Subset]], None] = lambda _sets: None,
    needs: Needs = MappingProxyType({}),
) -> Division:
    """Divide a gap among its causes.

    Args:
        causes: Their names.
        value: The gap with a set of them equalized; None where that cannot be run.
        gap: That of the empty set, above zero.
        sets: How many sets may be evaluated: all of them where there are no more, else as far as
            orders are drawn.
        seed: Of the orders.
        ahead: Told which sets are evaluated next, where that is known of several.
        needs: Of a cause the one that has to be equalized before it.
    """
    attribution = Attribution(causes, Game(value, gap, ahead, needs), seed)
    attribution.rank()
    match attribution.choose(sets):
        case "all sets":
            attribution.evaluate_all_sets()
        case "drawn orders":
            attribution.draw_first_orders()
            attribution.draw_more_orders(sets)
        case _:
            pass
    return attribution.division()


class Attribution:
    """The division of a gap among its causes, in steps that can be broken off.

    Attributes:
        causes: Their names.
        game: The gap with sets of them equalized.
        core: The causes that can be equalized together; None before they are ranked.
    """

    def __init__(self, causes: Sequence[str], game: Game, seed: int) -> None:
        """Begin with nothing known.

        Args:
            causes: Their names.
            game: The gap with sets of them equalized.
            seed: Of the orders that are drawn.
        """
        self.causes, self.game = tuple(causes), game
        self.core: Subset | None = None
        self._method: Method = "not ranked"
        self._active: list[str] = []  # of the core, those that may take something away
        self._sets: list[Subset] = []  # all sets of these, where they are evaluated
        self._exact: dict[str, float] = {}  # shares that are no estimates
        self._random = np.random.default_rng(seed)
        self._pairs: list[tuple[Order, Order]] = []
        self._failed_pairs = 0
        self._before_orders = 0  # sets that were evaluated before orders were drawn
        self._is_estimate = False  # whether enough orders were drawn

    # What is evaluated, step by step.

    def rank(self) -> None:
        """Evaluate all causes together, each alone, and all but each."""
        game, everything = self.game, frozenset(self.causes)
        game.expect(self.first_sets())
        for cause in self.causes:
            game.effect(cause, frozenset())
            game.effect(cause, everything - {cause})
        core = runnable(game, self.causes)
        game.expect(core - {cause} for cause in core)
        for cause in self.causes:
            if cause in core:
                game.effect(cause, core - {cause})
        self.core, self._method = core, "alone and last"

    def first_sets(self) -> list[Subset]:
        """Return the sets that rank the causes: all of them, each alone, and all but each."""
        if not self.causes:
            return []
        everything = frozenset(self.causes)
        singletons = [frozenset({cause}) for cause in self.causes]
        return [everything, *singletons, *(everything - one for one in singletons)]

    def choose(self, sets: int) -> Method:
        """Choose how shares are computed, and compute those that need no further set.

        Args:
            sets: How many sets may be evaluated for all of them to be.
        """
        assert self.core is not None
        core = [cause for cause in self.causes if cause in self.core]
        alone, last = self._alone(core), self._last(core, self.core)
        self._active = active_causes(self.game, core, alone, last)
        active = self._active
        self._exact = dict.fromkeys(core, 0.0)
        if not active:
            self._method = "nothing"
            return self._method
        total = 1.0 - self.game(frozenset(core))
        if adds_up(total, [alone[c] for c in active], [last[c] for c in active]):
            means = {c: (alone[c] + last[c]) / 2 for c in active}
            self._exact |= scaled(means, 1.0 - self.game(frozenset(active)))
            self._method = "one at a time"
            return self._method
        self._exact = {}
        self._sets = all_sets(self.game, active, sets)
        return "all sets" if self._sets else "drawn orders"

    def evaluate_all_sets(self) -> None:
        """Compute the shares over all orders that can be run."""
        game, active, sets = self.game, self._active, self._sets
        if not game.needs and not self._some_failed():
            # The sets of some whole orders come first: with these something is known of shares.
            orders = [self._drawn_pair() for _ in range(_FEWEST)]
            self._pairs = [pair for pair in orders if pair is not None]
        first = [subset for pair in self._pairs for subset in sets_of(pair)]
        game.expect([*first, *sets])
        for subset in sets:
            game(subset)
        self._pairs = []
        shares = dict.fromkeys(self._others(), 0.0)
        self._exact = shares | exact_shares(game, active, sets)
        self._method = "all sets"

    def count_of_all_sets(self) -> int:
        """Return how many sets are missing of all of them."""
        return sum(subset not in self.game.parts for subset in self._sets)

    def draw_first_orders(self) -> None:
        """Draw so many orders that their spread can be believed, if so many can be run."""
        self._before_orders = len(self.game.parts)
        while len(self._pairs) < _FEWEST and self._draw():
            pass
        self._method, self._is_estimate = "drawn orders", True

    def draw_more_orders(self, sets: int | None) -> None:
        """Draw orders until the shares are precise enough.

        Args:
            sets: How many sets may be evaluated for that, in all; None for as many as it takes.
        """
        while not self._is_precise():
            if sets is not None and len(self.game.parts) - self._before_orders >= sets:
                break
            if not self._draw():
                break

    def count_of_first_orders(self) -> int:
        """Return how many sets the first orders may have, at the most, that are not known yet.

        Those of one cause, and of all but one, are.
        """
        return 2 * _FEWEST * max(0, len(self._active) - 3)

    def count_of_more_orders(self, sets: int | None) -> int:
        """Estimate how many sets are missing until the shares are precise enough.

        Args:
            sets: How many may be evaluated, in all; None for as many as it takes.
        """
        pairs = len(self._pairs)
        evaluated = len(self.game.parts) - self._before_orders
        if not pairs or self._is_precise():
            return 0
        # A standard error goes with the root of the number of pairs.
        needed = evaluated * (self._largest_error() / _PRECISE) ** 2
        return int((needed if sets is None else min(needed, sets)) - evaluated)

    def _draw(self) -> bool:
        """Draw and evaluate one more pair of orders; False where no more can be had."""
        pair = self._drawn_pair()
        if pair is None or self._failed_pairs >= _FAILURES:
            return False
        could_fail = self._some_failed()
        self.game.expect(sets_of(pair))
        for order in pair:
            for number in range(len(order) + 1):
                if math.isnan(self.game(frozenset(order[:number]))):
                    break  # what comes behind is not run
        if math.isnan(sum(pair_mean(self.game, self._active, pair))):
            self._failed_pairs += 1
            if not could_fail:
                # From now on orders are drawn one by one, among those that can be run: pairs
                # whose second is the reverse of the first are others.
                self._pairs.clear()
            return True
        self._pairs.append(pair)
        return True

    def _drawn_pair(self) -> tuple[Order, Order] | None:
        """Draw two orders; None if none that can be run was met.

        The second is the reverse of the first, unless only some orders count.
        """
        first = self._drawn_order()
        if first is None:
            return None
        if not (self.game.needs or self._some_failed()):
            return first, first[::-1]
        second = self._drawn_order()
        return None if second is None else (first, second)

    def _drawn_order(self) -> Order | None:
        """Draw an order in which each cause comes after what it needs, and no set is known to fail.

        Each such order is as likely as the others.
        """
        active, game = self._active, self.game
        for _ in range(_TRIES):
            order = [active[int(k)] for k in self._random.permutation(len(active))]
            sets = [frozenset(order[:number]) for number in range(len(order) + 1)]
            if all(game.can_be(subset) and not game.failed(subset) for subset in sets):
                return order
        return None

    def _some_failed(self) -> bool:
        """Tell whether a set of the causes that may take something away could not be run."""
        active = frozenset(self._active)
        return any(subset <= active for subset in self.game.failures())

    # What is known.

    def division(self) -> Division:
        """Return what is known; no set is evaluated for it."""
        causes, core = self.causes, self.core
        together = frozenset(causes) if core is None else core
        alone, last = self._alone(causes), self._last(causes, together)
        unavailable = () if core is None else tuple(c for c in causes if c not in core)
        means = self._means_of_pairs()
        method = self._method
        share, error = dict.fromkeys(causes, math.nan), dict.fromkeys(causes, 0.0)
        if self._exact:
            share |= self._exact
        elif (self._is_estimate and len(means)) or len(means) >= _FEWEST:
            method = "drawn orders"
            share |= dict.fromkeys(self._others(), 0.0)
            share |= dict(zip(self._active, means.mean(axis=0).tolist(), strict=True))
            error |= dict(zip(self._active, standard_errors(means).tolist(), strict=True))
        ranges: dict[str, Range | None] = {}
        for cause in causes:
            known_effects = [alone[cause], last[cause]]
            if cause in self._active:
                known_effects += means[:, self._active.index(cause)].tolist()
            ranges[cause] = range_of(share[cause], error[cause], known_effects)
        return Division(
            method=method,
            share=none_for_nan(share),
            error=error,
            range=ranges | dict.fromkeys(unavailable),
            alone=none_for_nan(alone),
            last=none_for_nan(last),
            orders=2 * len(means),
            unavailable=unavailable,
            failures=self.game.failures(),
        )

    def _alone(self, causes: Sequence[str]) -> dict[str, float]:
        return {cause: self.game.evaluated_effect(cause, frozenset()) for cause in causes}

    def _last(self, causes: Sequence[str], together: Subset) -> dict[str, float]:
        """Return what each takes away after all others; NaN of one that is not among these."""
        last = dict.fromkeys(causes, math.nan)
        for cause in causes:
            if cause in together:
                last[cause] = self.game.evaluated_effect(cause, together - {cause})
        return last

    def _others(self) -> list[str]:
        """Return the causes that can be equalized and take nothing away."""
        assert self.core is not None
        return [c for c in self.causes if c in self.core and c not in self._active]

    def _means_of_pairs(self) -> Array:
        """Return what each active cause takes away (pairs, causes), the means over pairs of orders.

        Only pairs whose sets are all evaluated count.
        """
        rows = [pair_mean(self.game, self._active, pair) for pair in self._pairs]
        rows = [row for row in rows if not math.isnan(sum(row))]
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(self._active))

    def _largest_error(self) -> float:
        return float(standard_errors(self._means_of_pairs()).max(initial=0.0))

    def _is_precise(self) -> bool:
        return len(self._pairs) >= _FEWEST and self._largest_error() <= _PRECISE
