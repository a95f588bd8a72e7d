"""What moves a fresh engine: gravity, time, motors, commands, damping, friction."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from ....engines.measured import LetGo, Measurement, OneStep, Sliding
from ....engines.samples import RATE, limp
from ....measures.text import numbers
from .answers import UNDECIDED, EngineAnswer, closest, question

_ROUNDING = 1e-6  # m/s², s, m/s


@question(
    "Which gravity does a fresh engine have?",
    "An arm that holds itself up without any control may only be an arm that weighs nothing.",
    50,  # steps
)
def gravity(gravity: tuple[Sequence[float], Sequence[float]]) -> Iterator[EngineAnswer]:
    """Tell the gravity that a body feels, and that which the engine tells where it is another.

    Args:
        gravity: What the engine tells (3,) [m/s²], and with what a body falls (3,) [m/s²].
    """
    stated, measured = gravity
    felt = numbers(np.round(measured, 2) + 0.0)
    if np.allclose(stated, measured, atol=_ROUNDING):
        words = felt
    else:
        words = f"told {numbers(np.round(stated, 2) + 0.0)}, felt {felt}"
    fall = Measurement("falls with", tuple(float(part) for part in measured), "m/s²")
    yield EngineAnswer(words, (fall,))


@question(
    "How long is one step of a fresh engine, and who counts the time?",
    "The same number of steps is another span of time on each engine. A controller that runs "
    "at a fixed rate must know how many steps there are to one of its own.",
)
def timestep(step: OneStep) -> Iterator[EngineAnswer]:
    """Tell the step by how far a body at 1 m/s comes in it, and the engine's clock."""
    stated, moved, clock, ticked = step
    moved_ms = f"{moved * 1e3:.4g} ms"
    if abs(stated - moved) < _ROUNDING:
        words = moved_ms
    else:
        words = f"told {stated * 1e3:.4g} ms, moves {moved_ms}"
    yield EngineAnswer(words, (Measurement("at 1 m/s a body moves", moved, "m"),), "one step")
    ticks = (Measurement("it goes on by", ticked, "s"),)
    yield EngineAnswer(clock if ticked else "none", ticks, "clock")


@question(
    "Does a joint fall that nobody commands?",
    "Writing no command is not the same as no torque. Look for a motor that is on from the "
    "start, and for an actuator to which zero is a target, before you blame gravity.",
    0.25,  # s
)
def actuation(runs: Sequence[LetGo]) -> Iterator[EngineAnswer]:
    """Tell what the joint does, by how it moves and how it would move if nothing held it."""
    for part, moved, seconds, forces in runs:
        if seconds is None:
            verb, unit, free = "starts with", "rad/s²", RATE
        else:
            verb, unit, free = "moves", "rad", limp(seconds)
        words = _share(moved / free, "falls", "held")
        figures = (Measurement(verb, moved, unit), Measurement("limp", free, unit), *forces)
        yield EngineAnswer(words, figures, part)


def _share(share: float, all_of_it: str, nothing: str) -> str:
    """Return the word for a share of one, or of next to nothing."""
    if 0.9 < share < 1.1:
        return all_of_it
    if abs(share) < 0.1:
        return nothing
    return UNDECIDED


@question(
    "You command once, and step twice: does the command still act?",
    "A command that lasts one step has to be given before every step; one that stays has to be "
    "taken back.",
    1.0,  # N·m
)
def command(speeds: Mapping[str, Sequence[float]]) -> Iterator[EngineAnswer]:
    """Tell whether the second step gains as much speed as the first.

    Args:
        speeds: (3,) at rest and after each step [rad/s], by the kind of command.
    """
    for kind, three in speeds.items():
        first, second = np.diff(three).tolist()
        words = _share(second / first if first else math.nan, "stays", "lasts one step")
        figures = (
            Measurement("first step", first, "rad/s"),
            Measurement("second", second, "rad/s"),
        )
        yield EngineAnswer(words, figures, kind)


_INITIAL_SPEED = 200.0  # rad/s


@question(
    "Nothing brakes: does a body keep its speed, and a fast joint?",
    "Energy that an engine takes away by default looks like friction of the robot. What is cut "
    "off at some speed looks like a motor's limit.",
    1.0,  # s
    _INITIAL_SPEED,
)
def damping(speeds: tuple[float, float]) -> Iterator[EngineAnswer]:
    """Tell what is left of each speed.

    Args:
        speeds: Of a body that began at 1 m/s, after 1 s [m/s]; of a joint, one step after [rad/s].
    """
    left, joint = speeds
    body = "keeps it" if abs(left - 1) < _ROUNDING else f"loses {100 * (1 - left):.1f} % in 1 s"
    yield EngineAnswer(body, (Measurement("left after 1 s", left),), "a body at 1 m/s")
    turns = "keeps it" if abs(joint / _INITIAL_SPEED - 1) < 1e-3 else f"cut to {joint:.3g} rad/s"
    after = Measurement("one step after", joint, "rad/s")
    yield EngineAnswer(turns, (after,), "a joint at 200 rad/s")


SMOOTH, ROUGH = 0.25, 0.75


def _mean(block: float, floor: float) -> float:
    return (block + floor) / 2


def _geometric_mean(block: float, floor: float) -> float:
    return math.sqrt(block * floor)


def _block_friction(block: float, floor: float) -> float:
    return block


def _floor_friction(block: float, floor: float) -> float:
    return floor


_RULES: dict[str, Callable[[float, float], float]] = {
    "the larger": max,
    "the smaller": min,
    "their product": operator.mul,
    "their mean": _mean,
    "their geometric mean": _geometric_mean,
    "the block's": _block_friction,
    "the floor's": _floor_friction,
}
# A block that MuJoCo holds creeps, by millimetres a second; one that slides gains more.
_SLIDING_SPEED = 0.02  # m/s
_BISECTIONS = 10


@question(
    "Two bodies touch: which friction is between them?",
    "A grip that is tuned on one engine may drop its object on another, with the same two "
    "numbers in the file.",
)
def friction(speeds: Mapping[str, Sliding]) -> Iterator[EngineAnswer]:
    """Tell which rule explains on which slope a block begins to slide.

    Args:
        speeds: By what is special about the block, its speed on a floor.
    """
    for kind, speed in speeds.items():
        smooth_on_rough = _slope(speed, SMOOTH, ROUGH)
        rough_on_smooth = _slope(speed, ROUGH, SMOOTH)
        errors: dict[str, float] = {}
        for name, rule in _RULES.items():
            errors[name] = max(
                abs(rule(SMOOTH, ROUGH) - smooth_on_rough),
                abs(rule(ROUGH, SMOOTH) - rough_on_smooth),
            )
        figures = (
            Measurement(f"{SMOOTH:g} on {ROUGH:g} slides from", smooth_on_rough),
            Measurement(f"{ROUGH:g} on {SMOOTH:g} slides from", rough_on_smooth),
        )
        yield EngineAnswer(closest(errors).hypothesis, figures, kind)


def _slope(speed: Sliding, block: float, floor: float) -> float:
    """Return the tangent of the slope from which on a block slides: its friction, by halving."""
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if speed(block, floor, middle) > _SLIDING_SPEED:
            high = middle
        else:
            low = middle
    return (low + high) / 2
