"""Which side is nearer to the truth: the case of the battery that decides a cause is run.

The case is run as each side runs: on its engine and release, with its integrator, friction cone
and timestep. Nothing of it is stored. A side that is nearer in a case may be the farther one in
another run. So both sides are run once more, with finer steps: only where that says the same is
the case cited.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ...backends import BackendChoice
from ...engines import raw_engine_of
from ...errors import StateMachineError
from ...installed import DEFAULT
from ...interface import Model
from ...measures.text import command
from ...program import NAME
from ..validate.case_runs import measure
from ..validate.cases import CASES
from ..validate.variants import OWN, Variant, variants_of
from .cited_case import CitedCase, DecidedCause, ErrorsInRun, SideInCase, nearer_side
from .deciding_cases import DecidingCase, cones_of, deciding_cases
from .explanation import Explanation
from .finer_runs import errors_in_run
from .request import WhyRequest

_SHORTEST = 0.0005  # [s] of a timestep of a case: a shorter one of a side would take too long
# What the cases here run for is a whole number of these, but for those that wait for an event.
_PERIOD = 0.1  # [s]
# Causes that vanish with the timestep: each side then has its own truth in reach. Two releases may
# compute two laws, as two cones always do.
_VANISHING: tuple[DecidedCause, ...] = ("integrator", "offset centre of mass")


@dataclass(frozen=True, eq=False)
class _JudgedSide:
    """A side, and how it runs cases.

    Attributes:
        model: Its Model, with what both sides were run with.
        variant: How it steps.
        cone: Its friction cone, where that is the cause; else "".
    """

    model: Model
    variant: Variant
    cone: str


def with_cited_case(result: Explanation, question: WhyRequest) -> Explanation:
    """Return an explanation with the case that decides its cause, where there is one.

    Args:
        result: What the gap comes from.
        question: Whose sides run the case.
    """
    rows = deciding_cases(result, question)
    sides = _judged_sides(question, cones_of(result)) if rows else None
    if sides is None:
        return result
    for row in rows:
        cited = _cited(row, *sides)
        if cited is not None:
            return _checked(result, cited, question)
    return result


def _judged_sides(
    question: WhyRequest, cones: tuple[str, str]
) -> tuple[_JudgedSide, _JudgedSide] | None:
    """Return how each side runs cases; None where one steps in no way that the battery knows.

    Args:
        question: Whose sides they are.
        cones: The friction cones of both sides.
    """
    judged: list[_JudgedSide] = []
    for model, cone in zip((question.left, question.right), cones, strict=True):
        try:
            as_run = _as_run(model, question)
            variant = variant_of(as_run)
        except StateMachineError:  # its engine does not run
            return None
        if variant is None:
            return None
        judged.append(_JudgedSide(as_run, variant, cone))
    return judged[0], judged[1]


def _checked(result: Explanation, cited: CitedCase, question: WhyRequest) -> Explanation:
    """Return an explanation that cites a case, as far as the run that was asked says the same."""
    if cited.cause == "cone":
        return replace(result, cited_case=cited)
    in_run = errors_in_run(result, question)
    if _are_two_laws(cited, in_run):
        return replace(result, cited_case=cited)
    checked = replace(cited, in_run=in_run)
    if in_run is not None and in_run.converges and in_run.nearer == cited.nearer:
        return replace(result, cited_case=checked)
    return replace(result, contradicted_case=checked)


def _are_two_laws(cited: CitedCase, in_run: ErrorsInRun | None) -> bool:
    """Tell whether two sides compute two laws, so that finer steps do not bring them together."""
    return cited.cause not in _VANISHING and in_run is not None and not in_run.converges


def _cited(row: DecidingCase, left_side: _JudgedSide, right_side: _JudgedSide) -> CitedCase | None:
    """Return what both sides give in a case; None where they give the same, or one refuses it."""
    try:
        left, right = _side_in_case(row, left_side), _side_in_case(row, right_side)
    except StateMachineError:  # a side does not take the case: it decides nothing
        return None
    if left is None or right is None:
        return None
    case = CASES[left.case]
    nearer = nearer_side(left, right, case.rounding)
    if nearer is None:
        return None
    farther = right if nearer == "left" else left
    return CitedCase(
        cause=row.cause,
        description=case.description,
        source=case.source,
        reason=row.reason,
        left=left,
        right=right,
        nearer=nearer,
        command=command([NAME, "validate", "--case", farther.case]),
    )


def _as_run(model: Model, question: WhyRequest) -> Model:
    """Return the Model of a side with what both sides were run with, such as a timestep."""
    options = dict(question.scenario.options)
    return model.replace(**options) if options else model


def _side_in_case(row: DecidingCase, side: _JudgedSide) -> SideInCase | None:
    """Run a case as a side runs; None where there is none for its cone.

    Raises:
        StateMachineError: The side does not take the case.
    """
    name = row.case_for(side.cone)
    if name is None:
        return None
    model, variant = side.model, side.variant
    case = CASES[name]
    own_timestep = model.timestep / model.substeps
    timestep = timestep_of_case(own_timestep)
    measurement = measure(case, variant, timestep)
    return SideInCase(
        case=name,
        setting=_setting(row, side),
        backend=str(variant.backend),
        integrator=variant.integrator,
        timestep=timestep,
        own_timestep=own_timestep,
        truth=case.true_value,
        error=measurement.error,
        error_unit=case.error_unit,
    )


def timestep_of_case(own_timestep: float) -> float:
    """Return the timestep at which a case is run that is nearest to that of a side [s].

    A case ends at a moment: of a timestep that does not come by there, the time that is missing
    would count as an error.

    Args:
        own_timestep: Of the side [s].
    """
    timestep = max(own_timestep, _SHORTEST)
    steps = max(1, round(_PERIOD / timestep))
    if math.isclose(steps * timestep, _PERIOD, rel_tol=1e-9):
        return timestep
    return _PERIOD / steps


def _setting(row: DecidingCase, side: _JudgedSide) -> str:
    """Return what a side has of a cause."""
    if row.cause == "cone":
        return side.cone
    if row.cause == "release":
        return side.model.engine_version
    if row.cause == "integrator" and side.variant.integrator != OWN:
        return side.variant.integrator
    return str(side.variant.backend)


def variant_of(model: Model) -> Variant | None:
    """Return how a side steps; None where its engine has no integrator that the battery knows.

    An engine that lacks the integrator of the file acts as with the first that it has.

    Raises:
        StateMachineError: The engine does not run.
    """
    variants = variants_of(BackendChoice(model.backend, model.defaults))
    if model.compiled is not None:
        named = raw_engine_of(DEFAULT).integrator(model.compiled)
        for variant in variants:
            if variant.integrator.casefold() == named:
                return variant
    return variants[0] if variants else None
