"""For how long a command that is given once acts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..engines.measured import Measurement
from .answers import UNDECIDED, Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "You command once, and step twice: does the command still act?",
    "A command that lasts one step has to be given before every step; one that stays has to be "
    "taken back.",
)
GIVEN = (1.0,)  # N·m


def answer(speeds: Mapping[str, Sequence[float]]) -> Answers:
    """From the change of speed in a first step and in a second."""
    return tuple(_answer(kind, *three) for kind, three in speeds.items())


def _answer(kind: str, start: float, after: float, later: float) -> EngineAnswer:
    first, second = after - start, later - after
    share = second / first if first else float("nan")
    words = "stays" if 0.9 < share < 1.1 else "lasts one step" if abs(share) < 0.1 else UNDECIDED
    figures = Measurement("first step", first, "rad/s"), Measurement("second", second, "rad/s")
    return EngineAnswer(words, figures, kind)
