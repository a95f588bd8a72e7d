"""A cause is shown by what differs, with names and with digits that tell two values apart."""

from __future__ import annotations

from pathlib import Path

import pytest

import statemachine as sm
from statemachine.engines.records import TURNED, DifferingQuantity
from statemachine.lab.compare.matching import match_models
from statemachine.lab.why import Share
from statemachine.lab.why.causes import causes, differences_of
from statemachine.lab.why.values_page import heading_of, sides_of, texts_of, wording_of
from statemachine.lab.why.written import SourceLine, as_written

from .support.files import written_all
from .support.small_models import mjcf


def _share(name: str, kind: str, *values: DifferingQuantity) -> Share:
    return Share(name, values, None, kind)


def test_a_quantity_that_the_cause_does_not_say_is_named_in_the_heading():
    value = DifferingQuantity("solimp", (0.9, 0.95, 0.001), (0.5, 0.7, 0.01))
    share = _share("softness of floor", "geom", value)
    assert heading_of(share) == "softness of floor (solimp)"
    assert sides_of(share) == ("0.9 0.95 0.001", "0.5 0.7 0.01")


def test_several_quantities_stand_in_the_heading_each_with_its_name():
    values = DifferingQuantity("solref", 0.02, 0.06), DifferingQuantity("solmix", 1.0, 5.0)
    share = _share("softness of floor", "geom", *values)
    assert sides_of(share) == ("solref 0.02 and solmix 1", "solref 0.06 and solmix 5")


def test_inertia_whose_moments_are_equal_is_told_by_the_angle_of_its_axes():
    share = _share("inertia of m", "body", DifferingQuantity(TURNED, 0.0, 0.3, "rad"))
    assert wording_of(share) == "turned axes"
    assert sides_of(share)[1] == "17.2°"
    moments = DifferingQuantity("moments", (2.0, 1.0, 1.0), (3.0, 1.0, 1.0), "kg m²")
    assert wording_of(_share("inertia of m", "body", moments)) == "values"


@pytest.mark.parametrize(
    ("left", "right", "side"), [(None, 0.05, "on the right"), (0.05, None, "on the left")]
)
def test_a_filter_that_one_side_has_is_told_with_its_time_constant(left, right, side):
    value = DifferingQuantity("timeconst", left, right, "s")
    share = _share("filter of servo", "actuator", value)
    assert wording_of(share) == f"filter {side}"
    assert "50.0 ms" in sides_of(share)


def test_a_value_that_several_elements_have_alike_is_told_once():
    share = _share("friction of 9 geoms", "geom", *[DifferingQuantity("friction", 0.0, 1.0)] * 9)
    assert sides_of(share) == ("0", "1")


@pytest.mark.parametrize(
    ("left", "right", "texts"),
    [
        (1.0, 1.00001, ("1", "1.00001")),
        (1.0, 10.0, ("1", "10")),
        ((0.9, 0.95), (0.9, 0.95000001), ("0.9 0.95", "0.9 0.95000001")),
        ("filterexact", "filter", ("filterexact", "filter")),
        (-2.374, -2.0, ("-2.374", "-2")),
    ],
)
def test_as_many_digits_as_it_takes_to_tell_two_values_apart(left, right, texts):
    assert texts_of(DifferingQuantity("x", left, right)) == texts


PART = """<mujocoinclude>
<body name="b"><joint name="j" axis="0 1 0" damping="{}"/><geom size=".1" pos=".1 0 0"/></body>
</mujocoinclude>"""


def test_what_stands_in_an_included_file_is_told_with_its_line_there(tmp_path: Path) -> None:
    models = []
    for side, damping in (("left", 0.1), ("right", 0.2)):
        files = {"part.xml": PART.format(damping), "main.xml": mjcf('<include file="part.xml"/>')}
        models.append(sm.load(written_all(tmp_path / side, files) / "main.xml"))
    left, right = models
    found = causes(differences_of(left, right, match_models(left, right)))
    (cause,) = as_written(left.path, right.path, found)
    assert cause.place == SourceLine("part.xml", 2)
