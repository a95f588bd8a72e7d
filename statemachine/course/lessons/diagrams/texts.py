"""What the diagrams share: a template for what is said of one, and lists of names in a box."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ....interface import Data, Model, get_state
from ....show.blocks import Text
from ....show.diagrams.shapes import Label, Look, Shape, length_of
from ....show.markdown import plain_text
from ....show.pictures import Diagram
from ....show.templates import render

if TYPE_CHECKING:
    from ....show.templates import PageContent

_BETWEEN = "  "  # names of a list
_MOVING = ("act", "mocap_pos", "mocap_quat")  # further arrays that some models have


def diagram_of(content: PageContent, shapes: Sequence[Shape]) -> Diagram:
    """Return a diagram: of its template the title says what it shows, the paragraphs what is seen.

    Args:
        content: What the template names.
        shapes: Of the diagram.
    """
    page = render(content)
    words = [plain_text(block.text) for block in page.blocks if isinstance(block, Text)]
    return Diagram(plain_text(page.title), " ".join(words), tuple(shapes))


def file_of(model: Model) -> str:
    """Return the file of a Model and its folder, in letters that every file can hold."""
    return "/".join(model.path.parts[-2:]).encode(errors="replace").decode()


def stored_arrays(model: Model, data: Data) -> list[str]:
    """Return what is stored of a Data, each array with its length."""
    arrays = [f"qpos ({model.nq})", f"qvel ({model.nv})", f"ctrl ({model.nu})", "time"]
    for name, size in get_state(model, data).layout:
        if name in _MOVING:
            arrays.append(f"{name} ({size})")
    return arrays


def rows_of(names: Sequence[str], room: int) -> list[str]:
    """Return names in as many rows as they need.

    Args:
        names: None of them is broken.
        room: Number of columns of a row.
    """
    rows: list[str] = []
    for name in names:
        if rows and length_of(rows[-1] + _BETWEEN + name) <= room:
            rows[-1] += _BETWEEN + name
        else:
            rows.append(name)
    return rows


def lines(
    texts: Sequence[str],
    left: int,
    top: int,
    room: int,
    is_code: bool = False,
    look: Look = "plain",
) -> list[Label]:
    """Return lines of text, one below the other.

    Args:
        texts: The lines.
        left: Column of their first letters.
        top: Row of the first line.
        room: Number of columns.
        is_code: Whether they are typed as they are.
        look: What they are about.
    """
    return [
        Label(text, left, row, room, look, is_code) for row, text in enumerate(texts, start=top)
    ]
