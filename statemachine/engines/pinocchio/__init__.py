"""Pinocchio without us."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .. import RawEngine

if TYPE_CHECKING:
    from ..measured import Phrases


class PinocchioEngine(RawEngine):
    """Pinocchio: it computes, and runs nothing."""

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """A function of `conventions`."""
        from . import conventions

        return getattr(conventions, question, None)

    def phrases(self) -> Phrases:
        """A Model, functions of q and v, and a Data that holds what they computed last."""
        from .phrasebook import PHRASES

        return PHRASES
