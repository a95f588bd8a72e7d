"""How much time a step takes, and who keeps count of it."""

from __future__ import annotations

from ..engines.measured import Measurement, OneStep
from .answers import Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "How long is one step of a fresh engine, and who counts the time?",
    "The same number of steps is another span of time on each engine. A controller that runs "
    "at a fixed rate must know how many steps there are to one of its own.",
)
GIVEN = ()
_SAME = 1e-6  # s


def answer(step: OneStep) -> Answers:
    """The step [s] that a body at 1 m/s tells by how far it comes, and the engine's clock."""
    told_ms, moved_ms = (f"{span * 1e3:.4g} ms" for span in (step.told, step.moved))
    same = abs(step.told - step.moved) < _SAME
    words = moved_ms if same else f"told {told_ms}, moves {moved_ms}"
    moves = Measurement("at 1 m/s a body moves", step.moved, "m")
    ticks = Measurement("it goes on by", step.ticked, "s")
    return (
        EngineAnswer(words, (moves,), "one step"),
        EngineAnswer(step.clock if step.ticked else "none", (ticks,), "clock"),
    )
