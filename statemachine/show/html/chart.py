"""Curves over time as SVG within a page, with a cursor that follows its slider."""

from __future__ import annotations

import re

from ...errors import MissingEngineError
from ..charts import INK, SIDES, chart
from ..pictures import Traces
from .markup import Html, tag

_SIZE = (4.0, 1.3)  # inches
_BOX = (0.12, 0.18, 0.85, 0.75)  # of its axes: left, bottom, width, height
_COLOURS = {
    INK: "var(--ink)",
    SIDES[0]["color"]: "var(--one)",
    SIDES[1]["color"]: "var(--two)",
    "#f0f0f0": "var(--shade)",
}


def chart_figure(picture: Traces, caption: str, said: str) -> Html:
    """Return a chart with the cursor of time over its axes; without matplotlib, a line says so."""
    try:
        text = chart(picture, _SIZE, _BOX)
    except MissingEngineError as error:
        return tag("p", f"No chart: {error}.", class_="foot")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' id="[a-z]+[\d_]+"', "", text)
    text = re.sub(r"(\d\.\d)\d{3,}", r"\1", text)  # tenths of a point are seen, no more
    for colour, name in _COLOURS.items():
        text = text.replace(colour, name)
    left, bottom, width, height = (100 * share for share in _BOX)
    place = f"left:{left:g}%;width:{width:g}%;bottom:{bottom:g}%;height:{height:g}%"
    area = tag("div", tag("i", class_="cursor"), class_="area", style=place)
    return tag(
        "figure",
        tag("figcaption", caption),
        tag("div", Html(text), area, class_="plot", role="img", aria_label=said),
    )
