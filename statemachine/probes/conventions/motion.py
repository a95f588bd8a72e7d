"""What moves a fresh engine: gravity, time, motors, commands, damping, friction."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from ...engines.measured import LetGo, Measurement, OneStep, Sliding
from ...engines.samples import RATE, limp
from ...measures.text import numbers
from .answers import UNDECIDED, EngineAnswer, closest, question

_SAME = 1e-6  # m/s², s, m/s


@question(
    "Which gravity does a fresh engine have?",
    "An arm that holds itself up without any control may only be an arm that weighs nothing.",
    50,  # steps
)
def gravity(gravity: tuple[Sequence[float], Sequence[float]]) -> Iterator[EngineAnswer]:
    """The gravity (3,) [m/s²] that a body feels, unless the engine tells of another."""
    stated, measured = gravity
    felt, said = (numbers(np.round(v, 2) + 0.0) for v in (measured, stated))
    words = felt if np.allclose(stated, measured, atol=_SAME) else f"told {said}, felt {felt}"
    yield EngineAnswer(words, (Measurement("falls with", tuple(map(float, measured)), "m/s²"),))


@question(
    "How long is one step of a fresh engine, and who counts the time?",
    "The same number of steps is another span of time on each engine. A controller that runs "
    "at a fixed rate must know how many steps there are to one of its own.",
)
def timestep(step: OneStep) -> Iterator[EngineAnswer]:
    """The step [s] that a body at 1 m/s tells by how far it comes, and the engine's clock."""
    stated, moved, clock, ticked = step
    stated_ms, moved_ms = (f"{span * 1e3:.4g} ms" for span in (stated, moved))
    words = moved_ms if abs(stated - moved) < _SAME else f"told {stated_ms}, moves {moved_ms}"
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
    """What the joint does, by how it moves and how it would move if nothing held it."""
    for part, moved, seconds, forces in runs:
        verb, unit = ("starts with", "rad/s²") if seconds is None else ("moves", "rad")
        free = RATE if seconds is None else limp(seconds)
        words = _share(moved / free, "falls", "held")
        figures = Measurement(verb, moved, unit), Measurement("limp", free, unit), *forces
        yield EngineAnswer(words, figures, part)


def _share(share: float, all_of_it: str, nothing: str) -> str:
    """What a share of one, or of next to nothing, means."""
    return all_of_it if 0.9 < share < 1.1 else nothing if abs(share) < 0.1 else UNDECIDED


@question(
    "You command once, and step twice: does the command still act?",
    "A command that lasts one step has to be given before every step; one that stays has to be "
    "taken back.",
    1.0,  # N·m
)
def command(speeds: Mapping[str, Sequence[float]]) -> Iterator[EngineAnswer]:
    """From the speeds (3,) [rad/s] at rest and after each step, by the kind of command."""
    for kind, three in speeds.items():
        first, second = np.diff(three).tolist()
        words = _share(second / first if first else math.nan, "stays", "lasts one step")
        figures = Measurement("first step", first, "rad/s"), Measurement("second", second, "rad/s")
        yield EngineAnswer(words, figures, kind)


_FAST = 200.0  # rad/s


@question(
    "Nothing brakes: does a body keep its speed, and a fast joint?",
    "Energy that an engine takes away by default looks like friction of the robot. What is cut "
    "off at some speed looks like a motor's limit.",
    1.0,  # s
    _FAST,
)
def damping(speeds: tuple[float, float]) -> Iterator[EngineAnswer]:
    """Of a body that began at 1 m/s, after 1 s [m/s]; of a joint, one step after [rad/s]."""
    left, joint = speeds
    body = "keeps it" if abs(left - 1) < _SAME else f"loses {100 * (1 - left):.1f} % in 1 s"
    turns = "keeps it" if abs(joint / _FAST - 1) < 1e-3 else f"cut to {joint:.3g} rad/s"
    yield EngineAnswer(body, (Measurement("left after 1 s", left),), "a body at 1 m/s")
    after = (Measurement("one step after", joint, "rad/s"),)
    yield EngineAnswer(turns, after, "a joint at 200 rad/s")


SMOOTH, ROUGH = 0.25, 0.75
_RULES: dict[str, Callable[[float, float], float]] = {
    "the larger": max,
    "the smaller": min,
    "their product": lambda block, floor: block * floor,
    "their mean": lambda block, floor: (block + floor) / 2,
    "their geometric mean": lambda block, floor: math.sqrt(block * floor),
    "the block's": lambda block, floor: block,
    "the floor's": lambda block, floor: floor,
}
# A block that MuJoCo holds creeps, by millimetres a second; one that slides gains more.
_SLIDES = 0.02  # m/s
_HALVINGS = 10


@question(
    "Two bodies touch: which friction is between them?",
    "A grip that is tuned on one engine may drop its object on another, with the same two "
    "numbers in the file.",
)
def friction(speeds: Mapping[str, Sliding]) -> Iterator[EngineAnswer]:
    """Which rule explains on which slope a block begins to slide, one way round and the other.

    Args:
        speeds: By what is special about the block, its speed on a floor.
    """
    pairs = ((SMOOTH, ROUGH), (ROUGH, SMOOTH))
    for of, speed in speeds.items():
        measured = [_slope(speed, *pair) for pair in pairs]
        words, _, _ = closest(
            {
                name: max(abs(rule(*pair) - mu) for pair, mu in zip(pairs, measured, strict=True))
                for name, rule in _RULES.items()
            }
        )
        figures = [
            Measurement(f"{block:g} on {floor:g} slides from", mu)
            for (block, floor), mu in zip(pairs, measured, strict=True)
        ]
        yield EngineAnswer(words, tuple(figures), of)


def _slope(speed: Sliding, block: float, floor: float) -> float:
    """The tangent of the slope from which on a block slides: its friction, by halving."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if speed(block, floor, middle) > _SLIDES else (middle, high)
    return (low + high) / 2
