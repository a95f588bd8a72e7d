"""What `compare --models` lists is what `--why` brings over: each difference once, by one name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import statemachine as sm
from statemachine.compare.matching import match_models
from statemachine.compare.models import Difference, compare
from statemachine.compare.why.causes import differences_of

from .conftest import Cli
from .explained import ALONE, ARM, Case, changed


def _listed(folder: Path, right: str, left: str = ARM) -> list[Difference]:
    (folder / "left.xml").write_text(left)
    (folder / "right.xml").write_text(right)
    rows = compare(folder / "left.xml", folder / "right.xml").found.differences
    return [row for row in rows if row.matters]


@pytest.mark.parametrize("name", [name for name in ALONE if name != "start"])
def test_each_difference_is_told_once_by_the_name_of_its_cause(name, tmp_path):
    case = ALONE[name]
    rows = _listed(tmp_path, changed(ARM, case))
    assert {row.causes for row in rows} == {(case.cause,)}
    figures = [row.figure for row in rows]
    assert len(figures) == (2 if name == "medium" else 1), figures  # density and viscosity
    assert not any(row.refused for row in rows)


@pytest.mark.parametrize(
    "names",
    [
        ("mass", "gains", "damping", "axis"),
        ("geom moved", "extra shape", "floor", "pair"),
        ("gravity", "tendon", "equality", "exclude", "actuator"),
    ],
)
def test_many_differences_are_each_in_both_lists(names, tmp_path):
    right = ARM
    for name in names:
        right = changed(right, ALONE[name])
    rows = _listed(tmp_path, right)
    one, two = (sm.load(tmp_path / f"{side}.xml") for side in ("left", "right"))
    found = differences_of(one, two, match_models(one, two))
    assert {name for row in rows for name in row.causes} == {each.title for each in found}
    assert len({(row.where, row.figure, row.causes) for row in rows}) == len(rows)


def test_what_cannot_be_brought_over_is_said_with_its_reason(cli: Cli, tmp_path):
    more = (
        '<body name="more"><joint name="more" axis="1 0 0"/><inertial mass="0.2" pos="0 0 0" '
        'diaginertia="0.001 0.001 0.001"/></body><site name="tip"'
    )
    rows = _listed(tmp_path, ARM.replace('<site name="tip"', more))
    refused = {name for row in rows if row.refused for name in row.causes}
    assert refused == {"extra joint of more"}
    done = cli(
        "compare", "--models", str(tmp_path / "left.xml"), str(tmp_path / "right.xml"), code=1
    )
    assert "a joint cannot be added or taken away" in done.stdout


def test_the_words_are_those_of_two_sides(cli: Cli, tmp_path):
    right = ARM.replace('"elbow"', '"e"').replace('name="shoulder"', 'name="s"')
    right = right.replace('joint="shoulder"', 'joint="s"')
    case = Case('range="-2 2"', 'range="-2 0.4"', "")
    _listed(tmp_path, changed(right, case))
    files = str(tmp_path / "left.xml"), str(tmp_path / "right.xml")
    for option in ("--map", "--rename"):  # the name that it had
        words = ("compare", "--models", *files, option, "elbow=e", option, "shoulder=s", "--json")
        found = json.loads(cli(*words).stdout)["found"]["differences"]
        assert [row["causes"] for row in found] == [["range of shoulder"]]
    page = cli("compare", "--models", *files).stdout
    assert "left" in page
    assert "Range of shoulder" in page
    assert "the left goes 91.7° further" in " ".join(page.split())


def test_a_file_that_does_not_compile_has_its_description(tmp_path):
    gone = '<asset><mesh name="gone" file="gone.stl"/></asset><worldbody>'
    right = changed(ARM, ALONE["damping"]).replace("<worldbody>", gone)
    right = right.replace('<site name="tip"', '<geom type="mesh" mesh="gone"/><site name="tip"')
    rows = {row.subject: row for row in _listed(tmp_path, right)}
    assert rows["damping"].causes == ()
    assert (rows["damping"].one, rows["damping"].two) == (0.1, 0.2)
