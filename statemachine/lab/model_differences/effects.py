"""What a difference means for a motion, and how much it weighs.

All of it is computed at the zero of the joints, from what the two compiled models have in a run,
where a fault of a file is mended: M_ii, the inertia that a joint feels, its armature included; the
torque of the weight that it carries, its axis level; the spring that a servo is, as the joint feels
it: r² kp, with the moment arm r of the actuator, gear included.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...engines.description.match import Pair
from ...engines.description.reading import ModelReading
from ...engines.description.records import SCALAR, RobotJoint
from ...engines.description.tree import GRAVITY
from ...engines.records import TURNED
from ...interface import Array
from ...measures.text import milliseconds, rounded
from ...rotations import HERE, Placement
from ..compare.matching import MatchedTrees
from .loads import JointLoad, ServoParts, SideLoads
from .weighed_bodies import inertials, relative_gap, was_repaired

_FIXED_TO_WORLD = "stands still"
_ON_ITS_AXIS = 1e-9  # [m], and of entries of matrices: what is less is rounding


@dataclass(frozen=True)
class Meaning:
    """What a difference of a quantity means.

    Attributes:
        share: How much it weighs, from 0 to 1.
        effect: What it does, in words; "" if nothing can be said.
        scale: What the difference is set against to be rounding, where that is more than the
            values are.
        relative: How far apart the values are as a part of what they are set against, where that
            does not follow from them.
        matters: Whether it can change a motion.
    """

    share: float
    effect: str = ""
    scale: float = 0.0
    relative: float | None = None
    matters: bool = True


class Effects:
    """What differences of two models mean.

    Args:
        readings: Both.
        stated: Their rigid parts, with the masses and inertias that the files state.
        trees: Their rigid parts, with those that a run has.
        renamed: By the name of a joint of the first that in its tree, where it is another one.
        partners: By the name of a joint of the first that of its counterpart.
    """

    def __init__(
        self,
        readings: Sequence[ModelReading],
        stated: MatchedTrees,
        trees: MatchedTrees,
        renamed: Mapping[str, str],
        partners: Mapping[str, str],
    ) -> None:
        self._trees, self._renamed, self._partners = trees, renamed, partners
        self._stated = stated
        left, right = readings[0].run_model, readings[1].run_model
        self.left, self.right = SideLoads(left, trees.left), SideLoads(right, trees.right)
        self.reach = max(trees.left.reach, trees.right.reach)
        self._pairs = _by_body(trees)
        self._stated_pairs = _by_body(stated)

    # Joints

    def loads(self, joint: str) -> list[JointLoad]:
        """Return what a joint carries on each side that has it, by its name on the left."""
        sides = (
            self.left.loads.get(self._renamed.get(joint, joint)),
            self.right.loads.get(self._partners.get(joint, joint)),
        )
        return [side for side in sides if side is not None]

    def of_joint(
        self, joint: str, subject: str, left: float | None, right: float | None
    ) -> Meaning:
        """Return what another armature, damping, dry friction or effort of a joint means.

        Args:
            joint: Its name on the left.
            subject: What it is of the joint: "armature", "damping", "dry friction", "effort".
            left: The value of the left; None where it does not say.
            right: The value of the right.
        """
        loads = self.loads(joint)
        values = [value for value in (left, right) if value is not None]
        apart = abs(values[0] - values[1]) if len(values) == 2 else abs(values[0])
        largest = max(abs(value) for value in values)
        usual = apart / largest if largest and math.isfinite(largest) else 1.0
        match subject:
            case "armature":
                inertia = max((load.inertia for load in loads if load.inertia > 0), default=0.0)
                if inertia:
                    return Meaning(apart / inertia, f"{apart / inertia:.1%} of M_ii")
            case "dry friction":
                effort = max((load.effort for load in loads), default=0.0)
                if effort:
                    return Meaning(apart / effort, f"{apart / effort:.2%} of the effort")
            case "damping":
                return Meaning(
                    self._share_of_damping(loads, apart, usual), _decay_time_in_words(loads)
                )
            case "effort":
                return Meaning(usual, _effort_in_words(loads, values))
        return Meaning(usual)

    def _share_of_damping(self, loads: list[JointLoad], apart: float, usual: float) -> float:
        """Return a damping as a part of the effort: what it takes at 1 rad/s, or at 1 m/s."""
        effort = max((load.effort for load in loads), default=0.0)
        return apart / effort if effort else usual

    def of_range(self, ends: Sequence[tuple[float, float] | None], unit: str) -> Meaning:
        """Return what another range of a joint means.

        Args:
            ends: The range of each side; None where that has none.
            unit: Of the joint, "rad" or "m".
        """
        left, right = ends
        if left is None or right is None:
            return Meaning(1.0, f"the {'right' if right is None else 'left'} has no stop")
        span = max(left[1] - left[0], right[1] - right[0])
        further: dict[str, float] = {}
        for name, far in (("left", right[0] - left[0]), ("left", left[1] - right[1])):
            if far > 0:
                further[name] = max(further.get(name, 0.0), far)
        for far in (left[0] - right[0], right[1] - left[1]):
            if far > 0:
                further["right"] = max(further.get("right", 0.0), far)
        words = [f"the {side} goes {rounded(far, unit)} further" for side, far in further.items()]
        share = max(further.values(), default=0.0) / span if span else 1.0
        return Meaning(share, ", ".join(words), scale=span)

    # Actuators

    def of_servo(self, left: str, right: str, parts: ServoParts = "both") -> str:
        """Return what a servo is for its joint on each side, in words; "" where it is none.

        Args:
            left: Its name on the left; "" where that has none.
            right: Its name on the right; "" where that has none.
            parts: What is told of it.
        """
        sides = [
            self.left.servo(left, self._renamed) if left else None,
            self.right.servo(right, {}) if right else None,
        ]
        words = [servo.words(parts) for servo in sides if servo is not None]
        if len(words) == 2 and words[0] == words[1]:
            return f"{words[0]} on both" if words[0] else ""
        return " / ".join(words)

    # Bodies

    @property
    def root(self) -> Pair:
        """Return the rigid parts that carry all others, as the files state them."""
        return self._stated.matching.pairs[0]

    def joints_of_parts(self) -> Iterator[tuple[RobotJoint, RobotJoint]]:
        """Yield the joints that carry two parts which are one."""
        for pair in self._trees.matching.pairs:
            left, right = pair.left.joint, pair.right.joint
            if left is not None and right is not None:
                yield left, right

    def pair(self, body: int) -> Pair | None:
        """Return the rigid parts that a body of the left is in, and its counterpart."""
        return self._pairs.get(body)

    def _moves(self, pair: Pair) -> bool:
        """Tell whether a part can move: what is fixed to the world moves nothing by its mass."""
        return not (pair.left.parent < 0 and pair.right.parent < 0)

    def _inertia_of(self, pair: Pair) -> float:
        """Return the larger M_ii of the joint that carries a part; 0 where it is unknown."""
        felt = (
            self._trees.left.inertia_and_load(pair.left.number)[0],
            self._trees.right.inertia_and_load(pair.right.number)[0],
        )
        return max((inertia for inertia in felt if inertia > 0), default=0.0)

    def of_mass(self, body: int, left: float, right: float) -> Meaning:
        """Return what another mass of a body [kg] means."""
        pair, heavier = self.pair(body), max(left, right)
        share = abs(left - right) / heavier if heavier else 1.0
        if pair is not None and not self._moves(pair):
            return Meaning(0.0, _FIXED_TO_WORLD, matters=False)
        return Meaning(share, f"{share:.1%} of the larger")

    def of_centre(self, body: int, left: Array, right: Array) -> Meaning:
        """Return what another centre of mass (3,) [m] of a body means."""
        pair, apart = self.pair(body), float(np.linalg.norm(left - right))
        usual = Meaning(apart / self.reach, scale=self.reach)
        if pair is None:
            return usual
        if not self._moves(pair):
            return Meaning(0.0, _FIXED_TO_WORLD, scale=self.reach, matters=False)
        joint = pair.right.joint
        if joint is None or joint.kind != "hinge":
            return usual
        weight = max(pair.left.inertial.mass, pair.right.inertial.mass) * GRAVITY * apart
        loads = (
            self._trees.left.inertia_and_load(pair.left.number)[1],
            self._trees.right.inertia_and_load(pair.right.number)[1],
        )
        load = max(*(value for value in loads if value > 0), weight, 0.0, 0.0)
        share = weight / load if load else 0.0
        return Meaning(share, f"up to {weight:.2g} N·m", scale=self.reach)

    def of_inertia(self, body: int, other: int) -> Meaning:
        """Return what another inertia of a body means: as the joint feels it that carries it.

        Args:
            body: Its id on the left.
            other: That of its counterpart on the right.
        """
        pair = self.pair(body)
        if pair is None:
            return Meaning(0.5)
        stated = inertials(self._stated_pairs[body], body, other)
        left, right = inertials(pair, body, other)
        relative = relative_gap(*stated)  # of what is shown; the share is of what moves
        if not self._moves(pair):
            return Meaning(0.0, _FIXED_TO_WORLD, relative=relative, matters=False)
        any_mended = was_repaired(stated[0], left) or was_repaired(stated[1], right)
        mended = ", as mended" if any_mended else ""
        joint, inertia = pair.right.joint, self._inertia_of(pair)
        if joint is not None and joint.kind == "hinge" and inertia:
            off = left.tensor - right.tensor
            share = abs(float(joint.axis @ off @ joint.axis)) / inertia
            effect = f"{share:.2%} of M_ii{mended}"
            return Meaning(share, effect, relative=relative)
        share = relative_gap(left, right)
        effect = f"{share:.1%} of the larger{mended}" if mended else ""
        return Meaning(share, effect, relative=relative)

    def of_place(self, body: int, quantity: str, size: float) -> Meaning:
        """Return what another place of a body on the part that carries it means.

        Args:
            body: Its id on the left.
            quantity: "place", or that it is turned.
            size: How far it is off [m or rad].
        """
        scale = math.pi if quantity == TURNED else self.reach
        pair = self.pair(body)
        above = None if pair is None else self._trees.matching.of(pair.left.parent)
        if pair is None or above is None:
            return Meaning(size / scale, scale=scale)
        # The first one's frame as the second one would have it, in the second one's own.
        off = pair.right.place.inverse @ above.align @ pair.left.place @ pair.align.inverse
        far = max(float(np.linalg.norm(off.of(tip) - tip)) for tip in self._tips(pair))
        effect = ""
        if far > _ON_ITS_AXIS:
            effect = f"moves what it carries by up to {rounded(far, 'm')}"
        joint = pair.right.joint
        if joint is not None and joint.kind in SCALAR and _is_about(off, joint):
            effect = f"only its zero is elsewhere: {effect}" if effect else "its zero is elsewhere"
        return Meaning(max(far / self.reach, off.angle(HERE) / math.pi), effect, scale=scale)

    def _tips(self, pair: Pair) -> list[Array]:
        """Return points (3,) that a pair carries at zero [m], in the second one's frame.

        They are the origins of its frames, and its centres of mass.
        """
        tree = self._trees.left
        world = tree.poses()
        home = pair.align @ world[pair.left.number].inverse
        beyond = {pair.left.number}
        for group in tree.groups[pair.left.number + 1 :]:
            if group.parent in beyond:
                beyond.add(group.number)
        points = [
            home.of(world[number].of(place.pos))
            for number, place in tree.frames.values()
            if number in beyond
        ]
        return points + [home.of(world[k].of(tree.groups[k].inertial.com)) for k in beyond]

    def of_axis(self, left: Array, right: Array) -> Meaning:
        """Return what another axis (3,) of a joint means, both in the frame of the right."""
        tilt = math.atan2(float(np.linalg.norm(np.cross(left, right))), float(left @ right))
        effect = f"turned by {rounded(tilt, 'rad')}"
        if abs(tilt - math.pi) < 1e-3:
            effect = "moves the other way"
        return Meaning(tilt / math.pi, effect, relative=tilt / math.pi / 4)


def _by_body(trees: MatchedTrees) -> dict[int, Pair]:
    """Return the pair of rigid parts that each body of the left model is in, by its id."""
    pairs: dict[int, Pair] = {}
    for pair in trees.matching.pairs:
        for link, _ in pair.left.links:
            pairs[link.body] = pair
    return pairs


def _decay_time_in_words(loads: Sequence[JointLoad]) -> str:
    """Return in what time M_ii / damping a joint of each side slows down, in words.

    Of a ball and a free joint, which have no one M_ii, nothing is said.
    """
    words: list[str] = []
    for load in loads:
        damping = load.joint.damping
        if math.isnan(load.inertia):
            continue
        if damping and load.inertia > 0:
            words.append(milliseconds(load.inertia / damping, 3))
        else:
            words.append("never")
    return " / ".join(dict.fromkeys(words))


def _effort_in_words(loads: Sequence[JointLoad], values: Sequence[float]) -> str:
    """Return what another largest force of a joint means, in words."""
    least, most = min(values), max(values)
    if len(values) == 2 and 0 < least < most < math.inf:
        return f"{most / least:.3g} times"
    words: list[str] = []
    for load in loads:
        if load.load > 0:
            words.append(f"its load: {rounded(load.load, load.unit('N·m'))}")
    return " / ".join(dict.fromkeys(words))


def _is_about(off: Placement, joint: RobotJoint) -> bool:
    """Tell whether a frame is moved along the axis of a joint, or turned about it, alone.

    Args:
        off: The moved frame, in that of the joint.
        joint: A hinge or a slide.
    """
    shift = off.of(joint.anchor) - joint.anchor
    tilt = float(np.linalg.norm(off.mat @ joint.axis - joint.axis))
    if joint.kind == "hinge":
        return max(tilt, float(np.linalg.norm(shift))) < _ON_ITS_AXIS
    aside = shift - float(shift @ joint.axis) * joint.axis
    turn = float(np.abs(off.mat - np.eye(3)).max())
    return max(turn, float(np.linalg.norm(aside))) < _ON_ITS_AXIS
