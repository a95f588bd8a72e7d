"""The gap as a function of the causes that are equalized, each set of them evaluated once.

What cannot be run has no value: in the arithmetic of shares that is NaN.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

Subset = frozenset[str]
Needs = Mapping[str, str]  # of a cause the one that has to be equalized before it


class Game:
    """The gap with sets of causes equalized, as parts of the first gap.

    Attributes:
        needs: Of a cause the one that has to be equalized before it.
        parts: The part of the gap that is left with each set that was evaluated; NaN of a set
            that could not be run.
    """

    def __init__(
        self,
        value: Callable[[Subset], float | None],
        gap: float,
        ahead: Callable[[Iterable[Subset]], None],
        needs: Needs,
    ) -> None:
        """Begin with no set evaluated but the empty one.

        Args:
            value: The gap with a set of causes equalized; None where that cannot be run.
            gap: That of the empty set, above zero.
            ahead: Told which sets are evaluated next, where that is known of several.
            needs: Of a cause the one that has to be equalized before it.
        """
        self._value, self._gap, self._ahead, self.needs = value, gap, ahead, needs
        self.parts: dict[Subset, float] = {frozenset(): 1.0}
        self._expected: dict[Subset, None] = {}

    def __call__(self, equalized: Subset) -> float:
        """Evaluate a set, if that was not done yet."""
        if equalized not in self.parts:
            gap = self._value(equalized)
            self.parts[equalized] = math.nan if gap is None else gap / self._gap
        return self.parts[equalized]

    def can_be(self, equalized: Subset) -> bool:
        """Tell whether all that the causes of a set need is in it."""
        return all(self.needs[c] in equalized for c in equalized if c in self.needs)

    def expect(self, subsets: Iterable[Subset]) -> None:
        """Say which sets are evaluated next."""
        possible = dict.fromkeys(subset for subset in subsets if self.can_be(subset))
        missing = [subset for subset in possible if subset not in self.parts]
        self._expected |= dict.fromkeys(missing)
        self._ahead(missing)

    def collect(self, is_run: Callable[[Subset], bool]) -> None:
        """Take the value of each set that was expected and is run already; run none.

        Args:
            is_run: Tells whether the value of a set takes no more runs.
        """
        for subset in self._expected:
            if subset not in self.parts and is_run(subset):
                self(subset)

    def failed(self, equalized: Subset) -> bool:
        """Tell whether a set was evaluated, and could not be run."""
        return math.isnan(self.parts.get(equalized, 0.0))

    def failures(self) -> tuple[Subset, ...]:
        """Return the sets that could not be run: the smaller ones first, then by their names."""
        sets = [subset for subset, part in self.parts.items() if math.isnan(part)]
        return tuple(sorted(sets, key=lambda subset: (len(subset), sorted(subset))))

    def effect(self, cause: str, before: Subset) -> float:
        """Return what a cause takes away after others; NaN where that cannot be, or be run."""
        if not self.can_be(before) or not self.can_be(before | {cause}):
            return math.nan
        return self(before) - self(before | {cause})

    def evaluated_effect(self, cause: str, before: Subset) -> float:
        """Return the same of sets that are evaluated; NaN of others."""
        left = self.parts.get(before, math.nan)
        return left - self.parts.get(before | {cause}, math.nan)


def runnable(game: Game, causes: Sequence[str]) -> Subset:
    """Return the causes that can be equalized together, as many as can.

    That is all of them, unless that set cannot be run. Then those are left out with which no set
    could be run; and of causes that cannot be equalized together, though each can, the one without
    which least of the gap is left.

    Args:
        game: In which all causes, each alone, and all but each were evaluated.
        causes: Their names.
    """
    everything = frozenset(causes)
    if not math.isnan(game(everything)):
        return everything
    suspects = [cause for cause in causes if _fails_always(game, cause)]
    core = _completed(game, everything - frozenset(suspects))
    while core and math.isnan(game(core)):
        rests = [core - {cause} for cause in causes if cause in core]
        game.expect(rests)
        possible = [rest for rest in rests if game.can_be(rest) and not math.isnan(game(rest))]
        if not possible:
            return frozenset()
        core = min(possible, key=game)
    for cause in suspects:  # it may be another one by which those sets failed
        larger = core | {cause}
        if game.can_be(larger) and not math.isnan(game(larger)):
            core = larger
    return core


def _fails_always(game: Game, cause: str) -> bool:
    """Tell whether every set with a cause that was evaluated could not be run."""
    parts = [part for subset, part in game.parts.items() if cause in subset]
    return bool(parts) and all(math.isnan(part) for part in parts)


def _completed(game: Game, causes: Subset) -> Subset:
    """Return the causes without those that need one that is missing."""
    while not game.can_be(causes):
        incomplete = [c for c in causes if c in game.needs and game.needs[c] not in causes]
        causes = causes - frozenset(incomplete)
    return causes
