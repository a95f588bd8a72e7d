"""Why two sides differ: every known cause is found, weighed and brought to the same."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.records import DifferingQuantity
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.why import Explanation, WhyRequest, explain
from statemachine.lab.why.shapley import shapley

from .support.claims import assert_has, assert_in
from .support.explained import (
    ALONE,
    ARM,
    FLOOR,
    SWING,
    Case,
    balls,
    changed,
    explained,
    hills,
    mesh,
    with_changes,
)
from .support.files import written
from .support.known_causes import (
    BROUGHT_OVER,
    CORE,
    EASILY_MISSED,
    EQUIVALENT,
    EXTRA,
    LED,
    SAME,
    at_70_to_30,
    said_otherwise,
    that_interact,
    with_actuators_swapped,
)
from .support.requirements import ROOT

HOME = replace(SWING, keyframe="home")
STILL = replace(SWING, controller=lambda _model, _seed: lambda _model, _data: [0.0])


def shares(found: Explanation) -> dict[str, float]:
    """The part of each cause; of one without any it is not a number."""
    return {e.name: float("nan") if e.share is None else e.share for e in found.shares}


def is_brought(found: Explanation) -> bool:
    """Whether nothing is left where all causes are brought to the same."""
    return found.brought is not None and found.brought <= 1e-9 * found.gap + 1e-12


_QUICK_CAUSES = ("mass", "damping", "gains", "softness")


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n in _QUICK_CAUSES else pytest.mark.slow) for n in ALONE],
)
def test_one_cause_is_found_and_explains_all(name, tmp_path):
    case = ALONE[name]
    idle = (
        Case('mass="0.3"', 'mass="0.31"', "mass of lower")
        if case.quantity == "slides"
        else Case('0.05" damping="1"', '0.05" damping="1.5"', "damping of spring")
    )
    right = changed(ARM, case, idle)
    found = explained(tmp_path, ARM, right, scenario=HOME, quantity=case.quantity)
    told = shares(found)
    assert found.gap > 100 * found.negligible
    assert told[case.cause] >= 0.95, told
    assert all(abs(share) <= 0.02 for cause, share in told.items() if cause != case.cause), told
    assert set(told) <= {case.cause, idle.cause, "extra actuator of more"}
    assert is_brought(found)
    assert_has(found, located=0)
    assert found.verdict.holds


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


SMALL, LARGE, COARSE = {"size": 0.05}, {"size": 0.055}, {"corners": 30}


SHARED = [
    # One mesh for both, which is another.
    (
        balls("m", "m", m=SMALL),
        balls("m", "m", m=LARGE),
        ["shape of ball_shape, again_shape"],
    ),
    # Two files of one mesh are the same as one.
    (
        balls("m", "n", m=SMALL, n=SMALL),
        balls("m", "m", m=LARGE),
        ["shape of ball_shape, again_shape"],
    ),
    # The right has the left's mesh, too, whatever its size: each geom can take it up.
    (
        balls("m", "n", m=SMALL, n=COARSE),
        balls("n", "n", m=SMALL, n=COARSE),
        ["shape of ball_shape"],
    ),
    (
        balls("m", "n", m=SMALL, n=COARSE),
        balls("n", "m", m=SMALL, n=COARSE),
        ["shape of ball_shape", "shape of again_shape"],
    ),
    # The mesh that one geom could take up is the one that another's is copied into.
    (
        balls("m", "k", m=SMALL, k={"size": 0.06}),
        balls("n", "m", n=LARGE, m=SMALL),
        ["shape of ball_shape", "shape of again_shape"],
    ),
]


@pytest.mark.parametrize("other", ["margin", "exclude"])
def test_a_pair_that_is_taken_away_is_as_its_geoms_are_then(other, tmp_path):
    """Its geoms have another margin, or do not touch by themselves, until that is brought over."""
    right = changed(ARM, ALONE["pair"], ALONE[other])
    found = explained(tmp_path, ARM, right, scenario=HOME, quantity="ball position")
    assert_has(found, brought=0.0, method="all sets")
    alone = {row.name: row.alone for row in found.shares}
    # Without its pair the ball falls through the floor, from which it is excluded.
    assert ((alone["extra pair of pair 0"] or 0.0) < -1) == (other == "exclude")


# Meshes and height fields that cannot be brought over, and the reason.
REFUSED = [
    (mesh(), mesh(corners=30), "another number of vertices"),
    (hills(), hills(points=11), "other rows or columns"),
    *(
        (
            balls("m", other, m=SMALL, k={"noise": 2e-3}, n=LARGE),
            balls("n", "n", n=LARGE),
            "another geom has this mesh, too",
        )
        for other in ("k", "n")
    ),
]


@pytest.mark.parametrize(("left", "right", "reason"), REFUSED)
def test_what_is_not_brought_over_is_refused_with_its_reason(left, right, reason, tmp_path):
    found = explained(tmp_path, left, right, scenario=HOME, quantity="ball")
    assert found.shares
    assert all(reason in share.note for share in found.shares)
    assert not found.verdict.holds


@pytest.mark.slow
def test_what_cannot_be_brought_over_stays_unexplained(tmp_path):
    found = explained(tmp_path, ARM, ARM.replace(*EXTRA), scenario=SWING)
    assert [each.name for each in found.shares if each.share is None] == ["extra joint of more"]
    assert found.unexplained > 0.9
    assert not found.verdict.holds
    assert found.unmatched[1]["joint"] == ("more",)
    # A joint more on a body that is there does not hang it on another part.
    assert {"joints of lower", "extra joint of tilt"} == {
        each.name
        for each in explained(
            tmp_path,
            ARM,
            ARM.replace('<site name="tip"', '<joint name="tilt" axis="1 0 0"/><site name="tip"'),
            scenario=SWING,
        ).shares
        if each.note
    }


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


def test_a_mass_that_moves_the_centre_of_its_body_is_one_cause(tmp_path: Path) -> None:
    other = '/><geom type="sphere" pos="0 0 0.1" size="0.02" mass="0.2"'
    texts = (LINKS.format(geom="", beam=f'mass="{mass}"{other}') for mass in (1.0, 1.5))
    run = partial(explained, tmp_path, *texts, scenario=STILL, seconds=0.5)
    (row,) = run().shares
    assert_has(row, name="mass, centre of mass and inertia of a", share=pytest.approx(1.0))
    (value,) = row.values
    assert (value.left, value.right, row.place.line) == pytest.approx((1.2, 1.7, 3))
    assert {"mass of a", "centre of mass (x) of a"} < set(shares(run(finer=True)))


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(
    "name",
    [
        "mass",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("gains", "damping", "gear", "place", "armature")
        ),
    ],
)
def test_across_engines_the_file_is_told_from_the_engine(name, tmp_path):
    bare = ARM.replace(FLOOR, "")
    case = ALONE[name]
    found = explained(
        tmp_path, bare, changed(bare, case), engines=("mujoco", "pybullet"), quantity="joints"
    )
    told = shares(found)
    assert told[case.cause] >= 0.95, told
    assert all(abs(share) <= 0.02 for cause, share in told.items() if cause != case.cause), told
    assert found.verdict.holds


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
@pytest.mark.filterwarnings("ignore:PyBullet. contacts begin")
def test_what_an_engine_leaves_out_is_said(tmp_path: Path) -> None:
    text = ARM.replace('name="ball_shape"', 'name="ball_shape" margin="0.01"')
    engines = ("mujoco", "pybullet")
    found = explained(tmp_path, text, text, engines=engines, quantity="ball", seconds=0.5)
    assert_in(" ".join(found.notes), "pybullet: contacts begin at a distance of 0", "ball_shape")
    # MuJoCo raises both to two timesteps: another value, the same motion.
    stiff = [
        ARM.replace('name="ball_shape"', f'name="ball_shape" priority="1" solref="{time} 1"')
        for time in ("0.0005", "0.001")
    ]
    found = explained(tmp_path, *stiff, seconds=0.2)
    assert_in(" ".join(found.notes), "mujoco: a contact's solref below two timesteps acts")
    assert found.gap == 0.0


@pytest.mark.slow
def test_the_robot_of_a_urdf_is_that_of_the_mjcf():
    files = "so101/so101", ROOT / "models/so101/so101.urdf"
    left, right = (sm.load(file, contacts=False) for file in files)
    found = explain(WhyRequest(left, right, scenario("fall")))
    # A URDF knows no integrator, armature or timestep; the links, as far as it has digits, are one.
    assert {each.kind for each in found.shares if abs(each.share or 0.0) > 1e-3} <= {
        "option",
        "joint",
    }
    assert found.unexplained == pytest.approx(0.0, abs=1e-6)


def test_every_array_of_a_compiled_model_is_compared_or_has_no_effect():
    """A later engine may have more of them: then this fails, and the tables are to grow."""
    mujoco = pytest.importorskip("mujoco")
    from statemachine.engines.mujoco import _fields as fields

    raw = sm.load("so101/scene").compiled
    arrays = [n for n in dir(raw) if n[0] != "_" and isinstance(getattr(raw, n), np.ndarray)]
    assert [name for name in arrays if not fields.known(name)] == []
    known = {name for names in fields.OPTIONS.values() for name in names} | set(fields.FLAGS)
    assert [n for n in dir(raw.opt) if not n.startswith("_") and n not in known] == []
    assert set(fields.IDLE_FLAGS) <= {
        *mujoco.mjtDisableBit.__members__,
        *mujoco.mjtEnableBit.__members__,
    }


# Compared only where something else of the file makes them act; they have tests of their own.
ACTS_WITH_AN_OPTION = ("body_gravcomp", "actuator_group", "tree_sleep_policy")


@pytest.mark.slow
@pytest.mark.parametrize("model", ["so101/scene_box"])
def test_each_figure_of_a_model_is_found_and_brought_over(model):
    """One entry of each array is changed: the list has it, and the edits undo it."""
    from statemachine.engines.mujoco import _fields as fields
    from statemachine.engines.mujoco.differences import differences, edited
    from statemachine.lab.compare.matching import match_models

    left, random = sm.load(model), np.random.default_rng(0)
    raw, tried = left.compiled, 0
    for row in (row for rows in fields.ROWS.values() for row in rows):
        name = row.fields[0]
        array = getattr(raw, name)
        places = np.arange(len(array))
        if name.startswith("geom"):
            places = np.flatnonzero(raw.geom_contype | raw.geom_conaffinity)
        if not len(places) or row.when or name in ACTS_WITH_AN_OPTION:
            continue
        place = int(random.choice(places))
        old = np.array(array[place])
        new = ~old if old.dtype.kind == "b" else old + 1 if old.dtype.kind == "i" else old + 0.01
        right = left.with_compiled(edited(raw, [(name, (place,), new)]))
        (found,) = differences(raw, right.compiled, match_models(left, right))
        assert np.array_equal(getattr(edited(right.compiled, found.edits), name), array), name
        tried += 1
    assert tried > 15


def test_drawn_orders_come_with_their_error():
    names = [f"cause {k}" for k in range(10)]

    def value(brought: frozenset[str]) -> float:
        return max(0.0, 1.0 - (len(brought) / 10) ** 2)

    found = shapley(names, value, 1.0, sets=400, seed=3)
    assert found.method == "drawn orders"
    for name in names:
        assert abs((found.share[name] or 0.0) - 1 / 10) <= 4 * found.error[name] + 1e-12
    assert found == shapley(names, value, 1.0, sets=400, seed=3)


def test_a_set_that_cannot_be_run_is_told_and_only_orders_without_it_count():
    found = shapley(["a", "b"], lambda s: None if s == {"a"} else 1.0 - 0.4 * len(s), 1.0)
    assert (found.failures, found.alone["a"]) == ((frozenset({"a"}),), None)
    assert found.share == pytest.approx({"a": 0.4, "b": 0.4})


HOME_LEAVE = replace(HOME, controller=lambda _model, _seed: lambda _model, _data: None)
STAY = replace(HOME_LEAVE, keyframe=None)
BALL_SPRING = ('stiffness="0.1"', 'stiffness="0.3"')


BALL = {"quantity": "ball"}
BY_NUMBER = replace(HOME, controller=lambda _model, _seed: lambda _model, _data: [0.8, -0.5])
# As in a run of two sides: what the left was told last holds, and each begins with its own.
TOLD_ONCE = replace(
    HOME, controller=lambda _m, _s: lambda _model, data: [0.8, -0.5] if data.time < 0.1 else None
)
PUSHED = ARM.replace(
    "</actuator>", '<general name="push" site="tip" gear="0 0 0 0 1 0" gainprm="1"/></actuator>'
).replace('ctrl="0 0"', 'ctrl="0 0 0.1"')
OTHER_CTRL = with_changes(
    ARM, [('0.6 0 0.2 1 0 0 0  0" ctrl="0 0"', '0.6 0 0.2 1 0 0 0  0" ctrl="0.3 0"')]
)
# Two sides that move alike, and what is asked of them.
ALIKE: dict[str, tuple[str, str, dict[str, Any]]] = {
    **{name: (ARM, said_otherwise(name), {}) for name in SAME},
    **{name: (*sides, BALL) for name, sides in EQUIVALENT.items()},
    "names that are given": (
        ARM,
        ARM.replace('"elbow"', '"e"').replace('"shoulder"', '"s"').replace("_shape", "_s"),
        {"scenario": BY_NUMBER, "names": {"elbow": "e", "shoulder": "s"}},
    ),
    "a site that is found by its place": (PUSHED, PUSHED.replace('"tip"', '"end"'), {}),
    "no command after a while": (ARM, ARM.replace('kp="20"', 'kp="20.0"'), {"scenario": TOLD_ONCE}),
    "a start that is the left's": (
        OTHER_CTRL, ARM[: ARM.index("<keyframe>")] + "</mujoco>", {"scenario": HOME_LEAVE}
    ),
    "a mocap body and a cord": (LED, LED, {"scenario": HOME_LEAVE}),
    "a mocap body, a cord and another site": (
        LED, with_changes(LED, [(CORE, '<site name="first"/>' + CORE)]), {"scenario": HOME_LEAVE}
    ),
    "a mocap body, a cord and a colour": (
        LED,
        with_changes(LED, [('name="side"', 'name="side" rgba="1 0 0 1"')]),
        {"scenario": HOME_LEAVE},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ALIKE)
def test_another_way_of_saying_it_is_no_difference(name, tmp_path):
    left, right, how = ALIKE[name]
    found = explained(tmp_path, left, right, **{"scenario": HOME, **how})
    # An order matters to who reads or writes by number.
    orders = {"permuted actuators": ["order of ctrl"], "permuted bodies": ["order of qpos"]}
    assert [each.name for each in found.shares] == orders.get(name, [])
    assert_has(found.verdict, holds=True, divides=False)


def _easily_missed(name: str) -> tuple[str, str, list[str], dict[str, Any]]:
    both, other, cause, *quantity = EASILY_MISSED[name]
    left = with_changes(LED, both)
    # A delay shows only where the command changes.
    how: dict[str, Any] = {"scenario": HOME if "delay" in name else HOME_LEAVE}
    return (
        left,
        with_changes(left, other),
        [cause],
        how | ({"quantity": quantity[0]} if quantity else {}),
    )


# A joint more, or an equality that holds one of them.
SEVERAL = with_changes(
    LED,
    [('<site name="low"',
      '<joint name="twist" axis="1 0 0" damping="0.1"/><site name="low"')],
)  # fmt: skip
HELD = with_changes(LED, [("<equality>", '<equality><joint joint1="shoulder" joint2="elbow"/>')])
ANOTHER_ZERO = [('name="elbow" axis', 'name="elbow" ref="0.2" axis')]
# A ball joint, which is not among the hinges.
HIP = with_changes(
    ARM,
    [
        ('<body name="weight"',
         '<body pos="1 0 1"><joint name="hip" type="ball" stiffness="0.1"/>'
         '<geom type="capsule" size="0.02" fromto="0 0 0 0.1 0 -0.2" mass="0.3"/></body>'
         '<body name="weight"'),
        ('0 0.2 1 0 0 0  0"', '0 0.2 1 0 0 0  1 0 0 0  0"'),
    ],
)  # fmt: skip
SHORT = with_changes(ARM, [('range="-2 2"', 'range="-.3 .3"')])  # the motion reaches its ends
ASLEEP = with_changes(ARM, [('implicitfast"/>', 'implicitfast"><flag sleep="enable"/></option>')])
# A floating body falls onto a table that was moved: the table moved, not the robot.
TABLE = with_changes(
    ARM,
    [('<body name="ball"',
      '<body name="table" pos="0.6 0 0.05"><geom name="top" type="box" size=".03 .03 .05"/></body>'
      '<body name="ball"')],
)  # fmt: skip
TENDON = (
    '<tendon><fixed name="band" stiffness="5" springlength="0.1">'
    '<joint joint="elbow" coef="{}"/></fixed></tendon><actuator>'
)
# Two sides, their causes, and what is asked of them.
BROUGHT: dict[str, tuple[str, str, list[str], dict[str, Any]]] = {
    **{name: _easily_missed(name) for name in EASILY_MISSED},
    **{f"shared mesh {k}": (*row, BALL) for k, row in enumerate(SHARED)},
    **{cause: (left, right, [cause], BALL) for left, right, cause in BROUGHT_OVER},
    "another zero of one of several joints": (
        SEVERAL, with_changes(SEVERAL, ANOTHER_ZERO), ["zero of lower", "start"], {"scenario": STAY}
    ),
    "another zero of a joint that an equality holds": (
        HELD, with_changes(HELD, ANOTHER_ZERO), ["zero of lower", "start"], {"scenario": STAY}
    ),
    "a spring beside the hinges": (
        HIP, with_changes(HIP, [('stiffness="40"', 'stiffness="50"')]), ["spring of spring"], {}
    ),
    "a spring of a ball joint": (HIP, with_changes(HIP, [BALL_SPRING]), ["spring of hip"], {}),
    "what sleeps from the start": (
        ASLEEP,
        with_changes(ASLEEP, [('<body name="ball"', '<body name="ball" sleep="init"')]),
        ["sleep policy of ball"],
        BALL,
    ),
    "what is fixed elsewhere": (
        TABLE, TABLE.replace('pos="0.6 0 0.05"', 'pos="0.64 0 0.05"'), ["place of top"], BALL
    ),
    "the coefficient of a fixed tendon": (
ARM.replace("<actuator>", TENDON.format(1)), ARM.replace("<actuator>", TENDON.format(1.5)),
        ["coefficients of band"],
        {},
    ),
    "how a floating body turns": (
        ARM,
        ARM.replace('name="ball_shape"', 'name="ball_shape" pos="0.001 0 0"'),
        ["place of ball_shape"],
        {"scenario": HOME_LEAVE, "quantity": "ball, rotation"},
    ),
    "other actuators for who writes by number": (
        ARM, with_actuators_swapped(ARM), ["order of ctrl"], {"scenario": BY_NUMBER}
    ),
    "limits off": (
        SHORT,
        with_changes(
            SHORT, [('implicitfast"/>', 'implicitfast"><flag limit="disable"/></option>')]
        ),
        ["limit"],
        {},
    ),
    "no command on either side": (
        ARM, OTHER_CTRL, ["ctrl of the start"], {"scenario": HOME_LEAVE}
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROUGHT)
def test_causes_are_brought_over(name, tmp_path):
    left, right, causes, how = BROUGHT[name]
    # A cord that leaves its pulley, and what sleeps until it is touched, hang on a last bit.
    how = {"scenario": HOME, "uncertain": None, **how}
    found = explained(tmp_path, left, right, **how)
    assert found.gap > 100 * found.negligible
    told = shares(found)
    assert sorted(told) == sorted(causes)
    assert len(told) > 1 or told[causes[0]] == pytest.approx(1.0)
    # A weld is turned round; else the bits are the same.
    rounding = 1e-15 * ("parameters" in causes[0])
    assert_has(found, brought=pytest.approx(0.0, abs=rounding))
    assert found.verdict.holds
    assert found.unit == "rad" or "rotation" not in how.get("quantity", "")


@pytest.mark.slow
def test_a_finer_list_goes_down_to_single_entries(tmp_path):
    """What each entry of a place, an inertia, a range, gravity or a servo explains by itself."""
    changes = [
        ('<body name="lower" pos="0 0 -0.2">', '<body name="lower" pos="0.01 0 -0.21">'),
        ('diaginertia="0.001 0.001 0.0002"', 'diaginertia="0.001 0.0012 0.0004"'),
        ('range="-2 2"', 'range="-1.9 0.4"'),
        (
            '<position name="shoulder" joint="shoulder" kp="20" kv="1"/>',
            '<position name="shoulder" joint="shoulder" kp="24" kv="1.5"/>',
        ),
        ('timestep="0.002"', 'timestep="0.002" gravity="0.5 0 -9"'),
    ]
    how: Any = {"scenario": HOME, "finer": True, "seconds": 0.5}
    found = explained(tmp_path, ARM, with_changes(ARM, changes), **how)
    assert set(shares(found)) == {
        *("place (x) of lower", "place (z) of lower"),
        *("inertia (diaginertia[1]) of lower", "inertia (diaginertia[2]) of lower"),
        *("range (lower end) of shoulder", "range (upper end) of shoulder"),
        *("gains (kp) of shoulder", "gains (kv) of shoulder"),
        *("gravity (x)", "gravity (z)"),
    }
    assert is_brought(found)
    values = {each.name: each.values for each in found.shares}
    assert values["range (upper end) of shoulder"] == (
        DifferingQuantity("upper end", 2.0, 0.4, "rad"),
    )
    assert values["gravity (z)"] == (DifferingQuantity("z", -9.81, -9.0, "m/s²"),)
    # An entry that no motion depends on explains nothing: a hinge about y feels one moment.
    told = shares(found)
    assert abs(told["inertia (diaginertia[2]) of lower"]) < 1e-9
    assert abs(told["inertia (diaginertia[1]) of lower"]) > 1e-6


@pytest.mark.slow
def test_entries_of_every_case_bring_the_right_to_the_left(tmp_path):
    from statemachine.engines.mujoco._quantities import same
    from statemachine.engines.mujoco.differences import differences, edited, entries
    from statemachine.lab.compare.matching import match_models

    for name, case in ALONE.items():
        texts = (ARM, changed(ARM, case))
        left, right = (
            sm.load(written(tmp_path / f"{k}.xml", text)) for k, text in enumerate(texts)
        )
        found = differences(left.compiled, right.compiled, match_models(left, right))
        parts = [part for each in found for part in entries(right.compiled, each)]
        ways = [
            edited(right.compiled, [edit for each in those for edit in each.edits])
            for those in (found, parts)
        ]
        arrays = [n for n in dir(ways[0]) if isinstance(getattr(ways[0], n), np.ndarray)]
        assert [n for n in arrays if not same(*(getattr(way, n) for way in ways))] == [], name
