"""A page as one HTML file that asks for nothing but itself, and its scene with a slider."""

from __future__ import annotations

import base64
import hashlib
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...atomic_files import check_place, replace_text
from ...errors import BadInputError
from ...interface import Array, Ints
from ...lab.questions.compared_names import long_labels, short_labels, traces_of
from ...lab.questions.over_time import BothRuns, QuantityChart, spans
from ...measures.text import figure, on, reading, short_time
from ..blocks import Block, Interactive, Items, Page, Section, Text
from ..terminal import non_breaking
from .blocks import Html, data_of, drawn, filled, headline_as_html, joined, tag, template
from .geometry import packed
from .scene import Look, Scene, moments_of, scene_of

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
    stage = _NO_STAGE if runs is None else staged(runs, looks)
    opening = list(itertools.takewhile(_is_above_sections, page.blocks))
    rest: list[Block] = [*page.blocks[len(opening) :]]
    if stage.notes:
        rest.append(Section("picture", "Of the picture", [Items(stage.notes)]))
    main = tag("main", _header(page, opening, stage.markup, runs), drawn(rest, stage.markup))
    footer = tag(
        "footer",
        tag("p", non_breaking(page.origin)),
        tag("p", f"statemachine {__version__}; this file asks for nothing but itself."),
    )
    # Without data for a script there is none.
    script, data = "", {}
    if stage.data is not None:
        parts = "\n".join(template(name) for name in _SCRIPTS)
        script, data = f"(() => {{\n'use strict';\n{parts}\n}})();", stage.data
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
        "data": data_of(data),
        "script": Html(script),
    }
    return filled("page.html", slots)


def _is_above_sections(block: Block) -> bool:
    """Tell whether a block may stand in the header: it is no part that links lead to."""
    if isinstance(block, Section):
        return not block.name
    return not isinstance(block, Interactive)


def _header(page: Page, opening: Sequence[Block], stage: Html, runs: BothRuns | None) -> Html:
    """Return the top of a page: what was run, the answer, and what stands above all sections."""
    name = [tag("span", page.title, class_="experiment")] if runs is None else _name_of(runs)
    headline = tag("h1", page.title, id="finding")
    if page.headline is not None:
        headline = headline_as_html(page.headline)
    parts = [tag("p", *name, class_="kicker"), headline]
    if opening and isinstance(opening[0], Text):
        parts.append(tag("p", non_breaking(opening[0].text), class_="says"))
        opening = opening[1:]
    return tag("header", *parts, tag("div", drawn(opening, stage), class_="words"))


def _name_of(runs: BothRuns) -> list[Html]:
    """Return what was run, who against whom, and the button of the theme."""
    left, right = long_labels(runs.comparison)
    return [
        tag("span", runs.title, class_="experiment"),
        _side("one", left),
        tag("span", "against", class_="against"),
        _side("two", right),
        tag("button", "Dark", id="theme", type="button", hidden=True, aria_label="Dark colours"),
    ]


def _side(look: str, label: str) -> Html:
    """Return the name of a side, with the colour that it is drawn in."""
    return tag("span", tag("i", class_=f"key {look}"), label, class_="side")


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


@dataclass(frozen=True)
class Stage:
    """Both runs, drawn.

    Attributes:
        markup: The scene, the slider and the lanes under it.
        data: What the script reads; None where there is no script.
        notes: What a reader should know of the picture, in sentences.
    """

    markup: Html
    data: dict[str, Any] | None = None
    notes: Sequence[str] = ()


_NO_STAGE = Stage(Html(""))


def staged(runs: BothRuns, looks: Sequence[Look]) -> Stage:
    """Draw both runs.

    Args:
        runs: The runs.
        looks: What each is drawn as.
    """
    until = runs.comparison.until
    # Of these moments the page tells: they must be among those that can be shown.
    agreements = runs.comparison.agreements
    moments = {agreement.at for agreement in agreements}
    moments |= {agreement.since for agreement in agreements if agreement.since is not None}
    times, left_out = moments_of(*traces_of(runs.comparison), sorted(moments))
    start = int(np.argmin(np.abs(times - runs.start)))
    scene = scene_of(runs, looks, times, left_out, start)
    compared = runs.charts[0].curve.time if runs.charts else times
    rows = np.clip(np.searchsorted(compared, times + 1e-9, side="right") - 1, 0, None)
    data = {
        "time": packed(times, "f8"),
        "compared": packed(compared[rows], "f8"),
        "until": until,
        "start": start,
        "quantities": [_quantity_data(chart, rows) for chart in runs.charts],
        "lead": list(runs.lead),
        "scene": scene.data,
    }
    slots = _stage_slots(runs, scene, times, start)
    return Stage(filled("stage.html", slots), data, scene.notes)


