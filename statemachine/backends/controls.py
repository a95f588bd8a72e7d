"""Which actuator takes which number of ctrl; no engine is loaded for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..interface import Ints

if TYPE_CHECKING:
    from .compiled.types import MjModel


def ctrl_owners(m: MjModel) -> Ints:
    """Return the actuator (nu,) of each number of ctrl; one may take several."""
    return np.repeat(np.arange(m.nactuator), m.actuator_ctrlnum)
