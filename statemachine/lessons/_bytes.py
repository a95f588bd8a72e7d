"""The bytes of a Data: what a call changed is found by comparing them."""

from __future__ import annotations

import numpy as np

from ..interface import INPUTS, Contacts, Data
from ..measures.readings import readings


def read_stored(data: Data) -> dict[str, bytes]:
    """The bytes of every input, and of the time."""
    return {name: np.array(getattr(data, name)).tobytes() for name in (*INPUTS, "time")}


def read_derived(data: Data) -> dict[str, bytes]:
    """The bytes of every derived array that this engine gives, contacts among them."""
    return {
        name: b"".join(getattr(held, part).tobytes() for part in ("geom", "dist", "pos", "force"))
        if isinstance(held, Contacts)
        else held.tobytes()
        for name, held in readings(data).items()
    }
