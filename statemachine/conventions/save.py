"""What a saved state does not bring back."""

from __future__ import annotations

from collections.abc import Mapping

from ..engines.measured import Measurement, Past
from .answers import NO_ANSWER, Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "You save, go on, and restore: what does not come back?",
    "What is not in the saved state keeps the value of the run that you wanted to undo.",
)
GIVEN = ()


def answer(back: Mapping[str, Mapping[str, bool]] | Past) -> Answers:
    """What each way to save does not bring back; of a Data without a state, whether it has one."""
    if isinstance(back, Past):
        off = back.difference
        shown = Measurement("a used Data's acceleration is off by", off, "rad/s²")
        return (EngineAnswer("forgets a Data's past" if off else NO_ANSWER, (shown,)),)
    return tuple(_answer(way, kept) for way, kept in back.items())


def _answer(way: str, back: Mapping[str, bool]) -> EngineAnswer:
    kept = tuple(name for name in back if back[name])
    forgotten = [name for name in back if not back[name]]
    words = "forgets " + (", ".join(forgotten) or "nothing")
    return EngineAnswer(words, (Measurement("brings back", kept),), way)
