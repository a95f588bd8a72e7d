"""What a recording determines, and what it cannot tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...interface import Array
from .motions import MotionInformation
from .results import UNITS, FittedParameter, Reason
from .starts import Fits

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
    deviations = np.sqrt(np.diag(fits.covariance))
    prior = objective.prior_deviations
    values = fits.best.vector[objective.free]
    low, high = values - _QUANTILE * deviations, values + _QUANTILE * deviations
    ends = np.array([fit.vector[objective.free] for fit in fits.as_good])
    agree = np.all((ends >= low) & (ends <= high), axis=0).tolist()
    low = np.maximum(np.minimum(low, ends.min(axis=0)), objective.parameters.low[objective.free])
    high = np.maximum(high, ends.max(axis=0))
    told = deviations / prior
    fitted: list[FittedParameter] = []
    for place, number in enumerate(objective.free.tolist()):
        parameter = objective.parameters.each[number]
        reasons: list[Reason] = []
        if told[place] >= _TELLS:
            reasons.append("too little information")
        if not fits.residuals.at_floor:
            reasons.append("residual above the floor")
        if not agree[place] or len(ends) < _FEWEST_AS_GOOD:
            reasons.append("starts disagree")
        if not holds:
            reasons.append("does not hold elsewhere")
        fitted.append(
            FittedParameter(
                kind=parameter.kind,
                joint=parameter.joint,
                cause=parameter.cause,
                unit=UNITS[parameter.kind],
                model=parameter.model,
                fitted=parameter.figure(float(values[place])),
                low=parameter.figure(float(low[place])),
                high=parameter.figure(float(high[place])),
                information=float(told[place]),
                verdict="cannot tell" if reasons else "determined",
                reasons=tuple(reasons),
                motion=_motion_for(place, fits, motions) if told[place] >= _TELLS else "",
            )
        )
    return tuple(fitted)


def _motion_for(place: int, fits: Fits, motions: Sequence[MotionInformation]) -> str:
    """Return the first motion after which a parameter would be told; "" where none would do."""
    prior = fits.best.objective.prior_deviations
    for motion in motions:
        after = _deviations(fits.best.information + motion.information, prior)
        if after[place] < _TELLS * prior[place]:
            return motion.name
    return ""


def _deviations(information: Array, prior: Array) -> Array:
    """Return the standard deviations that information of data and prior leave."""
    return np.sqrt(np.diag(np.linalg.inv(information + np.diag(1.0 / np.square(prior)))))
