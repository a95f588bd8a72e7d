"""What `compare --models` lists is what `--why` brings over: each difference once, by one name."""

from __future__ import annotations

import json

import pytest

from .support.claims import assert_has
from .support.explained import ALONE, ARM, Case, changed
from .support.processes import Cli
from .support.two_files import differences_that_matter, written_sides


@pytest.mark.parametrize("name", [name for name in ALONE if name != "start"])
def test_each_difference_is_told_once_by_the_name_of_its_cause(name, tmp_path):
    case = ALONE[name]
    rows = differences_that_matter(tmp_path, ARM, changed(ARM, case))
    assert {row.cause for row in rows} == {case.cause}
    figures = [row.quantity for row in rows]
    # A medium has a density and a viscosity, a filter two masks; a box has other sizes than a
    # sphere, and an actuator is told with its two gains.
    several = {"medium": 2, "filter": 2, "type": 2, "actuator": 3}
    assert len(figures) == several.get(name, 1), figures
    assert not any(row.refused for row in rows)


def test_the_words_are_those_of_two_sides(here: Cli, tmp_path):
    right = ARM.replace('"elbow"', '"e"').replace('name="shoulder"', 'name="s"')
    right = right.replace('joint="shoulder"', 'joint="s"')
    written_sides(tmp_path, ARM, changed(right, Case('range="-2 2"', 'range="-2 0.4"', "")))
    words = ("left.xml", "right.xml", "--map", "elbow=e", "--map", "shoulder=s", "--json")
    found = json.loads(here("compare", "--models", *words).stdout)["differences"]
    assert [row["cause"] for row in found] == ["range of shoulder"]


_CYLINDER = '<geom name="lower_shape" type="capsule" size="0.02"'
_ELBOW_DRIVE = '<position name="elbow" joint="elbow" kp="20" kv="1"/>'


@pytest.mark.parametrize(
    ("left", "right", "figure", "values"),
    [
        (
            (_CYLINDER, f'{_CYLINDER} fluidshape="ellipsoid"'),
            (_CYLINDER, f'{_CYLINDER} fluidshape="ellipsoid" fluidcoef="0.9 0.25 1.5 1 1"'),
            "fluidcoef",
            (0.5, 0.9),
        ),
        (
            ("", ""),
            (_ELBOW_DRIVE, _ELBOW_DRIVE.replace('joint="elbow"', 'joint="shoulder"')),
            "drives",
            ("joint elbow", "joint shoulder"),
        ),
        (
            ("", ""),
            (_ELBOW_DRIVE, _ELBOW_DRIVE.replace("/>", ' timeconst="0.1"/>')),
            "dyntype",
            ("none", "filterexact"),
        ),
    ],
)
def test_a_row_names_what_differs_and_never_two_equal_values(left, right, figure, values, tmp_path):
    rows = differences_that_matter(tmp_path, ARM.replace(*left), ARM.replace(*right))
    assert (figure, values) in [(row.quantity, (row.left, row.right)) for row in rows]
    assert all(row.left != row.right for row in rows)


def test_what_is_carried_by_another_part_cannot_be_brought_over(tmp_path):
    """The ball with its hinge hangs on the lower link there, and stands on the world here."""
    start, end = ARM.index('<body name="ball"'), ARM.index('<body name="weight"')
    ball = ARM[start:end].replace('<freejoint name="ball"/>', '<joint name="ball" axis="0 1 0"/>')
    left = (ARM[:start] + ball + ARM[end:]).replace("0.6 0 0.2 1 0 0 0", "0")
    right = left.replace(ball, "").replace('<site name="tip"', f'{ball}<site name="tip"')
    (row,) = [
        row for row in differences_that_matter(tmp_path, left, right) if row.quantity == "parent"
    ]
    assert_has(
        row,
        left="world",
        right="lower",
        cause="parent of ball",
        refused="it hangs on another part: put its body into the same one in both files",
    )


def test_a_part_that_is_cut_otherwise_tells_each_figure(tmp_path):
    """One more body on a link on the right; its mass is taken from the link, its place is not."""
    inertial = '<inertial mass="0.3" pos="0 0 -0.08" diaginertia="0.001 0.001 0.0002"/>'
    piece = inertial.replace("0.3", "{}").replace("/>", "/></body>")
    left = '<body name="p" pos="0.1 0 0">' + piece.format("0.1")
    right = '<body name="q" pos="0.2 0 0">' + piece.format("0.1")
    texts = [ARM.replace(inertial, f"{inertial}{body}") for body in (left, right)]
    rows = {row.subject: row for row in differences_that_matter(tmp_path, *texts)}
    assert rows.keys() == {"centre of mass", "inertia"}
    assert rows["centre of mass"].size == pytest.approx(0.1 * 0.1 / 0.4)
    assert {row.cause for row in rows.values()} == {"centre of mass of lower"}
