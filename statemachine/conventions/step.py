"""Whether what is derived from the state is that of the state after a step."""

from __future__ import annotations

from .answers import EngineQuestion
from .write import answer

__all__ = ["GIVEN", "QUESTION", "answer"]

QUESTION = EngineQuestion(
    "You have stepped: is what you read the new state's?",
    "Positions of the joints and poses of the links, read in one breath, may belong to two "
    "moments. A camera or a controller that mixes them is one step late.",
)
# The speed of the pendulum [rad/s] and of the ball [m/s], which comes out by less than its depth
# [m] in one step.
GIVEN = (3.0, 0.02)
