"""The pictures of what a sweep says: the gap as a map, shares of its variance, a fit."""

from __future__ import annotations

from collections.abc import Sequence

from ..measures.text import listed, reading, rounded
from ..page import Bars, Figures, HeatMap, Traces


def pictures(sweep: Figures) -> list[HeatMap | Bars | Traces]:
    """The pictures of the page, in its order."""
    chosen = [map_picture(sweep), bars(sweep), *(fit_curve(sweep, t) for t in sweep.together)]
    return [picture for picture in chosen if picture is not None]


def map_picture(sweep: Figures) -> HeatMap | Traces | None:
    chart, main = sweep.map, sweep.quantity
    if chart is None:
        return None
    scale, unit = reading(main.unit)
    title = f"Gap of the {main.says} between {listed(list(sweep.sides))}"
    numbers = [value for value in chart.columns if not isinstance(value, (bool, str))]
    if not chart.up and len(numbers) == len(chart.columns) > 1:
        return _curve(sweep, chart, title)
    framed = [[v is not None and v <= main.tolerance for v in row] for row in chart.gap]
    title += f"; median over {listed(chart.others)}" if chart.others else ""
    if any(map(any, framed)):
        title += f"; framed: within {rounded(main.tolerance, main.unit, 2)}"
    if any(map(any, chart.inside)):
        title += "; hatched: inside the chaos floor"
    return HeatMap(
        title,
        axis(sweep, chart.across),
        axis(sweep, chart.up),
        [setting_word(sweep, chart.across, value) for value in chart.columns],
        [setting_word(sweep, chart.up, value) for value in chart.rows] or [""],
        [[None if v is None else v * scale for v in row] for row in chart.gap],
        f"gap [{unit.strip()}]",
        chart.inside,
        framed,
    )


def _curve(sweep: Figures, chart: Figures, title: str) -> Traces:
    """The gap over one parameter."""
    main, (scale, unit) = sweep.quantity, reading(sweep.quantity.unit)
    place = sweep.parameters.index(chart.across)
    known = [setting for setting in sweep.settings if setting.median is not None]
    known.sort(key=lambda setting: setting.values[place])
    x = [float(setting.values[place]) for setting in known]
    figures = {"median of the seeds": [setting.median for setting in known]}
    if sweep.seeds > 1:
        figures["worst seed"] = [setting.worst for setting in known]
    if sweep.floor is not None:
        figures["chaos floor"] = [setting.floor for setting in known]
    if chart.sampled or not known:
        pairs = [pair for pair in zip(chart.columns, chart.gap[0], strict=True) if None not in pair]
        x, figures = [float(value) for value, _ in pairs], {"median": [gap for _, gap in pairs]}
    curves: dict[str, tuple[Sequence[float], Sequence[float]]] = {
        name: (x, [scale * (gap or 0.0) for gap in gaps]) for name, gaps in figures.items()
    }
    curves["tolerance"] = ([x[0], x[-1]], [main.tolerance * scale] * 2)
    return Traces(title, axis(sweep, chart.across), f"gap [{unit.strip()}]", curves)


def bars(sweep: Figures) -> Bars | None:
    shares = sweep.sensitivity
    if shares is None or shares.method == "rank" or len(shares.indices) == 1:
        return None
    return Bars(
        "What the gap is sensitive to",
        "share of the gap's variance",
        [index.label for index in shares.indices],
        {
            "first order": [(index.first, index.first_interval) for index in shares.indices],
            "total": [(index.total, index.total_interval) for index in shares.indices],
        },
    )


def fit_curve(sweep: Figures, parameter: Figures) -> Traces | None:
    """The predicted gap over a parameter, and what was measured."""
    if parameter.fit is None:
        return None
    scale, unit = reading(sweep.quantity.unit)
    x, y = parameter.fit._scan
    curves: dict[str, tuple[Sequence[float], Sequence[float]]] = {
        "predicted": (x, [value * scale for value in y]),
        "tolerance": ([x[0], x[-1]], [sweep.quantity.tolerance * scale] * 2),
    }
    if parameter.tried is not None:
        pairs = sorted(zip(*parameter.tried, strict=True))
        curves["run"] = ([v for v, _ in pairs], [gap * scale for _, gap in pairs])
    elif parameter.measured is not None:
        value, width = parameter.fit.value, 0.01 * (x[-1] - x[0])
        curves["run there"] = ([value - width, value + width], [parameter.measured * scale] * 2)
    side = sweep.sides[1] if parameter.varied == "right" else "both"
    return Traces(
        f"The gap over {parameter.label} in {side}",
        axis(sweep, parameter.label),
        f"gap [{unit.strip()}]",
        curves,
    )


def axis(sweep: Figures, label: str) -> str:
    """A parameter with what its values are in."""
    if label in sweep.scaled:
        return f"{label} [times the model's own]"
    return f"{label} [{unit}]" if (unit := sweep.units.get(label)) else label


def setting_word(sweep: Figures, label: str, value: object) -> str:
    """A value of a parameter: "0.5x", "on", "euler"."""
    if isinstance(value, bool):
        return "on" if value else "off"
    times = "x" if label in sweep.scaled else ""
    return f"{value:.4g}{times}" if isinstance(value, float) else str(value)
