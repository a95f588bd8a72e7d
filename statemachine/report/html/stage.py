"""The scene with its slider, and under it when each quantity is beyond its tolerance."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...compare import Series
from ...measures.text import figure, on, reading, short_time
from ..over_time import BothRuns, QuantityChart
from .between import own_series, shown_series, shown_traces
from .budget import Budget
from .charts import time_axis
from .geometry import packed
from .markup import Html, joined, kept, tag
from .scene import SideDrawing, scene_of
from .sketch import sketch
from .timeline import Frames, frames_of


@dataclass(frozen=True, eq=False)
class StagePart:
    """What a page shows of both runs.

    Attributes:
        of: What it is made of.
        html: The scene, the slider and the lanes under it.
        data: For the script.
        own: Each side's curves at its own rows, by name.
        notes: What a reader should know of the picture, in sentences.
    """

    of: BothRuns
    html: Html
    data: dict[str, Any]
    own: Mapping[str, tuple[Series, Series]]
    notes: tuple[str, ...]

    @property
    def charts(self) -> int:
        """How many charts follow the slider."""
        return len(self.of.charts)


def staged(runs: BothRuns, looks: Sequence[SideDrawing], budget: Budget) -> StagePart:
    """Both runs, drawn.

    Args:
        runs: The runs.
        looks: What each is drawn as.
        budget: How much detail there may be.
    """
    one, two, tip = runs.one, runs.two, runs.site
    frames = frames_of(one, two, runs.moments, budget.frames(one, two))
    start = int(np.argmin(np.abs(frames.time - runs.start)))
    shown = shown_traces(one, two, frames)
    scene = scene_of(one, two, shown, frames, looks, tip, budget, start)
    at_frames = shown_series(shown, tip, [chart.curve for chart in runs.charts])
    data = {
        "time": packed(frames.time, "f8"),
        "between": packed(frames.share > 0, "u1"),
        "other": runs.labels[1],
        "until": runs.until,
        "start": start,
        "quantities": [
            _quantity_data(curve, chart)
            for curve, chart in zip(at_frames, runs.charts, strict=True)
        ],
        "lead": list(runs.lead),
        "scene": scene.data,
    }
    still = sketch(scene, one, two, frames, start, runs.labels)
    html = _stage(runs, frames, start, still, scene.strongest)
    return StagePart(runs, html, data, own_series(one, two, tip), scene.notes)


def _stage(runs: BothRuns, frames: Frames, start: int, still: Html, strongest: float) -> Html:
    """The scene, what the figures are at its moment, the slider and the lanes under it.

    Args:
        runs: The runs.
        frames: What the slider goes over.
        start: The moment to open at, among the frames.
        still: The drawing that needs no script.
        strongest: The largest force of an arrow [N]; 0 if there are no contacts.
    """
    labels, tip = runs.labels, runs.site
    now = float(frames.time[start])
    toggles = [
        ("solid", f"{labels[0]}, solid", "one"),
        ("ghost", f"{labels[1]}, ghost", "two"),
        ("marks", "contacts, with their forces", ""),
        ("trails", f"way of {tip_name(tip)}", ""),
    ]
    checks = [
        tag(
            "label",
            tag("input", type="checkbox", id=name, checked=True),
            tag("i", class_=f"key {look}") if look else None,
            f" {label}",
        )
        for name, label, look in toggles
    ]
    buttons = [
        ("all", "Whole", "Whole arm"),
        ("near", "Close", f"Close to {tip_name(tip)}"),
        ("in", "+", "Nearer"),
        ("out", "−", "Farther"),
    ]
    canvas = tag(
        "div",
        tag("canvas", id="scene", tabindex="0", role="img", hidden=True,
            aria_label="Both runs in three dimensions. Arrow keys turn the view, plus and minus "
                       "move nearer and farther, 0 shows the whole again."),
        tag("div", still, id="still"),
        tag("div", *(tag("button", text, type="button", id=f"view-{name}", aria_label=label,
                         title=label)
                     for name, text, label in buttons), class_="views", hidden=True, id="views"),
        tag("p", id="no-scene", class_="no-scene", hidden=True),
        class_="canvas",
    )  # fmt: skip
    transport = tag(
        "div",
        tag("button", "Play", id="play", type="button", hidden=True),
        tag("output", short_time(now), id="clock", for_="slider"),
        tag(
            "label",
            "speed ",
            tag(
                "select",
                *(tag("option", text, value=value, selected=value == "0.25")
                  for value, text in (("1", "1×"), ("0.25", "¼×"), ("0.05", "1/20×"))),
                id="speed",
            ),
            class_="speed",
            hidden=True,
            id="speeds",
        ),
        class_="transport",
    )  # fmt: skip
    looks = tag(
        "div",
        tag("div", *checks, class_="checks", id="checks", hidden=True),
        tag(
            "p",
            kept(
                "Arrows: contact forces, each as long as the root of its force; the longest of "
                f"the run is {figure(strongest)} N."
            )
            if strongest
            else "",
            class_="foot",
            id="arrows",
            hidden=True,
        ),
        class_="looks",
    )
    slider = tag(
        "input",
        type="range",
        id="slider",
        min=0,
        max=max(0, len(frames) - 1),
        step=1,
        value=start,
        aria_label="Moment of the run",
        aria_valuetext=short_time(now),
        hidden=True,
    )
    share = now / runs.until if runs.until else 0.0
    return tag(
        "section",
        tag("h2", "Both runs, moment by moment", id="stage-heading"),
        tag("p", kept(f"{runs.until:g} s {on(labels[0])}, as a solid arm, and {on(labels[1])}, "
                      "as a ghost over it."), class_="says"),
        tag("div", tag("div", canvas, transport, looks, class_="left"), _readout(runs),
            class_="pair"),
        tag("div", _lanes(runs, slider), class_="lanes"),
        id="stage",
        aria_labelledby="stage-heading",
        style=f"--start:{share:.6f}",
    )  # fmt: skip


def tip_name(tip: str) -> str:
    """The site that is followed, as it is called in the model."""
    return "gripperframe (tool frame)" if tip == "gripperframe" else tip or "a site"


def _readout(runs: BothRuns) -> Html:
    """The table that the script keeps at the cursor's moment."""
    return tag(
        "div",
        tag(
            "table",
            tag("caption", "At ", tag("span", "…", id="now"), class_="now"),
            tag("thead", tag("tr", tag("th", "quantity", scope="col", class_="word"),
                             tag("th", tag("i", class_="key one"), runs.short[0],
                                 scope="col"),
                             tag("th", tag("i", class_="key two"), runs.short[1],
                                 scope="col"),
                             tag("th", "apart", scope="col"))),
            tag("tbody", id="readout"),
        ),
        class_="readout",
        id="readout-box",
        hidden=True,
    )  # fmt: skip


