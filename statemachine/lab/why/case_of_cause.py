"""Which side is nearer to the truth: the case of the battery that decides a cause is run.

The case is run as each side runs: on its engine and release, with its integrator, friction cone
and timestep. Nothing of it is stored.
"""

from __future__ import annotations

from dataclasses import replace

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
from .cited_case import CitedCase, SideInCase, nearer_side
from .deciding_cases import DecidingCase, cones_of, deciding_cases
from .explanation import Explanation
from .request import WhyRequest

_SHORTEST = 0.0005  # [s] of a timestep of a case: a shorter one of a side would take too long


def with_cited_case(result: Explanation, question: WhyRequest) -> Explanation:
    """Return an explanation with the case that decides its cause, where there is one.

    Args:
        result: What the gap comes from.
        question: Whose sides run the case.
    """
    for row in deciding_cases(result, question):
        cited = _cited(row, question, cones_of(result))
        if cited is not None:
            return replace(result, cited_case=cited)
    return result


def _cited(row: DecidingCase, question: WhyRequest, cones: tuple[str, str]) -> CitedCase | None:
    """Return what both sides give in a case; None where they give the same, or one refuses it."""
    try:
        left = side_in_case(row, _as_run(question.left, question), cones[0])
        right = side_in_case(row, _as_run(question.right, question), cones[1])
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


def side_in_case(row: DecidingCase, model: Model, cone: str = "") -> SideInCase | None:
    """Run a case as a side runs; None where the side steps in no way that the battery knows.

    Args:
        row: Which case.
        model: Of the side.
        cone: The friction cone of the side, where that is the cause; else "".

    Raises:
        StateMachineError: The side does not take the case.
    """
    name = row.case_for(cone)
    variant = variant_of(model)
    if name is None or variant is None:
        return None
    case = CASES[name]
    timestep = max(model.timestep / model.substeps, _SHORTEST)
    measurement = measure(case, variant, timestep)
    return SideInCase(
        case=name,
        setting=_setting(row, model, variant, cone),
        backend=str(variant.backend),
        integrator=variant.integrator,
        timestep=timestep,
        truth=case.true_value,
        error=measurement.error,
        error_unit=case.error_unit,
    )


def _setting(row: DecidingCase, model: Model, variant: Variant, cone: str) -> str:
    """Return what a side has of a cause."""
    if row.cause == "cone":
        return cone
    if row.cause == "release":
        return model.engine_version
    if row.cause == "integrator" and variant.integrator != OWN:
        return variant.integrator
    return str(variant.backend)


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
