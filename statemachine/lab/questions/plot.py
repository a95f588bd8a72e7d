"""A figure of traces for a paper or a slide, one column wide and readable without colour."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...atomic_files import replace_bytes
from ...interface import Array, JointType
from ...measures import ENCODER_COUNT, distances
from ...measures.text import display_unit, milliseconds, rounded
from ...show.charts import SETTINGS, SIDES, check_suffix, draw_picture, saved
from ...show.pictures import Traces
from ...show.templates import PageContent, render_texts
from ..compare import Comparison, default_tip
from ..compare.chaos import ChaosFloor
from ..recordings import Trace
from .compared_names import long_labels, traces_of
from .finding import parting
from .stage.quantity_chart import CHARTS_SHOWN, QuantityChart, charts_of, spans

FIGURE_SETTINGS = {
    **SETTINGS,
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 6.0,
    "axes.linewidth": 0.5,
    "axes.titlesize": 6.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 2.0,
    "xtick.major.size": 1.8,
    "xtick.major.width": 0.5,
    "xtick.major.pad": 1.2,
    "ytick.major.size": 1.8,
    "ytick.major.width": 0.5,
    "ytick.major.pad": 1.2,
}
_DOTS = 300  # a PNG has to an inch
_WIDTH, _MM = 80.0, 1 / 25.4  # of the figure [mm]; inches to a millimetre
_ROW, _TOUCH, _LINE = 17.0, 5.0, 3.0  # heights of a row of charts, of a touch, of text [mm]
_LETTERS, _TITLE = 82, 30  # of a line of notes; of a title over half of the width
_PAIRS_SHOWN = 8

COMMAND = "the command"


# Of each side: from when to when it lasts [s].
Spans = Sequence[Sequence[Sequence[float]]]


@dataclass(frozen=True)
class TracePlot:
    """A figure of one or two traces: charts over time, and who touches when.

    Attributes:
        title: The experiment.
        lines: What made it, in short lines.
        labels: Names of the curves, in the order of the styles.
        rows: Charts, from top to bottom; one in a row is wide.
        touches: When two bodies touch, by their names, in rows of one panel at the bottom.
        seconds: End of the axis of time [s].
        part: When the two sides part [s]; None if they do not, and of one trace.
        notes: What the reader must know, below.
    """

    title: str
    lines: Sequence[str]
    labels: Sequence[str]
    rows: Sequence[Sequence[Traces]]
    touches: dict[str, Spans]
    seconds: float
    part: float | None
    notes: Sequence[str]


@dataclass(frozen=True)
class PlotNotes(PageContent):
    """What the reader of a figure must know.

    Attributes:
        has_two_sides: Whether it is of two traces.
        floor: The chaos floor, where it is drawn.
        sizes: By how much the start was changed in the runs of that floor.
        parts_at: When the sides part [s]; None where they do not.
        parting: What parts then.
        fewer: How many quantities have no chart.
        not_shown: How many joints have no chart.
    """

    template = "plot.md.j2"
    has_two_sides: bool = False
    floor: ChaosFloor | None = None
    sizes: Sequence[str] = ()
    parts_at: float | None = None
    parting: Sequence[str] = ()
    fewer: int = 0
    not_shown: int = 0


def of_comparison(comparison: Comparison, floor: ChaosFloor | None = None) -> TracePlot:
    """Return the figure of two traces: a row for each quantity, and who touches when."""
    charts, traces = charts_of(comparison, floor), traces_of(comparison)
    without_chart = len(comparison.curves) - len(charts)
    rows = [_charts_in_a_row(chart) for chart in charts]
    notes = _notes_on_sides(comparison, floor, without_chart)
    return TracePlot(
        title=traces[0].header.experiment,
        lines=_origin(*traces),
        labels=long_labels(comparison),
        rows=rows,
        touches=_touches(traces, comparison.until),
        seconds=comparison.until,
        part=parting(comparison),
        notes=notes,
    )


def _charts_in_a_row(chart: QuantityChart) -> list[Traces]:
    """Return both sides of a quantity, where it has values, and how far apart they are."""
    values = chart.values()
    return [chart.gap()] if values is None else [values, chart.gap()]


def _notes_on_sides(
    comparison: Comparison, floor: ChaosFloor | None, without_chart: int
) -> list[str]:
    """Return what the reader of a figure of two traces must know.

    Args:
        comparison: Of the traces.
        floor: The chaos floor, where it is drawn.
        without_chart: How many quantities are not drawn.
    """
    first = parting(comparison)
    names: list[str] = []
    if first is not None:
        names = [a.name for a in comparison.agreements if a.since == first]
    return render_texts(
        PlotNotes(
            has_two_sides=True,
            floor=floor,
            sizes=_sizes_of(floor),
            parts_at=first,
            parting=names,
            fewer=without_chart,
        )
    )


def of_trace(trace: Trace) -> TracePlot:
    """Return the figure of one trace: fingertip, joints and their commands, energy, touches."""
    header, until = trace.header, float(trace.time[-1] - trace.time[0])
    kinds = JointType.HINGE, JointType.SLIDE
    joints = [k for k, kind in enumerate(header.jnt_type) if kind in kinds]
    servos = {joint: k for k, joint in enumerate(header.actuator_jntid) if joint >= 0}
    charts: list[Traces] = []
    site = default_tip(header)
    if site and "site_xpos" in trace:
        where = trace.site(site)[0]
        way = 1000 * distances(where, where[0])
        charts.append(_chart(f"{site}, from its start [mm]", trace, way))
    charts += [_joint_chart(trace, joint, servos.get(joint)) for joint in joints[:CHARTS_SHOWN]]
    if "energy" in trace and np.isfinite(trace["energy"]).all():
        charts.append(_chart("energy [J]", trace, trace["energy"].sum(axis=1)))
    rows = [charts[k : k + 2] for k in range(0, len(charts), 2)]
    labels = [header.label, COMMAND] if servos else [header.label]
    notes = render_texts(PlotNotes(not_shown=len(joints[CHARTS_SHOWN:])))
    return TracePlot(
        title=header.experiment,
        lines=_origin(trace),
        labels=labels,
        rows=rows,
        touches=_touches([trace], until),
        seconds=until,
        part=None,
        notes=notes,
    )


def _joint_chart(trace: Trace, joint: int, servo: int | None) -> Traces:
    """Return the curve of a hinge or a slide, with that of its command if an actuator moves it."""
    header, is_hinge = trace.header, trace.header.jnt_type[joint] == JointType.HINGE
    scale, unit = display_unit("rad" if is_hinge else "m")
    name = header.joints[joint] if header.joints[joint] else f"joint {joint}"
    positions = scale * trace.qpos[:, header.jnt_qposadr[joint]]
    command = None if servo is None else scale * trace.ctrl[:, servo]
    # What the robot itself would not notice is not blown up to the height of a chart.
    least = 20 * scale * ENCODER_COUNT if is_hinge else 0.0
    return _chart(f"{name} [{unit.strip()}]", trace, positions, command, least)


def _chart(
    title: str, trace: Trace, values: Array, command: Array | None = None, least: float = 0.0
) -> Traces:
    """Return a chart of values (n,) over time, and of what was commanded."""
    time = trace.time - trace.time[0]
    curves = {trace.header.label: (time, values)}
    if command is not None:
        curves[COMMAND] = (time, command)
    return Traces(title, "", "", curves, sides=True, least=least)


def _touches(traces: Sequence[Trace], until: float) -> dict[str, Spans]:
    """Return the spans of each pair of bodies; those that touch first come first."""
    touching = [trace.touches() for trace in traces]
    pairs: dict[str, Spans] = {}
    firsts: dict[str, float] = {}
    for pair in dict.fromkeys(itertools.chain(*touching)):
        sides = [
            _touching_spans(trace, touch.get(pair), until)
            for touch, trace in zip(touching, traces, strict=True)
        ]
        starts = [start for start, _ in itertools.chain(*sides)]
        if starts:
            pairs[pair] = sides
            firsts[pair] = min(starts)
    ranked = sorted(firsts, key=firsts.__getitem__)
    return {pair: pairs[pair] for pair in ranked[:_PAIRS_SHOWN]}


def _touching_spans(
    trace: Trace, touching: NDArray[np.bool_] | None, until: float
) -> list[list[float]]:
    """Return from when to when two bodies touch in a run [s]; `touching` tells it by row."""
    if touching is None:
        return []
    return spans(touching, trace.time - trace.time[0], trace.header.timestep, until)


def _origin(*traces: Trace) -> list[str]:
    """Return the model, the steps and the version that computed it."""
    headers = [trace.header for trace in traces]
    sources = [header.provenance for header in headers]
    models = {source.model_file: source.model_sha256[:8] for source in sources}
    steps = dict.fromkeys(milliseconds(header.timestep) for header in headers)
    made_by = [f"step {' and '.join(steps)}"]
    made_by += dict.fromkeys(f"seed {source.seed}" for source in sources if source.seed is not None)
    versions = dict.fromkeys(source.versions.get("statemachine", "") for source in sources)
    made_by += [f"statemachine {version}" for version in versions]
    files = ", ".join(f"{name} ({digest})" for name, digest in models.items())
    return [files, ", ".join(made_by)]


def drawn(plot: TracePlot, form: str) -> bytes:
    """Return a figure as svg, png or pdf; the same figure gives the same bytes.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    return saved(lambda: draw(plot), form, FIGURE_SETTINGS, _DOTS)


