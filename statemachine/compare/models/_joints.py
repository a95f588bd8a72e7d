"""Differences of a pair of joints: limits, rotor, friction, and what drives them."""

from __future__ import annotations

import math

from ...description.match import Pair
from ...description.records import Actuator, Robot, RobotJoint
from ...description.tree import GroupTree
from ...measures.text import milliseconds, rounded
from .ledger import Ledger

_UNITS = {
    "hinge": {"limits": "rad", "speed": "rad/s", "effort": "N·m", "armature": "kg m²"},
    "slide": {"limits": "m", "speed": "m/s", "effort": "N", "armature": "kg"},
}


def compare(book: Ledger, pair: Pair, one: GroupTree, two: GroupTree) -> None:
    """Everything but where the joint is."""
    a, b = pair.one.joint, pair.two.joint
    if a is None or b is None or a.kind != b.kind:
        return
    units = _UNITS.get(a.kind, _UNITS["hinge"])
    whole = [one.inertia(pair.one.number), two.inertia(pair.two.number)]
    load = [one.load(pair.one.number), two.load(pair.two.number)]
    efforts = [each.effort for each in (a, b)]
    if a.kind in _UNITS:
        _limits(book, a, b, units["limits"])
        _speed(book, a, b, units["speed"])
        _effort(book, a, b, units["effort"], load)
        _spring(book, a, b)
        _follows(book, a, b)
    most = max(efforts, key=lambda e: -1 if e is None or math.isinf(e) else e)
    most = None if most is None or math.isinf(most) else most
    _armature(book, a, b, units["armature"], whole)
    _damping(book, a, b, whole, most)
    _friction(book, a, b, units["effort"], most)
    _drives(book, one, two, a, b, whole, load)


def _unsaid(
    book: Ledger,
    subject: str,
    where: str,
    figure: str,
    one: float | None,
    two: float | None,
    unit: str,
    share: float,
    effect: str = "",
    matters: bool = True,
) -> bool:
    """Whether one of them does not say; that is a difference where the other says not zero."""
    if one is not None and two is not None:
        return False
    value = one if one is not None else two
    if value:
        size = None if math.isinf(value) else abs(value)
        book.differ(subject, where, figure, one, two, unit, size, share, effect, matters)
    return True


def _armature(book: Ledger, a: RobotJoint, b: RobotJoint, unit: str, whole: list[float]) -> None:
    """Its share is that of M_ii, the inertia that the joint's motor feels, at zero."""
    apart = abs((a.armature or 0.0) - (b.armature or 0.0))
    most = max(whole)
    share = apart / most if most > 0 else 1.0
    effect = f"{share:.1%} of M_ii" if most > 0 else ""
    if not _unsaid(book, "armature", a.name, "", a.armature, b.armature, unit, share, effect):
        size = book.same("armature", a.name, a.armature or 0.0, b.armature or 0.0, unit)
        if size is not None:
            book.differ("armature", a.name, "", a.armature, b.armature, unit, size, share, effect)


def _damping(
    book: Ledger, a: RobotJoint, b: RobotJoint, whole: list[float], effort: float | None
) -> None:
    """Its share is that of the effort at 1 rad/s; it slows a free joint in M_ii / damping."""
    unit = "N·m·s" if a.kind != "slide" else "N·s/m"
    times = [
        milliseconds(m / d, 3) if d and m > 0 else "never"
        for d, m in ((a.damping, whole[0]), (b.damping, whole[1]))
    ]
    effect = f"{times[0]} / {times[1]}"
    values = a.damping or 0.0, b.damping or 0.0
    share = abs(values[0] - values[1]) / (effort or max(*values, 1e-300))
    if not _unsaid(book, "damping", a.name, "", a.damping, b.damping, unit, share, effect):
        size = book.same("damping", a.name, *values, unit)
        if size is not None:
            book.differ("damping", a.name, "", *values, unit, size, share, effect)


def _friction(book: Ledger, a: RobotJoint, b: RobotJoint, unit: str, effort: float | None) -> None:
    """Its share is that of the effort."""
    values = a.friction or 0.0, b.friction or 0.0
    apart = abs(values[0] - values[1])
    share = apart / effort if effort else 1.0
    effect = f"{share:.2%} of the effort" if effort else ""
    if not _unsaid(book, "dry friction", a.name, "", a.friction, b.friction, unit, share, effect):
        size = book.same("dry friction", a.name, *values, unit)
        if size is not None:
            book.differ("dry friction", a.name, "", *values, unit, size, share, effect)


