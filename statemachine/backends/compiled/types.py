"""Types of what MuJoCo's compiler makes, for modules that do not import MuJoCo.

MuJoCo ships no types: what the attributes are, its manual lists in the chapter API Reference.
"""

from __future__ import annotations

from typing import Any, Protocol


class MjModel(Protocol):
    """A compiled model: sizes, and arrays by the names of MuJoCo's mjModel."""

    def __getattr__(self, name: str) -> Any:
        """Return a size, an array, the options or the statistics of the model."""


class MjData(Protocol):
    """The working memory of what is computed of a compiled model, as MuJoCo's mjData."""

    def __getattr__(self, name: str) -> Any:
        """Return an array, or a number."""
