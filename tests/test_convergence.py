"""Finer timesteps: what is discretisation vanishes with them, and what is a difference stays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.compare.convergence import convergence
from statemachine.errors import EndedEarlyError
from statemachine.page import Figures
from statemachine.report.steps import convergence as page
from statemachine.runs import Trace, record

from .conftest import refused, written
from .small_models import FALLING_BAR


def found_of(folder: Path, *changes: dict[str, str], seconds: float = 1.0) -> Figures:
    usual = {"integrator": "implicitfast", "flag": "", "mass": "0.1", "height": "0.3"}
    usual["touch"] = 'contype="0" conaffinity="0"'
    models = [
        sm.load(written(folder / f"{k}.xml", FALLING_BAR.format(**usual | change)))
        for k, change in enumerate(changes)
    ]

    def run(finer: int) -> tuple[Trace, Trace]:
        one, two = (record(model.replace(substeps=finer), None, seconds) for model in models)
        return one, two

    return convergence(run)


def test_explicit_against_implicit_damping_is_discretisation(tmp_path: Path) -> None:
    explicit = {"integrator": "Euler", "flag": '<flag eulerdamp="disable"/>'}
    found = found_of(tmp_path, {}, explicit)
    (joint,) = [each for each in found.whole if each.kind == "joint"]
    assert joint.verdict == "discretisation"
    assert joint.gaps[0] > 1e-3
    assert [joint.gaps[k] / joint.gaps[k + 1] for k in (0, 1)] == pytest.approx([2, 2], rel=0.1)
    # Each side has as far to go, or more.
    assert joint.left[0] + joint.right[0] > joint.gaps[0] - joint.gaps[2]
    assert found.vanishes
    assert page(found, "fall").holds


@pytest.mark.parametrize(
    ("left", "right", "verdict"), [("RK4", "Euler", "discretisation"), ("RK4", "RK4", "rounding")]
)
def test_another_order_of_integration_is_discretisation_and_one_side_twice_no_gap(
    tmp_path: Path, left: str, right: str, verdict: str
) -> None:
    found = found_of(tmp_path, {"integrator": left}, {"integrator": right})
    assert {each.verdict for each in (*found.whole, *found.before)} == {verdict}


def test_a_changed_mass_stays(tmp_path: Path) -> None:
    found = found_of(tmp_path, {}, {"mass": "0.11"})
    assert {each.verdict for each in found.whole if each.kind == "joint"} == {"stays"}
    assert not found.vanishes
    assert not page(found, "fall").holds


def test_what_is_both_is_so_in_part(tmp_path: Path) -> None:
    explicit = {"integrator": "Euler", "flag": '<flag eulerdamp="disable"/>', "mass": "0.101"}
    found = found_of(tmp_path, {}, explicit, seconds=0.3)
    (joint,) = [each for each in found.whole if each.kind == "joint"]
    assert joint.verdict == "in part"
    assert 0.1 * joint.gaps[0] < joint.limit < 0.9 * joint.gaps[0]


def test_a_touch_parts_what_can_be_said(tmp_path: Path) -> None:
    touching = {"touch": ""}
    found: Any = found_of(tmp_path, touching, {**touching, "mass": "0.1"}, seconds=0.5)
    assert 0.1 < found.touch < 0.4


def test_a_run_that_ends_early_is_no_limit(tmp_path: Path) -> None:
    model = sm.load(
        written(
            tmp_path / "ends.xml",
            FALLING_BAR.format(integrator="Euler", flag="", mass="0.1", height="1", touch=""),
        )
    )

    def run(finer: int) -> tuple[Trace, Trace]:
        trace = record(model.replace(substeps=finer), None, 0.1)
        object.__setattr__(trace.header, "ended", "it left every bound")
        return trace, trace

    refused((EndedEarlyError, "it left every bound", lambda: convergence(run)))
