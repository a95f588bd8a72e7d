"""What a pair of joints is set to and driven by, and the settings of a simulation, as tables.

A row of a table is a figure: what of a reading it is, its unit, and what the compiled models call
it. What a difference of it is a share of, and what it does, follows from what the joint carries.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from ...engines.description.match import Pair
from ...engines.description.records import OF_A_SLIDE, SCALAR, Actuator, Robot, RobotJoint, Setting
from ...engines.description.tree import GroupTree
from ...measures.text import milliseconds, rounded
from .ledger import Figure, Key, Ledger


class _JointFigure(NamedTuple):
    """A figure of a joint.

    Attributes:
        subject: A key of `SUBJECTS`.
        name: What of the subject it is.
        field: The field of a `RobotJoint`.
        unit: SI unit of a hinge's.
        compiled: What the compiled models call it.
        of_any_joint: Whether other joints than hinges and slides have it.
    """

    subject: str
    name: str
    field: str
    unit: str
    compiled: str
    of_any_joint: bool = False


class _DriveFigure(NamedTuple):
    """A figure of an `Actuator`.

    Attributes:
        field: Its field.
        unit: SI unit of a hinge's.
        compiled: What the compiled models call it.
    """

    field: str
    unit: str
    compiled: tuple[str, ...]


_JOINT = (
    _JointFigure("speed", "", "velocity", "rad/s", "speed"),
    _JointFigure("effort", "", "effort", "N·m", "force limit"),
    _JointFigure("spring", "stiffness", "stiffness", "N·m/rad", "spring"),
    _JointFigure("spring", "slack at", "rest", "rad", "rest of the spring"),
    _JointFigure("armature", "", "armature", "kg m²", "armature", of_any_joint=True),
    _JointFigure("damping", "", "damping", "N·m·s", "damping", of_any_joint=True),
    _JointFigure("dry friction", "", "friction", "N·m", "dry friction", of_any_joint=True),
)
# Of an actuator that only one side has.
_GAINS = (
    _DriveFigure("kp", "N·m/rad", ("gains", "law", "extra actuator")),
    _DriveFigure("kv", "N·m·s", ("gains", "law", "extra actuator")),
)
_DRIVE = (
    *_GAINS,
    _DriveFigure("gain", "", ("gains", "law")),
    _DriveFigure("gear", "", ("gear",)),
    _DriveFigure("ctrlrange", "rad", ("range of ctrl",)),
    _DriveFigure("forcerange", "", ("force range",)),
)
_UNITS = {"timestep": "s", "gravity": "m/s²", "wind": "m/s"}


class _Driven:
    """A joint as one reading has it, with what it carries and what drives it.

    Attributes:
        joint: The joint.
        inertia: M_ii, the inertia that the joint feels [kg m²]; load: the torque [N·m] of what it
            carries at most. Of a slide they are kg and N.
        nothing: What stands where no actuator drives it; None where the format has no actuators.
        drives: The actuators that drive it.
    """

    def __init__(self, tree: GroupTree, number: int, joint: RobotJoint) -> None:
        """Find what a joint carries and what drives it.

        Args:
            tree: The robot.
            number: Of the group that the joint carries.
            joint: The joint.
        """
        self.joint, self._slides = joint, joint.kind == "slide"
        self.inertia, self.load = tree.felt(number)
        drives = tree.robot.actuators
        self.nothing = None if drives is None else "nothing"
        self.drives = [drive for drive in drives or () if drive.joint == joint.name]

    def against(self, field: str) -> float:
        """Return what a difference of a figure is a share of; 0: of the larger value."""
        if field == "armature":
            return self.inertia if self.inertia > 0 else 0.0
        if field in ("damping", "friction"):
            return self._finite_effort()
        return 1.0 if field == "rest" else 0.0

    def effect(self, field: str) -> str:
        """Return what a difference of a figure does; "" if nothing can be said."""
        match field:
            case "armature" if self.inertia > 0:
                return "{share:.1%} of M_ii"
            case "friction" if self._finite_effort():
                return "{share:.2%} of the effort"
            case "damping" if self.joint.damping and self.inertia > 0:
                return milliseconds(self.inertia / self.joint.damping, 3)
            case "damping":
                return "never"
            case "effort" if self.load > 0:
                return f"its load: {self.force(self.load)}"
        return ""

    def _finite_effort(self) -> float:
        """Return the largest force of the joint; 0 where it is unlimited or not said."""
        effort = self.joint.effort or 0.0
        return effort if math.isfinite(effort) else 0.0

    def effect_of_drive(self, field: str, drive: Actuator) -> str:
        """Return what a difference of an actuator does.

        It is of kp the sag under the load that the joint may have, of kv the damping ratio.
        """
        kp = drive.kp or 0.0
        match field:
            case "kp" if kp > 0:
                return f"sags {rounded(self.load / kp, self.unit('rad'), 2)}"
            case "kv" if kp > 0 and self.inertia > 0:
                damping = (drive.kv or 0.0) + (self.joint.damping or 0.0)
                return f"damping ratio {damping / (2 * math.sqrt(kp * self.inertia)):.2g}"
            case "kp" | "kv":
                return ""
            case "ctrlrange" if drive.kind == "position":
                return ""
        return f"at most {self.force(self.joint.effort)}"

    def force(self, value: float | None) -> str:
        """Return a force of the joint in words."""
        if value is None:
            return "nothing"
        if math.isinf(value):
            return "unlimited"
        return rounded(value, self.unit("N·m"))

    def unit(self, name: str) -> str:
        """Return the unit of a figure that has this one of a hinge."""
        return OF_A_SLIDE.get(name, name) if self._slides else name


def of_joints(
    book: Ledger,
    pair: Pair,
    joints: tuple[RobotJoint, RobotJoint],
    left: GroupTree,
    right: GroupTree,
) -> None:
    """Enter everything but where the joint is, of two of a kind."""
    a, b = joints
    ours, theirs = _Driven(left, pair.left.number, a), _Driven(right, pair.right.number, b)
    is_scalar = a.kind in SCALAR
    if is_scalar:
        _limits(book, a, b)
        _follows(book, a, b)
    for figure in _JOINT:
        is_slack = figure.field == "rest" and not (a.stiffness and b.stiffness)
        if not is_slack and (is_scalar or figure.of_any_joint):
            _of_joint(book, figure, ours, theirs)
    _drives(book, ours, theirs)


def _follows(book: Ledger, a: RobotJoint, b: RobotJoint) -> None:
    """Enter which joint a joint follows, and how."""
    words = [_followed(joint) for joint in (a, b)]
    if words[0] == words[1]:
        return
    keys: list[Key] = []
    for joint in (a, b):
        if joint.follows:
            label = joint.follows.label
            keys += [("equality", label, "extra equality"), ("equality", label, "what it keeps")]
    book.differ(Figure("structure", a.name, "follows", keys=keys), words)


def _followed(joint: RobotJoint) -> str:
    follows = joint.follows
    if not follows:
        return "nothing"
    return f"{follows.joint}, {follows.factor:g} times, {follows.offset:+g}"


def _of_joint(book: Ledger, figure: _JointFigure, left: _Driven, right: _Driven) -> None:
    """Enter one figure of two joints of a kind."""
    field, name = figure.field, left.joint.name
    values = getattr(left.joint, field), getattr(right.joint, field)
    effect = _joined([left.effect(field), right.effect(field)])
    if field == "effort" and None not in values and 0 < min(values) < max(values) < math.inf:
        effect = f"{max(values) / min(values):.3g} times"
    # An MJCF has no word for the largest speed.
    matters = field != "velocity" or None not in values
    unit, keys = left.unit(figure.unit), [("joint", name, figure.compiled)]
    book.enter(
        Figure(figure.subject, name, figure.name, unit, effect, matters, keys),
        values,
        scale=1.0 if field == "rest" else 0.0,
        against=max(left.against(field), right.against(field)),
    )


def _joined(effects: Sequence[str]) -> str:
    """Return the effects of both sides, one if they are the same."""
    return " / ".join(effect for effect in dict.fromkeys(effects) if effect)


def _limits(book: Ledger, a: RobotJoint, b: RobotJoint) -> None:
    """Enter the limits of a joint; their share is that of the wider range."""
    unit, keys = "m" if a.kind == "slide" else "rad", [("joint", a.name, "range")]
    if a.limits is None or b.limits is None:
        effect = f"the {'right' if a.limits else 'left'} has no stop"
        figure = Figure("limits", a.name, "range", unit, effect, keys=keys)
        if a.limits or b.limits:
            book.enter(figure, [joint.limits or "none" for joint in (a, b)])
        return
    span = max(high - low for low, high in (a.limits, b.limits))
    for name, ours, theirs in zip(("lower", "upper"), a.limits, b.limits, strict=True):
        further = "left" if (ours > theirs) == (name == "upper") else "right"
        effect = f"the {further} goes {rounded(abs(ours - theirs), unit)} further"
        figure = Figure("limits", a.name, name, unit, effect, keys=keys)
        book.enter(figure, (ours, theirs), scale=span, against=span)


def _drives(book: Ledger, left: _Driven, right: _Driven) -> None:
    """Enter what drives a joint. A gain's share is that of the larger one."""
    name = left.joint.name
    for ours, theirs in zip_longest(left.drives, right.drives):
        kinds = [
            ours.kind if ours else left.nothing,
            theirs.kind if theirs else right.nothing,
        ]
        if ours and theirs:
            keys = _keys_of_drive(ours, ("gains", "law"))
            book.enter(Figure("drive", name, "drive", keys=keys), kinds)
            if ours.kind == theirs.kind:
                for figure in _DRIVE:
                    _of_drive(book, figure, (left, ours), (right, theirs))
            continue
        silent = f"the {'right' if ours else 'left'} names none"
        keys = _keys_of_drive(ours or theirs, ("extra actuator",))
        book.enter(Figure("drive", name, "drive", effect=silent, keys=keys), kinds)
        for figure in _GAINS:
            _of_drive(book, figure, (left, ours), (right, theirs))


