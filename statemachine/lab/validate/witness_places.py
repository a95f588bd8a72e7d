"""Which joint, body and frame of an engine's model is which of the witness's, by their places.

Parts go by name first, and by place where names differ, as where two files are compared: what the
witness says of itself through its places, and what Pinocchio says of the numbers of the engine's
model, are laid on each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ...engines.description.match import Matching, Pair, frame_names, match
from ...engines.description.moving import describe, is_rooted
from ...engines.description.tree import Group, GroupTree
from ...errors import BadInputError
from ...interface import Model
from ...kinematics import Kinematics
from ...rotations import HERE, Placement
from ...witness import labels
from ..runs.readings import Tip
from .fingertip_result import CommonBody, FrameOffset
from .witness_parts import JointPair, PartsByName, WitnessFrame, WitnessParts, frame_kind

_SAME_PLACE_TOLERANCE = 1e-6  # [m] and [rad] within which two frames without a common name are one
_HALF_WEIGHT_DISTANCE = 1e-4  # [m] at which a mismatch of a joint's place counts half
_MIN_BETTER_FIT = 0.5  # by how much another base must fit better


def witness_parts(model: Model, kinematics: Kinematics) -> WitnessParts:
    """Return what of an engine's model is what of the witness's.

    Raises:
        BadInputError: They can go by names only, and these do not tell.
    """
    has_same_joints = kinematics.joint_names == tuple(model.joint_names)
    has_same_bodies = kinematics.body_names == tuple(labels("body", model.body_names))
    if model.compiled is None or (has_same_joints and has_same_bodies):
        return PartsByName(model, kinematics)
    return PartsByPlace(model, kinematics)


@dataclass(frozen=True)
class _Base:
    """A way to lay the bases of two robots on each other.

    Attributes:
        body: A body of the engine's base.
        witness_body: A body of the witness's base, whose frame is taken for that of `body`.
        align: The frame of the engine's base in that of the witness's.
    """

    body: str
    witness_body: str
    align: Placement


class PartsByPlace(WitnessParts):
    """Parts that go by name, and by place where names differ."""

    def __init__(self, model: Model, kinematics: Kinematics) -> None:
        """Lay the two robots on each other.

        Args:
            model: On the engine; its backend starts from a compiled model.
            kinematics: What the witness computes places with.
        """
        super().__init__(model, kinematics)
        numbers = Kinematics.same_reading(model)
        ours = describe(numbers, _joint_labels(numbers, "the engine"))
        theirs = describe(kinematics, _joint_labels(kinematics, "the witness"))
        self._left, self._right = GroupTree(ours), GroupTree(theirs)
        has_two_worlds = is_rooted(ours) and is_rooted(theirs)
        root = match(self._left, self._right, one_world=has_two_worlds).pairs[0]
        bases = _bases(self._left, self._right, root, has_two_worlds)
        base, matching = _best_base(self._left, self._right, bases)
        self._aligned = {pair.left.number: pair.align for pair in matching.pairs}
        self._counterparts = {pair.left.number: pair.right.number for pair in matching.pairs}
        self._frame_names = frame_names(self._left, self._right)
        is_of_worlds = root.left.number == 0 and root.right.number == 0
        is_as_it_is = base.body == root.left.name and base.witness_body == root.right.name
        if not (is_of_worlds and is_as_it_is):
            self.relative_to = CommonBody(base.body, base.witness_body)
        self._base_groups = root.left.number, root.right.number
        self.joints = tuple(_joint_pairs(matching))

    def frame(self, tip: Tip, name: str | None) -> WitnessFrame:
        """Return the frame of the name that was asked for, else the tip's counterpart.

        That is the frame of the tip's own name, one of a name that says the same, or one without
        a common name that is in the same place of the same rigid part.
        """
        if name is None:
            name = self._name_of(tip)
        kind = frame_kind(self.kinematics, name, tip.kind)
        group, place = self._left.frames[self._key(tip)]
        key = name
        if kind == "site" and name in self._right.at:
            key = f"{name} (site)"
        other_group, other = self._right.frames[key]
        offset = None
        if self._counterparts.get(group) == other_group:
            ours = self._aligned[group] @ place
            offset = FrameOffset(ours.distance(other), ours.angle(other))
        return WitnessFrame(name, kind, offset)

    def _key(self, tip: Tip) -> str:
        """Return what the tree of the engine's model calls a tip."""
        if tip.kind == "site" and tip.name in self._left.at:
            return f"{tip.name} (site)"
        return tip.name

    def _name_of(self, tip: Tip) -> str:
        """Return the name of a tip's counterpart; its own where there is none."""
        known = {*self.kinematics.body_names, *self.kinematics.site_names}
        if tip.named and tip.name in known:
            return tip.name
        if tip.named:
            alike = self._frame_names.get(self._key(tip), "").removesuffix(" (site)")
            if alike in known:
                return alike
        placed = self._in_same_place(tip)
        return tip.name if placed is None else placed

    def _in_same_place(self, tip: Tip) -> str | None:
        """Return a frame in the place of a tip, on the same rigid part; None if there is none."""
        number, place = self._left.frames[self._key(tip)]
        counterpart = self._counterparts.get(number)
        if counterpart is None:
            return None
        ours = self._aligned[number] @ place
        for name, (other_number, other) in self._right.frames.items():
            if other_number == counterpart and _are_one_place(ours, other):
                return name.removesuffix(" (site)")
        is_first = tip.kind == "body" and tip.name == self._left.groups[number].name
        return self._right.groups[counterpart].name if is_first else None

    def check_moved(self, tip: Tip, frame: WitnessFrame) -> None:
        """Check that both have all joints that move a tip against the common body."""
        ours, theirs = self._base_groups
        group, _ = self._left.frames[self._key(tip)]
        moving = _between(self._left, group, ours)
        paired = {pair.joint for pair in self.joints}
        for joint in moving:
            if joint not in paired:
                name = labels("joint", self.model.joint_names)[joint]
                raise BadInputError(
                    f"{self.kinematics.path.name} lacks the joint {name!r}, which moves "
                    f"{tip.name!r}"
                )
        key = frame.name
        if frame.kind == "site" and key in self._right.at:
            key = f"{key} (site)"
        group, _ = self._right.frames[key]
        paired = {pair.witness_joint for pair in self.joints}
        for joint in _between(self._right, group, theirs):
            if joint not in paired:
                name = labels("joint", self.kinematics.joint_names)[joint]
                raise BadInputError(
                    f"{self.model.path.name} lacks the joint {name!r} of "
                    f"{self.kinematics.path.name}, which moves {frame.name!r} there"
                )


