"""Pinocchio without us."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..methods import function_of
from ..raw_engine import RawEngine


class PinocchioEngine(RawEngine):
    """Pinocchio: it computes, and runs nothing."""

    phrases = function_of(".pinocchio.conventions:phrases")

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """Return a function of `conventions`."""
        from . import conventions

        return getattr(conventions, question, None)