def _limits(book: Ledger, a: RobotJoint, b: RobotJoint, unit: str) -> None:
    """Their share is that of the wider range."""
    spans = [high - low for low, high in (each for each in (a.limits, b.limits) if each)]
    span = max(spans, default=0.0)
    if a.limits is None or b.limits is None:
        if a.limits != b.limits:
            book.differ(
                "limits",
                a.name,
                "range",
                a.limits or "none",
                b.limits or "none",
                unit,
                None,
                1.0,
                f"the {'left' if a.limits is None else 'right'} has no stop",
            )
        return
    for k, figure in enumerate(("lower", "upper")):
        size = book.same("limits", a.name, a.limits[k], b.limits[k], unit, span)
        if size is not None:
            further = "left" if (a.limits[k] > b.limits[k]) == (k == 1) else "right"
            text = rounded(size, unit)
            share = size / span if span else 1.0
            effect = f"the {further} goes {text} further"
            book.differ(
                "limits", a.name, figure, a.limits[k], b.limits[k], unit, size, share, effect
            )


def _speed(book: Ledger, a: RobotJoint, b: RobotJoint, unit: str) -> None:
    """What an MJCF has no word for, and is said for the record then."""
    if a.velocity is None or b.velocity is None:
        _unsaid(book, "speed", a.name, "", a.velocity, b.velocity, unit, 0.0, "", matters=False)
        return
    size = book.same("speed", a.name, a.velocity, b.velocity, unit)
    if size is not None:
        share = size / max(a.velocity, b.velocity)
        book.differ("speed", a.name, "", a.velocity, b.velocity, unit, size, share)


def _effort(book: Ledger, a: RobotJoint, b: RobotJoint, unit: str, load: list[float]) -> None:
    """Its share is that of the larger one; the weight it may have to hold beside it."""
    heavy = max(load)
    if a.effort is None or b.effort is None:
        effect = f"its load: {rounded(heavy, unit)}" if heavy > 0 else ""
        _unsaid(book, "effort", a.name, "", a.effort, b.effort, unit, 1.0, effect)
        return
    size = book.same("effort", a.name, a.effort, b.effort, unit)
    if size is None:
        return
    low, high = sorted((a.effort, b.effort))
    known = not math.isinf(size)
    effect = f"{high / low:.3g} times" if known and low > 0 else ""
    share = size / high if known else 1.0
    book.differ(
        "effort", a.name, "", a.effort, b.effort, unit, size if known else None, share, effect
    )


def _spring(book: Ledger, a: RobotJoint, b: RobotJoint) -> None:
    """Its share is 1: the other has none, or another."""
    unit = "N·m/rad" if a.kind == "hinge" else "N/m"
    if _unsaid(book, "spring", a.name, "stiffness", a.stiffness, b.stiffness, unit, 1.0):
        return
    stiff = a.stiffness or 0.0, b.stiffness or 0.0
    size = book.same("spring", a.name, *stiff, unit)
    if size is not None:
        book.differ("spring", a.name, "stiffness", *stiff, unit, size, size / max(stiff))
    if all(stiff):
        at, unit = (a.rest or 0.0, b.rest or 0.0), "rad" if a.kind == "hinge" else "m"
        size = book.same("spring", a.name, *at, unit, 1.0)
        if size is not None:
            book.differ("spring", a.name, "slack at", *at, unit, size, size)


def _follows(book: Ledger, a: RobotJoint, b: RobotJoint) -> None:
    words = [
        "nothing" if each is None else f"{each[0]}, {each[1]:g} times, {each[2]:+g}"
        for each in (a.follows, b.follows)
    ]
    if words[0] != words[1]:
        book.differ("structure", a.name, "follows", words[0], words[1])


def _on(robot: Robot, joint: str) -> list[Actuator] | None:
    if robot.actuators is None:
        return None
    return [each for each in robot.actuators if each.joint == joint]


