"""Shares of a gap that do not depend on an order: Shapley values.

The share of a cause is the mean, over all orders in which causes can be brought to the same, of
what it takes away when its turn comes (L. S. Shapley, 1953). Where a cause needs another, only
those orders count in which it comes later (U. Faigle and W. Kern, 1992). Where causes add up the
share is what each takes away alone. Else it is computed over all sets of causes, or estimated from
drawn orders, in pairs, with the standard error of the mean. The shares add up to what all causes
take away together.

What no cause explains is located: something is left out on both sides. That makes another motion,
whose gap may be smaller for that reason alone, so that it counts only where it takes away more than
half of what was left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Literal

import numpy as np

from ...interface import Array
from ...page import Figures
from .settings import FEATURES
from .trials import Measure, Trials

Method = Literal["nothing", "one at a time", "all sets", "drawn orders"]
Subset = frozenset[str]
Needs = Mapping[str, str]  # of a cause the one that has to be brought to the same before it

ADDS_UP = 0.01  # of the gap: causes that interact by less add up
_DUMMY = 1e-7  # of the gap: a cause that takes away less, first and last, takes away nothing
_PRECISE = 0.01  # of the gap: a standard error that is small enough
_FEWEST, _FAILURES = 4, 10  # pairs of orders before their spread is believed; that could not be run


class _Game:
    """The gap with sets of causes brought to the same, as parts of the first gap.

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

    def __call__(self, brought: Subset) -> float:
        if brought not in self.parts:
            gap = self._value(brought)
            self.parts[brought] = math.nan if gap is None else gap / self._gap
        return self.parts[brought]

    def can_be(self, brought: Subset) -> bool:
        """Whether all that the causes of a set need is in it."""
        return all(self.needs[c] in brought for c in brought if c in self.needs)

    def expect(self, wanted: Iterable[Subset]) -> None:
        """Say which sets are evaluated next."""
        sets = dict.fromkeys(filter(self.can_be, wanted))
        self._ahead(brought for brought in sets if brought not in self.parts)

    def takes(self, cause: str, before: Subset) -> float:
        """What a cause takes away after others."""
        if not self.can_be(before) or not self.can_be(before | {cause}):
            return math.nan
        return self(before) - self(before | {cause})


