"""A diagram as a terminal shows it, with rich."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from ..pictures import Diagram
from .canvas import painted
from .shapes import Look, size_of

if TYPE_CHECKING:
    from rich.console import RenderableType

# Colours of what a shape is about; no colour says anything alone.
_STYLES: Mapping[Look, str] = {
    "plain": "",
    "constant": "blue",
    "state": "yellow",
    "derived": "green",
    "call": "magenta",
    "apart": "bold red",
    "faint": "dim",
}


def lines(block: Diagram, width: int, spelled: Callable[[str], str]) -> list[RenderableType]:
    """Return the lines of a diagram; where it is too wide, what there is to be seen.

    Args:
        block: The diagram.
        width: Number of columns that there are.
        spelled: Returns a text in letters that the terminal has.
    """
    from rich.text import Text as RichText

    if size_of(block.shapes)[0] > width:
        return [RichText(spelled(f"{block.title}. {block.words}"))]
    drawn: list[RenderableType] = [RichText(spelled(block.title), "italic")]
    for parts in painted(block.shapes, spelled):
        line = RichText()
        for part in parts:
            line.append(part.text, _STYLES[part.look])
        drawn.append(line)
    return drawn
