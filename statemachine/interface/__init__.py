"""The contract that every backend keeps: Model, Data, State, and the seven verbs less `load`.

A simulator is a state machine. A `Model` never changes; a `Data` holds all that does;
`step` turns one Data into the next. From the bottom up:

- `records`: what a backend says of itself, and what it hands out
- `checks`: what is checked of an argument before an engine sees it
- `options`: what `Model.replace` takes
- `free_base`: where a base that floats starts
- `read_options`: which options act only while a file is read
- `sites`: which site stands for the fingertip
- `model`: the constants of a simulation
- `exclusive_access`: one thread at a time
- `data`: what changes, and what follows from it
- `verbs`: what a user calls
"""

from .data import Data
from .model import Model
from .records import (
    BEHAVIOURS,
    DERIVED,
    FORCES,
    INPUTS,
    MOCAP,
    OPTIONS,
    PARTS,
    POSES,
    Array,
    Behaviour,
    Capabilities,
    Contacts,
    Ints,
    JointType,
    Keyframe,
    State,
    read_only,
)
from .verbs import forward, get_state, make_data, reset, set_state, step

__all__ = [
    "BEHAVIOURS",
    "DERIVED",
    "FORCES",
    "INPUTS",
    "MOCAP",
    "OPTIONS",
    "PARTS",
    "POSES",
    "Array",
    "Behaviour",
    "Capabilities",
    "Contacts",
    "Data",
    "Ints",
    "JointType",
    "Keyframe",
    "Model",
    "State",
    "forward",
    "get_state",
    "make_data",
    "read_only",
    "reset",
    "set_state",
    "step",
]
