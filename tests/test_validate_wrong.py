"""A wrong parameter is noticed by its case, on each engine that reads it."""

from __future__ import annotations

from functools import cache

import pytest

from statemachine.backends import parse_backend
from statemachine.lab.validate.battery import CaseResult, run_case
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.variants import Variant, variants_of
from tools.validate_faults.__main__ import blind, nowhere
from tools.validate_faults.matrix import Cell, outcome_of
from tools.validate_faults.other_cases import OTHER_CASES
from tools.validate_faults.table import FAULTS, Fault, Outcome

from .support.requirements import need_engine

NAMES = [fault.name for fault in FAULTS]


@cache
def sound(name: str, variant: Variant) -> CaseResult:
    """Return what a case gives without a wrong parameter."""
    return run_case(CASES[name], variant)


def outcomes(fault: Fault, engine: str) -> set[str]:
    """Return what its case does with a wrong parameter, on each variant of an engine."""
    case = CASES[fault.case]
    variants = variants_of(parse_backend(engine))
    return {outcome_of(fault, case, each, sound(case.name, each)) for each in variants}


def test_there_are_thirty_wrong_parameters_with_a_name_each() -> None:
    assert len(set(NAMES)) == len(NAMES) >= 30


@pytest.mark.parametrize("fault", FAULTS, ids=NAMES)
def test_case_of_a_wrong_parameter_has_that_parameter(fault: Fault) -> None:
    case = CASES[fault.case]
    assert fault.change(case) is not case


def test_no_wrong_parameter_is_on_record_as_missed() -> None:
    records = set[Outcome]()
    for fault in FAULTS:
        records |= {fault.on_pybullet, fault.as_it_comes, fault.on_motrix}
    assert records == {"noticed", "not read", "wrong anyway", "refused"}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=NAMES)
def test_wrong_parameter_is_noticed_with_each_integrator_of_mujoco(fault: Fault) -> None:
    case = CASES[fault.case]
    for variant in variants_of(parse_backend("mujoco")):
        expected = fault.with_discrete if variant.integrator == "discrete" else "noticed"
        assert outcome_of(fault, case, variant, sound(case.name, variant)) == expected


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=NAMES)
def test_wrong_parameter_is_noticed_on_pybullet_if_it_is_read(fault: Fault) -> None:
    assert outcomes(fault, "pybullet") == {fault.on_pybullet}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=NAMES)
def test_wrong_parameter_is_not_missed_where_pybullet_as_it_comes_is_right(fault: Fault) -> None:
    assert outcomes(fault, "pybullet:engine") == {fault.as_it_comes}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=NAMES)
def test_wrong_parameter_is_noticed_on_motrix_if_it_is_read_and_the_case_is_right(
    fault: Fault,
) -> None:
    need_engine("motrix")
    assert outcomes(fault, "motrix") == {fault.on_motrix}


def test_for_every_case_a_wrong_parameter_is_named_that_it_notices() -> None:
    named = {fault.case for fault in FAULTS}
    assert named | set(OTHER_CASES) == set(CASES)
    assert not named & set(OTHER_CASES)


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHER_CASES)
def test_a_case_that_no_wrong_parameter_names_notices_one(name: str) -> None:
    word, integrator = OTHER_CASES[name]
    (fault,) = [each for each in FAULTS if each.name == word]
    variant = Variant(parse_backend("mujoco"), integrator)
    assert outcome_of(fault, CASES[name], variant, sound(name, variant)) == "noticed"


def test_a_case_that_notices_nothing_is_reported() -> None:
    seen = Cell("gravity", "fall", "mujoco Euler", "noticed")
    missed = Cell("gravity", "roll", "mujoco Euler", "missed")
    unread = Cell("friction", "fall", "pybullet Euler", "not read")
    cells = [seen, missed, unread]
    assert blind(cells) == [("roll", "mujoco Euler")]
    assert nowhere(cells) == ["roll"]
