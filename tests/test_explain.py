"""Why two sides differ: a known cause gets its share of the gap, and its name and values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import statemachine as sm
from statemachine.engines.records import DifferingQuantity
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.why import Explanation, WhyRequest, explain

from .support.claims import assert_has
from .support.explained import (
    ALONE,
    ARM,
    FLOOR,
    HOME,
    STILL,
    SWING,
    Case,
    changed,
    explained,
    is_equalized,
    shares,
    with_changes,
)
from .support.known_causes import EXTRA, at_70_to_30, that_interact
from .support.requirements import ROOT

_QUICK_CAUSES = ("mass", "damping", "gains", "softness")


@dataclass(frozen=True)
class OneCause:
    """A pair with one cause that acts, and one that does not, and what was found.

    Attributes:
        cause: Name of the one that acts.
        idle: Name of the one that does not act on what is compared.
        explanation: What was found.
    """

    cause: str
    idle: str
    explanation: Explanation


@pytest.fixture(
    scope="module",
    params=[pytest.param(n, marks=() if n in _QUICK_CAUSES else pytest.mark.slow) for n in ALONE],
)
def one_cause(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> OneCause:
    """The arm against one with a change that acts and one that does not."""
    case = ALONE[request.param]
    if case.quantity == "slides":
        idle = Case('mass="0.3"', 'mass="0.31"', "mass of lower")
    else:
        idle = Case('0.05" damping="1"', '0.05" damping="1.5"', "damping of spring")
    found = explained(
        tmp_path_factory.mktemp("pair"),
        ARM,
        changed(ARM, case, idle),
        scenario=HOME,
        quantity=case.quantity,
        seconds=0.4,
    )
    return OneCause(case.cause, idle.cause, found)


def test_the_one_cause_that_acts_explains_the_gap(one_cause: OneCause) -> None:
    found = one_cause.explanation
    assert found.gap > 100 * found.negligible
    assert shares(found)[one_cause.cause] >= 0.95
    assert found.verdict.holds


def test_no_cause_is_listed_but_the_two_changes(one_cause: OneCause) -> None:
    listed = set(shares(one_cause.explanation))
    # An actuator more gives the other side a ctrl more, too.
    assert listed <= {one_cause.cause, one_cause.idle, "extra actuator of more"}


def test_a_cause_that_does_not_act_has_no_share(one_cause: OneCause) -> None:
    told = shares(one_cause.explanation)
    others = {name: share for name, share in told.items() if name != one_cause.cause}
    assert all(abs(share) <= 0.02 for share in others.values()), others


def test_nothing_is_left_where_the_cause_is_equalized(one_cause: OneCause) -> None:
    assert is_equalized(one_cause.explanation)
    assert one_cause.explanation.located == 0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("game", "seconds", "method", "off"),
    [(at_70_to_30, 3.0, "one at a time", 0.05), (that_interact, 6.0, "all sets", 0.01)],
)
def test_two_causes_get_their_shapley_value(
    game: Any, seconds: float, method: str, off: float, seed: int, tmp_path: Path
) -> None:
    left, right, parts = game(seed)
    found = explained(
        tmp_path, left, right, scenario=STILL, seconds=seconds, measure="end", quantity="slides"
    )
    assert_has(found, gap=pytest.approx(parts.pop("gap"), rel=1e-3), method=method)
    assert {name: shares(found)[name] for name in parts} == pytest.approx(parts, abs=off)


def test_a_joint_more_stays_unexplained(tmp_path: Path) -> None:
    found = explained(tmp_path, ARM, ARM.replace(*EXTRA), scenario=SWING, seconds=0.4)
    assert [row.name for row in found.shares if row.share is None] == ["extra joint of more"]
    assert found.unexplained > 0.9
    assert found.unmatched[1]["joint"] == ("more",)
    assert not found.verdict.holds


def test_a_joint_more_on_a_body_that_is_there_does_not_hang_it_elsewhere(tmp_path: Path) -> None:
    site = '<site name="tip"'
    right = ARM.replace(site, f'<joint name="tilt" axis="1 0 0"/>{site}')
    found = explained(tmp_path, ARM, right, scenario=SWING, seconds=0.2)
    refused = {row.name for row in found.shares if row.note}
    assert refused == {"joints of lower", "extra joint of tilt"}


LINKS = """<mujoco><default><geom type="capsule" {geom}/></default><worldbody>
<body name="a" pos="0 0 1"><joint name="j" axis="0 1 0" damping="0.1"/>
<geom name="beam" fromto="0 0 0 0.2 0 0" size="0.02" {beam}/>
<body name="b" pos="0.2 0 0"><joint name="k" axis="0 1 0" damping="0.1"/>
<geom fromto="0 0 0 0.1 0 0" size="0.02"/></body></body></worldbody>
<actuator><motor joint="k"/></actuator></mujoco>"""


@pytest.mark.parametrize(
    ("slot", "values", "name", "unit", "line"),
    [
        ("geom", ('density="500"', 'density="600"'), "density of a, b", "kg/m³", 1),
        ("geom", ("", 'density="1200"'), "density of a, b", "kg/m³", 1),
        ("geom", ('mass="0.2"', 'mass="0.3"'), "mass of a, b", "kg", 1),
        ("beam", ('mass="1"', 'mass="1.5"'), "mass of a", "kg", 3),
    ],
)
def test_one_edit_of_the_file_is_one_cause(
    slot: str, values: tuple[str, str], name: str, unit: str, line: int, tmp_path: Path
) -> None:
    """What multiplies masses and moments of inertia, named as the file has it."""
    left, right = (LINKS.format(**{"geom": "", "beam": "", slot: value}) for value in values)
    (row,) = explained(tmp_path, left, right, scenario=STILL, seconds=0.5).shares
    numbers = tuple(float(value.split('"')[1]) if value else 1000.0 for value in values)
    assert_has(row, name=name, share=pytest.approx(1.0))
    (value,) = row.values
    assert value.unit == unit
    assert (value.left, value.right, row.place.line) == pytest.approx((*numbers, line))


@pytest.fixture
def texts_of_a_moved_centre() -> tuple[str, str]:
    """A link with a weight beside it, and one whose larger mass moves the centre of both."""
    other = '/><geom type="sphere" pos="0 0 0.1" size="0.02" mass="0.2"'
    left, right = (LINKS.format(geom="", beam=f'mass="{mass}"{other}') for mass in (1.0, 1.5))
    return left, right


def test_a_mass_that_moves_the_centre_of_its_body_is_one_cause(
    texts_of_a_moved_centre: tuple[str, str], tmp_path: Path
) -> None:
    (row,) = explained(tmp_path, *texts_of_a_moved_centre, scenario=STILL, seconds=0.5).shares
    assert_has(row, name="mass, centre of mass and inertia of a", share=pytest.approx(1.0))
    (value,) = row.values
    assert (value.left, value.right, row.place.line) == pytest.approx((1.2, 1.7, 3))


def test_a_finer_list_parts_a_mass_from_the_centre_that_it_moves(
    texts_of_a_moved_centre: tuple[str, str], tmp_path: Path
) -> None:
    pair = texts_of_a_moved_centre
    found = explained(tmp_path, *pair, scenario=STILL, seconds=0.5, finer=True)
    assert {"mass of a", "centre of mass (x) of a"} < set(shares(found))


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(
    "name",
    ["mass", *(pytest.param(n, marks=pytest.mark.slow) for n in ("gains", "gear", "place"))],
)
def test_across_engines_the_file_is_told_from_the_engine(name: str, tmp_path: Path) -> None:
    bare = ARM.replace(FLOOR, "")
    case = ALONE[name]
    found = explained(
        *(tmp_path, bare, changed(bare, case)),
        engines=("mujoco", "pybullet"),
        quantity="joints",
        seconds=0.5,
    )
    told = shares(found)
    assert told[case.cause] >= 0.95, told
    assert all(abs(share) <= 0.02 for cause, share in told.items() if cause != case.cause), told
    assert found.verdict.holds


@pytest.mark.usefixtures("bullet")
@pytest.mark.filterwarnings("ignore:PyBullet. contacts begin")
def test_a_margin_that_pybullet_leaves_out_is_noted(tmp_path: Path) -> None:
    text = ARM.replace('name="ball_shape"', 'name="ball_shape" margin="0.01"')
    engines = ("mujoco", "pybullet")
    found = explained(tmp_path, text, text, engines=engines, quantity="ball", seconds=0.2)
    assert any(
        note.startswith("pybullet:") and "margin" in note and "ball_shape" in note
        for note in found.notes
    )


def test_a_stiffness_that_mujoco_raises_on_both_sides_is_noted_and_no_gap(tmp_path: Path) -> None:
    """MuJoCo raises both to two timesteps: another value, the same motion."""
    stiff = [
        ARM.replace('name="ball_shape"', f'name="ball_shape" priority="1" solref="{time} 1"')
        for time in ("0.0005", "0.001")
    ]
    found = explained(tmp_path, *stiff, seconds=0.2)
    assert any(note.startswith("mujoco:") and "refsafe" in note for note in found.notes)
    assert found.gap == 0.0


@pytest.mark.slow
def test_the_robot_of_a_urdf_is_that_of_the_mjcf() -> None:
    files = "so101/so101", ROOT / "models/so101/so101.urdf"
    left, right = (sm.load(file, contacts=False) for file in files)
    found = explain(WhyRequest(left, right, scenario("fall")))
    # A URDF knows no integrator, armature or timestep; the links, as far as it has digits, are one.
    assert {each.kind for each in found.shares if abs(each.share or 0.0) > 1e-3} <= {
        "option",
        "joint",
    }
    assert found.unexplained == pytest.approx(0.0, abs=1e-6)


# What a place, an inertia, a range, a servo or gravity has of several entries.
ENTRIES = [
    ('<body name="lower" pos="0 0 -0.2">', '<body name="lower" pos="0.01 0 -0.21">'),
    ('diaginertia="0.001 0.001 0.0002"', 'diaginertia="0.001 0.0012 0.0004"'),
    ('range="-2 2"', 'range="-1.9 0.4"'),
    (
        '<position name="shoulder" joint="shoulder" kp="20" kv="1"/>',
        '<position name="shoulder" joint="shoulder" kp="24" kv="1.5"/>',
    ),
    ('timestep="0.002"', 'timestep="0.002" gravity="0.5 0 -9"'),
]


@pytest.fixture(scope="module")
def finer(tmp_path_factory: pytest.TempPathFactory) -> Explanation:
    """An explanation by single entries."""
    right = with_changes(ARM, ENTRIES)
    folder = tmp_path_factory.mktemp("pair")
    return explained(folder, ARM, right, scenario=HOME, finer=True, seconds=0.4)


@pytest.mark.slow
def test_a_finer_list_goes_down_to_single_entries(finer: Explanation) -> None:
    entries: set[tuple[str, str]] = set()
    for name in shares(finer):
        entry, _, element = name.partition(" of ")
        entries.add((entry, element))
    assert entries == {
        *(("place (x)", "lower"), ("place (z)", "lower")),
        *(("inertia (diaginertia[1])", "lower"), ("inertia (diaginertia[2])", "lower")),
        *(("range (lower end)", "shoulder"), ("range (upper end)", "shoulder")),
        *(("gains (kp)", "shoulder"), ("gains (kv)", "shoulder")),
        *(("gravity (x)", ""), ("gravity (z)", "")),
    }


@pytest.mark.slow
def test_nothing_is_left_where_all_entries_are_equalized(finer: Explanation) -> None:
    assert is_equalized(finer)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("range (upper end) of shoulder", DifferingQuantity("upper end", 2.0, 0.4, "rad")),
        ("gravity (z)", DifferingQuantity("z", -9.81, -9.0, "m/s²")),
    ],
)
def test_an_entry_has_its_two_values_and_their_unit(
    name: str, value: DifferingQuantity, finer: Explanation
) -> None:
    assert {row.name: row.values for row in finer.shares}[name] == (value,)


@pytest.mark.slow
def test_an_entry_that_no_motion_depends_on_explains_nothing(finer: Explanation) -> None:
    """A hinge about y feels one moment of inertia."""
    told = {k: shares(finer)[f"inertia (diaginertia[{k}]) of lower"] for k in (1, 2)}
    assert abs(told[2]) < 1e-9
    assert abs(told[1]) > 1e-6