def _lanes(runs: BothRuns, slider: Html) -> Html:
    """For each quantity when it is beyond its tolerance, under the slider and as wide."""
    until = runs.until or 1.0
    rows = [_lane("time", slider, "slide")]
    for side, look in enumerate(("one", "two")):
        marks = [
            tag("i", class_=f"mark {look}", title=event.text,
                style=f"left:{100 * event.time / until:.2f}%")
            for event in runs.events
            if event.kind == "touch" and event.side == side
        ]  # fmt: skip
        if marks:
            key = tag("i", class_=f"mark key-of {look}")
            name = joined(("first touches, ", runs.short[side], " ", key))
            rows.append(_lane(name, joined(marks), "touches"))
    beyond = [(chart.title, _beyond(chart)) for chart in runs.charts]
    beyond = sorted(((name, s) for name, s in beyond if s), key=lambda pair: pair[1][0][0])
    for name, spans in beyond:
        bars = [
            tag(
                "i",
                class_="beyond",
                style=f"left:{100 * a / until:.2f}%;width:{100 * max(b - a, 0.0) / until:.2f}%",
            )
            for a, b in spans
        ]
        rows.append(_lane(name, joined(bars), "quantity"))
    within = len(runs.charts) - len(beyond)
    said = "Bars: beyond tolerance." if beyond else "No quantity leaves its tolerance."
    if beyond and within:
        said += f" {within} more never {'are' if within > 1 else 'is'}."
    rows.append(_lane("", time_axis(until), "axis"))
    spoken = "; ".join(
        f"{name} from {short_time(spans[0][0])}, {sum(b - a for a, b in spans):.3g} s in all"
        for name, spans in beyond
    )
    return joined(
        (
            tag("div", *rows, class_="rows"),
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
    edges = np.flatnonzero(np.diff(np.concatenate([[False], beyond, [False]]).astype(int)))
    until = float(time[-1])
    step = until / max(1, len(time) - 1)
    spans = [
        [float(time[a]), float(min(time[b - 1] + step, until))]
        for a, b in edges.reshape(-1, 2).tolist()
    ]
    return _few(spans)


def _quantity_data(curve: Series, chart: QuantityChart) -> dict[str, Any]:
    """What the script shows of a quantity at each moment shown, and when it is beyond."""
    scale, unit = reading(curve.unit)
    data: dict[str, Any] = {
        "name": chart.title,
        "unit": unit.replace(" ", "\u00a0"),
        "tolerance": chart.found.tolerance * scale,
        "apart": packed(curve.difference * scale, "f4"),
    }
    if curve.one.ndim == 1 and curve.one.size:
        data["one"] = packed(curve.one * scale, "f4")
        data["two"] = packed(curve.two * scale, "f4")
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
