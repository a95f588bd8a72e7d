"""What is still there after a reset."""

from __future__ import annotations

from collections.abc import Mapping

from ..engines.measured import Measurement
from .answers import Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "You reset: what is still there?",
    "An episode that starts with something of the last one is no repetition. What a reset "
    "leaves alone has to be set by hand.",
)
GIVEN = ()


def answer(still_there: Mapping[str, Mapping[str, bool]]) -> Answers:
    """What each way to reset keeps of what was written before."""
    return tuple(_answer(way, there) for way, there in still_there.items())


def _answer(way: str, there: Mapping[str, bool]) -> EngineAnswer:
    kept = [name for name in there if there[name]]
    gone = [f"{name} (gone)" if name == "bodies" else name for name in there if not there[name]]
    return EngineAnswer(
        "keeps " + (", ".join(kept) or "nothing"),
        (Measurement("sets back", tuple(gone)),),
        way,
    )