def _keys_of_drive(drive: Actuator, words: Sequence[str]) -> list[Key]:
    return [("actuator", drive.name, word) for word in words]


def _of_drive(
    book: Ledger,
    figure: _DriveFigure,
    left: tuple[_Driven, Actuator | None],
    right: tuple[_Driven, Actuator | None],
) -> None:
    """Enter one figure of two actuators of a kind, or of one that only one side has.

    Args:
        book: The list.
        figure: Which.
        left: The joint of the left, and its actuator.
        right: Those of the right.
    """
    field, (joint, ours), (_, theirs) = figure.field, left, right
    values = [getattr(drive, field, None) for drive in (ours, theirs)]
    if field.endswith("range"):
        values = [value or "none" for value in values]
    effects = [side.effect_of_drive(field, drive) for side, drive in (left, right) if drive]
    all_differ = len({*effects}) == len(effects)
    called = ours or theirs
    assert called is not None
    is_position = field == "ctrlrange" and called.kind == "position"
    unit = "" if field == "ctrlrange" and not is_position else joint.unit(figure.unit)
    effect = _joined(effects) if all_differ else ""
    keys = _keys_of_drive(called, figure.compiled)
    book.enter(Figure("drive", joint.joint.name, field, unit, effect, keys=keys), values)


def of_loose_drives(book: Ledger, left: GroupTree, right: GroupTree) -> None:
    """Enter actuators that drive something else than a joint: tendons, sites, bodies."""
    ours, theirs = _loose_drives(left), _loose_drives(right)
    for name in sorted(ours ^ theirs):
        sides = ["drives" if name in names else "nothing" for names in (ours, theirs)]
        keys = [("actuator", name, "extra actuator")]
        book.differ(Figure("drive", name, "drive", keys=keys), sides)