def _drives(
    book: Ledger,
    one: GroupTree,
    two: GroupTree,
    a: RobotJoint,
    b: RobotJoint,
    whole: list[float],
    load: list[float],
) -> None:
    """What drives a joint. A gain's share is that of the larger one."""
    ours, theirs = _on(one.robot, a.name), _on(two.robot, b.name)
    if not ours and not theirs:
        return
    if not ours or not theirs:
        (drive, *_), there = (theirs, 1) if theirs else (ours or [], 0)
        gains: list[tuple[str, float | None]] = [("kp", drive.kp), ("kv", drive.kv)]
        lacking = None if (theirs if there == 0 else ours) is None else "nothing"
        x, y = (drive.kind, lacking) if there == 0 else (lacking, drive.kind)
        silent = "right" if there == 0 else "left"
        book.differ("drive", a.name, "drive", x, y, "", None, 1.0, f"the {silent} names none")
        for name, value in gains:
            if value:
                pair = (value, None) if there == 0 else (None, value)
                effect = _gain_effect(name, value, whole[there], load[there], (a, b)[there], drive)
                book.differ("drive", a.name, name, *pair, _unit(name, a), abs(value), 1.0, effect)
        return
    for x, y in zip(ours, theirs, strict=False):
        _pair_of_drives(book, a, b, x, y, whole, load)
    if len(ours) != len(theirs):
        book.differ("drive", a.name, "count", float(len(ours)), float(len(theirs)))


def _unit(name: str, joint: RobotJoint) -> str:
    turn = joint.kind != "slide"
    return {"kp": "N·m/rad" if turn else "N/m", "kv": "N·m·s" if turn else "N·s/m"}.get(name, "")


def _gain_effect(
    name: str, value: float, whole: float, load: float, joint: RobotJoint, drive: Actuator
) -> str:
    """Of kp the sag under the load that a joint may have; of kv the damping ratio."""
    if name == "kp":
        sag = load / value if value > 0 else math.nan
        return f"sags {rounded(sag, 'm' if joint.kind == 'slide' else 'rad', 2)}"
    if drive.kp and drive.kp > 0 and whole > 0:
        ratio = (value + (joint.damping or 0.0)) / (2 * math.sqrt(drive.kp * whole))
        return f"damping ratio {ratio:.2g}"
    return ""


def _pair_of_drives(
    book: Ledger,
    a: RobotJoint,
    b: RobotJoint,
    x: Actuator,
    y: Actuator,
    whole: list[float],
    load: list[float],
) -> None:
    if x.kind != y.kind:
        book.differ("drive", a.name, "drive", x.kind, y.kind)
        return
    for name in ("kp", "kv", "gain", "gear"):
        mine, theirs = getattr(x, name), getattr(y, name)
        if mine is None or theirs is None:
            continue
        size = book.same("drive", a.name, mine, theirs, _unit(name, a))
        if size is None:
            continue
        effects = [
            _gain_effect(name, v, whole[k], load[k], (a, b)[k], (x, y)[k])
            for k, v in enumerate((mine, theirs))
        ]
        effect = " / ".join(effects) if name in ("kp", "kv") and all(effects) else ""
        share = size / max(abs(mine), abs(theirs))
        book.differ("drive", a.name, name, mine, theirs, _unit(name, a), size, share, effect)
    for name, figure in (("controls", "ctrlrange"), ("forces", "forcerange")):
        mine, theirs = getattr(x, name), getattr(y, name)
        if (mine is None) != (theirs is None):
            book.differ("drive", a.name, figure, mine or "none", theirs or "none")
        elif mine is not None and theirs is not None:
            unit = "" if name == "forces" or x.kind != "position" else "rad"
            apart = book.same("drive", a.name, mine, theirs, unit)
            if apart is not None:
                size = max(abs(x - y) for x, y in zip(mine, theirs, strict=True))
                span = max(high - low for low, high in (mine, theirs))
                share = size / span if span else 1.0
                book.differ("drive", a.name, figure, mine, theirs, unit, size, share)


def compare_loose_drives(book: Ledger, one: GroupTree, two: GroupTree) -> None:
    """Actuators that drive something else than a joint: tendons, sites, bodies."""
    loose = [
        {each.name for each in tree.robot.actuators or () if not each.joint} for tree in (one, two)
    ]
    for name in sorted(loose[0] ^ loose[1]):
        sides = ["drives" if name in each else "nothing" for each in loose]
        book.differ("drive", name, "drive", sides[0], sides[1])
