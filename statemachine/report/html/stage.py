"""The scene with its slider, and under it when each quantity is beyond its tolerance."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...interface import Ints
from ...measures.text import figure, on, reading, short_time
from ..finding import long_labels, short_labels
from ..over_time import BothRuns, QuantityChart, spans
from .geometry import packed
from .markup import Html, escaped, filled, joined, non_breaking, tag
from .scene import Scene, SideDrawing, scene_of
from .timeline import Frames, frames_of

_TICKS = 6  # of the axis of time
ARROWS = (
    "Arrows: contact forces, each as long as the root of its force; the longest of the run is "
    "{force} N."
)


@dataclass(frozen=True, eq=False)
class StagePart:
    """What a page shows of both runs.

    Attributes:
        html: The scene, the slider and the lanes under it.
        data: For the script.
        notes: What a reader should know of the picture, in sentences.
    """

    html: Html
    data: dict[str, Any]
    notes: tuple[str, ...]


def staged(runs: BothRuns, looks: Sequence[SideDrawing]) -> StagePart:
    """Both runs, drawn.

    Args:
        runs: The runs.
        looks: What each is drawn as.
    """
    # Of these moments the page tells: they must be among those that can be shown.
    agreements = runs.comparison.agreements
    moments = {t for each in agreements for t in (each.at, each.since) if t is not None}
    frames = frames_of(runs.one, runs.two, tuple(sorted(moments)))
    start = int(np.argmin(np.abs(frames.time - runs.start)))
    scene = scene_of(runs.one, runs.two, frames, looks, runs.site, start)
    compared = runs.charts[0].curve.time if runs.charts else frames.time
    rows = np.clip(np.searchsorted(compared, frames.time + 1e-9, side="right") - 1, 0, None)
    data = {
        "time": packed(frames.time, "f8"),
        "compared": packed(compared[rows], "f8"),
        "until": runs.comparison.until,
        "start": start,
        "quantities": [_quantity_data(chart, rows) for chart in runs.charts],
        "lead": list(runs.lead),
        "scene": scene.data,
    }
    return StagePart(_stage(runs, frames, start, scene), data, scene.notes)


def _stage(runs: BothRuns, frames: Frames, start: int, scene: Scene) -> Html:
    """The scene, what the figures are at its moment, the slider and the lanes under it."""
    now, until = float(frames.time[start]), runs.comparison.until
    (one, two), short = long_labels(runs.comparison), short_labels(runs.comparison)
    names = {"one": one, "two": two, "tip": tip_name(runs.site)}
    names |= {"short_one": short[0], "short_two": short[1], "now": short_time(now)}
    slots = {name: escaped(text) for name, text in names.items()}
    slots |= {
        "on_one": escaped(non_breaking(f"{until:g} s {on(one)}")),
        "on_two": escaped(on(two)),
        "arrows": escaped(non_breaking(ARROWS.format(force=figure(scene.strongest))))
        if scene.strongest
        else Html(""),
        "last": escaped(len(frames) - 1),
        "start": escaped(start),
        "share": escaped(f"{now / until if until else 0.0:.6f}"),
        "still": joined(tag("p", note) for note in scene.notes) if scene.data is None else Html(""),
        "lanes": _lanes(runs),
    }
    return filled("stage.html", slots)


def tip_name(tip: str) -> str:
    """The site that is followed, as it is called in the model."""
    return "gripperframe (tool frame)" if tip == "gripperframe" else tip or "a site"


def _lanes(runs: BothRuns) -> Html:
    """For each quantity when it is beyond its tolerance, under the slider and as wide."""
    until = runs.comparison.until or 1.0
    rows = []
    for side, look in enumerate(("one", "two")):
        marks = [
            tag("i", class_=f"mark {look}", title=event.text,
                style=f"left:{100 * event.time / until:.2f}%")
            for event in runs.events
            if event.kind == "touch" and event.side == side
        ]  # fmt: skip
        if marks:
            key = tag("i", class_=f"mark key-of {look}")
            name = joined(("first touches, ", short_labels(runs.comparison)[side], " ", key))
            rows.append(_lane(name, joined(marks), "touches"))
    beyond = [(chart.title, _beyond(chart)) for chart in runs.charts]
    beyond = sorted(((name, s) for name, s in beyond if s), key=lambda pair: pair[1][0][0])
    for name, times in beyond:
        bars = [
            tag(
                "i",
                class_="beyond",
                style=f"left:{100 * a / until:.2f}%;width:{100 * max(b - a, 0.0) / until:.2f}%",
            )
            for a, b in times
        ]
        rows.append(_lane(name, joined(bars), "quantity"))
    within = len(runs.charts) - len(beyond)
    said = f"Bars: beyond tolerance. Quantities that never are: {within} of {len(runs.charts)}."
    ticks = np.linspace(0.0, until, _TICKS)
    times = [
        tag("span", f"{tick:.3g}", style=f"left:{100 * tick / until:.2f}%") for tick in ticks[:-1]
    ]
    last = tag("span", f"{until:.3g}", tag("small", "s"), style="left:100%")
    axis = tag("div", *times, last, class_="times", aria_hidden="true")
    rows.append(_lane("", axis, "axis"))
    spoken = "; ".join(
        f"{name} from {short_time(times[0][0])}, {sum(b - a for a, b in times):.3g} s in all"
        for name, times in beyond
    )
    return joined(
        (
            *rows,
            tag("p", said, class_="hint"),
            tag("p", f"Beyond tolerance: {spoken}.", class_="unseen") if spoken else "",
        )
    )


def _lane(name: str, content: Html, look: str) -> Html:
    return tag(
        "div",
        tag("span", name, class_="lane-name", title=re.sub(r"<[^>]*>", "", name)),
        tag("div", content, tag("i", class_="cursor") if look != "axis" else None, class_="track"),
        class_=f"lane {look}",
    )


def _beyond(chart: QuantityChart) -> list[list[float]]:
    """From when to when a quantity is beyond its tolerance [s]."""
    time = chart.curve.time
    beyond = chart.curve.difference > chart.found.tolerance
    until = float(time[-1])
    return _few(spans(beyond, time, until / max(1, len(time) - 1), until))


def _quantity_data(chart: QuantityChart, rows: Ints) -> dict[str, Any]:
    """What the script shows of a quantity at each moment shown: figures that were compared."""
    curve = chart.curve
    scale, unit = reading(curve.unit)
    data: dict[str, Any] = {
        "name": chart.title,
        "unit": unit.replace(" ", "\u00a0"),
        "tolerance": chart.found.tolerance * scale,
        "apart": packed(curve.difference[rows] * scale, "f4"),
    }
    if curve.one.ndim == 1 and curve.one.size:
        data["one"] = packed(curve.one[rows] * scale, "f4")
        data["two"] = packed(curve.two[rows] * scale, "f4")
    return data


def _few(spans: list[list[float]], most: int = 200) -> list[list[float]]:
    """Spans, the shortest gaps between them closed until they are few."""
    while len(spans) > most:
        gaps = [b[0] - a[1] for a, b in itertools.pairwise(spans)]
        cut = sorted(gaps)[len(gaps) // 2]
        merged = [spans[0]]
        for before, span in zip(gaps, spans[1:], strict=True):
            if before <= cut:
                merged[-1][1] = span[1]
            else:
                merged.append(span)
        spans = merged
    return spans
