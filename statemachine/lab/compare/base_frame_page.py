"""That the base of a robot has another frame in two files, as a sentence."""

from __future__ import annotations

from dataclasses import dataclass

from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..runs.floating import BaseFrame


@dataclass(frozen=True)
class BaseFramePart(PageContent):
    """The frame of the right's base in that of the left's.

    Attributes:
        frame: Where it is.
    """

    template = "base_frame.md.j2"
    frame: BaseFrame


def base_frame_blocks(frame: BaseFrame | None) -> list[Block]:
    """Return that a base has another frame in two files; nothing where it is the same."""
    return [] if frame is None else render_blocks(BaseFramePart(frame))
