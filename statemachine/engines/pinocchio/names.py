"""What Pinocchio has no function for, looked up among its names."""

from __future__ import annotations

from typing import Any


def names_with(pin: Any, *words: str) -> tuple[str, ...]:
    """Public names of Pinocchio's, and of its Data's, that have one of the words in them."""
    names = (*vars(pin), *vars(pin.Data))
    return tuple(
        sorted(
            name for name in names if name[0] != "_" and any(word in name.lower() for word in words)
        )
    )