def write_plot(plot: TracePlot, path: Path) -> int:
    """Write a figure to a file .svg, .png or .pdf, whole or not at all; its bytes.

    Raises:
        BadInputError: Another suffix.
        MissingEngineError: matplotlib is not installed.
    """
    return replace_bytes(path, drawn(plot, check_suffix(path)))


def draw(plot: TracePlot) -> Any:
    """Draw a figure as matplotlib's, 80 mm wide."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    notes = "\n".join(textwrap.fill(note, _LETTERS) for note in plot.notes)
    heights = [_ROW] * len(plot.rows)
    if plot.touches:
        heights.append(_TOUCH * (len(plot.touches) + 1))
    words = notes.count("\n") + len(plot.lines) + len(plot.labels) + 5
    size = _WIDTH * _MM, (sum(heights) + _LINE * words) * _MM
    figure = Figure(size, facecolor="white", layout="constrained")
    figure.supxlabel(notes, x=0.01, ha="left", size=5.2)
    figure.legend(
        [Line2D([], [], **style) for style in SIDES[: len(plot.labels)]],
        plot.labels,
        title="\n".join((plot.title, *plot.lines)),
        loc="outside upper left",
        alignment="left",
        frameon=False,
    )
    grid = figure.add_gridspec(max(1, len(heights)), 2, height_ratios=heights if heights else None)
    for k, row in enumerate(plot.rows):
        for column, picture in enumerate(row):
            axes = figure.add_subplot(grid[k, column if len(row) > 1 else slice(None)])
            draw_picture(axes, picture)
            title = textwrap.fill(picture.title, _TITLE * (3 - len(row)))
            axes.set_title(title, weight="bold" if "DIFFERS" in title else "normal")
    if plot.touches:
        _draw_touches(figure.add_subplot(grid[-1, :]), plot)
    for axes in figure.axes:
        axes.set_xlim(0, max(plot.seconds, 1e-9))
        axes.locator_params(axis="x", nbins=4)
        if plot.part is not None:
            axes.axvline(plot.part, color="#8a8a8a", linewidth=0.6, zorder=0)
    if figure.axes:
        figure.axes[-1].set_xlabel("time [s]")
    return figure


def _draw_touches(axes: Any, plot: TracePlot) -> None:
    """Draw bars while two bodies touch: above of the first side, below, hatched, of the second."""
    axes.set_title("who touches when")
    least = plot.seconds / 300  # a touch of one step is seen too
    for row, (pair, sides) in enumerate(plot.touches.items()):
        for side, times in enumerate(sides):
            colour, base = SIDES[side]["color"], row + (0.42, 0.7)[side]
            bars = [(begin, max(end - begin, least)) for begin, end in times]
            look = {"facecolor": colour}
            if side == 1:
                look = {"hatch": "////////", "facecolor": "white"}
            axes.broken_barh(bars, (base, 0.26), edgecolor=colour, linewidth=0.4, **look)
        axes.text(0.0, row + 0.38, pair, size=5.2)
    axes.set_ylim(len(plot.touches), 0)
    axes.set_yticks([])
    axes.spines[["top", "right"]].set_visible(False)


def _sizes_of(floor: ChaosFloor | None) -> list[str]:
    """Return by how much the start was changed in the runs that a floor is made of."""
    if floor is None:
        return []
    size = floor.uncertain
    lengths = ((size.length, "m"), (size.angle, "rad"))
    return [rounded(value, unit) for value, unit in lengths if value > 0]
