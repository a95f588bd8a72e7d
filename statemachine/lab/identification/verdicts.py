"""What a recording determines, and what it cannot tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .motions import MotionInformation
from .parameters import Parameter
from .results import UNITS, FittedParameter, Reason
from .starts import Fits, least_certain

_TELLS = 0.3  # standard deviation after the fit, by that before it
_QUANTILE = 1.96  # of the normal distribution, for 95 %
_FEWEST_AS_GOOD = 3  # starts that end in the same fit, before it is taken for the best there is


def fitted_parameters(
    fits: Fits, holds: bool, motions: Sequence[MotionInformation]
) -> tuple[FittedParameter, ...]:
    """Return what the recording tells of each parameter that was fitted.

    Args:
        fits: From all starts.
        holds: Whether the best one holds on what was not fitted.
        motions: What other motions would tell, in the order in which they are advised.
    """
    objective = fits.best.objective
    deviations = fits.deviations
    prior = objective.prior_deviations
    values = fits.best.vector[objective.free]
    low, high = values - _QUANTILE * deviations, values + _QUANTILE * deviations
    ends = np.array([fit.vector[objective.free] for fit in fits.as_good])
    agree = np.all((ends >= low) & (ends <= high), axis=0).tolist()
    low = np.maximum(np.minimum(low, ends.min(axis=0)), objective.parameters.low[objective.free])
    high = np.maximum(high, ends.max(axis=0))
    told = (deviations / prior).tolist()
    fitted: list[FittedParameter] = []
    for place, number in enumerate(objective.free.tolist()):
        interval = _Interval(float(values[place]), float(low[place]), float(high[place]))
        agrees = agree[place] and len(ends) >= _FEWEST_AS_GOOD
        motion = "" if told[place] < _TELLS else _motion_for(place, fits, motions)
        reasons = _reasons(told[place], fits, agrees, holds)
        parameter = objective.parameters.each[number]
        fitted.append(_verdict(parameter, interval, told[place], reasons, motion))
    return tuple(fitted)


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
    if told >= _TELLS:
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
        if after[place] < _TELLS * prior[place]:
            return motion.name
    return ""
