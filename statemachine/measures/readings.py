"""Everything that an engine derives from a state, as one Data tells it at one moment."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from ..errors import UnsupportedError
from ..interface import DERIVED, Array, Contacts, Data

Readings = Mapping[str, "Array | Contacts"]


def readings(data: Data, copied: bool = False) -> dict[str, Array | Contacts]:
    """Everything derived that the backend of a Data yields: arrays by name, and "contacts".

    Args:
        data: Read, and not touched.
        copied: Whether the arrays stay as they are when the Data goes on.
    """
    derived: dict[str, Array | Contacts] = {}
    for name in DERIVED:
        with suppress(UnsupportedError):
            array = getattr(data, name)
            derived[name] = np.array(array) if copied else array
    derived["contacts"] = data.contacts
    return derived
