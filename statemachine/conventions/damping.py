"""Whether a body, or a joint, that nothing brakes keeps its speed."""

from __future__ import annotations

from ..engines.measured import Measurement
from .answers import Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "Nothing brakes: does a body keep its speed, and a fast joint?",
    "Energy that an engine takes away by default looks like friction of the robot. What is cut "
    "off at some speed looks like a motor's limit.",
)
_FAST = 200.0  # rad/s
GIVEN = (1.0, _FAST)  # s
_SAME = 1e-6


def answer(speeds: tuple[float, float]) -> Answers:
    """Of a body that began at 1 m/s, after 1 s; of a joint, one step after."""
    left, joint = speeds
    body = "keeps it" if abs(left - 1) < _SAME else f"loses {100 * (1 - left):.1f} % in 1 s"
    turns = "keeps it" if abs(joint / _FAST - 1) < 1e-3 else f"cut to {joint:.3g} rad/s"
    after = Measurement("one step after", joint, "rad/s")
    return (
        EngineAnswer(body, (Measurement("left after 1 s", left),), "a body at 1 m/s"),
        EngineAnswer(turns, (after,), "a joint at 200 rad/s"),
    )
