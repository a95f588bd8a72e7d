"""The witness of a model: where it places the ends of the robot, against the engine."""

from __future__ import annotations

from ..errors import MissingEngineError, StateMachineError
from ..interface import Model
from ..lessons.fingertip import certify
from .records import WitnessRow

_POSES = 20


def witness_row(model: Model, seed: int) -> WitnessRow:
    """Compare every end of the robot at random poses.

    Raises:
        MissingEngineError: The witness is not installed here.
    """
    try:
        found = certify(model, poses=_POSES, seed=seed)
    except MissingEngineError:
        raise
    except StateMachineError as error:
        return WitnessRow(refusal=" ".join(str(error).split()))
    gap = found.position_worst
    if gap is None:  # its frame is another one than the engine's
        gap = float("inf") if found.frames is None else found.frames.distance
    return WitnessRow(found.grade, found.reason, len(found.tips), gap)
