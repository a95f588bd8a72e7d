"""`compare --models` of an engine: what its backend supplies in a run does not act on a motion."""

from __future__ import annotations

from pathlib import Path

import pytest

from statemachine.lab.model_differences import ModelsComparison, compare
from statemachine.lab.model_differences.page import page
from statemachine.show.blocks import Code

from .support.explained import ARM
from .support.files import written
from .support.pages import blocks

pytestmark = pytest.mark.usefixtures("bullet")

PAIR, AS_IT_COMES = ("mujoco", "pybullet"), ("mujoco", "pybullet:engine")


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    return written(tmp_path / "arm.xml", ARM)


def acting(result: ModelsComparison) -> set[tuple[str, str, str]]:
    return {row.key for row in result.differences if row.matters}


def test_what_acts_or_is_supplied_is_what_acts_on_the_engine_as_it_comes(arm: Path) -> None:
    behind, as_it_comes = compare(arm, arm, PAIR), compare(arm, arm, AS_IT_COMES)
    supplied = {row.key for row in behind.differences if row.supplied}
    assert acting(behind) | supplied == acting(as_it_comes)
    assert not acting(behind) & supplied
    assert not any(row.supplied for row in as_it_comes.differences)


@pytest.mark.parametrize(
    "quantity", ["gravity", "timestep", "armature", "frictionloss", "actuator", "kp"]
)
def test_what_the_backend_computes_with_does_not_act(arm: Path, quantity: str) -> None:
    rows = [row for row in compare(arm, arm, PAIR).differences if row.quantity == quantity]
    assert rows
    assert all(row.supplied and not row.matters for row in rows)


def test_what_the_engine_does_natively_goes_on_acting(tmp_path: Path) -> None:
    """PyBullet's contacts are its own: it has no counterpart of a solref."""
    soft = ARM.replace('friction="0.8 0.005 0.0001"', 'solref="0.05 1"')
    path = written(tmp_path / "soft.xml", soft)
    left = [row for row in compare(path, path, PAIR).differences if row.subject == "contact"]
    assert any(row.matters and row.quantity.startswith("solref") for row in left)


def test_what_the_files_differ_in_goes_on_acting(arm: Path, tmp_path: Path) -> None:
    heavy = written(tmp_path / "heavy.xml", ARM.replace('armature="0.01"', 'armature="0.05"'))
    rows = [row for row in compare(arm, heavy, PAIR).differences if row.quantity == "armature"]
    assert rows
    assert all(row.matters for row in rows)


def test_the_command_for_a_motion_runs_the_engine_that_was_asked(arm: Path) -> None:
    (code,) = blocks(page(compare(arm, arm, AS_IT_COMES)), Code)
    assert f"{arm}@pybullet:engine" in " ".join(code.lines).split()
