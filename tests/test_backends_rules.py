"""Rules of MuJoCo's that backends compute by themselves, against MuJoCo and closed forms."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import delays, dense, edits
from statemachine.backends.actuators import commands_needed, control_names, delay_steps, servos
from statemachine.backends.bullet import soft
from statemachine.backends.bullet.contacts import Solid, Surfaces, contacts_of, damping_ratios
from statemachine.backends.compiled.model import fastest, gravity
from statemachine.backends.contact_rules import bodies_meet, masks_meet, mixed
from statemachine.backends.starts import overlap_warning, overlaps_in, places_in, usual_start
from statemachine.errors import BadInputError
from statemachine.interface import Array
from statemachine.rotations import matrix_from_quat

from .support.claims import overlapping
from .support.small_models import loaded


def raw_of(folder: Path, world: str, rest: str = "", option: str = "") -> Any:
    """Return the compiled model of a world, and what stands behind and before it."""
    return loaded(folder, world, rest, option=option).compiled


# Dense algebra.

RANDOM = np.random.default_rng(3)
SQUARE = RANDOM.normal(size=(4, 4))
POSITIVE = SQUARE @ SQUARE.T + 0.1 * np.eye(4)
VECTOR = RANDOM.normal(size=4)


def test_products_and_solutions() -> None:
    wide = RANDOM.normal(size=(2, 4))
    assert dense.times(wide, VECTOR) == pytest.approx(wide @ VECTOR)
    assert dense.product(wide, SQUARE) == pytest.approx(wide @ SQUARE)
    assert dense.dot(VECTOR, SQUARE[1].copy()) == pytest.approx(VECTOR @ SQUARE[1])
    factor = dense.factored(POSITIVE.copy())
    assert dense.solved(factor, VECTOR.copy()) == pytest.approx(np.linalg.solve(POSITIVE, VECTOR))


def by_trying(matrix: Array, right: Array, least: Array, most: Array) -> Array:
    """Return the solution between bounds, of all choices of which rows are at a bound."""
    for sides in itertools.product((-1, 0, 1), repeat=len(right)):
        side = np.array(sides)
        force = np.where(side < 0, least, most)
        free = side == 0
        if not np.isfinite(force[~free]).all():
            continue
        known = matrix[np.ix_(free, ~free)] @ force[~free]
        force[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free] - known)
        miss = matrix @ force - right
        within = (force >= least - 1e-12) & (force <= most + 1e-12)
        held = ((side < 0) & (miss >= 0)) | ((side > 0) & (miss <= 0)) | free
        if (within & held).all():
            return force
    raise AssertionError("no choice solves it")


@pytest.mark.parametrize("seed", range(12))
def test_a_solution_between_bounds_is_that_of_trying_all(seed: int) -> None:
    random = np.random.default_rng(seed)
    square = random.normal(size=(4, 4))
    matrix, right = square @ square.T + 0.05 * np.eye(4), 3 * random.normal(size=4)
    least, most = np.array([-0.3, 0.0, 0.0, -np.inf]), np.array([0.3, np.inf, 0.2, np.inf])
    start = random.normal(size=4)
    found = dense.pivoted(matrix, right, least, most, start)
    assert found == pytest.approx(by_trying(matrix, right, least, most), abs=1e-8)


def test_a_row_between_equal_bounds_stays_there() -> None:
    bound = np.array([0.25, -np.inf])
    found = dense.pivoted(
        np.array([[2.0, 1.0], [1.0, 2.0]]),
        np.zeros(2),
        bound,
        np.array([0.25, np.inf]),
        np.zeros(2),
    )
    assert found == pytest.approx([0.25, -0.125])


# Soft constraints.

JOINT = (
    '<body><joint name="j" axis="0 1 0" range="-20 30" limited="true" {style}/>'
    '<geom size=".1" mass="2" pos=".3 0 0"/></body>'
)
STYLES = {
    "as by default": "",
    "time and ratio": 'solreflimit=".05 .6" solimplimit=".3 .8 .2 .4 3"',
    "stiffness and damping": 'solreflimit="-300 -7" solimplimit=".3 .8 .2 .4 3"',
    "faster than two steps": 'solreflimit=".001 1.2"',
    "beyond the middle": 'solimplimit=".2 .9 .05 .3 2"',
    "without a width": 'solimplimit=".2 .7 0 .5 2"',
    "beyond what is taken": 'solimplimit="0 1 .01 .5 2"',
}


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("degrees", [31.0, 33.0, 60.0])
def test_a_soft_limit_is_mujoco_s(tmp_path: Path, style: str, degrees: float) -> None:
    model = loaded(tmp_path, JOINT.format(style=STYLES[style]))
    raw = model.compiled
    with sm.make_data(model) as data:
        data.qpos[0], data.qvel[0] = math.radians(degrees), 0.7
        sm.forward(model, data)
        limits = data.raw
        shortest = soft.shortest_time(raw, {"refsafe": False})
        (kind,) = soft.soft(raw.jnt_solref, raw.jnt_solimp, raw.dof_invweight0, shortest)
        gap = math.radians(30 - degrees)
        row = soft.soft_row(kind, np.array([-1.0]), gap, -0.7)
        assert row.softness == pytest.approx(float(limits.efc_R[0]), rel=1e-9)
        assert row.reference == pytest.approx(float(limits.efc_aref[0]), rel=1e-9)
        assert (row.least, row.most) == (0.0, math.inf)
        stiffness, damping, impedance = limits.efc_KBIP[0][:3].tolist()
        assert kind[1][:2] == pytest.approx([damping, stiffness])
        assert soft.impedance(kind[0], gap) == pytest.approx(impedance)


def test_the_shortest_time_is_two_steps_where_the_file_takes_care_of_it(tmp_path: Path) -> None:
    raw = raw_of(tmp_path, JOINT.format(style=""), option='<option timestep="0.004"/>')
    assert soft.shortest_time(raw, {"refsafe": False}) == pytest.approx(0.008)
    assert soft.shortest_time(raw, {"refsafe": True}) == 0


def test_the_impedance_of_a_distance_instead_of_the_gap() -> None:
    (kind,) = soft.soft(
        np.array([[0.02, 1.0]]), np.array([[0.2, 0.8, 0.1, 0.5, 1.0]]), np.ones(1), 0.0
    )
    row = soft.soft_row(kind, np.ones(1), 0.02, 0.0, (-1.0, 2.0), 0.05)
    assert soft.impedance(kind[0], 0.05) == pytest.approx(0.5)
    assert row.softness == pytest.approx(1.0)
    assert (row.least, row.most) == (-1.0, 2.0)
    assert row.reference == pytest.approx(-kind[1][1] * 0.5 * 0.02)


def test_what_is_not_limited_has_no_bounds() -> None:
    low, high = soft.bounds_of(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([True, False]))
    assert (low.tolist(), high.tolist()) == ([1, -math.inf], [2, math.inf])


# Contact parameters.

TOUCHING = (
    '<geom name="floor" type="plane" size="1 1 .1" {floor}/>'
    '<body pos="0 0 .05"><freejoint/><geom name="ball" size=".06" {ball}/></body>'
)
PARAMETERS = {
    "as by default": ("", ""),
    "the larger friction": ('friction=".5 .02 .003"', 'friction=".9 .01 .004"'),
    "condim": ('condim="1"', 'condim="4"'),
    "weights": (
        'solmix="3" solref=".03 .8" solimp=".8 .9 .002 .4 2"',
        'solmix="1" solref=".05 1" solimp=".7 .95 .001 .5 3"',
    ),
    "stiffness": ('solref="-100 -5"', 'solref="-300 -2"'),
    "stiffness of one": ('solref="-100 -5"', 'solref=".03 1"'),
    "priority of the first": ('priority="2" friction=".1 .02 .003" condim="1"', 'condim="6"'),
    "priority of the second": ('condim="6"', 'priority="1" friction=".1 .02 .003" condim="4"'),
    "no weight": ('solmix="0" solref=".03 .8"', 'solmix="0" solref=".05 1"'),
}


@pytest.mark.parametrize("name", PARAMETERS)
@overlapping
def test_the_parameters_of_a_contact_are_mujoco_s(tmp_path: Path, name: str) -> None:
    floor, ball = PARAMETERS[name]
    model = loaded(tmp_path, TOUCHING.format(floor=floor, ball=ball))
    with sm.make_data(model) as data:
        sm.forward(model, data)
        contact = data.raw.contact
        for pair in ((0, 1), (1, 0)):
            condim, friction, solref, solimp = mixed(model.compiled, *pair)
            assert condim == contact.dim[0]
            assert friction == pytest.approx(contact.friction[0][[0, 2, 3]])
            assert solref == pytest.approx(contact.solref[0])
            assert solimp == pytest.approx(contact.solimp[0])


# Five balls in one place: of a chain, of what is welded to it, and of the world.
CROWD = (
    '<geom name="stand" size=".1"/><body name="root"><joint axis="0 1 0"/><geom name="root" '
    'size=".1"/><body name="welded"><geom name="welded" size=".1" contype="2" conaffinity="1"/>'
    '</body><body name="child"><joint axis="1 0 0"/><geom name="child" size=".1"/>'
    '<body name="grandchild"><joint axis="0 0 1"/><geom name="grandchild" size=".1" '
    'contype="1" conaffinity="2"/></body></body></body>'
    '<body name="other"><joint axis="0 1 0"/><geom name="other" size=".1" contype="4" '
    'conaffinity="4"/></body>'
)


@pytest.mark.parametrize(
    ("rest", "option"),
    [
        ("", ""),
        ('<contact><exclude body1="grandchild" body2="root"/></contact>', ""),
        ("", '<option><flag filterparent="disable"/></option>'),
    ],
)
@overlapping
def test_which_geoms_meet_is_what_mujoco_finds(tmp_path: Path, rest: str, option: str) -> None:
    model = loaded(tmp_path, CROWD, rest, option=option)
    raw = model.compiled
    with sm.make_data(model) as data:
        sm.forward(model, data)
        touching = {frozenset(pair) for pair in data.contacts.geom.tolist()}
    bodies = raw.geom_bodyid.tolist()
    for a, b in itertools.permutations(range(raw.ngeom), 2):
        meet = masks_meet(raw, a, b) and bodies_meet(raw, bodies[a], bodies[b])
        assert meet == (frozenset((a, b)) in touching), (a, b)


# Frictions of PyBullet's links.

THREE = (
    '<geom name="floor" type="plane" size="1 1 .1" friction="{}"/>'
    '<body pos="0 0 2"><freejoint/><geom name="a" size=".1" friction="{}" condim="6"/></body>'
    '<body pos="0 0 4"><freejoint/><geom name="b" size=".1" friction="{}" condim="4"/></body>'
)


def test_products_of_frictions_are_those_of_the_pairs(tmp_path: Path) -> None:
    raw = raw_of(tmp_path, THREE.format(".2 .01 .001", ".4 .02 .002", ".8 .03 .002"))
    surfaces = Surfaces(raw)
    assert [solid.geoms for solid in surfaces.solids] == [(0,), (1,), (2,)]
    assert [solid.plane for solid in surfaces.solids] == [True, False, False]
    for i, j in surfaces.meeting:
        wanted = mixed(raw, i, j)[1]
        slide = surfaces.slide
        assert slide[i] * slide[j] == pytest.approx(wanted[0])
        spin = surfaces.spin[i] * slide[j] + surfaces.spin[j] * slide[i]
        assert spin == pytest.approx(wanted[1])
    assert not [text for text in surfaces.differences if text.startswith("friction")]


def test_a_friction_that_no_product_gives_is_told(tmp_path: Path) -> None:
    """Of three pairs two are zero, by a condim of 1; the third is not."""
    world = (
        THREE.format("1 0 0", "1 0 0", "1 0 0")
        .replace('condim="6"', "")
        .replace('condim="4"', 'condim="1"')
        .replace('condim="1"', 'condim="1" priority="1"')
    )
    surfaces = Surfaces(raw_of(tmp_path, world))
    assert surfaces.slide.tolist() == [1, 1, 0]
    assert surfaces.differences == []


def test_geoms_of_a_body_that_meet_the_same_are_one_solid(tmp_path: Path) -> None:
    world = (
        '<geom name="floor" type="plane" size="1 1 .1"/><body pos="0 0 1"><freejoint/>'
        '<geom size=".1"/><geom size=".2" contype="2" conaffinity="0"/><geom size=".3"/>'
        '<geom size=".4" contype="0" conaffinity="0"/></body>'
        '<body pos="0 0 3"><freejoint/><geom size=".1" conaffinity="3"/></body>'
    )
    surfaces = Surfaces(raw_of(tmp_path, world))
    assert surfaces.solids == [
        Solid(0, (0,), plane=True),
        Solid(1, (1, 3), part=0),
        Solid(1, (2,), part=1),
        Solid(2, (5,), part=0),
    ]
    assert surfaces.touching.tolist() == [True, True, True, True, False, True]
    assert surfaces.pairs == {
        (0, 1): True,
        (0, 2): False,
        (0, 3): True,
        (1, 2): False,
        (1, 3): True,
        (2, 3): True,
    }
    assert surfaces.of_one_robot(whole=False) == []
    assert surfaces.of_one_robot(whole=True) == [(0, 1), (0, 3), (1, 3), (2, 3)]


def test_a_file_without_contacts_has_nothing_that_touches(tmp_path: Path) -> None:
    for flag in ("contact", "constraint"):
        option = f'<option><flag {flag}="disable"/></option>'
        surfaces = Surfaces(raw_of(tmp_path, THREE.format("1", "1", "1"), option=option))
        assert surfaces.solids == []
        assert surfaces.meeting == []


def test_a_pair_that_is_named_has_its_own_parameters(tmp_path: Path) -> None:
    pair = (
        '<contact><pair geom1="a" geom2="floor" condim="3" friction=".3 .3 .1 .1 .1" '
        'solref="-400 -8"/></contact>'
    )
    raw = raw_of(tmp_path, THREE.format("1 0 0", "1 0 0", "1 0 0"), pair)
    surfaces = Surfaces(raw)
    assert surfaces.slide[0] * surfaces.slide[1] == pytest.approx(0.3)
    assert surfaces.slide[0] * surfaces.slide[2] == pytest.approx(1.0)
    assert surfaces.spin.tolist() == [0, 0, 0]  # its condim leaves them out
    # b / (2 √k), and a ratio as it is.
    assert damping_ratios(raw, [(0, 1), (1, 0), (0, 2)]) == pytest.approx([0.2, 0.2, 1.0])


# Contacts as PyBullet has them.

SHAPES = (
    '<body name="b" pos="1 0 0"><freejoint/><geom type="box" size=".1 .2 .3" pos="0 0 1"/>'
    '<geom type="capsule" size=".1 .2" pos="0 0 -1"/><geom type="cylinder" size=".1 .2" '
    'pos="2 0 0"/><geom size=".1" pos="-2 0 0"/></body>'
    '<body name="c" pos="9 0 0"><freejoint/><geom size=".1"/></body>'
)


def point(
    bodies: tuple[int, int],
    on_a: tuple[float, float, float],
    on_b: tuple[float, float, float],
    normal: tuple[float, float, float],
    distance: float = -0.01,
    push: float = 0.0,
    frictions: tuple[float, float] = (0.0, 0.0),
) -> tuple[Any, ...]:
    """Return a row of getContactPoints; friction acts along x and y."""
    ends = (0, *bodies, -1, -1, on_a, on_b, normal, distance, push)
    return (*ends, frictions[0], (1.0, 0.0, 0.0), frictions[1], (0.0, 1.0, 0.0))


def contacts(
    raw: Any, points: list[tuple[Any, ...]], turn: Array | None = None
) -> sm.interface.Contacts:
    """Return the contacts of points; the first body has four geoms, the second one."""
    quat = np.array([1.0, 0, 0, 0]) if turn is None else turn
    poses = {
        "xpos": np.array([[0.0, 0, 0], [1.0, 0, 0], [9.0, 0, 0]]),
        "xquat": np.array([[1.0, 0, 0, 0], quat, [1.0, 0, 0, 0]]),
    }
    rotations = {geom: np.eye(3) for geom in range(raw.ngeom)}
    geoms = {(10, -1): (1, (0, 1, 2, 3)), (20, -1): (2, (4,))}
    return contacts_of(raw, points, geoms, rotations, poses.__getitem__)


@pytest.mark.parametrize(
    ("place", "geom"),
    [
        ((1.0, 0.0, 1.31), 0),
        ((1.0, 0.0, 0.69), 0),
        ((1.0, 0.0, -0.69), 1),
        ((1.11, 0.0, -1.1), 1),
        ((3.0, 0.0, 0.21), 2),
        ((3.11, 0.0, 0.0), 2),
        ((-1.11, 0.0, 0.0), 3),
        ((-0.5, 0.0, 0.0), 3),
    ],
)
def test_of_several_geoms_of_a_link_the_nearest_touches(
    tmp_path: Path, place: tuple[float, float, float], geom: int
) -> None:
    found = contacts(raw_of(tmp_path, SHAPES), [point((20, 10), place, place, (0, 0, 1))])
    assert found.geom.tolist() == [[geom, 4]]


def test_the_nearest_geom_turns_with_its_body(tmp_path: Path) -> None:
    turn = np.array([math.sqrt(0.5), 0, math.sqrt(0.5), 0])  # z to x
    place = (1 + 1.31, 0.0, 0.0)
    found = contacts(raw_of(tmp_path, SHAPES), [point((20, 10), place, place, (0, 0, 1))], turn)
    assert found.geom.tolist() == [[0, 4]]
    assert matrix_from_quat(turn) @ [0, 0, 1] == pytest.approx([1, 0, 0])


def test_a_contact_has_its_middle_its_normal_and_its_force(tmp_path: Path) -> None:
    raw = raw_of(tmp_path, SHAPES)
    row = point((20, 10), (1, 0, 1.3), (1, 0, 1.4), (0, 0, 1), -0.1, 5.0, (2.0, 3.0))
    (middle,), (frame,), (force,) = (
        getattr(contacts(raw, [row]), name) for name in ("pos", "frame", "force")
    )
    assert middle.tolist() == pytest.approx([1, 0, 1.35])
    assert frame.tolist() == [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    assert force.tolist() == [5, 3, -2]


def test_the_normal_goes_from_the_first_geom_to_the_second(tmp_path: Path) -> None:
    raw = raw_of(tmp_path, SHAPES)
    row = point((10, 20), (1, 0, 1.3), (1, 0, 1.3), (0, 0.8, 0.6), -0.1, 5.0)
    found = contacts(raw, [row])
    assert found.geom.tolist() == [[0, 4]]
    assert found.frame[0, 0].tolist() == [0, -0.8, -0.6]
    assert found.force[0].tolist() == pytest.approx([5, 0, 0])
    assert np.linalg.det(found.frame[0]) == pytest.approx(1)
    assert found.frame[0] @ found.frame[0].T == pytest.approx(np.eye(3))


@pytest.mark.parametrize(
    ("distance", "push", "count"), [(0.1, 0.0, 0), (0.1, 1.0, 1), (0.0, 0.0, 1), (-0.1, 0.0, 1)]
)
def test_what_is_apart_without_a_force_is_no_contact(
    tmp_path: Path, distance: float, push: float, count: int
) -> None:
    place = (1.0, 0.0, 1.3)
    row = point((20, 10), place, place, (0, 0, 1), distance, push)
    found = contacts(raw_of(tmp_path, SHAPES), [row])
    assert len(found) == count
    assert found.pos.shape == (count, 3)
    assert found.torque.tolist() == [[0, 0, 0]] * count


# Actuators.

DRIVEN = (
    '<body><joint name="j" axis="0 1 0" damping=".5"/><geom size=".1" mass="2"/>'
    '<body pos="1 0 0"><joint name="k" type="slide" axis="1 0 0"/><geom size=".1" mass="1"/>'
    "</body></body>"
)


def driven(folder: Path, *actuators: str, option: str = "") -> Any:
    """Return a compiled model with actuators."""
    return raw_of(folder, DRIVEN, f"<actuator>{''.join(actuators)}</actuator>", option)


@pytest.mark.parametrize(
    ("actuator", "is_servo"),
    [
        ('<position joint="j" kp="3"/>', True),
        ('<position joint="j" kp="3" timeconst=".1"/>', True),
        ('<motor joint="j"/>', False),
        ('<velocity joint="j" kv="1"/>', False),
        ('<intvelocity joint="j" kp="2" actrange="-1 1"/>', False),
        ('<general joint="j" gainprm="2" biastype="affine" biasprm="0 -2 0"/>', True),
        ('<general joint="j" gainprm="2" biastype="affine" biasprm="0 -3 0"/>', False),
        ('<general joint="j" gainprm="2" biasprm="0 -2 0"/>', False),
        ('<general joint="j" gainprm="0" biastype="affine" biasprm="0 0 -1"/>', False),
    ],
)
def test_what_a_position_servo_is(tmp_path: Path, actuator: str, is_servo: bool) -> None:
    owner, servo = servos(driven(tmp_path, '<motor joint="k"/>', actuator))
    assert owner.tolist() == [0, 1]
    assert servo.tolist() == [False, is_servo]


def test_controls_have_the_names_of_their_actuators(tmp_path: Path) -> None:
    raw = driven(tmp_path, '<motor name="a" joint="j"/>', '<motor joint="k"/>')
    assert list(control_names(raw)) == ["a", ""]


@pytest.mark.parametrize(
    ("delay", "steps"), [(0.0, 0), (0.01, 1), (0.0101, 2), (0.02, 2), (0.02 + 1e-13, 2)]
)
def test_so_many_commands_are_kept_for_a_delay(delay: float, steps: int) -> None:
    assert commands_needed(np.array([delay]), 0.01).tolist() == [steps]


def test_a_delay_is_counted_in_steps_and_at_most_those_that_are_kept(tmp_path: Path) -> None:
    raw = driven(
        tmp_path,
        '<motor joint="j" delay=".03" nsample="5"/>',
        '<motor joint="k" delay=".09" nsample="4"/>',
        option='<option timestep=".01"/>',
    )
    assert delay_steps(raw).tolist() == [3, 4]


@pytest.mark.parametrize(("delay", "kept"), [(0.0, [4, 0]), (0.05, [5, 5]), (0.03, [4, 3])])
def test_no_fewer_commands_are_kept_than_the_file_asks_for(
    tmp_path: Path, delay: float, kept: list[int]
) -> None:
    raw = driven(
        tmp_path,
        '<motor joint="j" delay=".02" nsample="4"/>',
        '<motor joint="k"/>',
        option='<option timestep=".01"/>',
    )
    assert delays.commands_kept(raw, np.array([delay, delay]), 0.01).tolist() == kept


def test_a_latency_that_no_memory_holds_is_refused(tmp_path: Path) -> None:
    raw = driven(tmp_path, '<motor joint="j"/>')
    with pytest.raises(BadInputError):
        delays.commands_kept(raw, np.array([10.0]), 1e-10)


def test_the_commands_before_the_start_are_that_of_the_start(tmp_path: Path) -> None:
    raw = driven(
        tmp_path,
        '<motor joint="j" delay=".03" nsample="3"/>',
        '<motor joint="k" delay=".02" nsample="2"/>',
        option='<option timestep=".01"/>',
    )
    history = np.zeros((2, raw.nhistory))
    delays.hold(raw, history, np.array([[1.0, 2.0], [3.0, 4.0]]))
    # Of each buffer: two numbers of its own, the times, and the commands.
    assert raw.actuator_historyadr.tolist() == [0, 8]
    assert history[:, 5:8].tolist() == [[1, 1, 1], [3, 3, 3]]
    assert history[:, 12:14].tolist() == [[2, 2], [4, 4]]
    assert np.abs(history).sum() == 3 * (1 + 3) + 2 * (2 + 4)


@pytest.mark.parametrize(
    ("counts", "places"), [([2, 0], range(6)), ([0, 3], range(10, 18)), ([0, 0], range(0))]
)
def test_the_buffers_of_a_world_lie_in_those_that_all_share(
    tmp_path: Path, counts: list[int], places: range
) -> None:
    """Each has two numbers of its own, and a time and a command for each that is kept."""
    before = driven(tmp_path, '<motor joint="j"/>', '<motor joint="k"/>')
    shared = delays.with_room(before, np.array([4, 3]))
    assert shared.actuator_historyadr.tolist() == [0, 10]
    assert shared.nhistory == 18
    own = delays.with_room_of(shared, before, np.array(counts))
    assert own.actuator_history[:, 0].tolist() == counts
    assert own.nhistory == len(places)
    assert delays.places_of(before, shared, np.array(counts)).tolist() == list(places)


def test_a_model_with_room_enough_stays(tmp_path: Path) -> None:
    raw = driven(tmp_path, '<motor joint="j" delay=".03" nsample="20"/>', '<motor joint="k"/>')
    assert delays.with_room(raw) is raw
    assert delays.with_room(raw, np.array([20, 0])) is raw
    more = delays.with_room(raw, np.array([21, 0]))
    assert (more.actuator_history[0, 0], raw.actuator_history[0, 0]) == (21, 20)
    assert more.nhistory == raw.nhistory + 2 + 21 * 2


def test_the_commands_of_each_world_are_held_in_its_own_buffer(tmp_path: Path) -> None:
    before = driven(tmp_path, '<motor joint="j"/>', '<motor joint="k"/>')
    shared = delays.with_room(before, np.array([2, 1]))
    history = np.zeros((2, shared.nhistory))
    ctrl = np.array([[1.0, 2.0], [3.0, 4.0]])
    delays.hold(shared, history, ctrl, np.array([[2, 1], [1, 0]]))
    assert history[0].tolist() == [0, 0, 0, 0, 1, 1, 0, 0, 0, 2]
    assert history[1].tolist() == [0, 0, 0, 3, 0, 0, 0, 0, 0, 0]


# Options in a compiled model.

SERVO = '<position joint="j" kp="3" kv=".5"/>'


def test_masses_scale_their_inertia(tmp_path: Path) -> None:
    raw = driven(tmp_path, SERVO)
    arrays = edits.changes(raw, {"mass": np.array([0.0, 4.0, 0.5])})
    assert arrays["body_mass"].tolist() == [0, 4, 0.5]
    assert arrays["body_inertia"] == pytest.approx(raw.body_inertia * [[1], [2], [0.5]])
    assert set(arrays) == {"body_mass", "body_inertia"}


def test_gains_are_written_where_the_engine_reads_them(tmp_path: Path) -> None:
    raw = driven(tmp_path, '<motor joint="k" gear="2"/>', SERVO)
    arrays = edits.changes(raw, {"kp": np.array([np.nan, 7.0]), "kv": np.array([np.nan, 0.25])})
    assert arrays["actuator_gainprm"][:, 0].tolist() == [1, 7]
    assert arrays["actuator_biasprm"][:, :3].tolist() == [[0, 0, 0], [0, -7, -0.25]]
    only = edits.changes(raw, {"kv": np.array([np.nan, 0.25])})
    assert set(only) == {"actuator_biasprm"}
    assert only["actuator_biasprm"][1, :3].tolist() == [0, -3, -0.25]


def test_gains_of_several_worlds_have_a_row_for_each(tmp_path: Path) -> None:
    raw = driven(tmp_path, '<motor joint="k" gear="2"/>', SERVO)
    gains = edits.changes(raw, {"kp": np.array([[np.nan, 7.0], [np.nan, 8.0]])})
    assert gains["actuator_gainprm"][:, 1, 0].tolist() == [7, 8]
    assert gains["actuator_biasprm"][:, 1, 1].tolist() == [-7, -8]
    assert gains["actuator_gainprm"][:, 0, 0].tolist() == [1, 1]


def test_a_friction_is_the_sliding_one(tmp_path: Path) -> None:
    raw = driven(tmp_path, SERVO)
    arrays = edits.changes(raw, {"friction": np.array([0.25, 0.75])})
    assert arrays["geom_friction"][:, 0].tolist() == [0.25, 0.75]
    assert arrays["geom_friction"][:, 1:].tolist() == raw.geom_friction[:, 1:].tolist()


def test_a_latency_is_written_a_millionth_shorter(tmp_path: Path) -> None:
    raw = driven(tmp_path, '<motor joint="k"/>', SERVO)
    arrays = edits.changes(raw, {"latency": np.array([0.01, 0.03])})
    assert arrays["actuator_delay"] == pytest.approx([0.01 * (1 - 1e-6), 0.03 * (1 - 1e-6)])


FLAGS = {"actuation": 1 << 13, "contacts": 1 << 4, "limits": 1 << 3}


@pytest.mark.parametrize(
    ("flags", "options", "disabled"),
    [
        ("", {"actuation": True}, None),
        ("", {"actuation": False}, {"actuation"}),
        ("", {"actuation": False, "limits": False}, {"actuation", "limit"}),
        ('actuation="disable"', {"actuation": True}, set()),
        ('actuation="disable"', {"actuation": False}, None),
        ('gravity="disable"', {"gravity": np.ones(3)}, set()),
        ('constraint="disable"', {"contacts": True}, set()),
        ('constraint="disable" damper="disable"', {"contacts": False}, {"damper", "contact"}),
        ('damper="disable"', {"damping": np.ones(2)}, set()),
        ('frictionloss="disable" damper="disable"', {"frictionloss": np.ones(2)}, {"damper"}),
    ],
)
def test_what_an_option_switches(
    tmp_path: Path, flags: str, options: dict[str, Any], disabled: set[str] | None
) -> None:
    raw = driven(tmp_path, SERVO, option=f"<option><flag {flags}/></option>")
    wanted = None
    if disabled is not None:
        words = " ".join(f'{name}="disable"' for name in disabled)
        other = driven(tmp_path, SERVO, option=f"<option><flag {words}/></option>")
        wanted = int(other.opt.disableflags)
    now = edits.changes(raw, options).get("opt.disableflags")
    assert (now if now is None else int(now)) == wanted


def test_an_edited_copy_leaves_the_model_as_it_was(tmp_path: Path) -> None:
    raw = driven(tmp_path, SERVO)
    before = raw.dof_M0.copy()
    copy = edits.edited(raw, {"armature": np.array([0.25, 0.5])}, 0.004)
    assert copy.dof_armature.tolist() == [0.25, 0.5]
    assert copy.dof_M0 - before == pytest.approx([0.25, 0.5])
    assert copy.opt.timestep == 0.004
    assert raw.dof_armature.tolist() == [0, 0]
    assert raw.opt.timestep == 0.002


@pytest.mark.parametrize(
    ("timestep", "substeps", "options", "length"),
    [(0.01, 4, {}, 0.0025), (0.01, 4, {"timestep": 0.02}, 0.005), (0.01, 1, {}, 0.01)],
)
def test_a_step_of_the_engine_is_a_part_of_a_timestep(
    timestep: float, substeps: int, options: dict[str, float], length: float
) -> None:
    assert edits.step_length(timestep, substeps, options) == length


def test_a_timestep_that_cannot_be_divided_is_refused() -> None:
    with pytest.raises(BadInputError):
        edits.step_length(5e-324, 2, {})


def test_a_bit_of_a_set_of_flags_is_written_alone() -> None:
    holder: Any = SimpleNamespace(flags=0b101, row=np.zeros((2, 2)))
    edits.put(holder, "flags", 1, (0b10,))
    edits.put(holder, "flags", 0, (0b1,))
    edits.put(holder, "row", 3.0, (1, 0))
    assert holder.flags == 0b110
    assert holder.row.tolist() == [[0, 0], [3, 0]]


# When something has diverged.


def test_what_no_actuator_drives_has_diverged_at_a_thousand_radians_a_step(
    tmp_path: Path,
) -> None:
    raw = driven(tmp_path, option='<option timestep="0.0002"/>')
    assert fastest(raw) == pytest.approx([1000 / 0.0002, 1000 * raw.stat.extent / 0.0002])


def test_what_slides_may_fall_for_a_day(tmp_path: Path) -> None:
    assert fastest(driven(tmp_path, option='<option timestep="1"/>'))[1] == pytest.approx(9.81e5)


def test_the_least_speed_that_has_diverged_is_a_hundred_thousand(tmp_path: Path) -> None:
    raw = driven(tmp_path, option='<option timestep="1"/>')
    assert fastest(raw)[0] == pytest.approx(1e5)


def test_a_motor_may_be_as_fast_as_its_damping_lets_it(tmp_path: Path) -> None:
    motor = '<motor joint="j" gear="3" ctrllimited="true" ctrlrange="-2e5 1e5"/>'
    raw = driven(tmp_path, motor, option='<option timestep="1"/>')
    damping = 0.5 + raw.dof_M0[0] / 1e5
    assert fastest(raw)[0] == pytest.approx(3 * 2e5 / damping)


def test_a_motor_without_a_limit_may_be_as_fast_as_numbers_go(tmp_path: Path) -> None:
    raw = driven(tmp_path, '<motor joint="j"/>', option='<option timestep="1"/>')
    assert fastest(raw)[0] == 1e10


def test_a_motor_is_no_faster_than_its_force_lets_it(tmp_path: Path) -> None:
    motor = '<motor joint="j" gear="2" forcelimited="true" forcerange="-1e5 3e5"/>'
    raw = driven(tmp_path, motor, option='<option timestep="1"/>')
    damping = 0.5 + raw.dof_M0[0] / 1e5
    assert fastest(raw)[0] == pytest.approx(2 * 3e5 / damping)


def test_gravity_that_is_switched_off_is_none(tmp_path: Path) -> None:
    assert gravity(driven(tmp_path)).tolist() == [0, 0, -9.81]
    off = '<option><flag gravity="disable"/></option>'
    assert gravity(driven(tmp_path, option=off)).tolist() == [0, 0, 0]


# The start of a run.

TWO_BALLS = (
    '<body name="a"><freejoint/><geom name="a" size=".1"/></body>'
    '<body name="b" pos="1 0 0"><joint type="slide" axis="1 0 0"/><geom name="b" size=".1"/></body>'
)
KEYS = (
    '<keyframe><key qpos="0 0 0 1 0 0 0 .5"/><key name="deep" qpos="0 0 0 1 0 0 0 -.85"/>'
    '<key qpos="0 0 0 1 0 0 0 -.9"/></keyframe>'
)


@pytest.fixture
def two_balls(tmp_path: Path) -> sm.Model:
    """Two balls that are apart in the default state, and inside each other in keyframes."""
    return loaded(tmp_path, TWO_BALLS, KEYS)


def test_shapes_inside_each_other_are_found_in_the_state_that_is_asked_for(
    two_balls: sm.Model,
) -> None:
    assert overlaps_in(two_balls, None) == []
    assert overlaps_in(two_balls, 0) == []
    assert overlaps_in(two_balls, "deep") == ["b on a by 50 mm"]
    assert overlaps_in(two_balls, 2) == ["b on a by 100 mm"]


@pytest.mark.parametrize(
    ("keyframe", "off", "state"),
    [
        ("deep", 0.0, "the keyframe 'deep'"),
        (2, 0.0, "keyframe 2"),
        ("deep", 0.9e-9, "the keyframe 'deep'"),
        ("deep", 2e-9, "the state that the run starts in"),
    ],
)
def test_a_warning_names_the_state(
    two_balls: sm.Model, keyframe: int | str, off: float, state: str
) -> None:
    places = {name: np.array(array) for name, array in places_in(two_balls, keyframe).items()}
    places["qpos"][7] += off
    assert f" in {state}: b on a by " in overlap_warning(two_balls, places)


def test_a_state_without_overlaps_has_no_warning(two_balls: sm.Model) -> None:
    assert overlap_warning(two_balls, places_in(two_balls, None)) == ""
    assert usual_start(two_balls) is None
