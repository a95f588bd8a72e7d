"""What a pair of joints is set to and driven by, and the settings of a simulation, as tables.

A row of a table is a figure: what of a reading it is, its unit, and what the compiled models call
it. What a difference of it is a share of, and what it does, follows from what the joint carries.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import zip_longest

import numpy as np

from ...engines.description.match import Pair
from ...engines.description.records import OF_A_SLIDE, SCALAR, Actuator, RobotJoint, Setting
from ...engines.description.tree import GroupTree
from ...measures.text import milliseconds, rounded
from .ledger import Ledger

# Of a joint each figure's subject and what of it it is, the field of a `RobotJoint`, its unit, and
# what the compiled models call it.
_JOINT = (
    ("speed", "", "velocity", "rad/s", "speed"),
    ("effort", "", "effort", "N·m", "force limit"),
    ("spring", "stiffness", "stiffness", "N·m/rad", "spring"),
    ("spring", "slack at", "rest", "rad", "rest of the spring"),
    ("armature", "", "armature", "kg m²", "armature"),
    ("damping", "", "damping", "N·m·s", "damping"),
    ("dry friction", "", "friction", "N·m", "dry friction"),
)
_ANY_JOINT = ("armature", "damping", "friction")  # the rest only a hinge or a slide has
# The same of an `Actuator`; of one that only one side has, its gains.
_GAINS = {
    "kp": ("N·m/rad", ("gains", "law", "extra actuator")),
    "kv": ("N·m·s", ("gains", "law", "extra actuator")),
}
_DRIVE = _GAINS | {
    "gain": ("", ("gains", "law")),
    "gear": ("", ("gear",)),
    "ctrlrange": ("rad", ("range of ctrl",)),
    "forcerange": ("", ("force range",)),
}
_UNITS = {"timestep": "s", "gravity": "m/s²", "wind": "m/s"}


class _Driven:
    """A joint as one reading has it, with what it carries and what drives it."""

    def __init__(self, tree: GroupTree, number: int, joint: RobotJoint) -> None:
        self.joint, self.slides = joint, joint.kind == "slide"
        self.inertia, self.load = tree.felt(number)
        effort, damping = joint.effort or 0.0, joint.damping
        effort = effort if math.isfinite(effort) else 0.0
        slows = milliseconds(self.inertia / damping, 3) if damping and self.inertia > 0 else "never"
        # What a difference is a share of, 0: of the larger value; and what it does.
        self.against = {
            "armature": self.inertia if self.inertia > 0 else 0.0,
            **dict.fromkeys(("damping", "friction"), effort),
            "rest": 1.0,
        }
        self.effects = {
            "armature": "{share:.1%} of M_ii" if self.inertia > 0 else "",
            "friction": "{share:.2%} of the effort" if effort else "",
            "damping": slows,
            "effort": f"its load: {self.force(self.load)}" if self.load > 0 else "",
        }
        drives = tree.robot.actuators
        self.nothing = None if drives is None else "nothing"
        self.drives = [drive for drive in drives or () if drive.joint == joint.name]

    def effect_of_drive(self, field: str, drive: Actuator) -> str:
        """Of kp the sag under the load that a joint may have; of kv the damping ratio."""
        kp = drive.kp or 0.0
        match field, drive.kind:
            case "kp", _ if kp > 0:
                return f"sags {rounded(self.load / kp, 'm' if self.slides else 'rad', 2)}"
            case "kv", _ if kp > 0 < self.inertia:
                damping = (drive.kv or 0.0) + (self.joint.damping or 0.0)
                return f"damping ratio {damping / (2 * math.sqrt(kp * self.inertia)):.2g}"
            case ("kp" | "kv", _) | ("ctrlrange", "position"):
                return ""
        return f"at most {self.force(self.joint.effort)}"

    def force(self, value: float | None) -> str:
        """A force of the joint in words."""
        if value is None or math.isinf(value):
            return "nothing" if value is None else "unlimited"
        return rounded(value, self.unit("N·m"))

    def unit(self, name: str) -> str:
        """The unit of a figure that has this one of a hinge."""
        return OF_A_SLIDE.get(name, name) if self.slides else name


def of_joints(
    book: Ledger,
    pair: Pair,
    joints: tuple[RobotJoint, RobotJoint],
    left: GroupTree,
    right: GroupTree,
) -> None:
    """Everything but where the joint is, of two of a kind."""
    a, b = joints
    sides = _Driven(left, pair.left.number, a), _Driven(right, pair.right.number, b)
    scalar = a.kind in SCALAR
    if scalar:
        _limits(book, a, b)
        words = [
            f"{j.follows.joint}, {j.follows.factor:g} times, {j.follows.offset:+g}"
            if j.follows
            else "nothing"
            for j in (a, b)
        ]
        keys = [
            ("equality", joint.follows.label, word)
            for joint in (a, b)
            if joint.follows
            for word in ("extra equality", "what it keeps")
        ]
        if words[0] != words[1]:
            book.differ("structure", a.name, "follows", words, keys=keys)
    for subject, figure, field, unit, called in _JOINT:
        slack = field == "rest" and not (a.stiffness and b.stiffness)
        if slack or not (scalar or field in _ANY_JOINT):
            continue
        values = getattr(a, field), getattr(b, field)
        effect = _joined([side.effects.get(field, "") for side in sides])
        if field == "effort" and None not in values and 0 < min(values) < max(values) < math.inf:
            effect = f"{max(values) / min(values):.3g} times"
        book.enter(
            *(subject, a.name, figure, values, sides[0].unit(unit)),
            scale=float(field == "rest"),
            against=max(side.against.get(field, 0.0) for side in sides),
            effect=effect,
            matters=field != "velocity" or None not in values,  # an MJCF has no word for it
            keys=[("joint", a.name, called)],
        )
    _drives(book, *sides)


def _joined(effects: Sequence[str]) -> str:
    """Those of both sides, one if they are the same."""
    return " / ".join(filter(None, dict.fromkeys(effects)))


def _limits(book: Ledger, a: RobotJoint, b: RobotJoint) -> None:
    """Their share is that of the wider range."""
    unit, keys = "m" if a.kind == "slide" else "rad", [("joint", a.name, "range")]
    if a.limits is None or b.limits is None:
        ranges = [j.limits or "none" for j in (a, b)] if a.limits or b.limits else [None] * 2
        effect = f"the {'right' if a.limits else 'left'} has no stop"
        book.enter("limits", a.name, "range", ranges, unit, effect=effect, keys=keys)
        return
    span = max(high - low for low, high in (a.limits, b.limits))
    for figure, low, high in zip(("lower", "upper"), a.limits, b.limits, strict=True):
        further = "left" if (low > high) == (figure == "upper") else "right"
        book.enter(
            *("limits", a.name, figure, (low, high), unit),
            scale=span,
            against=span,
            effect=f"the {further} goes {rounded(abs(low - high), unit)} further",
            keys=keys,
        )


def _drives(book: Ledger, left: _Driven, right: _Driven) -> None:
    """What drives a joint. A gain's share is that of the larger one."""
    name, sides = left.joint.name, (left, right)
    for x, y in zip_longest(left.drives, right.drives):
        called = (x or y).name
        words = ("gains", "law") if x and y else ("extra actuator",)
        kinds = [d.kind if d else side.nothing for d, side in zip((x, y), sides, strict=True)]
        silent = "" if x and y else f"the {'right' if x else 'left'} names none"
        keys = [("actuator", called, word) for word in words]
        book.enter("drive", name, "drive", kinds, effect=silent, keys=keys)
        if x and y and x.kind != y.kind:
            continue
        for field, (unit, words) in (_DRIVE if x and y else _GAINS).items():
            values = [getattr(drive, field, None) for drive in (x, y)]
            if field.endswith("range"):
                values = [value or "none" for value in values]
            effects = [s.effect_of_drive(field, d) for s, d in zip(sides, (x, y), strict=True) if d]
            commanded = field == "ctrlrange" and (x or y).kind != "position"
            book.enter(
                *("drive", name, field, values, "" if commanded else left.unit(unit)),
                effect=_joined(effects) if len({*effects}) == len(effects) else "",
                keys=[("actuator", called, word) for word in words],
            )


