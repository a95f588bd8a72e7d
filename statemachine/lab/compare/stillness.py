"""What is said where nothing moved, so that nothing was compared: on every page the same."""

from __future__ import annotations

from ...measures.text import quantity
from .instead import Instead
from .motion import MotionExtent

STILL = "Nothing moved ({most} in {seconds:g} s{energy}), so nothing was compared: {instead}"
TRY = "try {experiment}, which moves {file}"
NO_ACTUATORS = (
    "no experiment moves {file}; waves needs an actuator, and it has none: add a motor to both "
    "files"
)
NONE_MOVES = (
    "no experiment moves {file}: start it elsewhere (--keyframe), or command it with "
    "FILE.py:FUNCTION"
)
UNKNOWN = "try waves, which moves whatever has an actuator"


def nothing_moved(motion: MotionExtent, instead: Instead | None = None) -> str:
    """Say that nothing moved, and what to run instead; a sentence without its end.

    Args:
        motion: How far both sides move.
        instead: What moves the model; None where that was not looked for.
    """
    energy = ""
    if motion.energy is not None:
        energy = f", the energy changes by {quantity(motion.energy, 'J')}"
    return STILL.format(
        most=extent_of(motion), seconds=motion.seconds, energy=energy, instead=_instead(instead)
    )


def extent_of(motion: MotionExtent) -> str:
    """Return how far both sides move at most, as text: "0°", "0.001° and 0 mm"."""
    extents: list[str] = []
    if motion.angle is not None:
        extents.append(quantity(motion.angle, "rad"))
    if motion.length is not None:
        extents.append(quantity(motion.length, "m"))
    return " and ".join(extents)


def _instead(instead: Instead | None) -> str:
    """Say what to run instead."""
    if instead is None:
        return UNKNOWN
    if instead.experiment:
        return TRY.format(experiment=instead.experiment, file=instead.file)
    if not instead.has_actuators:
        return NO_ACTUATORS.format(file=instead.file)
    return NONE_MOVES.format(file=instead.file)
