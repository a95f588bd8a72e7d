"""A page as one HTML file that asks for nothing but itself, and its scene with a slider."""

from __future__ import annotations

import base64
import hashlib
import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...errors import BadInputError
from ...interface import Ints
from ...measures.text import figure, on, reading, short_time
from ...page import Block, Interactive, Items, Page, Section, Text
from ...runs.whole import check_place, replace_text
from ..finding import long_labels, short_labels, traces_of
from ..over_time import BothRuns, QuantityChart, spans
from ..terminal import non_breaking
from .blocks import Html, data_of, drawn, filled, headline_as_html, joined, tag, template
from .geometry import packed
from .scene import Look, moments_of, scene_of

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

    # What stands above all sections.
    opening = list(
        itertools.takewhile(
            lambda block: (
                not (isinstance(block, Interactive) or (isinstance(block, Section) and block.name))
            ),
            page.blocks,
        )
    )
    rest: list[Block] = [*page.blocks[len(opening) :]]
    if notes:
        rest.append(Section("picture", "Of the picture", [Items(notes)]))
    main = tag("main", _header(page, opening, stage, runs), drawn(rest, stage))
    footer = tag(
        "footer",
        tag("p", non_breaking(page.origin)),
        tag("p", f"statemachine {__version__}; this file asks for nothing but itself."),
    )
    # Without data for a script there is none.
    script = "\n".join(template(name) for name in _SCRIPTS)
    script = "" if data is None else f"(() => {{\n'use strict';\n{script}\n}})();"
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    slots = {
        "policy": Html(policy),
        "title": page.headline.lead if page.headline else page.title,
        "style": Html(template("page.css")),
        "body": joined((main, footer)),
        "data": data_of(data or {}),
        "script": Html(script),
    }
    return filled("page.html", slots)


def _header(page: Page, opening: Sequence[Block], stage: Html, runs: BothRuns | None) -> Html:
    name: list[object] = [tag("span", page.title, class_="experiment")]
    if runs is not None:
        left, right = (
            tag("span", tag("i", class_=f"key {look}"), label, class_="side")
            for look, label in zip(("one", "two"), long_labels(runs.comparison), strict=True)
        )
        theme = tag("button", "Dark", id="theme", type="button", hidden=True,
                    aria_label="Dark colours")  # fmt: skip
        name = [
            tag("span", runs.title, class_="experiment"),
            left,
            tag("span", "against", class_="against"),
            right,
            theme,
        ]
    lead = [block for block in opening[:1] if isinstance(block, Text)]
    return tag(
        "header",
        tag("p", *name, class_="kicker"),
        headline_as_html(page.headline) if page.headline else tag("h1", page.title, id="finding"),
        *(tag("p", non_breaking(block.text), class_="says") for block in lead),
        tag("div", drawn(opening[len(lead) :], stage), class_="words"),
    )


