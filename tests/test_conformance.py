"""Every backend keeps the contract."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from statemachine import conformance

from .conftest import need_engine


@pytest.fixture
def lab(backend: str) -> Iterator[conformance.Lab]:
    with conformance.Lab(backend) as lab:
        yield lab


@pytest.mark.parametrize("check", conformance.CHECKS)
def test_backend_keeps(lab: conformance.Lab, check: str) -> None:
    if "witness" in check:
        need_engine("pinocchio")
    conformance.CHECKS[check](lab)


def test_run_reports_every_check(backend: str) -> None:
    outcomes = conformance.run(backend)
    assert [outcome.check for outcome in outcomes] == list(conformance.CHECKS)
    allowed = {"passed"} if backend == "mujoco" else {"passed", "skipped"}
    assert {outcome.result for outcome in outcomes} <= allowed, outcomes
    assert len(outcomes) > 40
