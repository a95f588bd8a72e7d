"""A page of two runs as one HTML file: a stage with a slider, and the charts that follow it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....interface import Array, Ints
from ....measures.text import display_unit, figure, on_label, short_time, significant
from ....show import html
from ....show.blocks import Interactive, Items, Page, Section
from ....show.html.geometry import packed
from ....show.html.markup import Html, data_of, filled, joined, tag, text_of
from ....show.text_blocks import non_breaking
from ..compared_names import long_labels, short_labels, traces_of
from .both_runs import BothRuns
from .lanes import lanes_of
from .quantity_chart import QuantityChart
from .quantity_row import quantity_row
from .scene import Look, Scene, moments_of, scene_of

_SCRIPTS = ("show/html/gl.js", "lab/questions/stage/scene.js", "lab/questions/stage/stage.js")
_NO_LOOK = "no model was given"
_TOOL = "gripperframe (tool frame)"
ARROWS = (
    "Arrows: contact forces, each as long as the root of its force; the longest of the run is "
    "{force} N."
)


def report(page: Page, looks: Sequence[Look] = (_NO_LOOK, _NO_LOOK)) -> str:
    """Return a page as HTML.

    Args:
        page: What is said. Without `BothRuns` among its blocks it has no slider and no script.
        looks: What each of both runs is drawn as; the same object twice if both are of one model.
    """
    runs = next((block for block in page.blocks if isinstance(block, BothRuns)), None)
    if runs is None:
        return html.report(page, html.Interaction(lambda block: _drawn(block, Html(""))))
    stage = staged(runs, looks)
    if stage.notes:
        notes = Section("picture", "Of the picture", [Items(stage.notes)])
        page = replace(page, blocks=[*page.blocks, notes])
    interaction = html.Interaction(
        draw=lambda block: _drawn(block, stage.markup),
        above=_name_of(runs),
        data=data_of(stage.data),
        script="\n".join(text_of(name) for name in _SCRIPTS),
    )
    return html.report(page, interaction)


def _drawn(block: Interactive, stage: Html) -> Html:
    """Return a chart of a quantity as a row, and both runs as the stage."""
    return quantity_row(block) if isinstance(block, QuantityChart) else stage


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


@dataclass(frozen=True)
class Stage:
    """Both runs, drawn.

    Attributes:
        markup: The scene, the slider and the lanes under it.
        data: What the script reads.
        notes: What a reader should know of the picture, in sentences.
    """

    markup: Html
    data: dict[str, Any]
    notes: Sequence[str]


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
    return Stage(filled("lab/questions/stage/stage.html", slots), data, scene.notes)


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
    no_contacts = Html("" if runs.comparison.touches else " hidden")
    if scene.strongest:
        arrows = non_breaking(ARROWS.format(force=figure(scene.strongest)))
    if scene.data is None:
        still = joined(tag("p", note) for note in scene.notes)
    share = now / until if until else 0.0
    on_left = non_breaking(f"{significant(until)} s {on_label(left)}")
    on_right = on_label(right)
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
        "no_contacts": no_contacts,
        "last": len(times) - 1,
        "start": start,
        "share": f"{share:.6f}",
        "still": still,
        "lanes": lanes_of(runs),
    }


def _quantity_data(chart: QuantityChart, rows: Ints) -> dict[str, Any]:
    """Return what the script shows of a quantity at each moment: figures that were compared."""
    curve = chart.curve
    scale, unit = display_unit(curve.unit)
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