def _loose_drives(tree: GroupTree) -> set[str]:
    return {drive.name for drive in tree.robot.actuators or () if not drive.joint}


def of_settings(book: Ledger, left: GroupTree, right: GroupTree) -> Iterator[str]:
    """Enter settings of the simulation; where a format has none, what the other would change.

    Yields:
        What to note of it.
    """
    robots = left.robot, right.robot
    silent = [robot.format for robot in robots if robot.settings is None]
    says = next((robot for robot in robots if robot.settings), robots[0])
    for name, value in (says.settings or {}).items():
        if silent:
            _enter_unsaid(book, name, value, says, robots)
        else:
            _enter_setting(book, name, value, robots)
    if len(silent) == 1:
        yield (
            f"a {silent[0]} says nothing of timestep, gravity and solver: the engine that "
            "loads it decides (--backend shows what it takes)"
        )


def _enter_setting(book: Ledger, name: str, value: Setting, robots: tuple[Robot, Robot]) -> None:
    """Enter a setting that both formats have a word for."""
    values = [(robot.settings or {}).get(name) for robot in robots]
    if values[1] is not None:
        figure = Figure("settings", "", name, _UNITS.get(name, ""), keys=[("option", "", name)])
        book.enter(figure, values, share=_share(name, value, values[1]))


def _enter_unsaid(
    book: Ledger, name: str, value: Setting, says: Robot, robots: tuple[Robot, Robot]
) -> None:
    """Enter a setting that one format has no word for, unless it is what the engine takes anyway.

    Args:
        book: The list.
        name: Of the setting.
        value: What the one that says it says.
        says: The robot that says it.
        robots: Both.
    """
    usual = says.defaults.get(name)
    if value == usual:
        return
    effect = ""
    if usual is not None:
        taken = usual
        if not isinstance(usual, str):
            taken = " ".join(f"{number:g}" for number in np.ravel(usual))
        effect = f"{says.reader.split()[0]} would take {taken}"
    figure = Figure("settings", "", name, _UNITS.get(name, ""), effect, keys=[("option", "", name)])
    values = [(robot.settings or {}).get(name) for robot in robots]
    book.enter(figure, values, share=_share(name, value, usual))


def _share(name: str, left: Setting, right: Setting) -> float:
    """Return how much a setting differs; of the solver's settings at most a fifth counts."""
    if left is None or right is None or isinstance(left, str) or isinstance(right, str):
        return 0.5
    a, b = np.ravel(left), np.ravel(right)
    most = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
    share = float(np.linalg.norm(a - b)) / most if most else 0.0
    return share if name in ("gravity", "timestep") else min(share, 0.2)
