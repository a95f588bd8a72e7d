"""The words of every comparison: what a contact is called."""

from __future__ import annotations

from .contacts import ContactNames, same_pairs

__all__ = ["ContactNames", "same_pairs"]
