"""Which joint, body, site and actuator of one Model is which of another.

By name, then by structure: `engines.description.match` says how, and `names` overrules it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ...engines import raw_engine_of
from ...engines.description.match import SCALAR, Matching, Pair, match, renamed
from ...engines.description.records import Robot
from ...engines.description.shapes import one_to_one
from ...engines.description.tree import GroupTree
from ...engines.records import BodyPair, Pairs
from ...errors import BadInputError, check_name
from ...installed import DEFAULT
from ...interface import Model
from ...interface.options import OptionValue
from ...measures.text import command
from ...rotations import HERE, Placement
from .matched import Matched, Only, RenamedPair, joint_name

_SWITCHED_BY = {"actuators": "actuation", "floor": "contacts"}  # the option of each part
_ONE_PLACE = 1e-6  # [m] within which two sites without a common name are one


@dataclass(frozen=True, eq=False)
class MatchedTrees:
    """The rigid parts of two Models, and which is which.

    Attributes:
        left: Those of the left, by the names of the right.
        right: Those of the right.
        matching: Which is which.
    """

    left: GroupTree
    right: GroupTree
    matching: Matching


def match_trees(
    left: Model, right: Model, names: Mapping[str, str], *, one_world: bool = True
) -> MatchedTrees:
    """Pair the rigid parts of two Models.

    Args:
        left: A Model.
        right: Another, of any engine.
        names: Joints, bodies and sites of `left` that go by other names in `right`; other names
            have no effect.
        one_world: Whether both worlds are one; else what stands on one coincides with its
            counterpart, as of a URDF, which does not say where its base stands.

    Raises:
        BadInputError: A backend tells nothing of the bodies of its Model.
    """
    robots = [_description(model) for model in (left, right)]
    of_robot = {name: names[name] for name in names if name in robots[0].names}
    trees = GroupTree(renamed(robots[0], of_robot)), GroupTree(robots[1])
    return MatchedTrees(*trees, match(*trees, one_world=one_world))


def match_models(
    left: Model,
    right: Model,
    names: Mapping[str, str] | None = None,
    *,
    one_world: bool = True,
) -> Matched:
    """Pair what two Models have.

    Args:
        left: A Model.
        right: Another, of any engine.
        names: Joints, bodies, sites and actuators of `left` that go by other names in `right`.
        one_world: As of `match_trees`.

    Raises:
        UnknownNameError: A name that was given is not there.
        BadInputError: A backend tells nothing of the bodies of its Model.
    """
    names = {} if names is None else dict(names)
    if names:
        _check_names(left, names.keys())
        _check_names(right, names.values())
    trees = match_trees(left, right, names, one_world=one_world)
    matching = trees.matching
    joints = _joints(matching)
    # A body with several joints is several parts of a description, of which the last has its mass.
    by_body = {solid.left: solid for solid in _solids(trees)}
    solids = (*by_body.values(), *_mocap_pairs(left, right, names))
    by_name = _by_name(left.body_names, right.body_names, names)
    bodies = _and_further(((solid.left, solid.right) for solid in solids), by_name)
    sites = _sites(left, right, names, trees)
    actuators = _actuators(left, right, joints, names)
    only_left = _only((left, right), 0, joints, actuators, sites)
    only_right = _only((right, left), 1, joints, actuators, sites)
    by_place = (*_joints_by_place(matching), *_by_place(left, right, sites, actuators, names))
    return Matched(
        left=left,
        right=right,
        joints=joints,
        bodies=bodies,
        sites=sites,
        actuators=actuators,
        solids=solids,
        only=(only_left, only_right),
        renamed=by_place,
        other_notes=tuple(matching.other_kinds()),
    )


def _check_names(model: Model, names: Iterable[str]) -> None:
    """Refuse names of what a Model does not have.

    Raises:
        UnknownNameError: It has nothing of such a name.
        BadInputError: Its backend tells nothing of its bodies.
    """
    known = _description(model).names | {name for name in model.actuator_names if name}
    for name in names:
        check_name(f"joint, body, site or actuator in {model.path.name}", name, sorted(known))


def _joints(matching: Matching) -> Pairs:
    """Return the joints of counterparts that are of one kind."""
    joints = []
    for pair in matching.pairs:
        left, right = pair.left.joint, pair.right.joint
        if left and right and left.kind == right.kind:
            joints.append((left.number, right.number))
    return tuple(sorted(joints))


def _only(
    models: tuple[Model, Model], side: int, joints: Pairs, actuators: Pairs, sites: Pairs
) -> Only:
    """Return what has no counterpart: the names of one of two Models, 0 or 1.

    A site that is a body in the other file is none of it: so it is where a link behind a fixed
    joint is fused with its parent in one of them, and not in the other.

    Args:
        models: The Model, and the other one.
        side: Which of the two the Model is in the pairs.
        joints: Pairs of ids.
        actuators: Pairs of ids.
        sites: Pairs of ids.
    """
    model, other = models
    further_sites = _unmatched_names(model.site_names, sites, side)
    joint_names = [joint_name(model, joint) for joint in range(model.njnt)]
    return {
        "joint": _unmatched_names(joint_names, joints, side),
        "actuator": _unmatched_names(model.actuator_names, actuators, side),
        "site": tuple(name for name in further_sites if name not in other.body_names),
    }


def match_alike(left: Model, right: Model) -> Matched:
    """Pair two Models of one file, of which a backend does not tell what the bodies are.

    Raises:
        BadInputError: They do not have the same names in the same order.
    """
    pairs = {}
    for kind in ("joint", "body", "site", "actuator"):
        names = getattr(left, f"{kind}_names"), getattr(right, f"{kind}_names")
        if names[0] != names[1]:
            raise BadInputError(
                "a backend does not tell what the bodies of its models are, and they cannot be "
                f"matched by name: the two sides have other names of a {kind}"
            )
        pairs[kind] = tuple((k, k) for k in range(len(names[0])))
    return Matched(
        left=left,
        right=right,
        joints=pairs["joint"],
        bodies=pairs["body"],
        sites=pairs["site"],
        actuators=pairs["actuator"],
        solids=(),
        only=({}, {}),
        renamed=(),
        other_notes=(),
    )


def _description(model: Model) -> Robot:
    if model.compiled is None:
        raise BadInputError(
            f"{model.backend} does not tell what the bodies of its models are: they cannot be "
            "matched with those of another file"
        )
    return raw_engine_of(DEFAULT).describe(model.compiled, model.path.name)


def _solids(trees: MatchedTrees) -> Iterator[BodyPair]:
    """Yield the bodies of pairs of groups: of a body with several joints one for each."""
    for pair in trees.matching.pairs:
        moved = pair.moved and not _bodies_hang_alike(trees, pair)
        yield BodyPair(pair.left.body, pair.right.body, pair.align, moved)


def _bodies_hang_alike(trees: MatchedTrees, pair: Pair) -> bool:
    """Tell whether the bodies of two groups hang on counterparts, in whatever order they turn."""
    above = trees.matching.of(trees.left.carrier(pair.left).number)
    return above is not None and trees.right.carrier(pair.right).is_of_body(above.right)


def _mocap_pairs(left: Model, right: Model, names: Mapping[str, str]) -> list[BodyPair]:
    """Return the pairs of mocap bodies, by name.

    No joint moves them, but they are not part of the world. Those without a name in both are a
    pair where as many others come before them.
    """
    left_bodies, right_bodies = _mocap_bodies_of(left), _mocap_bodies_of(right)
    left_names = [left.body_names[body] for body in left_bodies]
    right_names = [right.body_names[body] for body in right_bodies]
    both = enumerate(zip(left_names, right_names, strict=False))
    nameless = [(k, k) for k, pair in both if not any(pair)]
    pairs = sorted([*_by_name(left_names, right_names, names), *nameless])
    return [
        BodyPair(left_bodies[left_id], right_bodies[right_id], HERE, False)
        for left_id, right_id in pairs
    ]


def _mocap_bodies_of(model: Model) -> list[int]:
    """Return the ids of the mocap bodies of a Model."""
    return np.flatnonzero(model.compiled.body_mocapid >= 0).tolist()


def _by_name(
    left_names: Sequence[str], right_names: Sequence[str], names: Mapping[str, str]
) -> Pairs:
    right_ids = {name: k for k, name in enumerate(right_names) if name}
    names_on_right = [names.get(name, name) for name in left_names]
    return tuple((k, right_ids[name]) for k, name in enumerate(names_on_right) if name in right_ids)


def _and_further(pairs: Iterable[tuple[int, int]], further: Iterable[tuple[int, int]]) -> Pairs:
    """Return the pairs, and of some further ones, in turn, those whose ends are both left."""
    return tuple(sorted(one_to_one(further, pairs).items()))


def _sites(
    left: Model,
    right: Model,
    names: Mapping[str, str],
    trees: MatchedTrees,
) -> Pairs:
    """Return the pairs of sites: by name, then those in one place of the same rigid body."""
    left_places, right_places = _frame_places(trees.left), _frame_places(trees.right)

    def in_one_place(left_id: int, right_id: int) -> bool:
        left_solid, left_place = left_places[left_id]
        right_solid, right_place = right_places[right_id]
        pair = trees.matching.of(left_solid)
        if pair is None or right_solid != pair.right.number:
            return False
        return (pair.align @ left_place).distance(right_place) < _ONE_PLACE

    by_place = (
        (left_id, right_id)
        for left_id, right_id in product(range(left.nsite), range(right.nsite))
        if in_one_place(left_id, right_id)
    )
    return _and_further(_by_name(left.site_names, right.site_names, names), by_place)


def _frame_places(tree: GroupTree) -> list[tuple[int, Placement]]:
    """Return for each frame of a robot the number of its solid, and where it is in that."""
    places = []
    for frame in tree.robot.frames:
        number, at = tree.at[frame.link]
        places.append((number, at @ frame.place))
    return places


def _actuators(left: Model, right: Model, joints: Pairs, names: Mapping[str, str]) -> Pairs:
    """Return the pairs of actuators: by name, then the n-th of a joint and the n-th of its pair.

    Those without a name that drive no joint, such as the actuator of a site, are paired in their
    order where both sides have as many.
    """
    of_one_joint = (
        (left_id, right_id)
        for left_id, left_joint in enumerate(left.actuator_jntid.tolist())
        for right_id, right_joint in enumerate(right.actuator_jntid.tolist())
        if (left_joint, right_joint) in joints
    )
    further = [*of_one_joint]
    left_others, right_others = _unnamed_without_joint(left), _unnamed_without_joint(right)
    if len(left_others) == len(right_others):
        further += zip(left_others, right_others, strict=True)
    return _and_further(_by_name(left.actuator_names, right.actuator_names, names), further)


def _unnamed_without_joint(model: Model) -> list[int]:
    """Return the actuators without a name that drive a site, a tendon or a body."""
    return [
        number
        for number, joint in enumerate(model.actuator_jntid.tolist())
        if joint < 0 and not model.actuator_names[number]
    ]


def _unmatched_names(names: Sequence[str], pairs: Pairs, side: int) -> tuple[str, ...]:
    matched_ids = {pair[side] for pair in pairs}
    return tuple(name or f"number {k}" for k, name in enumerate(names) if k not in matched_ids)


def _joints_by_place(matching: Matching) -> Iterator[RenamedPair]:
    """Yield joints that were matched by their place although they go by two names."""
    for pair in matching.pairs:
        left, right = pair.left.joint, pair.right.joint
        if pair.by != "place" or not left or not right or left.kind not in SCALAR:
            continue
        if left.name != right.name:
            suggestion = command(["--map", f"{left.name}=NAME"])
            shared = "one kind, one place, one axis"
            yield RenamedPair("joint", left.name, right.name, shared, suggestion)


def _by_place(
    left: Model, right: Model, sites: Pairs, actuators: Pairs, names: Mapping[str, str]
) -> Iterator[RenamedPair]:
    """Yield sites and actuators that are matched although they go by two names."""
    for kind, pairs, place in (("site", sites, "place"), ("actuator", actuators, "joint")):
        both = [getattr(model, f"{kind}_names") for model in (left, right)]
        for left_id, right_id in pairs:
            left_name, right_name = both[0][left_id], both[1][right_id]
            is_same = left_name == right_name or names.get(left_name) == right_name
            if left_name and right_name and not is_same:
                suggestion = f"--map {left_name}=NAME"
                yield RenamedPair(kind, left_name, right_name, f"one {place}", suggestion)


def missing_parts(
    left: Model, right: Model, options: Mapping[str, OptionValue]
) -> tuple[tuple[str, str], ...]:
    """Return what one of two Models lacks and the other has, as far as the options leave it on.

    Args:
        left: The one.
        right: The other.
        options: Of what is run, which may switch actuators or contacts off.

    Returns:
        Pairs: "left" or "right", who has none; and "actuators" or "floor".
    """
    if left.compiled is None or right.compiled is None:
        return ()
    left_counts, right_counts = (
        raw_engine_of(DEFAULT).counts(model.compiled) for model in (left, right)
    )
    return tuple(
        ("right" if left_counts[part] else "left", part)
        for part in left_counts
        if bool(left_counts[part]) is not bool(right_counts[part])
        if options.get(_SWITCHED_BY[part], True)
    )
