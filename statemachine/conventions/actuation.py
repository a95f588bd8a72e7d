"""Whether a joint that nobody commands falls."""

from __future__ import annotations

from collections.abc import Sequence

from ..engines.measured import LetGo, Measurement
from ..engines.samples.pendulum import RATE, limp
from .answers import UNDECIDED, Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "Does a joint fall that nobody commands?",
    "Writing no command is not the same as no torque. Look for a motor that is on from the "
    "start, and for an actuator to which zero is a target, before you blame gravity.",
)
GIVEN = (0.25,)  # s


def answer(runs: Sequence[LetGo]) -> Answers:
    """What the joint does, by how it moves and how it would move if nothing held it."""
    return tuple(_answer(run) for run in runs)


def _answer(run: LetGo) -> EngineAnswer:
    verb, unit = ("starts with", "rad/s²") if run.seconds is None else ("moves", "rad")
    free = RATE if run.seconds is None else limp(run.seconds)
    share = run.moved / free
    words = "falls" if 0.9 < share < 1.1 else "held" if abs(share) < 0.1 else UNDECIDED
    moved, would = Measurement(verb, run.moved, unit), Measurement("limp", free, unit)
    return EngineAnswer(words, (moved, would, *run.figures), run.part)
