"""Deformable bodies of two files: each by its own numbers, and what moves them otherwise."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.records import ModelDifference
from statemachine.interface import Array
from statemachine.lab.compare.matching import match_models
from statemachine.lab.model_differences import ListedDifference, compare
from statemachine.lab.why.causes import built, causes, differences_of

from .support.claims import numbers
from .support.files import written_all

CLOTHS = """<mujoco><worldbody><geom type="plane" size="1 1 0.1"/>
<flexcomp name="still" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" dim="2" pos="1 0 0.1">
  <elasticity elastic2d="both" young="200" thickness="0.01" damping="0.01"/></flexcomp>
<flexcomp name="cloth" type="grid" count="{count}" radius="{radius}" spacing="0.1 0.1 0.1" dim="2"
          pos="0 0 0.3">
  <edge damping="{edge}"/><pin id="0"/><contact friction="{friction}"/>
  <elasticity elastic2d="both" young="{young}" thickness="0.01" damping="{damping}"/>
</flexcomp></worldbody></mujoco>"""
VALUES = {
    **{"count": "3 3 1", "radius": 0.01, "edge": 0, "friction": 0.5, "young": 300},
    **{"damping": 0.02},
}


def _texts(folder: Path, **changes: str | float) -> None:
    texts = CLOTHS.format(**VALUES), CLOTHS.format(**(VALUES | changes))
    written_all(folder, {"left.xml": texts[0], "right.xml": texts[1]})


def _rows(folder: Path, **changes: str | float) -> list[ListedDifference]:
    _texts(folder, **changes)
    return list(compare(folder / "left.xml", folder / "right.xml").differences)


def _compiled(
    folder: Path, **changes: str | float
) -> tuple[sm.Model, sm.Model, tuple[ModelDifference, ...]]:
    _texts(folder, **changes)
    left, right = sm.load(folder / "left.xml"), sm.load(folder / "right.xml")
    return left, right, differences_of(left, right, match_models(left, right))


def _raw_end(raw: mujoco.MjModel) -> Array:
    data = mujoco.MjData(raw)
    mujoco.mj_step(raw, data, 300)
    return np.array(data.qpos)


@pytest.mark.parametrize(
    ("changes", "quantity", "values"),
    [
        ({"damping": 0.05}, "damping", (0.02, 0.05)),
        ({"edge": 0.3}, "edgedamping", (0.0, 0.3)),
        ({"radius": 0.02}, "radius", (0.01, 0.02)),
        ({"friction": 0.9}, "friction", (0.5, 0.9)),
    ],
)
def test_a_number_of_one_flex_is_told_of_that_flex(changes, quantity, values, tmp_path):
    (row,) = _rows(tmp_path, **changes)
    assert (row.kind, row.element, row.quantity) == ("flex", "cloth", quantity)
    assert (row.left, row.right) == values
    assert (row.left_line.line, row.right_line.line) == (4, 4)


def test_another_stiffness_is_told_by_an_element_of_the_flex(tmp_path):
    rows = _rows(tmp_path, young=600)
    assert {row.element for row in rows} == {"cloth"}
    assert {row.cause for row in rows} == {"stiffness of cloth", "bending stiffness of cloth"}
    for row in rows:
        assert numbers(row.right) == pytest.approx(2 * numbers(row.left))


@pytest.mark.parametrize("changes", [{"damping": 0.05}, {"young": 600}, {"radius": 0.03}])
def test_a_flex_with_the_lefts_numbers_moves_as_the_left(changes, tmp_path):
    left, right, rows = _compiled(tmp_path, **changes)
    edits = tuple(edit for cause in causes(rows) for edit in cause.edits(1))
    alike = built(right, edits).compiled
    ends = [_raw_end(raw) for raw in (left.compiled, right.compiled, alike)]
    assert np.array_equal(ends[0], ends[2])
    assert not np.array_equal(ends[0], ends[1])


def test_another_number_of_vertices_is_refused_by_the_name_of_the_flex(tmp_path):
    _, _, rows = _compiled(tmp_path, count="3 2 1")
    (row,) = [row for row in rows if row.subject == "mesh"]
    assert row.where == "cloth"
    assert row.refused
    counts = {value.quantity: (value.left, value.right) for value in row.values}
    assert counts["vertnum"] == ("9", "6")


def test_a_flex_that_one_side_has_is_told(tmp_path):
    _texts(tmp_path)
    text = (tmp_path / "left.xml").read_text(encoding="utf-8")
    start, end = text.index("<flexcomp"), text.index("</flexcomp>") + len("</flexcomp>")
    (tmp_path / "right.xml").write_text(text[:start] + text[end:], encoding="utf-8")
    rows = compare(tmp_path / "left.xml", tmp_path / "right.xml").differences
    (row,) = [row for row in rows if row.kind == "flex"]
    assert (row.element, row.left, row.right) == ("still", "there", "nothing")
    assert row.refused


def test_how_a_flex_is_drawn_is_no_difference(tmp_path):
    _texts(tmp_path)
    text = (tmp_path / "left.xml").read_text(encoding="utf-8")
    drawn = text.replace('name="cloth"', 'name="cloth" rgba="1 0 0 1" group="3" flatskin="true"')
    (tmp_path / "right.xml").write_text(drawn, encoding="utf-8")
    assert compare(tmp_path / "left.xml", tmp_path / "right.xml").differences == ()