def shapley(
    causes: Sequence[str],
    value: Callable[[Subset], float | None],
    gap: float,
    *,
    budget: int = 200,
    seed: int = 0,
    ahead: Callable[[Iterable[Subset]], None] = lambda _sets: None,
    needs: Needs = MappingProxyType({}),
) -> Figures:
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

    Returns:
        method: How the parts of the gap were computed.
        share: By cause; error: its standard error, 0 where it is not an estimate.
        alone: What it takes away if it is the only one, None where that cannot be, or be run.
        last: What it takes away if it comes after all others, None as for `alone`.
        orders: How many orders were drawn.
        impossible: Sets of causes that could not be run, sorted.
    """
    game, everything = _Game(value, gap, ahead, needs), frozenset(causes)
    if causes:
        ones = [frozenset({cause}) for cause in causes]
        game.expect([*ones, *(everything - left for left in ones), everything])
    alone = {cause: game.takes(cause, frozenset()) for cause in causes}
    last = {cause: game.takes(cause, everything - {cause}) for cause in causes}
    share, error = dict.fromkeys(causes, 0.0), dict.fromkeys(causes, 0.0)
    active = [
        cause
        for cause in causes
        if cause in needs.values()
        # Not: it takes away nothing. What is not known may take something.
        or not (abs(alone[cause]) <= _DUMMY and abs(last[cause]) <= _DUMMY)
    ]
    whole = game(everything)
    if not (math.isnan(whole) or abs(game(frozenset(active)) - whole) <= _DUMMY):
        active = list(causes)  # some do nothing alone and nothing last, but something together
    method: Method = "nothing"
    orders = 0
    if active and _adds_up(1.0 - whole, [alone[c] for c in active], [last[c] for c in active]):
        method = "one at a time"
        share |= _scaled(
            {c: (alone[c] + last[c]) / 2 for c in active}, 1.0 - game(frozenset(active))
        )
    elif active and (sets := _all_sets(game, active, budget)):
        method = "all sets"
        game.expect(sets)
        share |= _exact(game, active, sets)
    elif active:
        method = "drawn orders"
        drawn = _drawn(game, active, budget, np.random.default_rng(seed))
        orders = 2 * len(drawn)
        means = (float(column.mean()) if orders else math.nan for column in drawn.T)
        share |= dict(zip(active, means, strict=True))
        error |= dict(zip(active, _errors(drawn).tolist(), strict=True))
    impossible = (tuple(sorted(s)) for s, part in game.parts.items() if math.isnan(part))
    return Figures(
        method=method,
        share=_known(share),
        error=error,
        alone=_known(alone),
        last=_known(last),
        orders=orders,
        impossible=tuple(sorted(impossible)),
    )


def _known(parts: Mapping[str, float]) -> dict[str, float | None]:
    """Parts by cause, None where one is not known."""
    return {cause: None if math.isnan(part) else part for cause, part in parts.items()}


def _adds_up(whole: float, alone: Sequence[float], last: Sequence[float]) -> bool:
    """Whether causes take away as much first as last, and together as much as all of them do."""
    apart = (abs(first - then) <= ADDS_UP for first, then in zip(alone, last, strict=True))
    return abs(sum(alone) - whole) <= ADDS_UP and all(apart) and any(alone)


def _scaled(shares: dict[str, float], whole: float) -> dict[str, float]:
    """Shares that nearly add up, with what they lack spread over them by their size."""
    lacking, size = whole - sum(shares.values()), sum(map(abs, shares.values()))
    return {c: share + lacking * (abs(share) / size) for c, share in shares.items()}


def _all_sets(game: _Game, active: Sequence[str], budget: int) -> list[Subset]:
    """All sets that can be, the smaller ones first; none where there are more than the budget.

    They are in one order everywhere, else the last bits of their sums would be chance.
    """
    sets: dict[Subset, None] = {frozenset(): None}
    smaller = list(sets)
    while smaller and len(sets) <= budget:
        larger = (s | {cause} for s in smaller for cause in active if cause not in s)
        smaller = list(dict.fromkeys(filter(game.can_be, larger)))
        sets |= dict.fromkeys(smaller)
    return list(sets) if len(sets) <= budget else []


def _exact(game: _Game, active: Sequence[str], sets: Sequence[Subset]) -> dict[str, float]:
    """Over all orders, by the number of orders that lead to a set and from it to all causes."""
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
    """What each cause takes away (pairs, causes), the means over pairs of orders.

    Pairs are drawn until they are precise enough. The second order of a pair is the reverse of
    the first, unless a cause needs another.
    """
    pairs: list[list[float]] = []
    start, failed = len(game.parts), 0
    while failed < _FAILURES:
        order = _order(game, active, random)
        orders = order, _order(game, active, random) if game.needs else order[::-1]
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
    """The standard error of the mean of each column (pairs, causes)."""
    if len(pairs) < 2:
        return np.full(pairs.shape[1], math.inf)
    return np.std(pairs, axis=0, ddof=1) / math.sqrt(len(pairs))


def _order(game: _Game, active: Sequence[str], random: np.random.Generator) -> list[str]:
    """An order in which every cause comes after what it needs, each as likely as the others."""
    while True:
        order = [active[int(k)] for k in random.permutation(len(active))]
        place = {cause: k for k, cause in enumerate(order)}
        if all(place[game.needs[c]] < place[c] for c in order if c in game.needs):
            return order


def _along(game: _Game, order: Sequence[str]) -> dict[str, float]:
    """What each takes away in an order; NaN from where a set cannot be run."""
    parts = dict.fromkeys(order, math.nan)
    for k, cause in enumerate(order):
        parts[cause] = game.takes(cause, frozenset(order[:k]))
        if math.isnan(parts[cause]):
            break
    return parts


_NOTHING = 1e-6  # of the gap: what is less is left alone
_LEAST, _LEAST_SET = 0.5, 0.05  # of what was left: less does not count; of a setting
_STILL = 0.1  # of the left's own motion: less is no motion any more


def locate(
    trials: Trials,
    brought: frozenset[str],
    quantity: str,
    measure: Measure,
    gap: float,
    left: float,
    bound: float,
    least: float = _LEAST,
) -> tuple[Figures, ...]:
    """Leave features out on both sides, each on top of those that count.

    The integrator comes first, of the sides that have several, and is tried again once something is
    left out: what differs by it may be hidden by what was left. Where only one side has several it
    is a setting, which need not take away half if nothing else does either.

    Args:
        trials: The runs.
        brought: The causes that are brought to the same.
        quantity: What the gap is measured in.
        measure: Which figure of it.
        gap: As the sides come, above zero.
        left: With the causes brought to the same.
        bound: What rounding and chaos make of it: no more is looked for.
        least: What such a setting has to take away of what was left.

    Returns:
        A part of the gap each, and where it comes from:
        name: What was left out, or chosen.
        without: What a run without it is, in words; of an integrator, the one that was chosen.
        values: The integrators of the two sides as they come; None of what was left out.
        share: The part of the gap that went; alone: of an integrator, as the sides come; None if
            that could not be run, and of what was left out.
        gap: What was left of it, in the unit of the gap.
        is_still: Whether nothing moves any more, so that there can be no gap.
        _side: Of a setting of one side, chosen while nothing was left out, that side: "left" or
            "right"; "" of the others.
    """
    rows: list[Figures] = []
    without, integrator = frozenset[str](), ""
    enough = max(_NOTHING * gap, bound)
    able = filter(trials.can_be_without, FEATURES)
    # None: an integrator is chosen. A run that was made already is not made again.
    for feature in (None, *(choice for one_able in able for choice in (one_able, None))):
        if left <= enough:
            break
        more = without | {feature.name} if feature else without
        choices = [integrator] if feature or integrator else trials.integrators
        rests = [
            (getattr(gaps[quantity], measure), choice)
            for choice in choices
            if (gaps := trials.gaps(brought, more, choice))
        ]
        # Of those that leave nothing none is better.
        rest, best = min(
            rests, key=lambda pair: (max(pair[0], enough), pair[1]), default=(left, "")
        )
        setting = len(trials.selects) == 1 and not more
        if left - rest <= (least if setting else _LEAST) * left:
            continue
        alone = None if feature else trials.gaps(frozenset(), integrator=best)
        without, integrator = more, best
        rows.append(
            Figures(
                name=feature.name if feature else "integrator",
                without=feature.without if feature else best,
                values=None if feature else (trials.integrator_of(0), trials.integrator_of(1)),
                share=(left - rest) / gap,
                alone=1.0 - getattr(alone[quantity], measure) / gap if alone else None,
                gap=rest,
                is_still=trials.extent(quantity, without) < _STILL * trials.extent(quantity),
                _side=("left", "right")[trials.selects[0]] if setting else "",
            )
        )
        left = rest
    return (
        tuple(rows)
        if rows or least < _LEAST
        else locate(trials, brought, quantity, measure, gap, left, bound, _LEAST_SET)
    )