def _stage_slots(runs: BothRuns, scene: Scene, times: Array, start: int) -> dict[str, object]:
    """Return the slots of the template of the stage.

    Args:
        runs: The runs.
        scene: What is drawn of them.
        times: (n,) the moments that are shown [s].
        start: The moment that the page opens at, among them.
    """
    until, site = runs.comparison.until, runs.comparison.tip
    now, (left, right) = float(times[start]), long_labels(runs.comparison)
    short_left, short_right = short_labels(runs.comparison)
    tip, arrows, still = site, "", Html("")
    if site == "gripperframe":
        tip = _TOOL
    elif not site:
        tip = "a site"
    if scene.strongest:
        arrows = non_breaking(ARROWS.format(force=figure(scene.strongest)))
    if scene.data is None:
        still = joined(tag("p", note) for note in scene.notes)
    share = now / until if until else 0.0
    on_left = non_breaking(f"{until:g} s {on(left)}")
    on_right = on(right)
    spoken_time = short_time(now)
    return {
        "left": left,
        "right": right,
        "short_left": short_left,
        "short_right": short_right,
        "on_left": on_left,
        "on_right": on_right,
        "tip": tip,
        "now": spoken_time,
        "arrows": arrows,
        "last": len(times) - 1,
        "start": start,
        "share": f"{share:.6f}",
        "still": still,
        "lanes": _lanes(runs),
    }


def _lanes(runs: BothRuns) -> Html:
    """Return for each quantity when it is beyond its tolerance, under the slider and as wide."""
    until = runs.comparison.until if runs.comparison.until else 1.0
    lanes = _touch_lanes(runs, until)
    beyond: list[tuple[str, list[list[float]]]] = []
    for chart in runs.charts:
        of_chart = _beyond(chart, until)
        if of_chart:
            beyond.append((chart.title, of_chart))
    beyond.sort(key=lambda quantity: quantity[1][0][0])
    for name, of_chart in beyond:
        bars = [_bar(start, end, until) for start, end in of_chart]
        lanes.append(_lane(name, bars, "quantity"))
    lanes.append(_time_axis(until))
    within = len(runs.charts) - len(beyond)
    said = f"Bars: beyond tolerance. Charts without a bar: {within} of {len(runs.charts)}."
    lanes.append(tag("p", said, class_="hint"))
    if beyond:
        spoken = "; ".join(_spoken(name, of_chart) for name, of_chart in beyond)
        lanes.append(tag("p", f"Beyond tolerance: {spoken}.", class_="unseen"))
    return joined(lanes)


def _touch_lanes(runs: BothRuns, until: float) -> list[Html]:
    """Return a lane with the first touches of each side that has some."""
    lanes = []
    labels = short_labels(runs.comparison)
    for side, look in enumerate(("one", "two")):
        marks = [
            tag("i", class_=f"mark {look}", style=_left(event.time, until), title=event.text)
            for event in runs.events
            if event.kind == "touch" and event.side == side
        ]
        if marks:
            key = tag("i", class_=f"mark key-of {look}")
            lanes.append(_lane(f"first touches, {labels[side]}", marks, "touches", " ", key))
    return lanes


def _bar(start: float, end: float, until: float) -> Html:
    """Return a bar from a time to another [s]."""
    width = 100 * max(end - start, 0.0) / until
    return tag("i", class_="beyond", style=f"{_left(start, until)};width:{width:.2f}%")


def _left(time: float, until: float) -> str:
    """Return the style of what stands at a time [s] of a lane."""
    return f"left:{100 * time / until:.2f}%"


def _time_axis(until: float) -> Html:
    """Return the axis of time under the lanes."""
    *ticks, last = np.linspace(0.0, until, _TICKS).tolist()
    times = [tag("span", f"{time:.3g}", style=_left(time, until)) for time in ticks]
    times.append(tag("span", f"{last:.3g}", tag("small", "s"), style="left:100%"))
    return _lane("", [tag("div", *times, class_="times", aria_hidden="true")], "axis")


def _spoken(name: str, of_quantity: Sequence[Sequence[float]]) -> str:
    """Say when a quantity is beyond its tolerance."""
    total = sum(end - start for start, end in of_quantity)
    return f"{name} from {short_time(of_quantity[0][0])}, {total:.3g} s in all"


def _lane(name: str, content: Sequence[Html], look: str, *key: object) -> Html:
    """Return a row under the slider, with the cursor of time unless it is the axis."""
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