def check_target(path: str | Path) -> Path:
    """Where a report is to be written, checked before anything is run.

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


_TICKS = 6  # of the axis of time
_SEEN = 1 / 400  # of the axis: a narrower gap between two bars is not seen
_TOOL = "gripperframe (tool frame)"
ARROWS = (
    "Arrows: contact forces, each as long as the root of its force; the longest of the run is "
    "{force} N."
)


def staged(runs: BothRuns, looks: Sequence[Look]) -> tuple[Html, dict[str, Any], list[str]]:
    """Both runs, drawn.

    Args:
        runs: The runs.
        looks: What each is drawn as.

    Returns:
        The scene, the slider and the lanes under it; the data for the script; and what a reader
        should know of the picture, in sentences.
    """
    until, site = runs.comparison.until, runs.comparison.tip
    # Of these moments the page tells: they must be among those that can be shown.
    agreements = runs.comparison.agreements
    moments = {t for a in agreements for t in (a.at, a.since) if t is not None}
    times, left_out = moments_of(*traces_of(runs.comparison), sorted(moments))
    start = int(np.argmin(np.abs(times - runs.start)))
    scene, notes, strongest = scene_of(runs, looks, times, left_out, start)
    compared = runs.charts[0].curve.time if runs.charts else times
    rows = np.clip(np.searchsorted(compared, times + 1e-9, side="right") - 1, 0, None)
    data = {
        "time": packed(times, "f8"),
        "compared": packed(compared[rows], "f8"),
        "until": until,
        "start": start,
        "quantities": [_quantity_data(chart, rows) for chart in runs.charts],
        "lead": list(runs.lead),
        "scene": scene,
    }
    now, (left, right) = float(times[start]), long_labels(runs.comparison)
    short_left, short_right = short_labels(runs.comparison)
    slots = {
        "left": left,
        "right": right,
        "short_left": short_left,
        "short_right": short_right,
        "on_left": non_breaking(f"{until:g} s {on(left)}"),
        "on_right": on(right),
        "tip": _TOOL if site == "gripperframe" else site or "a site",
        "now": short_time(now),
        "arrows": non_breaking(ARROWS.format(force=figure(strongest))) if strongest else "",
        "last": len(times) - 1,
        "start": start,
        "share": f"{now / until if until else 0.0:.6f}",
        "still": joined(tag("p", note) for note in notes) if scene is None else "",
        "lanes": _lanes(runs),
    }
    return filled("stage.html", slots), data, notes


def _lanes(runs: BothRuns) -> Html:
    """For each quantity when it is beyond its tolerance, under the slider and as wide."""
    until = runs.comparison.until or 1.0

    def bar(look: str, start: float, end: float | None = None, **more: str) -> Html:
        place = f"left:{100 * start / until:.2f}%"
        wide = "" if end is None else f";width:{100 * max(end - start, 0.0) / until:.2f}%"
        return tag("i", class_=look, style=place + wide, **more)

    lanes = []
    for side, look in enumerate(("one", "two")):
        marks = [
            bar(f"mark {look}", event.time, title=event.text)
            for event in runs.events
            if event.kind == "touch" and event.side == side
        ]
        name = f"first touches, {short_labels(runs.comparison)[side]}"
        key = tag("i", class_=f"mark key-of {look}")
        lanes += [_lane(name, marks, "touches", " ", key)] if marks else []
    beyond = [(chart.title, spans) for chart in runs.charts if (spans := _beyond(chart, until))]
    beyond.sort(key=lambda quantity: quantity[1][0][0])
    lanes += [
        _lane(name, [bar("beyond", *span) for span in spans], "quantity") for name, spans in beyond
    ]
    within = len(runs.charts) - len(beyond)
    said = f"Bars: beyond tolerance. Charts without a bar: {within} of {len(runs.charts)}."
    *ticks, last = np.linspace(0.0, until, _TICKS).tolist()
    times = [tag("span", f"{t:.3g}", style=f"left:{100 * t / until:.2f}%") for t in ticks]
    times.append(tag("span", f"{last:.3g}", tag("small", "s"), style="left:100%"))
    lanes.append(_lane("", [tag("div", *times, class_="times", aria_hidden="true")], "axis"))
    spoken = "; ".join(
        f"{name} from {short_time(spans[0][0])}, {sum(b - a for a, b in spans):.3g} s in all"
        for name, spans in beyond
    )
    unseen = tag("p", f"Beyond tolerance: {spoken}.", class_="unseen") if spoken else ""
    return joined((*lanes, tag("p", said, class_="hint"), unseen))


def _lane(name: str, content: Sequence[Html], look: str, *key: object) -> Html:
    cursor = tag("i", class_="cursor") if look != "axis" else None
    return tag(
        "div",
        tag("span", name, *key, class_="lane-name", title=name),
        tag("div", *content, cursor, class_="track"),
        class_=f"lane {look}",
    )


def _beyond(chart: QuantityChart, until: float) -> list[list[float]]:
    """When a quantity is beyond its tolerance, from and to [s]; tiny gaps are closed."""
    time = chart.curve.time
    beyond = chart.curve.difference > chart.agreement.tolerance
    seen: list[list[float]] = []
    for start, end in spans(beyond, time, float(time[-1]) / max(1, len(time) - 1), float(time[-1])):
        if seen and start - seen[-1][1] < _SEEN * until:
            seen[-1][1] = end
        else:
            seen.append([start, end])
    return seen


def _quantity_data(chart: QuantityChart, rows: Ints) -> dict[str, Any]:
    """What the script shows of a quantity at each moment shown: figures that were compared."""
    curve = chart.curve
    scale, unit = reading(curve.unit)
    data: dict[str, Any] = {
        "name": chart.title,
        "unit": unit.replace(" ", "\u00a0"),
        "tolerance": chart.agreement.tolerance * scale,
        "apart": packed(curve.difference[rows] * scale, "f4"),
    }
    if curve.left.ndim == 1 and curve.left.size:
        data["one"] = packed(curve.left[rows] * scale, "f4")
        data["two"] = packed(curve.right[rows] * scale, "f4")
    return data
