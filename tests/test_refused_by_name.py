"""What cannot be brought over is refused by its name, with both values and with what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from statemachine.lab.model_differences import ListedDifference, compare

from .support.files import written_all

ARM = """<mujoco><compiler angle="radian"/><worldbody>
<body name="a"><joint name="x" axis="1 0 0"/><joint name="y" axis="0 1 0" pos="0 0 0.1"/>
<geom name="one" size="0.05"/><site name="here" pos="0.1 0 0"/>
<body name="b" pos="0.2 0 0"><joint name="z" axis="0 0 1"/><geom name="two" size="0.05"/>
<site name="there" pos="0.1 0 0"/><site name="beside" pos="0 0.1 0"/></body></body>
<body name="c" pos="0 1 0"><joint name="w" axis="0 0 1"/><geom name="three" size="0.05"/></body>
</worldbody>
<tendon><spatial name="cable" stiffness="5"><site site="here"/><site site="there"/></spatial>
</tendon>
<actuator><pid name="hold" joint="z" kp="5" ki="1"/></actuator></mujoco>"""

_X, _Y = '<joint name="x" axis="1 0 0"/>', '<joint name="y" axis="0 1 0" pos="0 0 0.1"/>'


@pytest.mark.parametrize(
    ("old", "new", "cause", "values"),
    [
        (f"{_X}{_Y}", f"{_Y}{_X}", "order of the joints x, y of a", ()),
        (
            '<site site="there"/>',
            '<site site="beside"/><site site="there"/>',
            "path of cable",
            ("here, there", "here, beside, there"),
        ),
        ('kp="5"', 'kp="5" input="pos"', "law of hold", ()),
        ('name="two" size="0.05"', 'name="two" type="hfield" hfield="h"', "shape of two", ()),
    ],
)
def test_it_says_what_to_do_in_both_files(old, new, cause, values, tmp_path: Path) -> None:
    assert ARM.count(old) == 1
    right = ARM.replace(old, new)
    if "hfield" in new:
        field = '<asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1" elevation="0 1 0 1"/>'
        right = right.replace("<worldbody>", f"{field}</asset><worldbody>")
        right = right.replace(
            '<joint name="z" axis="0 0 1"/>',
            '<joint name="z" axis="0 0 1"/><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>',
        )
    written_all(tmp_path, {"left.xml": ARM, "right.xml": right})
    rows = compare(tmp_path / "left.xml", tmp_path / "right.xml").differences
    refused = [row for row in rows if row.refused]
    assert {row.cause for row in refused} == {cause}
    for row in refused:
        assert "both files" in row.refused or "same order" in row.refused
    if values:
        assert [(row.left, row.right) for row in refused] == [values]
    assert all(isinstance(row, ListedDifference) and row.left != row.right for row in refused)
