"""The report of a comparison as one HTML file that asks for nothing but itself."""

from __future__ import annotations

import base64
import hashlib
import os
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from ... import __version__
from ...compare import Comparison, Series, Witness, default_tip, series
from ...errors import BadInputError
from ...page import Page, Verdict
from ...traces import Trace
from ...traces.files import replace_file
from ..figures_of import scale_of
from . import sections
from .charts import data_table, difference_chart, values_chart
from .finding import headline, in_words, leading, parting
from .geometry import packed
from .markup import Html, data_of, escaped, joined, kept, tag
from .scene import Look, scene_of
from .sketch import sketch
from .stage import quantity_data, stage
from .timeline import Frames, events_of, frames_of

if TYPE_CHECKING:
    from ...compare.why import Attribution

SUFFIXES = (".html", ".htm")
_SCRIPTS = ("gl.js", "scene.js", "page.js")
_NO_LOOK = Look(None, "no model was given")


def check_target(path: str | os.PathLike[str]) -> Path:
    """Where a report is to be written, checked before anything is run.

    Raises:
        BadInputError: It is no name of a page, or its folder is not there or not to be written.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a report is a file .html; got {target.name!r}")
    if target.is_dir():
        raise BadInputError(f"{target} is a folder; name a file in it")
    folder = target.parent
    if not folder.is_dir():
        raise BadInputError(f"there is no folder {folder} to write {target.name} into")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BadInputError(f"the folder {folder} cannot be written into")
    return target


def write_report(path: str | os.PathLike[str], text: str) -> Path:
    """Write a report; it is there whole or not at all.

    Raises:
        BadInputError: See `check_target`.
        OSError: It cannot be written.
    """
    target = check_target(path)
    data = text.encode("utf-8", errors="replace")

    def fill(out: BinaryIO) -> None:
        out.write(data)

    replace_file(target, fill)
    return target


def report(
    comparison: Comparison,
    one: Trace,
    two: Trace,
    *,
    looks: Sequence[Look] = (_NO_LOOK, _NO_LOOK),
    tip: str | None = None,
    attribution: Attribution | None = None,
    why_not: str = "",
    models: Page | None = None,
    said: Sequence[str] = (),
    command: str = "",
    witness: Witness | None = None,
) -> str:
    """The page.

    Args:
        comparison: What was found in comparing the two.
        one: The first trace, drawn solid.
        two: The second, drawn as a ghost.
        looks: What each is drawn as; the same object twice if both are of one model.
        tip: The site that was compared, as given to `compare`.
        attribution: How much each factor explains, if that was asked.
        why_not: Why there is none, as a sentence.
        models: The differences between what the engines make of the model, if asked.
        said: What stood in for a run, line by line.
        command: What makes the page again.
        witness: How far the fingertip is from where a third party puts it, if asked.
    """
    site = default_tip(one.header, two.header) if tip is None else tip
    curves = series(one, two, tip)
    events = events_of(comparison, one, two)
    frames = frames_of(one, two, _moments(comparison))
    scene = scene_of(one, two, frames, looks, site)
    start = _start(comparison, frames)
    text = headline(comparison, events, attribution)
    labels = comparison.one.label, comparison.two.label
    if labels[0] == labels[1]:
        labels = f"{labels[0]} (first)", f"{labels[1]} (second)"
    words = in_words(comparison, events, attribution)
    data = {
        "time": packed(frames.time, "f8"),
        "compared": packed(curves[0].time[frames.compared], "f8"),
        "until": comparison.until,
        "start": start,
        "labels": list(labels),
        "parting": parting(comparison),
        "quantities": [quantity_data(c, comparison, frames) for c in curves],
        "lead": _lead(comparison, curves),
        "scene": scene.data,
    }
    still = sketch(scene, one, two, frames, start, labels)
    parts: list[object] = [
        _head(comparison, one, labels, text, words),
        stage(comparison, curves, events, frames, start, labels, still),
    ]
    if attribution is not None:
        parts.append(_section("why", "What causes it", sections.attribution_section(attribution)))
    elif why_not:
        parts.append(_section("why", "What causes it", tag("p", why_not)))
    parts += [
        _section(
            "curves",
            "How far apart, over time",
            _curves(comparison, curves, labels),
        ),
        _section(
            "figures",
            "The figures",
            sections.agreements(comparison),
            sections.third_party(witness, labels) if witness is not None else None,
        ),
        _section("events", "What happens when", sections.events_table(events, comparison)),
    ]
    if models is not None:
        parts.append(_section("models", "What each engine makes of the model", _models(models)))
    emulated = sections.emulated(comparison)
    if emulated is not None:
        parts.append(_section("emulated", "What is emulated", emulated))
    notes = [_sentence(line) for line in (*said, *comparison.notes, *scene.notes)]
    parts.append(
        _section(
            "origin",
            "Where this comes from",
            sections.provenance((one.header, two.header), comparison),
            tag("p", "This page was made by ", tag("code", command), ".") if command else None,
            tag("h3", "Notes") if notes else None,
            tag("ul", *(tag("li", note) for note in notes)) if notes else None,
        )
    )
    body = joined(
        (
            tag("main", *parts),
            tag(
                "footer",
                tag(
                    "p", "Neither side is the truth, and two engines that agree may both be wrong."
                ),
                tag("p", f"statemachine {__version__}; this file asks for nothing but itself."),
            ),
        )
    )
    return _assembled(text, body, data)


def _moments(comparison: Comparison) -> tuple[float, ...]:
    """Moments that must be among those shown."""
    found = comparison.agreements
    times = {a.at for a in found} | {a.since for a in found if a.since is not None}
    return tuple(sorted(times))


def _start(comparison: Comparison, frames: Frames) -> int:
    """The moment to open the page at: where the leading quantity is farthest apart."""
    subject = leading(comparison)
    at = subject.at if subject is not None else 0.0
    return int(np.argmin(np.abs(frames.time - at)))


def _head(
    comparison: Comparison, one: Trace, labels: tuple[str, str], text: str, words: Sequence[str]
) -> Html:
    says = one.header.says
    shown = (
        f"{comparison.until:g} s on {labels[0]}, below as a solid arm, and on {labels[1]}, as a "
        "ghost over it."
    )
    finding, _, cause = text.partition(". ")
    return tag(
        "header",
        tag(
            "p",
            tag("span", comparison.one.experiment, class_="experiment"),
            tag("span", tag("i", class_="key one"), labels[0], class_="side"),
            tag("span", "against", class_="against"),
            tag("span", tag("i", class_="key two"), labels[1], class_="side"),
            tag("button", "Dark", id="theme", type="button", aria_pressed="false", hidden=True,
                aria_label="Dark colours"),
            class_="kicker",
        ),
        tag(
            "h1",
            kept(f"{finding}."),
            tag("span", kept(f" {cause}."), class_="cause") if cause else None,
            id="finding",
            tabindex="-1",
        ),
        tag("p", f"{says} " if says else "", kept(shown), class_="says"),
        *(tag("p", kept(line)) for line in words),
    )  # fmt: skip


def _curves(comparison: Comparison, curves: Sequence[Series], labels: tuple[str, str]) -> Html:
    """A row of charts for each quantity, those that differ first."""
    by_name = {found.name: found for found in comparison.agreements}
    shown: dict[str, list[tuple[float, Html]]] = {"differs": [], "settles": [], "agrees": []}
    for curve in curves:
        found = by_name[curve.name]
        chart = values_chart(curve, labels)
        unit = scale_of(curve.kind)[1].strip()
        row = tag(
            "section",
            tag("h3", tag("span", curve.name, class_="quantity"),
                sections.verdict_badge(found.verdict)),
            tag(
                "div",
                tag("figure", tag("figcaption", f"how far apart, {unit}; shaded: within tolerance"),
                    difference_chart(curve, found)),
                tag("figure", tag("figcaption", f"both sides, {unit}"), chart) if chart else None,
                class_="charts",
            ),
            tag("details", tag("summary", f"The figures of {curve.name}"),
                data_table(curve, found, labels), class_="data"),
            class_="quantity-row",
        )  # fmt: skip
        shown[found.verdict].append((-found.max / found.tolerance, row))
    beyond = [row for v in ("differs", "settles") for _, row in sorted(shown[v], key=_first)]
    within = [row for _, row in sorted(shown["agrees"], key=_first)]
    key = tag(
        "p",
        tag("i", class_="key one"), f" {labels[0]}, full line ",
        tag("i", class_="key two"), f" {labels[1]}, broken line ",
        class_="legend",
    )  # fmt: skip
    if not beyond:
        return joined((key, *within))
    more = tag("details", tag("summary", _agreeing(len(within))), *within) if within else None
    return joined([part for part in (key, *beyond, more) if part is not None])


def _first(pair: tuple[float, Html]) -> float:
    return pair[0]


def _agreeing(count: int) -> str:
    return f"The {count} that agree" if count > 1 else "The one that agrees"


def _models(page: Page) -> Html:
    """The verdict, and what it is of on demand."""
    verdicts = [block for block in page.blocks if isinstance(block, Verdict)]
    rest = [block for block in page.blocks if not isinstance(block, Verdict)]
    return joined(
        (
            tag("p", "Before anything moves. What the backends then do about it for the runs above "
                "is in ", tag("a", "What is emulated", href="#emulated"), "."),
            sections.from_page(Page("", "", verdicts)),
            tag("details", tag("summary", page.title), sections.from_page(Page("", "", rest))),
        )
    )  # fmt: skip


def _section(name: str, heading: str, *content: object) -> Html:
    return tag(
        "section",
        tag("h2", heading, id=f"{name}-heading"),
        *content,
        id=name,
        aria_labelledby=f"{name}-heading",
    )


def _lead(comparison: Comparison, curves: Sequence[Series]) -> list[int]:
    """The quantities that are spoken with the moment: the leading one, and the fingertip's."""
    subject = leading(comparison)
    names = [curve.name for curve in curves]
    lead = [names.index(subject.name)] if subject and subject.name in names else []
    lead += [k for k, curve in enumerate(curves) if curve.kind == "tip"]
    return list(dict.fromkeys(lead))[:2] or [0]


def _assembled(title: str, body: Html, data: dict[str, Any]) -> str:
    script = "(() => {\n'use strict';\n" + "\n".join(_file(name) for name in _SCRIPTS) + "\n})();"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    filled = {
        "policy": Html(policy),
        "title": escaped(title),
        "style": Html(_file("page.css")),
        "body": body,
        "data": data_of(data),
        "script": Html(script),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: filled[found[1]], _file("page.html"))


def _file(name: str) -> str:
    return resources.files(__package__ or "").joinpath(name).read_text(encoding="utf-8")


def _sentence(line: str) -> str:
    text = line[:1].upper() + line[1:]
    return text if text.endswith(".") else text + "."
