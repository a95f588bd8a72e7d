"""What a recording determines, and what it cannot tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...interface import Array
from .motions import MotionInformation
from .parameters import Parameter
from .refinements import Refinement
from .residuals import QUANTILE
from .results import UNITS, FittedParameter, Reason
from .starts import Fits, least_certain

TELLS = 0.3  # standard deviation after the fit, by that before it
_MOVED = 0.5  # standard deviations: an interval of 95 % that is off by that covers 92 %
AGREEING = 0.5  # of the starts, of which more end in the same fit if it is taken for the best one


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
    prior = objective.prior_deviations
    values = fits.best.vector[objective.free]
    low, high = values - QUANTILE * deviations, values + QUANTILE * deviations
    ends = np.array([fit.vector[objective.free] for fit in fits.as_good])
    agree = np.all((ends >= low) & (ends <= high), axis=0).tolist()
    low = np.minimum(low, ends.min(axis=0))
    high = np.maximum(high, ends.max(axis=0))
    changed: dict[Reason, NDArray[np.bool_]] = {
        each.reason: np.zeros(len(prior), bool) for each in refinements
    }
    for each in refinements:
        low = np.minimum(low, values + each.least)
        high = np.maximum(high, values + each.most)
        changed[each.reason] |= _changed_by(each, deviations)
    low = np.maximum(low, objective.parameters.low[objective.free])
    told = (deviations / prior).tolist()
    fitted: list[FittedParameter] = []
    for place, number in enumerate(objective.free.tolist()):
        interval = _Interval(float(values[place]), float(low[place]), float(high[place]))
        agrees = agree[place] and len(ends) > AGREEING * len(fits.each)
        motion = "" if told[place] < TELLS else _motion_for(place, fits, motions)
        reasons = _reasons(told[place], fits, agrees, holds)
        others: list[Reason] = [reason for reason, mine in changed.items() if mine[place]]
        parameter = objective.parameters.each[number]
        fitted.append(_verdict(parameter, interval, told[place], (*reasons, *others), motion))
    return tuple(fitted)


def _changed_by(refinement: Refinement, deviations: Array) -> NDArray[np.bool_]:
    """Tell of each parameter (free,) whether it is another one with a refinement.

    Where that fits better, a parameter may hardly move; where it fits as well, within its interval.
    """
    allowed = _MOVED if refinement.fits_better else QUANTILE
    return np.maximum(-refinement.least, refinement.most) > allowed * deviations


@dataclass(frozen=True)
class _Interval:
    """An entry of the vector, and within what it is."""

    value: float
    low: float
    high: float


def _verdict(
    parameter: Parameter,
    interval: _Interval,
    told: float,
    reasons: tuple[Reason, ...],
    motion: str,
) -> FittedParameter:
    """Return what is said of a parameter."""
    return FittedParameter(
        kind=parameter.kind,
        joint=parameter.joint,
        cause=parameter.cause,
        unit=UNITS[parameter.kind],
        model=parameter.model,
        fitted=parameter.figure(interval.value),
        low=parameter.figure(interval.low),
        high=parameter.figure(interval.high),
        information=told,
        verdict="cannot tell" if reasons else "determined",
        reasons=reasons,
        motion=motion,
    )


def _reasons(told: float, fits: Fits, agrees: bool, holds: bool) -> tuple[Reason, ...]:
    """Return why a parameter is not determined; empty where it is.

    Args:
        told: Its standard deviation after the fit, by that before it.
        fits: From all starts.
        agrees: Whether all starts that fit as well as the best have it within its interval.
        holds: Whether the best fit holds on what was not fitted.
    """
    reasons: list[Reason] = []
    if told >= TELLS:
        reasons.append("too little information")
    if not fits.residuals.at_floor:
        reasons.append("residual above the floor")
    if not agrees:
        reasons.append("starts disagree")
    if not holds:
        reasons.append("does not hold elsewhere")
    return tuple(reasons)


def _motion_for(place: int, fits: Fits, motions: Sequence[MotionInformation]) -> str:
    """Return the first motion after which a parameter would be told; "" where none would do."""
    prior = fits.best.objective.prior_deviations
    for motion in motions:
        together = [each + motion.information for each in fits.informations]
        after = least_certain(together, prior)
        if after[place] < TELLS * prior[place]:
            return motion.name
    return ""
