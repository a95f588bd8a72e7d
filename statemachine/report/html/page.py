"""A page as one HTML file that asks for nothing but itself."""

from __future__ import annotations

import base64
import hashlib
import itertools
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ... import __version__
from ...errors import BadInputError
from ...page import Block, Interactive, Items, Page, Section, Text
from ...runs.whole import check_place, replace_text
from ..finding import long_labels
from ..over_time import BothRuns
from ..terminal import non_breaking
from .blocks import drawn, headline_as_html
from .markup import Html, data_of, filled, joined, tag, template
from .scene import Look
from .stage import staged

SUFFIXES = (".html", ".htm")
_SCRIPTS = ("gl.js", "scene.js", "page.js")
_NO_LOOK = "no model was given"


def report(page: Page, looks: Sequence[Look] = (_NO_LOOK, _NO_LOOK)) -> str:
    """A page as HTML.

    Args:
        page: What is said. Without `BothRuns` among its blocks it has no slider and no script.
        looks: What each of both runs is drawn as; the same object twice if both are of one model.
    """
    runs = next((block for block in page.blocks if isinstance(block, BothRuns)), None)
    stage, data, notes = (Html(""), None, []) if runs is None else staged(runs, looks)

    opening = list(itertools.takewhile(_opens, page.blocks))
    rest: list[Block] = [*page.blocks[len(opening) :]]
    if notes:
        rest.append(Section("picture", "Of the picture", [Items(notes)]))
    parts = [_header(page, opening, stage, runs), drawn(rest, stage)]
    about = f"statemachine {__version__}; this file asks for nothing but itself."
    footer = tag("footer", tag("p", non_breaking(page.origin)), tag("p", about))
    body = joined((tag("main", *parts), footer))
    title = page.headline.lead if page.headline else page.title
    return _assembled(title, body, data)


def _opens(block: Block) -> bool:
    """Whether a block belongs to the opening of a page, above all sections."""
    return not (isinstance(block, Interactive) or (isinstance(block, Section) and block.name))


def _header(page: Page, opening: Sequence[Block], stage: Html, runs: BothRuns | None) -> Html:
    name: list[object] = [tag("span", page.title, class_="experiment")]
    if runs is not None:
        one, two = (
            tag("span", tag("i", class_=f"key {look}"), label, class_="side")
            for look, label in zip(("one", "two"), long_labels(runs.comparison), strict=True)
        )
        against = tag("span", "against", class_="against")
        theme = tag("button", "Dark", id="theme", type="button", hidden=True,
                    aria_label="Dark colours")  # fmt: skip
        name = [tag("span", runs.title, class_="experiment"), one, against, two, theme]
    lead = [block for block in opening[:1] if isinstance(block, Text)]
    return tag(
        "header",
        tag("p", *name, class_="kicker"),
        headline_as_html(page.headline) if page.headline else tag("h1", page.title, id="finding"),
        *(tag("p", non_breaking(block.text), class_="says") for block in lead),
        tag("div", drawn(opening[len(lead) :], stage), class_="words"),
    )


def _assembled(title: str, body: Html, data: dict[str, Any] | None) -> str:
    """The file; without data for a script there is none."""
    script = "\n".join(template(name) for name in _SCRIPTS)
    script = "" if data is None else f"(() => {{\n'use strict';\n{script}\n}})();"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    slots = {
        "policy": Html(policy),
        "title": title,
        "style": Html(template("page.css")),
        "body": body,
        "data": data_of(data or {}),
        "script": Html(script),
    }
    return filled("page.html", slots)


def check_target(path: str | os.PathLike[str]) -> Path:
    """Where a report is to be written, checked before anything is run.

    Raises:
        BadInputError: It is no name of a page, or see `check_place`.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a report is a file .html; got {target.name!r}")
    check_place(target)
    return target


def write_report(path: str | os.PathLike[str], text: str) -> Path:
    """Write a report; it is there whole or not at all.

    Raises:
        BadInputError: See `check_target`.
        OSError: It cannot be written.
    """
    target = check_target(path)
    replace_text(target, text)
    return target
