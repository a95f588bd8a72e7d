"""A figure of traces for a paper or a slide, one column wide and readable without colour."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..compare import Comparison, default_tip
from ..compare.perturbed import ChaosFloor
from ..interface import Array, JointType
from ..measures import COUNT, distances
from ..measures.text import few, milliseconds, reading, short_time
from ..page import Figures, Traces
from ..runs import Trace
from ..runs.whole import replace_bytes
from . import template
from .figures import SETTINGS, SIDES, check_suffix, draw_picture, saved
from .finding import changed_by, long_labels, parting, traces_of
from .over_time import CHARTS_SHOWN, charts_of, spans
from .template import if_true

FIGURE_SETTINGS = {
    **SETTINGS,
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 6.0,
    "axes.linewidth": 0.5,
    "axes.titlesize": 6.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 2.0,
    **{f"{axis}tick.{what}": size for axis in "xy" for what, size in
       (("major.size", 1.8), ("major.width", 0.5), ("major.pad", 1.2))},
}  # fmt: skip
_DOTS = 300  # a PNG has to an inch
_WIDTH, _MM = 80.0, 1 / 25.4  # of the figure [mm]; inches to a millimetre
_ROW, _TOUCH, _LINE = 17.0, 5.0, 3.0  # heights of a row of charts, of a touch, of text [mm]
_LETTERS, _TITLE = 82, 30  # of a line of notes; of a title over half of the width
_PAIRS_SHOWN = 8

COMMAND = "the command"


# Of each side: from when to when it lasts [s].
Spans = Sequence[Sequence[Sequence[float]]]


def of_comparison(comparison: Comparison, floor: ChaosFloor | None = None) -> Figures:
    """The figure of two traces: a row for each quantity, and who touches when.

    Returns:
        title: The experiment.
        lines: What made it, in short lines.
        labels: Names of the sides, in the order of the styles.
        rows: Charts, from top to bottom; one in a row is wide.
        touches: When two bodies touch, by their names, in rows of one panel at the bottom.
        seconds: End of the axis of time [s].
        part: When they part [s], or None.
        notes: What the reader must know, below.
    """
    charts, traces = charts_of(comparison, floor), traces_of(comparison)
    first = parting(comparison)
    names = few(
        [a.name for a in comparison.agreements if first is not None and a.since == first], 1
    )
    return Figures(
        title=traces[0].header.experiment,
        lines=_origin(*traces),
        labels=long_labels(comparison),
        rows=[list(filter(None, (chart.values(), chart.gap()))) for chart in charts],
        touches=_touches(traces, comparison.until),
        seconds=comparison.until,
        part=first,
        notes=_notes(
            right=if_true(True),
            changed=changed_by(floor) if floor else None,
            at=None if first is None else short_time(first),
            names=names,
            fewer=len(comparison.curves) - len(charts) or None,
        ),
    )


def of_trace(trace: Trace) -> Figures:
    """The same of one trace: fingertip, joints and what they were told, energy, touches."""
    header, time = trace.header, trace.time - trace.time[0]
    charts: list[Traces] = []

    def add(title: str, values: Array, command: Array | None = None, least: float = 0.0) -> None:
        curves = {header.label: (time, values)}
        if command is not None:
            curves[COMMAND] = (time, command)
        charts.append(Traces(title, "", "", curves, sides=True, least=least))

    site = default_tip(header)
    if site and "site_xpos" in trace:
        where = trace.site(site)[0]
        add(f"{site}, from its start [mm]", 1000 * distances(where, where[0]))
    servos = {joint: k for k, joint in enumerate(header.actuator_jntid) if joint >= 0}
    kinds = JointType.HINGE, JointType.SLIDE
    joints = [k for k, kind in enumerate(header.jnt_type) if kind in kinds]
    for joint in joints[:CHARTS_SHOWN]:
        hinge = header.jnt_type[joint] == JointType.HINGE
        scale, unit = reading("rad" if hinge else "m")
        add(
            f"{header.joints[joint] or f'joint {joint}'} [{unit.strip()}]",
            scale * trace.qpos[:, header.jnt_qposadr[joint]],
            scale * trace.ctrl[:, servos[joint]] if joint in servos else None,
            # What the robot itself would not notice is not blown up to the height of a chart.
            20 * scale * COUNT if hinge else 0.0,
        )
    if "energy" in trace and np.isfinite(trace["energy"]).all():
        add("energy [J]", trace["energy"].sum(axis=1))
    return Figures(
        title=header.experiment,
        lines=_origin(trace),
        labels=[header.label, COMMAND] if servos else [header.label],
        rows=[charts[k : k + 2] for k in range(0, len(charts), 2)],
        touches=_touches([trace], float(time[-1])),
        seconds=float(time[-1]),
        part=None,
        notes=_notes(not_shown=len(joints[CHARTS_SHOWN:]) or None),
    )


def _notes(**slots: object) -> list[str]:
    """What the reader must know: the sentences of `plot.md` that have what they need."""
    return template.texts(
        "plot", **dict.fromkeys(("right", "changed", "at", "names", "fewer", "not_shown")) | slots
    )


def _touches(traces: Sequence[Trace], until: float) -> dict[str, Spans]:
    """Spans of each pair of bodies; those that touch first come first."""
    touching = [trace.touches() for trace in traces]
    pairs: dict[str, Spans] = {
        pair: [
            spans(touch[pair], trace.time - trace.time[0], trace.header.timestep, until)
            if pair in touch
            else []
            for touch, trace in zip(touching, traces, strict=True)
        ]
        for pair in dict.fromkeys(itertools.chain(*touching))
    }
    first = {
        pair: min(start for side in sides for start, _ in side)
        for pair, sides in pairs.items()
        if any(sides)
    }
    return {pair: pairs[pair] for pair in sorted(first, key=first.__getitem__)[:_PAIRS_SHOWN]}


def _origin(*traces: Trace) -> list[str]:
    """The model, the steps and the version that computed it."""
    headers = [trace.header for trace in traces]
    sources = [header.provenance for header in headers]
    models = {source.model_file: source.model_sha256[:8] for source in sources}
    steps = dict.fromkeys(milliseconds(header.timestep) for header in headers)
    seeds = {f"seed {source.seed}": None for source in sources if source.seed is not None}
    versions = dict.fromkeys(source.versions.get("statemachine", "") for source in sources)
    return [
        ", ".join(f"{name} ({digest})" for name, digest in models.items()),
        ", ".join(
            [
                f"step {' and '.join(steps)}",
                *seeds,
                *(f"statemachine {version}" for version in versions),
            ]
        ),
    ]


def drawn(plot: Figures, form: str) -> bytes:
    """A figure as svg, png or pdf; the same figure gives the same bytes.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    return saved(lambda: draw(plot), form, FIGURE_SETTINGS, _DOTS)


