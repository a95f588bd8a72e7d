"""`trace show` says in which units the figures of each column are."""

from __future__ import annotations

from pathlib import Path

import pytest

import statemachine as sm
from statemachine.lab.questions.trace_page import trace_page, unit_of
from statemachine.lab.recordings import Trace, record_scenario
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.show.blocks import Table

from .support.files import written
from .support.pages import blocks

CART = """<mujoco><worldbody>
<body name="cart"><joint name="rail" type="slide" axis="1 0 0"/><geom size=".1" mass="1"/>
<body name="pole" pos="0 0 .2"><joint name="pivot" axis="0 1 0"/>
<geom size=".05" pos="0 0 .3" mass=".2"/></body></body>
<body name="ball" pos="1 0 1"><freejoint/><geom size=".1" mass="1"/></body>
</worldbody><actuator><position joint="rail" kp="9"/><motor joint="pivot"/></actuator></mujoco>"""


def waved(file: Path) -> Trace:
    return record_scenario(SCENARIOS["waves"], sm.load(file))


@pytest.fixture
def trace(tmp_path: Path) -> Trace:
    """Return a run of a robot that slides and turns, beside a ball that floats."""
    return waved(written(tmp_path / "cart.xml", CART))


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("time", "s"),
        ("qpos", "rad, m"),
        ("qvel", "rad/s, m/s"),
        ("ctrl", "m, of the actuator"),
        ("xpos", "m"),
        ("xquat", ""),
        ("qfrc_bias", "N·m, N"),
        ("energy", "J"),
    ],
)
def test_a_column_has_the_units_of_its_coordinates(trace: Trace, column: str, unit: str) -> None:
    assert unit_of(trace.header, column) == unit


def test_a_rotation_of_qpos_has_no_unit(tmp_path: Path) -> None:
    hinge = CART.replace('type="slide" axis="1 0 0"', "").replace("<freejoint/>", "")
    assert unit_of(waved(written(tmp_path / "a.xml", hinge)).header, "qpos") == "rad"


def test_the_page_of_a_trace_shows_the_units_of_its_columns(trace: Trace) -> None:
    (table,) = [t for t in blocks(trace_page(trace, "a.npz"), Table) if "unit" in t.headers]
    shown = {row[0]: row[table.headers.index("unit")] for row in table.rows}
    assert shown["qvel"] == "rad/s, m/s"
