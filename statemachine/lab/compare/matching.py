"""Which joint, body, site and actuator of one Model is which of another.

By name, then by structure: `engines.description.match` says how, and `names` overrules it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from ...backends.controls import ctrl_owners
from ...engines import room
from ...engines.description.match import Matching, Pair, match, renamed
from ...engines.description.records import Robot
from ...engines.description.shapes import one_to_one
from ...engines.description.tree import GroupTree
from ...engines.records import BodyPair, Counterparts, Pairs
from ...errors import BadInputError, check_name
from ...installed import DEFAULT
from ...interface import Array, Model, State
from ...rotations import HERE, Placement
from ..recordings import SideStart

Only = Mapping[str, tuple[str, ...]]
_ONE_PLACE = 1e-6  # [m] within which two sites without a common name are one


@dataclass(frozen=True, eq=False, kw_only=True)
class Matched(Counterparts):
    """What of one Model is what of another.

    Attributes:
        left: The first Model.
        right: The second.
        bodies: Pairs of ids.
        only: For each Model what it alone has: names, by "joint", "site" and "actuator".
        notes: What a reader should know, in sentences.
    """

    left: Model
    right: Model
    bodies: Pairs
    only: tuple[Only, Only]
    notes: tuple[str, ...]

    @property
    def reordered(self) -> bool:
        """Whether who writes ctrl by number meets other actuators on the second."""
        places = [b for _, b in self.actuators]
        return places != sorted(places)

    @property
    def joints_elsewhere(self) -> bool:
        """Whether who reads qpos or qvel by number meets other joints on the second."""
        here, there = self.left, self.right
        return any(
            here.jnt_qposadr[a] != there.jnt_qposadr[b] or here.jnt_dofadr[a] != there.jnt_dofadr[b]
            for a, b in self.joints
        )

    @property
    def mocap_elsewhere(self) -> bool:
        """Whether who moves mocap bodies by number meets others on the second."""
        ours, theirs = self.places["mocap_pos"]
        return ours != theirs

    def start(self, left: SideStart, right: SideStart) -> SideStart:
        """The start of the first Model in the second's terms; the rest is that of `right`."""
        return SideStart(
            qpos=self.moved("qpos", left.qpos, right.qpos),
            qvel=self.moved("qvel", left.qvel, right.qvel),
            ctrl=self.moved("ctrl", left.ctrl, right.ctrl),
        )

    def state(self, left: State, right: State) -> State:
        """The second Model's State `right` with what a State of the first tells of it.

        Beside the time these are the arrays in `places` that both have.
        """
        given = {
            name: self.moved(name, left[name], right[name])
            for name in self.places
            if name in dict(left.layout) and name in dict(right.layout)
        }
        return right.with_parts(time=left["time"], **given)

    def moved(self, part: str, values: Array, start: Array) -> Array:
        """An array of the second Model, from that of the first.

        Args:
            part: Its name in `places`.
            values: (m,) or (n, m) of the first.
            start: (k,) of the second, for what has no counterpart.
        """
        return _moved(values, start, *self.places[part])

    @cached_property
    def places(self) -> Mapping[str, list[list[int]]]:
        """By array of a State, where in it on either side the counterparts are.

        Activations are of actuators that have as many of them.
        """
        left, right = self.left.compiled, self.right.compiled
        activations: Iterable[tuple[int, int]] = ()
        if left is not None and right is not None:
            activations = _activations(self.actuators, left, right)
        mocap_bodies = list(self._mocap_bodies())
        return {
            "qpos": self._spans("jnt_qposadr", "nq"),
            "qvel": self._spans("jnt_dofadr", "nv"),
            "ctrl": _ends(self.actuators),
            "act": _ends(activations),
            "mocap_pos": _ends(_entries(mocap_bodies, 3)),
            "mocap_quat": _ends(_entries(mocap_bodies, 4)),
        }

    def _mocap_bodies(self) -> Iterator[tuple[int, int]]:
        """Yield the numbers of mocap bodies, as `body_mocapid` has them, that are counterparts."""
        for pair in self.solids:
            here = int(self.left.compiled.body_mocapid[pair.left])
            there = int(self.right.compiled.body_mocapid[pair.right])
            if here >= 0 and there >= 0:
                yield here, there

    def _spans(self, start: str, end: str) -> list[list[int]]:
        """The places of the joints of both, in qpos or qvel."""
        places: list[list[int]] = [[], []]
        for side, model in enumerate((self.left, self.right)):
            starts = [*getattr(model, start).tolist(), getattr(model, end)]
            for pair in self.joints:
                places[side] += range(starts[pair[side]], starts[pair[side] + 1])
        return places


