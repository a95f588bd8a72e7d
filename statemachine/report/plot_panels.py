"""What a figure of traces shows, panel by panel: figures only, no drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..compare import (
    Agreement,
    ChaosFloor,
    Comparison,
    Series,
    default_tip,
    labels_of,
    series,
)
from ..interface import Array, JointType
from ..measures import COUNT, QUANTITIES
from ..measures.text import few, milliseconds, quantity, reading, short_time
from ..runs import Header, Trace
from .floor import changed_by

MOST = 16  # panels of joints and bodies
_MOST_PAIRS = 8

Curve = tuple[Array, Array]  # time (n,) [s] and values (n,)


@dataclass(frozen=True, eq=False)
class Panel:
    """One small picture: a quantity over time, and below how far apart its sides are.

    Attributes:
        title: What.
        unit: Of the values, as shown.
        curves: One for each side, by its place among the figure's labels.
        apart: The differences, or None.
        tolerance: Of them; the values' axis spans some of it at least.
        verdict: In a word, or "".
        wide: Whether it has a row of its own.
        floor: The chaos floor of the differences, or None.
    """

    title: str
    unit: str
    curves: Sequence[tuple[int, Curve]]
    apart: Curve | None = None
    tolerance: float | None = None
    verdict: str = ""
    wide: bool = False
    floor: Curve | None = None


@dataclass(frozen=True, eq=False)
class TouchSpans:
    """When two bodies touch: spans of time [s] on each side."""

    name: str
    spans: Sequence[Sequence[tuple[float, float]]]


@dataclass(frozen=True, eq=False)
class Plot:
    """All of a figure.

    Attributes:
        title: The experiment.
        lines: What made it, in short lines.
        labels: Names of the sides, in the order of the styles.
        panels: From top to bottom.
        touches: In rows of one panel at the bottom.
        seconds: End of the axis of time [s].
        part: When they part [s], or None.
        notes: What the reader must know, below.
    """

    title: str
    lines: Sequence[str]
    labels: Sequence[str]
    panels: Sequence[Panel]
    touches: Sequence[TouchSpans]
    seconds: float
    part: float | None
    notes: Sequence[str]


def of_comparison(
    one: Trace,
    two: Trace,
    comparison: Comparison,
    tip: str | None = None,
    floor: ChaosFloor | None = None,
) -> Plot:
    """The figure of two traces: fingertip first, then joints, bodies, energy, touches."""
    bands = {} if floor is None else {band.name: band.width for band in floor.bands}
    found = {agreement.name: agreement for agreement in comparison.agreements}
    curves = series(one, two, tip)
    shown = [curve for curve in curves if QUANTITIES[curve.kind].own]
    kept = _worst_of(shown, found)
    tips = [curve for curve in curves if curve.kind == "tip"]
    energy = [curve for curve in curves if curve.kind == "energy"]
    panels = [
        _panel(curve, found.get(curve.name), curve.kind == "tip", bands.get(curve.name))
        for curve in (*tips, *kept, *energy)
    ]
    parted = [agreement for agreement in comparison.agreements if agreement.since is not None]
    first = min((agreement.since or 0.0 for agreement in parted), default=None)
    parting = few([a.name for a in parted if a.since == first], 1)
    notes = [
        "Upper: both sides. Lower: how far apart, on a log axis, and below it in grey what is "
        "exactly 0; the dotted line is the tolerance, and what is beyond it is filled. Beside "
        "the verdict: the largest difference.",
        ""
        if floor is None
        else "Grey band: the chaos floor, how far the first side gets from "
        f"itself with {changed_by(floor)}.",
        "" if first is None else f"Grey line: they part at {short_time(first)}, first {parting}.",
        f"{len(shown) - len(kept)} further joints and bodies differ less."
        * (len(shown) > len(kept)),
    ]
    return Plot(
        title=one.header.experiment,
        lines=_origin(one, two),
        labels=labels_of(one.header, two.header).long,
        panels=panels,
        touches=_touches([one, two], comparison.until),
        seconds=comparison.until,
        part=first,
        notes=[note for note in notes if note],
    )


def of_trace(trace: Trace) -> Plot:
    """The figure of one trace: joints and what they were told, fingertip, energy, touches."""
    header, time = trace.header, trace.time - trace.time[0]
    told = {joint: k for k, joint in enumerate(header.actuator_jntid) if joint >= 0}
    panels = []
    site = default_tip(header)
    if site and "site_xpos" in trace:
        where = trace.site(site)[0]
        away = 1000 * np.linalg.norm(where - where[0], axis=1)
        panels.append(Panel(f"{site}, from its start", "mm", [(0, (time, away))], wide=True))
    joints = [
        k
        for k, kind in enumerate(header.jnt_type)
        if kind in (int(JointType.HINGE), int(JointType.SLIDE))
    ]
    for joint in joints[:MOST]:
        hinge = header.jnt_type[joint] == JointType.HINGE
        scale, unit = reading("rad" if hinge else "m")
        # What the robot itself would not notice is not blown up to the height of a panel.
        small = scale * COUNT if hinge else None
        curves = [(0, (time, scale * trace.qpos[:, header.jnt_qposadr[joint]]))]
        if joint in told:
            curves.append((1, (time, scale * trace.ctrl[:, told[joint]])))
        title = header.joints[joint] or f"joint {joint}"
        panels.append(Panel(title, unit.strip(), curves, tolerance=small))
    if "energy" in trace and np.isfinite(trace["energy"]).all():
        panels.append(Panel("energy", "J", [(0, (time, trace["energy"].sum(axis=1)))]))
    notes = ["Dashed: the command."] if told else []
    if len(joints) > MOST:
        notes.append(f"{len(joints) - MOST} further joints are not shown.")
    return Plot(
        title=header.experiment,
        lines=_origin(trace),
        labels=[header.label, "the command"] if told else [header.label],
        panels=panels,
        touches=_touches([trace], float(time[-1])),
        seconds=float(time[-1]),
        part=None,
        notes=notes,
    )


def _panel(
    curve: Series, found: Agreement | None, wide: bool = False, floor: Array | None = None
) -> Panel:
    scale, unit = reading(curve.unit)
    values = [(k, (curve.time, scale * side)) for k, side in enumerate(_values(curve))]
    title = curve.name.removesuffix(", position").removeprefix(", ")  # a joint without a name
    if curve.kind in ("tip", "body"):
        title += ", from its start"
    verdict = ""
    if found is not None:
        verdict = {"agrees": "agrees", "settles": "settles", "differs": "DIFFERS"}[found.verdict]
        verdict += f", {quantity(found.max, found.unit)}"
    return Panel(
        title=title,
        unit=unit.strip(),
        curves=values,
        apart=(curve.time, scale * curve.difference),
        tolerance=None if found is None else scale * found.tolerance,
        verdict=verdict,
        wide=wide,
        floor=None if floor is None else (curve.time, scale * floor),
    )


def _values(curve: Series) -> list[Array]:
    """What is drawn of each side: of a position its way from where the first side began."""
    if curve.one.size == 0:
        return []
    if curve.one.ndim == 1:
        return [curve.one, curve.two]
    return [np.linalg.norm(side - curve.one[0], axis=1) for side in (curve.one, curve.two)]


def _worst_of(shown: list[Series], found: dict[str, Agreement]) -> list[Series]:
    """All of them, or, of very many, those that are farthest beyond their tolerance."""
    if len(shown) <= MOST:
        return shown
    share = {name: agreement.tolerances() for name, agreement in found.items()}
    kept = sorted(shown, key=lambda curve: -share.get(curve.name, 0.0))[:MOST]
    return [curve for curve in shown if any(curve is one for one in kept)]


def _touches(traces: Sequence[Trace], until: float) -> list[TouchSpans]:
    """Spans of each pair of bodies; those that touch first come first."""
    touching = [trace.touches() for trace in traces]
    found = []
    for pair in dict.fromkeys(name for touch in touching for name in touch):
        spans = [
            _spans(touch[pair], trace.time - trace.time[0], trace.header.timestep, until)
            if pair in touch
            else []
            for touch, trace in zip(touching, traces, strict=True)
        ]
        if any(spans):
            found.append(TouchSpans(pair, spans))
    found.sort(key=lambda touch: min(span[0] for side in touch.spans for span in side))
    return found[:_MOST_PAIRS]


def _spans(
    touching: NDArray[np.bool_], time: Array, timestep: float, until: float
) -> list[tuple[float, float]]:
    """When it begins and how long it lasts; a row counts until the next one."""
    edges = np.diff(np.concatenate([[0], touching.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    spans = []
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        begin, stop = float(time[start]), min(float(time[end - 1]) + timestep, until)
        if begin <= until:
            spans.append((begin, max(stop - begin, 0.0)))
    return spans


def _origin(*traces: Trace) -> list[str]:
    """The model, the steps and the version that computed it."""
    headers: list[Header] = [trace.header for trace in traces]
    models = {h.provenance.model_file: h.provenance.model_sha256[:8] for h in headers}
    steps = dict.fromkeys(milliseconds(header.timestep) for header in headers)
    seeds = dict.fromkeys(
        f"seed {header.provenance.seed}" for header in headers if header.provenance.seed is not None
    )
    versions = dict.fromkeys(
        f"statemachine {header.provenance.versions.get('statemachine', '')}" for header in headers
    )
    return [
        ", ".join(f"{name} ({digest})" for name, digest in models.items()),
        ", ".join([f"step {' and '.join(steps)}", *seeds, *versions]),
    ]
