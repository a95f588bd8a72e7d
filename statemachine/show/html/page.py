"""A page as one HTML file that asks for nothing but itself."""

from __future__ import annotations

import base64
import hashlib
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ... import __version__
from ...atomic_files import check_place, replace_text
from ...errors import BadInputError
from ..blocks import Block, Interactive, Page, Section, Text
from ..pictures import RobotPicture
from ..text_blocks import non_breaking
from .blocks import DrawInteractive, drawn, headline_as_html, no_interaction
from .markup import Html, filled, joined, tag, text_of

SUFFIXES = (".html", ".htm")
_NO_DATA = Html("{}")


def no_picture(_picture: RobotPicture) -> str:
    """Return no address: a page has the words of a picture that nothing draws."""
    return ""


@dataclass(frozen=True)
class Interaction:
    """What moves on a page.

    Attributes:
        draw: Draws an interactive block.
        picture: Returns the address of a drawn robot; "" where nothing draws it.
        above: What stands above the headline; empty for the title of the page.
        data: JSON that the script reads.
        script: JavaScript; "" for none.
    """

    draw: DrawInteractive = no_interaction
    picture: Callable[[RobotPicture], str] = no_picture
    above: Sequence[Html] = ()
    data: Html = _NO_DATA
    script: str = ""


NOTHING_MOVES = Interaction()


def report(page: Page, interaction: Interaction = NOTHING_MOVES) -> str:
    """Return a page as HTML.

    Args:
        page: What is said.
        interaction: What moves on it.
    """
    opening = list(itertools.takewhile(_is_above_sections, page.blocks))
    rest = _all_drawn(page.blocks[len(opening) :], interaction)
    main = tag("main", _header(page, opening, interaction), rest)
    script = ""
    if interaction.script:
        script = f"(() => {{\n'use strict';\n{interaction.script}\n}})();"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    slots = {
        "policy": Html(policy),
        "title": page.headline.lead if page.headline else page.title,
        "style": Html(text_of("show/html/page.css")),
        "main": main,
        "origin": non_breaking(page.origin),
        "version": __version__,
        "data": interaction.data,
        "script": Html(script),
    }
    return filled("show/html/page.html", slots)


def _all_drawn(blocks: Sequence[Block], interaction: Interaction) -> Html:
    """Return blocks one after the other, pictures of a robot among them."""
    parts: list[Html] = []
    for block in blocks:
        if isinstance(block, RobotPicture):
            parts.append(_robot(block, interaction.picture(block)))
        else:
            parts.append(drawn([block], interaction.draw))
    return joined(parts)


def _robot(picture: RobotPicture, source: str) -> Html:
    """Return the picture of a robot; without one, what would be seen."""
    shown = tag("img", src=source, alt=picture.words) if source else tag("p", picture.words)
    caption = tag("figcaption", picture.title, " Live: ", tag("code", picture.view))
    return tag("figure", shown, caption, class_="drawn")


def _is_above_sections(block: Block) -> bool:
    """Tell whether a block may stand in the header: it is no part that links lead to."""
    if isinstance(block, Section):
        return not block.name
    return not isinstance(block, Interactive)


def _header(page: Page, opening: Sequence[Block], interaction: Interaction) -> Html:
    """Return the top of a page: what was run, the answer, and what stands above all sections."""
    name = interaction.above
    if not name:
        name = [tag("span", page.title, class_="experiment")]
    headline = tag("h1", page.title, id="finding")
    if page.headline is not None:
        headline = headline_as_html(page.headline)
    parts = [tag("p", *name, class_="kicker"), headline]
    if opening and isinstance(opening[0], Text):
        parts.append(tag("p", non_breaking(opening[0].text), class_="says"))
        opening = opening[1:]
    return tag("header", *parts, tag("div", _all_drawn(opening, interaction), class_="words"))


def check_target(path: str | Path) -> Path:
    """Return where a report is to be written, checked before anything is run.

    Raises:
        BadInputError: It is not a name of a page, or see `check_place`.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a report is a file .html; got {target.name!r}")
    check_place(target)
    return target


def write_report(path: str | Path, text: str) -> Path:
    """Write a report; it is there whole or not at all.

    Raises:
        BadInputError: See `check_target`.
        OSError: It cannot be written.
    """
    replace_text(check_target(path), text)
    return Path(path)
