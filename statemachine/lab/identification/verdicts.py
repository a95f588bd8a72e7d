"""What a recording determines, and what it cannot tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...interface import Array
from .motions import MotionInformation
from .refinements import Refinement
from .residuals import QUANTILE
from .results import FittedParameter, Reason
from .starts import Fits, least_certain

TELLS = 0.3  # standard deviation after the fit, by that before it
_MOVED = 0.5  # standard deviations: an interval of 95 % that is off by that covers 92 %
AGREEING = 0.5  # part of the starts, of which more must fit as well as the best one


def fitted_parameters(
    fits: Fits,
    holds: bool,
    motions: Sequence[MotionInformation],
    refinements: Sequence[Refinement] = (),
) -> tuple[FittedParameter, ...]:
    """Return what the recording tells of each parameter that was fitted.

    Args:
        fits: From all starts.
        holds: Whether the best one holds on what was not fitted.
        motions: What other motions would tell, in the order in which they are advised.
        refinements: What the model lacks and the arm may have.
    """
    objective = fits.best.objective
    deviations = fits.deviations
    ratios = (deviations / objective.prior_deviations).tolist()
    values = fits.best.vector[objective.free]
    lows, highs = _intervals(fits, deviations, refinements)
    agree = _agree(fits, deviations)
    changed = _changed_by_reason(refinements, deviations)
    fitted: list[FittedParameter] = []
    for place, number in enumerate(objective.free.tolist()):
        reasons = _reasons(ratios[place], fits, agree[place], holds)
        for reason, is_changed in changed.items():
            if is_changed[place]:
                reasons.append(reason)
        motion = "" if ratios[place] < TELLS else _motion_for(place, fits, motions)
        parameter = objective.parameters.each[number]
        entries = (values[place], lows[place], highs[place])
        figure, low, high = (parameter.figure(float(entry)) for entry in entries)
        told = FittedParameter(
            kind=parameter.kind,
            joint=parameter.joint,
            model=parameter.model,
            fitted=figure,
            low=low,
            high=high,
            posterior_by_prior=ratios[place],
            reasons=tuple(reasons),
            motion=motion,
        )
        fitted.append(told)
    return tuple(fitted)


def _intervals(
    fits: Fits, deviations: Array, refinements: Sequence[Refinement]
) -> tuple[Array, Array]:
    """Return the ends (free,) of the intervals in which parameters are with 95 %.

    They reach to where starts end that fit as well, and to what refinements make of a parameter.

    Args:
        fits: From all starts.
        deviations: (free,) standard deviations after the fit.
        refinements: What the model lacks and the arm may have.
    """
    objective = fits.best.objective
    values, ends = fits.best.vector[objective.free], _ends(fits)
    low = np.minimum(values - QUANTILE * deviations, ends.min(axis=0))
    high = np.maximum(values + QUANTILE * deviations, ends.max(axis=0))
    for each in refinements:
        low = np.minimum(low, values + each.least)
        high = np.maximum(high, values + each.most)
    return np.maximum(low, objective.parameters.low[objective.free]), high


def _ends(fits: Fits) -> Array:
    """Return where the starts end (starts, free) that fit as well as the best."""
    free = fits.best.objective.free
    return np.array([fit.vector[free] for fit in fits.as_good])


def _agree(fits: Fits, deviations: Array) -> NDArray[np.bool_]:
    """Tell of each parameter (free,) whether most starts end within its interval."""
    values, ends = fits.best.vector[fits.best.objective.free], _ends(fits)
    if len(ends) <= AGREEING * len(fits.each):
        return np.zeros(len(values), bool)
    low, high = values - QUANTILE * deviations, values + QUANTILE * deviations
    return np.all((ends >= low) & (ends <= high), axis=0)


def _changed_by_reason(
    refinements: Sequence[Refinement], deviations: Array
) -> dict[Reason, NDArray[np.bool_]]:
    """Tell of each parameter (free,) whether refinements change it, by the reason that they are."""
    changed: dict[Reason, NDArray[np.bool_]] = {}
    for each in refinements:
        before = changed.get(each.reason, np.zeros(len(deviations), bool))
        changed[each.reason] = before | _changed_by(each, deviations)
    return changed


def _changed_by(refinement: Refinement, deviations: Array) -> NDArray[np.bool_]:
    """Tell of each parameter (free,) whether it is another one with a refinement.

    Where that fits better, a parameter may hardly move; where it fits as well, within its interval.
    """
    allowed = _MOVED if refinement.fits_better else QUANTILE
    return np.maximum(-refinement.least, refinement.most) > allowed * deviations


def _reasons(ratio: float, fits: Fits, agrees: bool, holds: bool) -> list[Reason]:
    """Return why the fits do not determine a parameter; empty where they do.

    Args:
        ratio: Its standard deviation after the fit, by that before it.
        fits: From all starts.
        agrees: Whether all starts that fit as well as the best have it within its interval, and
            they are most of all starts.
        holds: Whether the best fit holds on what was not fitted.
    """
    reasons: list[Reason] = []
    if ratio >= TELLS:
        reasons.append("too little information")
    if not fits.residuals.at_floor:
        reasons.append("residual above the floor")
    if not agrees:
        reasons.append("starts disagree")
    if not holds:
        reasons.append("does not hold elsewhere")
    return reasons


def _motion_for(place: int, fits: Fits, motions: Sequence[MotionInformation]) -> str:
    """Return the first motion after which a parameter would be told; "" where none would do."""
    prior = fits.best.objective.prior_deviations
    for motion in motions:
        together = [each + motion.information for each in fits.informations]
        after = least_certain(together, prior)
        if after[place] < TELLS * prior[place]:
            return motion.name
    return ""