def of_loose_drives(book: Ledger, left: GroupTree, right: GroupTree) -> None:
    """Actuators that drive something else than a joint: tendons, sites, bodies."""
    loose = [
        {drive.name for drive in tree.robot.actuators or () if not drive.joint}
        for tree in (left, right)
    ]
    for name in sorted(loose[0] ^ loose[1]):
        sides = ["drives" if name in names else "nothing" for names in loose]
        book.differ("drive", name, "drive", sides, keys=[("actuator", name, "extra actuator")])


def of_settings(book: Ledger, left: GroupTree, right: GroupTree) -> Iterator[str]:
    """Settings of the simulation; where a format has none, what the other would change."""
    robots = left.robot, right.robot
    says = next((robot for robot in robots if robot.settings), robots[0])
    silent = [robot.format for robot in robots if robot.settings is None]
    for name, value in (says.settings or {}).items():
        values = [(robot.settings or {}).get(name) for robot in robots]
        other, effect = says.defaults.get(name) if silent else values[1], ""
        if silent and other is not None:
            taken = other if isinstance(other, str) else " ".join(f"{x:g}" for x in np.ravel(other))
            effect = f"{says.reader.split()[0]} would take {taken}"
        if (value == other) if silent else (other is None):
            continue
        book.enter(
            *("settings", "", name, values, _UNITS.get(name, "")),
            share=_share(name, value, other),
            effect=effect,
            keys=[("option", "", name)],
        )
    if len(silent) == 1:
        yield (
            f"a {silent[0]} says nothing of timestep, gravity and solver: the engine that "
            "loads it decides (--backend shows what it takes)"
        )


def _share(name: str, left: Setting, right: Setting) -> float:
    """Of gravity and the timestep, how much of it; of the solver's settings at most a fifth."""
    if left is None or right is None or isinstance(left, str) or isinstance(right, str):
        return 0.5
    a, b = np.ravel(left), np.ravel(right)
    most = max(float(np.linalg.norm(a)), float(np.linalg.norm(b)))
    share = float(np.linalg.norm(a - b)) / most if most else 0.0
    return share if name in ("gravity", "timestep") else min(share, 0.2)
