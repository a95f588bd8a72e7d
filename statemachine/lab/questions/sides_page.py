"""Sides of a comparison: their commands, what made them, their contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import (
    NO_NUMBER,
    figure,
    milliseconds,
    numbers,
    quantity,
    sentence,
    short_time,
)
from ...show.blocks import Table, TableCell
from ..compare import Agreement, Comparison, SidesRun
from ..compare.alike import commands_alike
from ..compare.series import PairContacts, Touch
from ..recordings import Header, Trace
from .compared_names import long_labels, moment, name_of, short_labels, traces_of

# Of the promises that a backend may emulate, those that move the arm, in plain words.
PHYSICS = {
    "position servo": "servos with the gains of the model",
    "armature": "armature",
    "joint damping": "damping",
    "dry friction": "dry friction",
    "joint limits": "joint limits",
}


def commands_table(comparison: Comparison) -> Table:
    """Return what each actuator was told, at the start and in the end; no rows without any.

    Where both sides were told the same, once.
    """
    (left, right), labels = traces_of(comparison), long_labels(comparison)
    actuators = left.header.actuators
    if actuators != right.header.actuators or without_actuation((left, right)):
        actuators = ()
    traces = {"": left}
    if not commands_alike(left, right):
        traces = {f"{labels[0]}, ": left, f"{labels[1]}, ": right}
    columns: dict[str, list[str]] = {"actuator": list(actuators)}
    for side, trace in traces.items():
        count = len(actuators)
        columns[f"{side}at the start"] = [figure(v) for v in trace.ctrl[0, :count].tolist()]
        columns[f"{side}in the end"] = [figure(v) for v in trace.ctrl[-1, :count].tolist()]
    return Table(list(columns), list(zip(*columns.values(), strict=True)))


def without_actuation(traces: Sequence[Trace]) -> bool:
    """Tell whether the actuators are off in all of some runs."""
    return all(trace.header.options.get("actuation") is False for trace in traces)


def pressing_table(comparison: Comparison) -> Table:
    """Return how hard each pair of bodies presses in the end, and how deep it overlaps."""
    left, right = short_labels(comparison)
    rows = []
    for touch in sorted(comparison.touches, key=_pressing, reverse=True):
        rows.append((touch.pair, left, *_contact_cells(touch.left)))
        rows.append((touch.pair, right, *_contact_cells(touch.right)))
    return Table(
        ("bodies", "side", "force, N", "with friction, N", "deepest", "at, s", "last touch"),
        rows,
        words=frozenset({0, 1}),
        wide=frozenset({5}),
    )


def _pressing(touch: Touch) -> tuple[float, float]:
    """Return what pairs of bodies are ranked by: force [N], then depth [m], on either side."""
    force = max(touch.left.force, touch.right.force)
    return force, max(touch.left.deepest, touch.right.deepest)


def _contact_cells(contact: PairContacts) -> tuple[str, ...]:
    """Return the cells of a pair of bodies on one side."""
    if contact.first is None:
        return NO_NUMBER, NO_NUMBER, NO_NUMBER, NO_NUMBER, "never touches"
    last = "in the end"
    if not contact.ends and contact.last is not None:
        last = short_time(contact.last)
    return (
        figure(contact.force),
        figure(contact.total),
        quantity(contact.deepest, "m"),
        moment(contact.deepest_at),
        last,
    )


def remarks(run: SidesRun, comparison: Comparison) -> list[str]:
    """Return what a reader should know of how two sides were run, in sentences."""
    lines = [*run.unmatched, *run.notes, *comparison.notes]
    return [sentence(line) for line in lines]


def loops_table(comparison: Comparison, played: Comparison | None) -> Table:
    """Return the figures of both loops, by quantity; no rows where they are the same."""
    closed = {agreement.name: agreement for agreement in comparison.agreements}
    opened: dict[str, Agreement] = {}
    if played is not None:
        opened = {agreement.name: agreement for agreement in played.agreements}
    rows = []
    if opened:
        for name in closed | opened:
            cells = (*_cells(closed.get(name)), *_cells(opened.get(name)))
            rows.append((name_of(name), *cells))
    return Table(
        ("quantity", "closed loop", "largest", "open loop", "largest"),
        rows,
        words=frozenset({0, 1, 3}),
    )


def _cells(agreement: Agreement | None) -> tuple[str, str]:
    if agreement is None:
        return NO_NUMBER, NO_NUMBER
    verdict = TableCell(agreement.verdict, verdict=agreement.verdict)
    if agreement.kind in ("contact", "fall") and agreement.note:
        return verdict, agreement.note
    return verdict, quantity(agreement.max, agreement.unit)


@dataclass(frozen=True)
class EmulatedSide:
    """What a backend computes for its engine.

    Attributes:
        engine: Engine and version.
        backend: What computes it.
        physics: What of it moves the robot.
        others: Promises of the interface, and conventions.
        without: What to type for the engine without that.
    """

    engine: str
    backend: str
    physics: tuple[str, ...]
    others: tuple[str, ...]
    without: str


def emulated_sides(comparison: Comparison) -> list[EmulatedSide]:
    """Return what each backend computes for its engine; two sides of one engine are one."""
    sides: dict[str, EmulatedSide] = {}
    for side in (comparison.left, comparison.right):
        header = side.trace.header
        promises = header.provenance.emulated
        if promises and header.defaults == "model":
            physics = [PHYSICS[name] for name in promises if name in PHYSICS]
            others = [name for name in promises if name not in PHYSICS]
            without = f"{header.backend}:engine"
            sides[header.label] = EmulatedSide(
                header.label, header.backend, tuple(physics), tuple(others), without
            )
    return list(sides.values())


def provenance(comparison: Comparison) -> Table:
    """Return a table of what made both sides."""
    left, right = comparison.left.trace.header, comparison.right.trace.header
    rows = [("ran as", _ran_as(left), _ran_as(right))]
    versions, others = left.provenance.versions, right.provenance.versions
    for name in versions | others:
        rows.append((name, versions.get(name, NO_NUMBER), others.get(name, NO_NUMBER)))
    rows.append(("rows", f"{comparison.left.rows}", f"{comparison.right.rows}"))
    facts, other_facts = facts_of(left), facts_of(right)
    for name, fact in facts.items():
        if fact or other_facts[name]:
            rows.append((name, fact, other_facts[name]))
    return Table(
        ("what", *long_labels(comparison)),
        rows,
        words=frozenset({0, 1, 2}),
    )


def _ran_as(header: Header) -> str:
    """Say whether a run was made for this page."""
    return "recorded, opened here" if header.recorded else "run for this page"


def facts_of(header: Header) -> dict[str, str]:
    """Return what made a run, apart from versions."""
    source = header.provenance
    options = ", ".join(f"{name} {value}" for name, value in header.options.items())
    timestep = milliseconds(header.timestep)
    if header.substeps > 1:
        timestep += f" in {header.substeps} substeps"
    facts: dict[str, str] = {}
    facts["model"] = source.model_file
    facts["its SHA-256"] = TableCell(source.model_sha256, code=True)
    facts["defaults"] = header.defaults
    facts["options"] = options if options else "none"
    facts["starts in"] = header.keyframe if header.keyframe else "the default state"
    facts["timestep"] = timestep
    facts["gravity"] = f"{numbers(header.gravity)} m/s²"
    facts["seed"] = "none drawn" if source.seed is None else f"{source.seed}"
    facts["energies by"] = header.energy_by if header.energy_by else NO_NUMBER
    facts["made again by"] = TableCell(header.command, code=True)
    return facts
