"""What the witness computes places from, and how it came by it.

There are two ways. *Own reading*: Pinocchio's own parser reads the robot's file. *Same
reading*: a Pinocchio model is built from the numbers of a compiled model, so that the code
that computes is another, and the reading of the file is not.
"""

from __future__ import annotations

from .file import read_file
from .record import OWN_READING, SAME_READING, Segment, WitnessModel, labels, read_numbers

__all__ = [
    "OWN_READING",
    "SAME_READING",
    "Segment",
    "WitnessModel",
    "labels",
    "read_file",
    "read_numbers",
]
