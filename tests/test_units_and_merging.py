"""Each figure of a difference has its own unit; rows merge by their values alone."""

from __future__ import annotations

import math

import pytest

from statemachine.lab.why.causes import causes

from .support.two_files import causes_of_texts

MODEL = """
<mujoco><compiler angle="radian"/><worldbody>
<body name="l" pos="0 0 1"><joint name="j" axis="0 1 0" {joint}/>
<geom name="shape" type="capsule" fromto="0 0 0 0 0 .3" size=".02"/>
<body name="hand" pos="0 0 .3" {body}><joint name="k" axis="0 1 0" {hinge}/>
<inertial mass="1" pos="0 0 0" diaginertia="3 2 1.5" {inertial}/>
<geom name="box" type="box" size=".02 .03 .04" mass="0" {geom}/>
<site name="tip" {site}/>
<body name="slider"><joint name="s" type="slide" {slide}/><geom size=".01" mass="0.1" contype="0"
 conaffinity="0"/></body>
</body></body></worldbody></mujoco>
"""
SLOTS = dict.fromkeys(("joint", "body", "hinge", "inertial", "geom", "site", "slide"), "")
SLOTS |= {"joint": 'range="-3 3"', "slide": 'range="-3 3"'}
# An edit of the right: its slot and text, the figure that differs, both values and the unit.
EDITS = {
    "a body is turned": ("body", 'euler="0 0.2 0"', "turned by", 0.2, "rad"),
    "a geom is turned": ("geom", 'euler="0 0.3 0"', "turned by", 0.3, "rad"),
    "a site is turned": ("site", 'euler="0 0.4 0"', "turned by", 0.4, "rad"),
    "a reference turns a body": ("hinge", 'ref="0.5"', "turned by", 0.5, "rad"),
    "axes of inertia are turned": ("inertial", 'euler="0 0 0.3"', "turned by", 0.3, "rad"),
    "a geom is elsewhere": ("geom", 'pos="0 0 0.1"', "place", (0.0, 0.0, 0.1), "m"),
    "a hinge has a range": ("joint", 'range="-1 2"', "range", (-1.0, 2.0), "rad"),
    "a slide has a range": ("slide", 'range="-1 2"', "range", (-1.0, 2.0), "m"),
    "a hinge is damped": ("joint", 'damping="2"', "damping", 2.0, "N·m·s"),
    "a slide is damped": ("slide", 'damping="2"', "damping", 2.0, "N·s/m"),
}


@pytest.mark.parametrize("name", EDITS)
def test_each_figure_has_its_own_unit(name, tmp_path):
    slot, text, figure, value, unit = EDITS[name]
    rows = causes_of_texts(tmp_path, MODEL.format(**SLOTS), MODEL.format(**{**SLOTS, slot: text}))
    known = {value.quantity: value for row in rows for value in row.values}
    shown, its_unit = known[figure].right, known[figure].unit
    if isinstance(value, float):
        assert shown == pytest.approx(value, rel=1e-9)
        assert isinstance(shown, float)
        assert math.isfinite(shown)
    else:
        assert shown == pytest.approx(value)
    assert its_unit == unit


FEET = (
    '<body name="b{0}" pos="{0} 0 1"><freejoint/><geom name="g{0}" size=".1" condim="{1}"/></body>'
)


def test_rows_merge_only_if_they_share_both_values(tmp_path):
    """However many differences there are: here more than 24 others."""
    left, right = (
        "<mujoco><worldbody>"
        + "".join(FEET.format(k, side(k)) for k in range(19))
        + "".join(
            f'<body pos="{k} 3 1"><freejoint/>'
            f'<geom name="h{k}" size=".1" friction="{f(k)}"/></body>'
            for k in range(30)
        )
        + "</worldbody></mujoco>"
        for side, f in (
            (lambda k: 6 if k < 4 else 1, lambda k: 0.5 + 0.01 * k),
            (lambda _: 3, lambda _: 0.4),
        )
    )
    found = causes(causes_of_texts(tmp_path, left, right))
    for cause in found:
        assert len({row.values for row in cause.differences}) == 1
    sizes = [len(c.differences) for c in found if c.name.startswith("friction dimensions")]
    assert sorted(sizes) == [4, 15]
    assert len({cause.name for cause in found}) == len(found)
