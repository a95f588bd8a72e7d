"""Lanes under the slider: when bodies first touch, and when a quantity is beyond its tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ....measures.text import short_time
from ....show.html.markup import Html, joined, tag
from ..compared_names import short_labels
from .both_runs import BothRuns
from .quantity_chart import QuantityChart, spans

_TICKS = 6  # intervals of the axis of time, at most
_WHOLE = 1 - 1e-9  # of a number of steps: a hair less than a whole number is one
_SEEN = 1 / 400  # of the axis: a narrower gap between two bars is not seen


def lanes_of(runs: BothRuns) -> Html:
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
    *ticks, last = round_times(until)
    times = [tag("span", f"{time:.3g}", style=_left(time, until)) for time in ticks]
    times.append(tag("span", f"{last:.3g}", tag("small", "s"), style=_left(last, until)))
    return _lane("", [tag("div", *times, class_="times", aria_hidden="true")], "axis")


def round_times(until: float) -> list[float]:
    """Return round moments from 0 to a time [s], 1, 2 or 5 times a power of ten apart."""
    smallest = until / _TICKS
    power = 10.0 ** math.floor(math.log10(smallest))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= smallest * _WHOLE)
    return [step * number for number in range(math.floor(until / step / _WHOLE) + 1)]


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
    """Return when a quantity is beyond its tolerance, from and to [s]; tiny gaps are closed."""
    time = chart.curve.time
    beyond = chart.curve.difference > chart.agreement.tolerance
    seen: list[list[float]] = []
    for start, end in spans(beyond, time, float(time[-1]) / max(1, len(time) - 1), float(time[-1])):
        if seen and start - seen[-1][1] < _SEEN * until:
            seen[-1][1] = end
        else:
            seen.append([start, end])
    return seen
