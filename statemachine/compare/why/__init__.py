"""Why two simulations differ: see `attribute`."""

from __future__ import annotations

from .attribute import Attribution, Touch, Trial, attribute
from .factors import FACTORS, Factor
from .gap import Gap

__all__ = ["FACTORS", "Attribution", "Factor", "Gap", "Touch", "Trial", "attribute"]
