"""Where the rest of a gap comes from: what goes when something is left out on both sides.

What is left out makes another motion, whose gap may be smaller for that reason alone. So it
counts only where it takes away more than half of what was left.
"""

from __future__ import annotations

from ...page import Figures
from .settings import FEATURES
from .trials import Measure, Trials

_NOTHING = 1e-6  # of the gap: what is less is left alone
_LEAST = 0.5  # of what was left: what takes less away does not count
_STILL = 0.1  # of the left's own motion: less is no motion any more


def locate(
    trials: Trials,
    brought: frozenset[str],
    quantity: str,
    measure: Measure,
    gap: float,
    left: float,
    bound: float,
) -> tuple[Figures, ...]:
    """Leave features out on both sides, each on top of those that count.

    The integrator comes first, of the sides that have several, and is tried again once something is
    left out: what differs by it may be hidden by what was left.

    Args:
        trials: The runs.
        brought: The causes that are brought to the same.
        quantity: What the gap is measured in.
        measure: Which figure of it.
        gap: As the sides come, above zero.
        left: With the causes brought to the same.
        bound: What rounding and chaos make of it: no more is looked for.

    Returns:
        A part of the gap each, and where it comes from:
        name: What was left out, or chosen.
        without: What a run without it is, in words; of an integrator, the one that was chosen.
        values: The integrators of the two sides as they come, or, of a setting, those that ran;
            None of what was left out.
        share: The part of the gap that went.
        gap: What was left of it, in the unit of the gap.
        moved: How far the left's own motion is then from its motion as it comes; above zero
            the gap is that of another motion.
        is_still: Whether nothing moves any more, so that there can be no gap.
        is_setting: Whether it is a setting of one side, chosen while nothing was left out.
    """
    rows: list[Figures] = []
    without, integrator = frozenset[str](), ""
    able = filter(trials.can_be_without, FEATURES)
    # None: an integrator is chosen. A run that was made already is not made again.
    for feature in (None, *(choice for one_able in able for choice in (one_able, None))):
        if left <= max(_NOTHING * gap, bound):
            break
        more = without | {feature.name} if feature else without
        choices = [integrator] if feature or integrator else trials.integrators
        rests = {
            choice: getattr(gaps[quantity], measure)
            for choice in choices
            if (gaps := trials.gaps(brought, more, choice))
        }
        best = min(rests, key=rests.__getitem__, default="")
        rest = rests.get(best, left)
        if not rest < _LEAST * left:
            continue
        without, integrator = more, best
        setting = len(trials.selects) == 1 and not feature and not without
        values = None
        if not feature:
            on_left, on_right = (
                best if setting and side in trials.selects else trials.integrator_of(side)
                for side in (0, 1)
            )
            values = on_left, on_right
        rows.append(
            Figures(
                name=feature.name if feature else "integrator",
                without=feature.without if feature else best,
                values=values,
                share=(left - rest) / gap,
                gap=rest,
                moved=trials.moved(quantity, without, integrator),
                is_still=trials.extent(quantity, without) < _STILL * trials.extent(quantity),
                is_setting=setting,
            )
        )
        left = rest
    return tuple(rows)
