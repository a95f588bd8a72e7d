"""Why two simulations differ: see `attribute`."""

from __future__ import annotations

from .attribute import attribute
from .factors import FACTORS, Factor
from .gap import Gap
from .results import Attribution, Touch, Trial

__all__ = ["FACTORS", "Attribution", "Factor", "Gap", "Touch", "Trial", "attribute"]
