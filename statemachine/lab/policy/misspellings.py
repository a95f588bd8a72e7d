"""Names of a contract or a robot that are probably others, misspelt."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_MISSPELT = 0.65  # likeness of two names, from 0 to 1, from which on one may be the other misspelt


def nearest_name(name: str, known: Iterable[str]) -> str:
    """Return the one name of which another is a misspelling; "" where none or several are near."""
    close = difflib.get_close_matches(name, known, 2, _MISSPELT)
    if len(close) == 2 and _likeness(name, close[0]) == _likeness(name, close[1]):
        return ""
    return close[0] if close else ""


def _likeness(name: str, known: str) -> float:
    """Return how alike two names are, from 0 to 1."""
    return difflib.SequenceMatcher(None, known, name).ratio()
