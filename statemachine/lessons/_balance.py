"""Who holds a joint: its forces in words, and the engine without our adapter."""

from __future__ import annotations

import numpy as np

from ..measures.text import position, signed
from ..page import Table, Text, Verdict
from ..runs.robot import ARM
from ._fall import BALANCE, Droop, Gravity
from ._robot import robot_word

_PARTS = (
    ("gravity (−bias)", "bias"),
    ("servo", "actuator"),
    ("damping", "passive"),
    ("dry friction", "friction"),
    ("contact", "contact"),
    ("joint limit", "limit"),
    ("equality", "equality"),
)
_SLOW = 0.01  # rad/s or m/s; a joint below it is at rest or creeps
_STARTS = 0.02  # rad/s² or m/s²; a joint beyond it is about to move
_AT_REST = 1e-4  # the same; below it nothing of the robot moves
_SHARE = 1e-4  # of the largest part; a sum below it is zero, too


def parts_of(first: Gravity) -> tuple[tuple[str, str], ...]:
    """The parts of the forces, with the words for them on this robot."""
    if first.joint in ARM:
        return _PARTS
    words = {"passive": "springs, damping, …", "limit": "limit"}
    if not first.servo:
        words["actuator"] = "actuator"
    return tuple(
        (words.get(part, label), part)
        for label, part in _PARTS
        if first.drives or part != "actuator"
    )


def unit_of(result: Gravity) -> str:
    return "N" if result.slide else "N·m"


def force(run: Droop, part: str) -> float | None:
    value = run.forces[part]
    return -value if part == "bias" and value is not None else value


def who_holds(name: str, run: Droop, first: Gravity) -> Text | Verdict:
    """Who carries the load, if the joint is at rest and its forces balance."""
    total, load = run.forces["total"], force(run, "bias")
    if abs(run.velocity) > _SLOW or abs(run.acceleration) > _STARTS:
        speed = position(run.velocity, first.slide)
        return Text(f"{name}: {first.joint} still moves, at {speed}/s; no balance is drawn.")
    if total is None or load is None:
        return Text(f"{name}: this engine does not tell all the parts, so no sum is drawn.")
    unit = unit_of(first)
    largest_part = max(abs(force(run, part) or 0.0) for _, part in _PARTS)
    if abs(total) > max(BALANCE, _SHARE * largest_part):
        if max(abs(run.acceleration), *run.others) > _AT_REST:
            return Text(
                f"{name}: {first.joint} stands, but the robot still moves: the {total:+.4f} {unit} "
                "that are left over accelerate it (M·qacc). No balance is drawn."
            )
        return Verdict(f"{name}: the joint stands, yet its forces do not sum to zero", False)
    if abs(load) < BALANCE:
        return Verdict(f"{name}: no load, so nothing has to hold {first.joint}", True)
    against = {
        label: abs(value)
        for label, part in parts_of(first)[1:]
        if (value := force(run, part)) is not None and value * load < 0
    }
    if not against:
        return Text(f"{name}: no single part holds {first.joint}.")
    label = max(against, key=lambda each: against[each])
    text = (
        f"{name}: {first.joint} is held by the {label}, with {against[label]:.4f} {unit} against "
        f"gravity's {abs(load):.4f} {unit}, and all forces sum to zero"
    )
    if label == "contact":
        rest = -sum(force(run, part) or 0.0 for part in ("passive", "friction")) * np.sign(load)
        how = "hold" if rest >= 0 else "pull the other way, with gravity, by"
        damping = "Damping" if first.joint in ARM else "Springs, damping"
        text += f". {damping} and dry friction together {how} {abs(rest):.4f} {unit}"
    return Verdict(text, True)


def engine_alone(name: str, result: Gravity) -> list[Table | Text]:
    """The engine without our adapter: what its own defaults do to the joint."""
    unit = unit_of(result)
    rows = [
        (
            each.label,
            position(each.position, result.slide),
            f"{signed(each.motor)} {unit}",
        )
        for each in result.alone
    ]
    time = result.alone[0].time
    blocks: list[Table | Text] = [
        Table(
            (f"{name} itself", result.joint, "its own motor"),
            rows,
            title=f"The same model as {name}'s own users load it, left alone, at {time:.3g} s",
        )
    ]
    _, held, limp, undamped = result.alone
    if held.motor and abs(held.position) < min(abs(limp.position), abs(undamped.position)) / 10:
        blocks.append(
            Text(
                f"At {name}'s own 1/240 s a step. A fresh world of {name} has a gravity of "
                f"{held.gravity:g} m/s²; and with the model's set, the "
                f"{robot_word(result.joint)} still does not fall, not because of its servos: the "
                "joints come with motors of the engine's own, which "
                f"keep them all within {position(held.widest, result.slide)}; that of "
                f"{result.joint} exerts {abs(held.motor):.4f} {unit}. With the motors off and no "
                f"joint damping in the URDF it is at {position(undamped.position, result.slide)} "
                f"then, instead of {position(held.position, result.slide)}."
            )
        )
    if limp.explicit > 2 and limp.turns > limp.steps / 4:
        blocks.append(
            Text(
                f"With the motors off and the damping in, it flails: its velocity changes its sign "
                f"in {limp.turns} of {limp.steps} steps. {name} takes the damping torque of the "
                "velocity before the step; that changes the velocity by timestep × damping ÷ "
                f"inertia, here up to {limp.explicit:.0f} times itself, and from 2 on the joint "
                "turns round faster than it was."
            )
        )
    return blocks
