"""What a recording cannot tell, and the motions that would."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import grouped
from .parameter_texts import name_of_parameter
from .results import FittedParameter


@dataclass(frozen=True)
class TellingMotion:
    """A motion that would determine parameters.

    Attributes:
        motion: Which.
        names: The parameters that it would determine.
    """

    motion: str
    names: Sequence[str]


def motions_of(parameters: Sequence[FittedParameter]) -> list[TellingMotion]:
    """Return the motions that would tell what a recording cannot, those that tell most first."""
    named = [(each.motion, name_of_parameter(each)) for each in parameters if each.motion]
    motions = [TellingMotion(*pair) for pair in grouped(named).items()]
    return sorted(motions, key=lambda motion: -len(motion.names))


def undeterminable(parameters: Sequence[FittedParameter]) -> list[str]:
    """Return the names of the parameters that no motion would tell.

    Those that lack something else than information are not among them.
    """
    return [
        name_of_parameter(each)
        for each in parameters
        if "too little information" in each.reasons and not each.motion
    ]
