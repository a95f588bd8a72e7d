"""Two files of robots, or what two engines make of one, before anything moves.

Both become compiled models, and one list tells what differs: the one that `..why` explains a gap
with.

- `reading`: both sides, each as a compiled model
- `comparison`: `compare`, and what a reader should know
- `compiled`: what the compiled models differ in, as `..why` has it
- `declared`: what the text of a file says and no compiled model keeps
- `faults`, `only_read`, `visuals`: what was mended; what no engine uses; what is only drawn
- `meanings`, `effects`, `loads`, `weighed_bodies`: what a difference means for a motion
- `listing`, `locating`: the list, and the line of each file that an entry stands at
- `changes`: what of the right's file undoes each difference
- `agreement`: how well the rest agrees
"""

from .comparison import compare
from .reading import read
from .records import (
    SUBJECTS,
    FileFault,
    FileSide,
    ListedDifference,
    ModelsComparison,
    PoseGap,
    QuantityAgreement,
    Value,
)
from .visuals import gross_visuals

__all__ = [
    "SUBJECTS",
    "FileFault",
    "FileSide",
    "ListedDifference",
    "ModelsComparison",
    "PoseGap",
    "QuantityAgreement",
    "Value",
    "compare",
    "gross_visuals",
    "read",
]