def write_plot(plot: Figures, path: Path) -> int:
    """Write a figure to a file .svg, .png or .pdf, whole or not at all; its bytes.

    Raises:
        BadInputError: Another suffix.
        MissingEngineError: matplotlib is not installed.
    """
    return replace_bytes(path, drawn(plot, check_suffix(path)))


def draw(plot: Figures) -> Any:
    """The figure as matplotlib's, 80 mm wide."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    notes = "\n".join(textwrap.fill(note, _LETTERS) for note in plot.notes)
    heights = [_ROW] * len(plot.rows) + [_TOUCH * (len(plot.touches) + 1)] * bool(plot.touches)
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
    grid = figure.add_gridspec(max(1, len(heights)), 2, height_ratios=heights or None)
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


def _draw_touches(axes: Any, plot: Figures) -> None:
    """Bars while two bodies touch: above of the first side, below, hatched, of the second."""
    axes.set_title("who touches when")
    least = plot.seconds / 300  # a touch of one step is seen too
    for row, (pair, sides) in enumerate(plot.touches.items()):
        for side, times in enumerate(sides):
            colour, base = SIDES[side]["color"], row + (0.42, 0.7)[side]
            bars = [(begin, max(end - begin, least)) for begin, end in times]
            look = {"hatch": "////////", "facecolor": "white"} if side else {"facecolor": colour}
            axes.broken_barh(bars, (base, 0.26), edgecolor=colour, linewidth=0.4, **look)
        axes.text(0.0, row + 0.38, pair, size=5.2)
    axes.set_ylim(len(plot.touches), 0)
    axes.set_yticks([])
    axes.spines[["top", "right"]].set_visible(False)
