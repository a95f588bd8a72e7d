"""What an engine has no function for, looked up among its names."""

from __future__ import annotations

from typing import Any

from . import NO_ANSWER, Figure, Finding


def lacking(pin: Any, *words: str, of: str = "") -> Finding:
    """`NO_ANSWER` if no public name of Pinocchio's, or of its Data's, has one of the words.

    Otherwise the names are the answer: then the question has to be asked anew.
    """
    names = [*vars(pin), *vars(pin.Data)]
    found = sorted(
        name for name in names if name[0] != "_" and any(word in name.lower() for word in words)
    )
    counted = Figure(f"functions called …{'…, …'.join(words)}…:", len(found))
    return Finding(", ".join(found) or NO_ANSWER, (counted,), of)
