"""What to ask next of two descriptions of a robot: what each difference explains of a motion."""

from __future__ import annotations

from ..compare.typed_command import TypedCommand
from .records import ModelsComparison


def next_command_of(result: ModelsComparison) -> str:
    """Return the command that tells what each difference explains; "" where none can be equalized.

    Its experiment runs on any robot that has such a file.
    """
    if not any(row.cause and not row.refused for row in result.differences):
        return ""
    if not (result.left.joints and result.right.joints):  # no experiment runs on it
        return ""
    experiment = "waves" if result.has_actuators else "gravity"
    words = ["statemachine", "compare", experiment]
    for side, label in zip(("left", "right"), result.labels, strict=True):
        faults = [fault for fault in result.faults if fault.side == side]
        words.append(label)
        if any(fault.unit == "kg m²" for fault in faults):
            words.append("balance_inertia=on")
        if any(fault.used is None for fault in faults):
            words.append("meshes=off")
    return TypedCommand(tuple(words)).lines("--why")