def _joint_labels(kinematics: Kinematics, owner: str) -> list[str]:
    """Return what joints are called; one without a name is like none of another robot."""
    names = kinematics.joint_names
    called = labels("joint", names)
    for number, name in enumerate(names):
        if not name:
            called[number] = f"{called[number]} of {owner}"
    return called


def _joint_pairs(matching: Matching) -> list[JointPair]:
    """Return the joints of one kind of rigid parts that are one, in the engine's order."""
    pairs = []
    for pair in matching.pairs:
        ours, theirs = pair.left.joint, pair.right.joint
        if ours is not None and theirs is not None and ours.kind == theirs.kind:
            pairs.append(JointPair(ours.number, theirs.number))
    return sorted(pairs, key=lambda pair: pair.joint)


def _bases(left: GroupTree, right: GroupTree, root: Pair, has_two_worlds: bool) -> list[_Base]:
    """Return the ways to lay two bases on each other, those that are looked for first before.

    Args:
        left: The engine's robot.
        right: The witness's.
        root: The rigid parts that are the bases.
        has_two_worlds: Whether both files say where in the world their robot is.
    """
    places = {link.name: place for link, place in root.left.links}
    others = {link.name: place for link, place in root.right.links}
    names = [(root.left.name, root.right.name)]
    if has_two_worlds and root.left.number == root.right.number == 0:
        return [_Base(*names[0], HERE)]
    common = [(name, name) for name in places if name in others]
    first = _first_link(left, root.left), _first_link(right, root.right)
    if root.left.number == root.right.number == 0:
        names += [*common, first]
    else:  # one of them floats: a common name says best which bodies are one
        names = [*common, first, *names]
    bases: list[_Base] = []
    for body, witness_body in names:
        align = others[witness_body] @ places[body].inverse
        if not any(_are_one_place(align, base.align) for base in bases):
            bases.append(_Base(body, witness_body, align))
    return bases


def _first_link(tree: GroupTree, group: Group) -> str:
    """Return the robot's first link in its base; the world is none if there is another."""
    if is_rooted(tree.robot) and group.number == 0 and len(group.links) > 1:
        return group.links[1][0].name
    return group.name


def _best_base(left: GroupTree, right: GroupTree, bases: Sequence[_Base]) -> tuple[_Base, Matching]:
    """Return the first base with which most parts are paired, and their joints fit nearly best.

    Args:
        left: The engine's robot.
        right: The witness's.
        bases: Ways to lay the one on the other.
    """
    matchings = [match(left, right, root_align=base.align) for base in bases]
    most = max(len(matching.pairs) for matching in matchings)
    fitting = [
        (base, matching)
        for base, matching in zip(bases, matchings, strict=True)
        if len(matching.pairs) == most
    ]
    misfits = [_misfit(matching) for _, matching in fitting]
    least = min(misfits)
    best = next(k for k, misfit in enumerate(misfits) if misfit <= least + _MIN_BETTER_FIT)
    return fitting[best]


def _misfit(matching: Matching) -> float:
    """Return how badly the places of joints fit; each counts 1 at most."""
    sum_of_misfits = 0.0
    for pair in matching.pairs:
        above = matching.of(pair.left.parent)
        if pair.by == "root" or pair.moved or above is None:
            continue
        hung = pair.right.place.inverse @ above.align @ pair.left.place
        gap = hung.distance(pair.align) + hung.angle(pair.align) / 10
        sum_of_misfits += gap / (gap + _HALF_WEIGHT_DISTANCE)
    return sum_of_misfits


def _are_one_place(frame: Placement, other: Placement) -> bool:
    """Tell whether two frames are one but for rounding."""
    return (
        frame.distance(other) < _SAME_PLACE_TOLERANCE and frame.angle(other) < _SAME_PLACE_TOLERANCE
    )


def _between(tree: GroupTree, number: int, base: int) -> list[int]:
    """Return the joints that move a rigid part against the base, or the base against it."""
    return sorted(set(_movers(tree, number)) ^ set(_movers(tree, base)))


def _movers(tree: GroupTree, number: int) -> Iterable[int]:
    """Yield the numbers of the joints that move a rigid part in the world."""
    while number >= 0:
        group = tree.groups[number]
        if group.joint is not None:
            yield group.joint.number
        number = group.parent