def _entries(bodies: Iterable[tuple[int, int]], size: int) -> Iterator[tuple[int, int]]:
    """Yield the places of so many numbers of each body, which stand one after the other."""
    for here, there in bodies:
        for k in range(size):
            yield size * here + k, size * there + k


def _ends(pairs: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Return the left ends of some pairs, and the right ones."""
    both = list(pairs)
    return [[a for a, _ in both], [b for _, b in both]]


def _activations(actuators: Pairs, left: Any, right: Any) -> list[tuple[int, int]]:
    """Pairs of places in act."""
    owner = ctrl_owners(left), ctrl_owners(right)
    pairs: set[tuple[int, int]] = set()
    for a, b in actuators:
        here, there = int(owner[0][a]), int(owner[1][b])
        number = int(left.actuator_actnum[here])
        if number == right.actuator_actnum[there]:
            start = int(left.actuator_actadr[here]), int(right.actuator_actadr[there])
            pairs |= {(start[0] + k, start[1] + k) for k in range(number)}
    return sorted(pairs)


@dataclass(frozen=True, eq=False)
class MatchedTrees:
    """The rigid parts of two Models, and which is which.

    Attributes:
        left: Those of the first, by the names of the second.
        right: Those of the second.
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
    ours = {a: b for a, b in names.items() if a in robots[0].names}
    trees = GroupTree(renamed(robots[0], ours)), GroupTree(robots[1])
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
    given = {} if names is None else dict(names)
    for side, model in enumerate((left, right)):
        known = _description(model).names | {name for name in model.actuator_names if name}
        for pair in given.items():
            check_name(
                f"joint, body, site or actuator in {model.path.name}", pair[side], sorted(known)
            )
    trees = match_trees(left, right, given, one_world=one_world)
    matching = trees.matching
    joints = _joints(matching)
    # A body with several joints is several parts of a description, of which the last has its mass.
    by_body = {solid.left: solid for solid in map(_solid, matching.pairs)}
    solids = (*by_body.values(), *_led(left, right, given))
    by_name = _by_name(left.body_names, right.body_names, given)
    bodies = _and_further(((solid.left, solid.right) for solid in solids), by_name)
    sites = _sites(left, right, given, trees)
    actuators = _actuators(left, right, joints, given)
    only_left = _only((left, right), 0, joints, actuators, sites)
    only_right = _only((right, left), 1, joints, actuators, sites)
    return Matched(
        left=left,
        right=right,
        joints=joints,
        bodies=bodies,
        sites=sites,
        actuators=actuators,
        solids=solids,
        only=(only_left, only_right),
        notes=(*matching.notes(), *_by_place(left, right, sites, actuators, given)),
    )


def _joints(matching: Matching) -> Pairs:
    """Return the joints of counterparts that are of one kind."""
    joints = []
    for pair in matching.pairs:
        here, there = pair.left.joint, pair.right.joint
        if here and there and here.kind == there.kind:
            joints.append((here.number, there.number))
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
    further_sites = _rest(model.site_names, sites, side)
    return {
        "joint": _rest(model.joint_names, joints, side),
        "actuator": _rest(model.actuator_names, actuators, side),
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
        notes=(),
    )


def _description(model: Model) -> Robot:
    if model.compiled is None:
        raise BadInputError(
            f"{model.backend} does not tell what the bodies of its models are: they cannot be "
            "matched with those of another file"
        )
    return room(DEFAULT).describe(model.compiled, model.path.name)


def _solid(pair: Pair) -> BodyPair:
    bodies = [group.links[0][0].body for group in (pair.left, pair.right)]
    return BodyPair(bodies[0], bodies[1], pair.align, pair.moved)


def _led(left: Model, right: Model, given: Mapping[str, str]) -> list[BodyPair]:
    """The mocap bodies: no joint moves them, but they are not part of the world; by name.

    Those without a name in both are one where as many others come before them.
    """
    left_bodies, right_bodies = _mocap_bodies_of(left), _mocap_bodies_of(right)
    ours = [left.body_names[body] for body in left_bodies]
    theirs = [right.body_names[body] for body in right_bodies]
    nameless = [(k, k) for k, names in enumerate(zip(ours, theirs, strict=False)) if not any(names)]
    pairs = sorted([*_by_name(ours, theirs, given), *nameless])
    return [BodyPair(left_bodies[a], right_bodies[b], HERE, False) for a, b in pairs]


def _mocap_bodies_of(model: Model) -> list[int]:
    """Return the ids of the mocap bodies of a Model."""
    return np.flatnonzero(model.compiled.body_mocapid >= 0).tolist()


def _by_name(ours: Sequence[str], theirs: Sequence[str], given: Mapping[str, str]) -> Pairs:
    there = {name: k for k, name in enumerate(theirs) if name}
    wanted = [given.get(name, name) for name in ours]
    return tuple((k, there[name]) for k, name in enumerate(wanted) if name in there)


def _and_further(pairs: Iterable[tuple[int, int]], further: Iterable[tuple[int, int]]) -> Pairs:
    """Pairs, and of some further ones, in turn, those whose ends are both left."""
    return tuple(sorted(one_to_one(further, pairs).items()))


def _sites(
    left: Model,
    right: Model,
    given: Mapping[str, str],
    trees: MatchedTrees,
) -> Pairs:
    """By name, then by place: of what is left, those in one place of the same solid."""
    left_places, right_places = _frame_places(trees.left), _frame_places(trees.right)

    def in_one_place(site: int, other: int) -> bool:
        (number, place), (other_number, other_place) = left_places[site], right_places[other]
        pair = trees.matching.of(number)
        if pair is None or other_number != pair.right.number:
            return False
        return (pair.align @ place).distance(other_place) < _ONE_PLACE

    by_place = (
        (site, other)
        for site, other in product(range(left.nsite), range(right.nsite))
        if in_one_place(site, other)
    )
    return _and_further(_by_name(left.site_names, right.site_names, given), by_place)


def _frame_places(tree: GroupTree) -> list[tuple[int, Placement]]:
    """Return for each frame of a robot the number of its solid, and where it is in that."""
    places = []
    for frame in tree.robot.frames:
        number, at = tree.at[frame.link]
        places.append((number, at @ frame.place))
    return places


def _actuators(left: Model, right: Model, joints: Pairs, given: Mapping[str, str]) -> Pairs:
    """By name, then by the joint: the n-th of a joint is the n-th of its counterpart."""
    of_one_joint = (
        (a, b)
        for a, joint in enumerate(left.actuator_jntid.tolist())
        for b, other in enumerate(right.actuator_jntid.tolist())
        if (joint, other) in joints
    )
    return _and_further(_by_name(left.actuator_names, right.actuator_names, given), of_one_joint)


def _rest(names: Sequence[str], pairs: Pairs, side: int) -> tuple[str, ...]:
    taken = {pair[side] for pair in pairs}
    return tuple(name or f"number {k}" for k, name in enumerate(names) if k not in taken)


def _by_place(
    left: Model, right: Model, sites: Pairs, actuators: Pairs, given: Mapping[str, str]
) -> Iterator[str]:
    """Sites and actuators that are matched although they go by two names."""
    for kind, pairs, place in (("site", sites, "place"), ("actuator", actuators, "joint")):
        names = [getattr(model, f"{kind}_names") for model in (left, right)]
        for a, b in pairs:
            name, other = names[0][a], names[1][b]
            if name and other and name != other and given.get(name) != other:
                yield (
                    f"{kind} {name!r} on the left is taken for {other!r} on the right: one {place} "
                    f"(--map {name}=NAME says otherwise)"
                )


def _moved(values: Array, start: Array, here: Sequence[int], there: Sequence[int]) -> Array:
    """Values (k,) or (n, k) at other places of a start (m,)."""
    rows = np.array(np.broadcast_to(start, (*np.shape(values)[:-1], len(start))))
    rows[..., there] = values[..., here]
    return rows


def missing_parts(left: Model, right: Model) -> tuple[tuple[str, str], ...]:
    """What one of two Models has nothing of, and the other has.

    Returns:
        Pairs: "left" or "right", who has none; and "actuators" or "floor".
    """
    if left.compiled is None or right.compiled is None:
        return ()
    left_counts, right_counts = (room(DEFAULT).counts(model.compiled) for model in (left, right))
    return tuple(
        ("right" if left_counts[part] else "left", part)
        for part in left_counts
        if bool(left_counts[part]) is not bool(right_counts[part])
    )
