"""Mechanics and shapes of a description, by closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from statemachine.engines.description.match import alike_names, match, renamed
from statemachine.engines.description.records import (
    CollisionShape,
    Inertial,
    Link,
    Robot,
    RobotFrame,
    RobotJoint,
)
from statemachine.engines.description.shapes import (
    bounds_of,
    capsules_of,
    laid_on,
    most_alike,
    one_to_one,
)
from statemachine.engines.description.tree import GroupTree, composite
from statemachine.errors import UnknownNameError
from statemachine.interface import Array
from statemachine.rotations import HERE, Placement, rotation

X, Y, Z = np.eye(3)
QUARTER = math.pi / 2


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: Array | None = None) -> Placement:
    """Return a place."""
    return Placement(np.array([x, y, z]), np.eye(3) if turn is None else turn)


def solid(mass: float, com: tuple[float, float, float] = (0, 0, 0)) -> Inertial:
    """Return a body of moments 1, 2 and 3 times a tenth of its mass."""
    return Inertial(mass, np.array(com, dtype=float), 0.1 * mass * np.diag([1.0, 2.0, 3.0]))


def hinge(
    name: str,
    axis: Array = Y,
    anchor: tuple[float, float, float] = (0, 0, 0),
    kind: str = "hinge",
    armature: float | None = None,
) -> RobotJoint:
    """Return a joint."""
    return RobotJoint(name, kind, axis, np.array(anchor, dtype=float), armature=armature)


def robot(*links: Link, frames: tuple[RobotFrame, ...] = ()) -> Robot:
    """Return a robot of links."""
    return Robot("r", "a reader", links, frames, None, None)


# A base, an arm with a plate fixed to it, and a hand that slides.
BASE = Link("base", "", HERE, None, solid(5.0))
ARM = Link(
    "arm", "base", at(0, 0, 1), hinge("turn", Y, (0.1, 0, 0), armature=0.5), solid(2.0, (0.6, 0, 0))
)
PLATE = Link("plate", "arm", at(1.0, 0, 0), None, solid(1.0))
HAND = Link(
    "hand", "plate", at(0, 0, 0.5), hinge("push", X, kind="slide", armature=0.25), solid(0.5)
)
TIP = RobotFrame("tip", "hand", at(0, 0, 0.25))
ROBOT = robot(BASE, ARM, PLATE, HAND, frames=(TIP,))


def test_two_bodies_are_one_by_the_parallel_axis_theorem() -> None:
    whole = composite([solid(1.0, (0, 0, 0)), solid(3.0, (0.4, 0, 0))])
    assert whole.mass == 4.0
    assert whole.com == pytest.approx([0.3, 0, 0])
    # A mass of 1 at 0.3 and of 3 at 0.1, across x.
    across = 1 * 0.3**2 + 3 * 0.1**2
    moments = 0.4 * np.array([1, 2, 3]) + [0, across, across]
    assert whole.tensor == pytest.approx(np.diag(moments))


def test_products_of_inertia_have_their_sign() -> None:
    whole = composite([solid(1.0, (0, 0, 0)), solid(1.0, (2.0, 4.0, 0))])
    assert whole.tensor[0, 1] == pytest.approx(-2 * 1.0 * 2.0)
    assert whole.tensor[2, 2] == pytest.approx(0.6 + 2 * (1 + 4))


def test_an_inertia_turns_with_its_frame() -> None:
    turned = solid(2.0, (1, 0, 0)).in_frame(at(0, 0, 5, rotation(Z, QUARTER)))
    assert turned.com == pytest.approx([0, 1, 5])
    assert turned.tensor == pytest.approx(np.diag([0.4, 0.2, 0.6]))


def test_links_without_a_joint_are_one_group() -> None:
    tree = GroupTree(ROBOT)
    assert [group.name for group in tree.groups] == ["base", "arm", "hand"]
    assert [group.parent for group in tree.groups] == [-1, 0, 1]
    assert tree.at["plate"][0] == 1
    assert tree.groups[2].place.pos.tolist() == [1, 0, 0.5]
    assert {name: group.number for name, group in tree.by_joint.items()} == {"turn": 1, "push": 2}
    assert [group.name for group in tree.children(1)] == ["hand"]


def test_a_group_is_as_heavy_as_its_links() -> None:
    group = GroupTree(ROBOT).groups[1]
    assert group.inertial.mass == 3.0
    assert group.inertial.com == pytest.approx([(2 * 0.6 + 1) / 3, 0, 0])


def test_poses_follow_the_joints() -> None:
    tree = GroupTree(ROBOT)
    zero = [pose.pos.tolist() for pose in tree.poses()]
    assert zero == [[0, 0, 0], [0, 0, 1], [1, 0, 1.5]]
    slid = tree.poses({"push": 0.25})[2].pos
    assert slid == pytest.approx([1.25, 0, 1.5])
    # About an axis through x = 0.1: the hand is 0.9 before it and 0.5 above.
    turned = tree.poses({"turn": QUARTER})[2].pos
    assert turned == pytest.approx([0.1 + 0.5, 0, 1 - 0.9])


def test_frames_are_sites_and_links() -> None:
    tree = GroupTree(ROBOT)
    number, place = tree.frames["tip"]
    assert (number, place.pos.tolist()) == (2, [0, 0, 0.25])
    assert list(tree.frames) == ["base", "arm", "plate", "hand", "tip"]
    both = GroupTree(replace(ROBOT, frames=(RobotFrame("hand", "hand", at(1)),)))
    assert both.frames["hand (site)"][1].pos.tolist() == [1, 0, 0]


def test_a_robot_reaches_as_far_as_its_farthest_frame() -> None:
    assert GroupTree(ROBOT).reach == pytest.approx(math.hypot(1, 1.75))
    # Of one link at its origin there is no reach: then it is a metre.
    assert GroupTree(robot(BASE)).reach == 1.0


def test_a_joint_carries_all_beyond_it() -> None:
    tree = GroupTree(ROBOT)
    assert [body.mass for body in tree.carried] == [8.5, 3.5, 0.5]
    com = (2 * 0.6 + 1 * 1 + 0.5 * 1) / 3.5
    assert tree.carried[1].com == pytest.approx([com, 0, 0.25 / 3.5])


def test_the_inertia_about_a_hinge_and_the_torque_of_its_weight() -> None:
    inertia, torque = GroupTree(ROBOT).inertia_and_load(1)
    # Arms of the arm, the plate and the hand from the axis, across it.
    arms = {2.0: 0.5**2, 1.0: 0.9**2, 0.5: 0.9**2 + 0.5**2}
    own = 0.2 * (2.0 + 1.0 + 0.5)
    assert inertia == pytest.approx(own + sum(m * arm for m, arm in arms.items()) + 0.5)
    com = np.array([2 * 0.5 + 0.9 + 0.5 * 0.9, 0, 0.5 * 0.5])
    assert torque == pytest.approx(9.81 * float(np.linalg.norm(com)))


def test_what_slides_moves_its_mass() -> None:
    inertia, weight = GroupTree(ROBOT).inertia_and_load(2)
    assert (inertia, weight) == (0.75, pytest.approx(0.5 * 9.81))


def test_a_base_has_no_inertia_about_a_joint() -> None:
    assert np.isnan(GroupTree(ROBOT).inertia_and_load(0)).all()


# Which is which.


def test_joints_are_one_by_their_names() -> None:
    found = match(GroupTree(ROBOT), GroupTree(ROBOT))
    assert [(pair.left.name, pair.right.name, pair.by) for pair in found.pairs] == [
        ("base", "base", "root"),
        ("arm", "arm", "name"),
        ("hand", "hand", "name"),
    ]
    assert (found.only_left, found.only_right) == ((), ())
    assert not any(pair.moved for pair in found.pairs)


@pytest.mark.parametrize(("off", "is_found"), [(0.0049, True), (0.0051, False)])
def test_a_joint_of_another_name_is_found_by_its_axis(off: float, is_found: bool) -> None:
    other = replace(ARM, joint=hinge("other", Y, (0.1 + off, 5.0, 0)))
    found = match(GroupTree(ROBOT), GroupTree(robot(BASE, other, PLATE, HAND)))
    assert (found.of(1) is not None) is is_found
    if is_found:
        assert found.pairs[1].by == "place"


@pytest.mark.parametrize(("tilt", "is_found"), [(0.099, True), (0.101, False), (math.pi, True)])
def test_an_axis_may_be_tilted_by_a_tenth(tilt: float, is_found: bool) -> None:
    other = replace(ARM, joint=hinge("other", rotation(X, tilt) @ Y, (0.1, 0, 0)))
    found = match(GroupTree(ROBOT), GroupTree(robot(BASE, other, PLATE, HAND)))
    assert (found.of(1) is not None) is is_found


def test_a_joint_of_another_kind_is_no_counterpart_by_place() -> None:
    other = replace(ARM, joint=hinge("other", Y, (0.1, 0, 0), kind="slide"))
    found = match(GroupTree(ROBOT), GroupTree(robot(BASE, other, PLATE, HAND)))
    assert [group.name for group in found.only_left] == ["arm"]
    assert [group.name for group in found.only_right] == ["arm"]


def test_another_kind_of_one_name_is_said() -> None:
    other = replace(HAND, joint=hinge("push", X))
    found = match(GroupTree(ROBOT), GroupTree(robot(BASE, ARM, PLATE, other)))
    (text,) = found.other_kinds()
    assert "'push' is a slide on the left and a hinge on the right" in text


def test_what_hangs_elsewhere_has_moved() -> None:
    other = replace(HAND, parent="base")
    found = match(GroupTree(ROBOT), GroupTree(robot(BASE, ARM, PLATE, other)))
    assert [pair.moved for pair in found.pairs] == [False, False, True]


def test_the_frame_of_a_link_may_be_turned() -> None:
    """The same solids, in a frame that is turned by a quarter about z and moved."""
    frame = at(0.2, 0.3, 0.4, rotation(Z, QUARTER))
    back = frame.inverse
    joint = hinge("turn", back.mat @ Y, tuple(back.of(np.array([0.1, 0, 0])).tolist()))
    assert ARM.inertial is not None
    turned = replace(
        ARM,
        place=ARM.place @ frame,
        joint=joint,
        inertial=ARM.inertial.in_frame(back),
    )
    plate = replace(PLATE, place=back @ PLATE.place)
    found = match(GroupTree(ROBOT), GroupTree(robot(BASE, turned, plate, HAND, frames=(TIP,))))
    pair = found.of(1)
    assert pair is not None
    assert pair.align.distance(back) < 1e-9
    assert pair.align.mat == pytest.approx(back.mat)


def test_names_are_alike_but_for_case_signs_and_what_they_are() -> None:
    left = ["gripperframe", "Tool_0", "same", "told", "lone"]
    right = ["gripper_frame_link", "tool0", "same", "other", "link"]
    assert alike_names(left, right, {"told": "other"}) == {
        "told": "other",
        "gripperframe": "gripper_frame_link",
        "Tool_0": "tool0",
        "same": "same",
    }


def test_a_name_goes_to_one_alone() -> None:
    assert alike_names(["a_link", "a_site"], ["a"], {}) == {"a_link": "a"}


def test_a_robot_under_other_names() -> None:
    other = renamed(ROBOT, {"arm": "upper", "turn": "shoulder", "tip": "tool"})
    assert [(link.name, link.parent) for link in other.links] == [
        ("base", ""),
        ("upper", "base"),
        ("plate", "upper"),
        ("hand", "plate"),
    ]
    assert [link.joint.name for link in other.links if link.joint] == ["shoulder", "push"]
    assert [(frame.name, frame.link) for frame in other.frames] == [("tool", "hand")]
    with pytest.raises(UnknownNameError):
        renamed(ROBOT, {"elbow": "x"})


# Shapes.


def shape(kind: str, *size: float, place: Placement = HERE, name: str = "") -> CollisionShape:
    """Return a shape."""
    return CollisionShape(kind, place, size, name=name)


def test_a_pair_has_each_end_once() -> None:
    candidates = [(0, 1), (0, 2), (1, 1), (1, 2), (2, 0)]
    assert one_to_one(candidates) == {0: 1, 1: 2, 2: 0}
    assert one_to_one(candidates, [(2, 1)]) == {2: 1, 0: 2}


def test_a_shape_of_the_same_name_is_most_alike_then_one_of_its_kind() -> None:
    ours = [shape("box", 1, 1, 1, name="a"), shape("sphere", 1), shape("sphere", 2)]
    theirs = [
        shape("sphere", 2.1),
        shape("sphere", 0.9),
        shape("sphere", 1, place=at(9), name="a"),
    ]
    assert most_alike(ours, theirs) == {0: 2, 1: 1, 2: 0}


def test_a_nearer_shape_is_more_alike_and_the_order_of_sizes_does_not_count() -> None:
    ours = [shape("box", 1, 2, 3), shape("box", 1, 2, 3, place=at(2))]
    theirs = [shape("box", 3, 1, 2, place=at(2.1)), shape("box", 2, 3, 1, place=at(0.1))]
    assert most_alike(ours, theirs) == {0: 1, 1: 0}


def test_a_mesh_is_where_its_corners_are() -> None:
    points = np.array([[0.0, 0, 0], [1, 2, 3], [-1, 1, 1]])
    mesh = replace(shape("mesh", place=at(10, 0, 0, rotation(Z, QUARTER))), points=points)
    assert bounds_of(mesh) == pytest.approx([8, -1, 0, 10, 1, 3])
    assert bounds_of(shape("mesh")).shape == (0,)
    assert bounds_of(shape("sphere", 1, place=at(1, 2, 3))).tolist() == [1, 2, 3, 1, 2, 3]


@pytest.mark.parametrize(
    ("radius", "off", "is_capsule"),
    [
        (0.1, 0.0, True),
        (0.1 * (1 + 0.9e-6), 0.0, True),
        (0.1 * (1 + 1.1e-6), 0.0, False),
        (0.1, 0.9e-4, True),
        (0.1, 1.1e-4, False),
    ],
)
def test_a_cylinder_with_balls_on_its_ends_is_a_capsule(
    radius: float, off: float, is_capsule: bool
) -> None:
    cylinder = shape("cylinder", 0.1, 0.3, place=at(1, 2, 3, rotation(Y, QUARTER)))
    balls = [
        shape("sphere", 0.1, place=at(1.3, 2, 3)),
        shape("sphere", radius, place=at(0.7 + off, 2, 3)),
    ]
    found = list(capsules_of([balls[0], cylinder, balls[1]]))
    assert found == ([(cylinder, (balls[1], balls[0]))] if is_capsule else [])


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_a_box_whose_axes_have_other_names_lies_as_it_did(order: tuple[int, ...]) -> None:
    size = np.array([0.1, 0.2, 0.4])
    axes = np.eye(3)[:, order]
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    one = shape("box", *size, place=at(1, 0, 0, rotation(X, 0.1)))
    other = shape("box", *size[list(order)], place=at(1, 0, 0, rotation(X, 0.1) @ axes))
    laid = laid_on(one, other)
    assert laid.size == tuple(size)
    assert laid.place.mat == pytest.approx(one.place.mat)
    assert laid.is_reordered == (order != (0, 1, 2))
    own = laid.in_own_order(np.array([7.0, 8.0, 9.0]))
    assert own.tolist() == np.array([7.0, 8.0, 9.0])[list(order)].tolist()


@pytest.mark.parametrize(("longer", "is_reordered"), [(1.40, True), (1.46, False)])
def test_a_box_that_was_turned_by_90_degrees_was_turned(longer: float, is_reordered: bool) -> None:
    """Its sizes change places where that leaves a quarter of what the turn is."""
    turned = at(0, 0, 0, rotation(Z, QUARTER))
    laid = laid_on(shape("box", 1, longer, 4), shape("box", 1, longer, 4, place=turned))
    assert laid.is_reordered is is_reordered
    assert HERE.angle(laid.place) == pytest.approx(0 if is_reordered else QUARTER, abs=1e-9)


@pytest.mark.parametrize("kind", ["cylinder", "capsule"])
def test_what_has_two_ends_is_the_same_upside_down(kind: str) -> None:
    turned = at(0, 0, 0, rotation(X, math.pi - 0.1) @ rotation(Z, 0.7))
    laid = laid_on(shape(kind, 0.1, 0.3), shape(kind, 0.1, 0.3, place=turned))
    angle = math.acos(float(laid.place.mat[2, 2]))
    assert angle == pytest.approx(0.1)
    assert HERE.angle(laid.place) == pytest.approx(0.1, abs=1e-9)


def test_a_ball_is_the_same_however_it_is_turned() -> None:
    turned = at(1, 2, 3, rotation(np.array([0.6, 0, 0.8]), 1.1))
    laid = laid_on(shape("sphere", 0.1), shape("sphere", 0.1, place=turned))
    assert laid.place.mat == pytest.approx(np.eye(3))
    assert laid.place.pos.tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("size", "axis", "is_seen"),
    [
        ((0.1, 0.1, 0.3), Z, False),
        ((0.1, 0.1, 0.3), X, True),
        ((0.3, 0.1, 0.1), X, False),
        ((0.1, 0.3, 0.1), Y, False),
        ((0.1, 0.1 * (1 + 2e-6), 0.1 * (1 + 4e-6)), Z, True),
        ((0.1, 0.2, 0.3), Z, True),
        ((0.1, 0.1, 0.1), X, False),
    ],
)
def test_a_turn_of_an_ellipsoid_is_seen_where_it_is_not_round(
    size: tuple[float, ...], axis: Array, is_seen: bool
) -> None:
    turned = at(0, 0, 0, rotation(axis, 0.3))
    laid = laid_on(shape("ellipsoid", *size), shape("ellipsoid", *size, place=turned))
    assert HERE.angle(laid.place) == pytest.approx(0.3 if is_seen else 0, abs=1e-9)


def test_a_plane_has_no_middle() -> None:
    one = shape("plane", place=at(5, 6, 0.25))
    laid = laid_on(one, shape("plane", place=at(-1, -2, 1, rotation(Z, 0.4))))
    assert laid.place.pos == pytest.approx([5, 6, 1])
    assert laid.place.mat == pytest.approx(np.eye(3))
