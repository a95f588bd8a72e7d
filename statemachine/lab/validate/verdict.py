"""How an engine does in a case: one function makes every verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from .case import Case, Expectation, Verdict

# The least size of an error of which an order is observed: below it is rounding.
SMALLEST_OF_ORDER = 1e-11
LEAST_ORDER = 0.5  # a smaller one is no convergence
_ORDER_SLACK = 0.4  # what an observed order may be below the expected one
_RANKS: tuple[Verdict, ...] = get_args(Verdict)

_MUCH_SMALLER = 4.0  # by how much an error below its record shows that the record is out of date

# "other timestep": the record is of the case's own timesteps, and none of them was asked for.
Status = Literal["as expected", "better", "worse", "not on record", "other timestep"]


@dataclass(frozen=True)
class CaseMeasurement:
    """What a case gave at one timestep.

    Attributes:
        timestep: [s].
        measured: The number [unit of the case]; None if the run diverged.
        error: How far it is from the truth for the time that was simulated, steps times
            timestep [unit of the case's error]; None likewise.
        discrete_error: How far it is from the exact discrete truth [unit of the case's error];
            None without one.
        steps: Number of steps of the run.
        seconds_per_step: CPU time of a step, reading included [s], as of `Run.seconds`; None if
            the run diverged.
    """

    timestep: float
    measured: float | None
    error: float | None
    discrete_error: float | None
    steps: int
    seconds_per_step: float | None


def observed_order(case: Case, measurements: Sequence[CaseMeasurement]) -> float | None:
    """Return with which power of the timestep the error vanishes, by least squares.

    Only the first errors count that are above rounding and get smaller. None where fewer than two
    are left, or where the end of the run is chaotic.
    """
    if case.is_chaotic:
        return None
    floor = max(SMALLEST_OF_ORDER, case.rounding)
    lengths: list[float] = []
    sizes: list[float] = []
    for measurement in measurements:
        error = measurement.error
        if error is None or not floor < abs(error) < math.inf:
            break
        lengths.append(measurement.timestep)
        sizes.append(abs(error))
    if len(sizes) < 2:
        return None
    slope, _ = np.polyfit(np.log(lengths), np.log(sizes), 1)
    return float(slope)


@dataclass(frozen=True)
class CaseJudgement:
    """What the errors of an engine in a case say.

    Attributes:
        verdict: How the engine does.
        order: With which power of the timestep the error vanishes; None where that is not seen.
        status: Whether that is what its record says.
    """

    verdict: Verdict
    order: float | None
    status: Status


def judgement_of(
    case: Case,
    measurements: Sequence[CaseMeasurement],
    expectation: Expectation | None,
) -> CaseJudgement:
    """Return how an engine does, and whether that is as on record.

    Args:
        case: Whose tolerances count; the record is of its own timesteps.
        measurements: From the longest timestep to the shortest; empty if it was refused.
        expectation: The record; None if there is none.
    """
    order = _order(case, measurements, expectation)
    verdict = _verdict(case, measurements, order)
    return CaseJudgement(verdict, order, _status_of_own(case, measurements, expectation))


def failure_judgement(expectation: Expectation | None) -> CaseJudgement:
    """Return the judgement of a run that failed: nothing was measured.

    Args:
        expectation: The record; None if there is none.
    """
    return CaseJudgement("failed", None, "not on record" if expectation is None else "worse")


def _verdict(case: Case, measurements: Sequence[CaseMeasurement], order: float | None) -> Verdict:
    """Return how an engine does, from what was measured at each timestep."""
    if not measurements:
        return "refused"
    errors: list[float] = []
    for measurement in measurements:
        if measurement.error is None or math.isnan(measurement.error):
            return "diverges"
        errors.append(abs(measurement.error))
    if max(errors) <= case.rounding:
        return "exact"
    discrete = [measurement.discrete_error for measurement in measurements]
    if all(error is not None and abs(error) <= case.rounding for error in discrete):
        return "exact discrete form"
    if order is not None and order >= LEAST_ORDER and errors[-1] <= case.tolerance:
        return "converges"
    if max(errors) <= case.tolerance:
        return "bounded"
    return "wrong"


def _order(
    case: Case, measurements: Sequence[CaseMeasurement], expectation: Expectation | None
) -> float | None:
    """Return the observed order; None where the record says that rounding is all that is seen."""
    if expectation is not None and expectation.rounded is not None:
        return None
    return observed_order(case, measurements)


def _status_of_own(
    case: Case, measurements: Sequence[CaseMeasurement], expectation: Expectation | None
) -> Status:
    """Tell whether an engine does as its record says, at the timesteps that this is of."""
    own = [each for each in measurements if each.timestep in case.timesteps]
    if expectation is not None and measurements and not own:
        return "other timestep"
    order = _order(case, own, expectation)
    return _status(case, own, expectation, _verdict(case, own, order), order)


def _status(
    case: Case,
    measurements: Sequence[CaseMeasurement],
    expectation: Expectation | None,
    verdict: Verdict,
    order: float | None,
) -> Status:
    """Tell whether an engine does as its record says."""
    if expectation is None:
        return "not on record"
    if expectation.rounded is not None:
        return _status_of_rounding(measurements, expectation)
    expected = expectation.verdict
    shows_no_order = len(measurements) == 1 and expected in ("converges", "wrong", "bounded")
    if shows_no_order and verdict in ("bounded", "wrong"):
        verdict = expected  # the size of the error tells then
    if verdict != expected:
        return "better" if _RANKS.index(verdict) < _RANKS.index(expected) else "worse"
    if not measurements or measurements[0].error is None:
        return "as expected"
    size = abs(measurements[0].error)
    if size > expectation.within:
        return "worse"
    if _is_lower(order, expectation.order):
        return "worse"
    # A shorter timestep than the case's own has a smaller error anyway, and chaos has any.
    is_comparable = measurements[0].timestep == case.timesteps[0] and not case.is_chaotic
    much_smaller = _largest(measurements) < expectation.within / _MUCH_SMALLER
    if is_comparable and expected != "exact" and much_smaller:
        return "better"
    return "as expected"


def _status_of_rounding(
    measurements: Sequence[CaseMeasurement], expectation: Expectation
) -> Status:
    """Tell whether each error is within what the rounding of its steps can make."""
    if not measurements:
        return "worse"
    for measurement in measurements:
        error = measurement.error
        if error is None or not abs(error) <= expectation.bound(measurement.steps):
            return "worse"
    return "as expected"


def _is_lower(order: float | None, expected: float | None) -> bool:
    """Tell whether an order is lower than expected; not where one of them is unknown."""
    if order is None or expected is None:
        return False
    return order < expected - _ORDER_SLACK


def _largest(measurements: Sequence[CaseMeasurement]) -> float:
    """Return the largest size of an error; infinite if a run diverged."""
    sizes: list[float] = []
    for measurement in measurements:
        sizes.append(math.inf if measurement.error is None else abs(measurement.error))
    return max(sizes)
