"""The scene with its slider, and under it when each quantity is beyond its tolerance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...interface import Ints
from ...measures.text import figure, on, reading, short_time
from ..finding import long_labels, short_labels, traces_of
from ..over_time import BothRuns, QuantityChart, spans
from ..terminal import non_breaking
from .geometry import packed
from .markup import Html, filled, joined, tag
from .scene import Look, moments_of, scene_of

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
    now, (one, two) = float(times[start]), long_labels(runs.comparison)
    short_one, short_two = short_labels(runs.comparison)
    slots = {
        "one": one,
        "two": two,
        "short_one": short_one,
        "short_two": short_two,
        "on_one": non_breaking(f"{until:g} s {on(one)}"),
        "on_two": on(two),
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
    said = f"Bars: beyond tolerance. Quantities that never are: {within} of {len(runs.charts)}."
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
    if curve.one.ndim == 1 and curve.one.size:
        data["one"] = packed(curve.one[rows] * scale, "f4")
        data["two"] = packed(curve.two[rows] * scale, "f4")
    return data
