"""The contract that every backend keeps: Model, Data, State, and the seven verbs less `load`.

A simulator is a state machine. A `Model` never changes; a `Data` holds all that does;
`step` turns one Data into the next. From the bottom up:

- `records`: capabilities, keyframes, contacts and States
- `checks`: how an argument is checked before an engine sees it
- `options`: what `Model.replace` takes
- `free_base`: where a floating base starts
- `read_options`: the options that act only while a file is read
- `sites`: which site stands for the fingertip
- `model`: the constants of a simulation
- `model_labels`: labels that tell two Models apart
- `exclusive_access`: one thread at a time
- `data`: inputs, and what is derived from them
- `worlds`: many Data of one Model, in arrays
- `verbs`: the functions that a user calls
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
