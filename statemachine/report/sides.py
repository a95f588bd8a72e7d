"""Sides of a comparison: their commands, what made them, their contacts; the page of one trace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..compare import Agreement, Comparison, SidesRun
from ..compare.alike import commands_alike
from ..measures.text import (
    NONE,
    figure,
    listed,
    milliseconds,
    numbers,
    quantity,
    sentence,
    short_time,
)
from ..page import Block, Figures, Headline, Items, Page, Section, Table, TableCell, Text
from ..runs import COLUMNS, Header, Trace
from . import template
from .finding import long_labels, moment, name_of, short_labels, traces_of, window
from .template import if_true, versions_of
from .why_answer import missing

_PAIRS_SHOWN = 3  # pairs of bodies that have rows: those that press hardest
# Of the promises that a backend may emulate, those that move the arm, in plain words.
PHYSICS = {
    "position servo": "servos with the gains of the model",
    "armature": "armature",
    "joint damping": "damping",
    "dry friction": "dry friction",
    "joint limits": "joint limits",
}


def commanded(comparison: Comparison) -> list[Block]:
    """What each actuator was told, at the start and in the end; empty without actuators."""
    (left, right), labels = traces_of(comparison), long_labels(comparison)
    actuators = left.header.actuators
    if not actuators or actuators != right.header.actuators:
        return []
    if without_actuation((left, right)):
        return [Text("The actuators of the file are off on both sides: nothing is commanded.")]
    same = commands_alike(left, right)
    traces = {"": left} if same else {f"{labels[0]}, ": left, f"{labels[1]}, ": right}
    columns = {
        f"{side}{when}": map(figure, trace.ctrl[row].tolist())
        for side, trace in traces.items()
        for when, row in (("at the start", 0), ("in the end", -1))
    }
    rows = list(zip(actuators, *columns.values(), strict=True))
    heading = f"What was commanded ({'' if same else 'not '}the same on both sides)"
    table = Table(("actuator", *columns), rows, "ctrl, by actuator")
    return [Section("", heading, [table], folded=True, detail=True)]


def without_actuation(traces: Sequence[Trace]) -> bool:
    """Whether nobody commands any of some runs."""
    return all(trace.header.options.get("actuation") is False for trace in traces)


def contact_words(comparison: Comparison) -> Table:
    """How hard each pair of bodies presses in the end on each side, and how deep it overlaps."""
    labels, touches = short_labels(comparison), comparison.touches
    hardest = sorted(
        touches,
        key=lambda t: (max(t.left.force, t.right.force), max(t.left.deepest, t.right.deepest)),
        reverse=True,
    )[:_PAIRS_SHOWN]
    return Table(
        ("bodies", "side", "force, N", "with friction, N", "deepest", "at, s", "last touch"),
        [
            (touch.pair, label, *_contact_cells(side))
            for touch in hardest
            for label, side in zip(labels, (touch.left, touch.right), strict=True)
        ],
        f"Who presses hardest ({len(hardest)} of {len(touches)} pairs; forces are means over "
        f"{window(comparison)}, depths are of the whole run)",
        words=frozenset({0, 1}),
        wide=frozenset({5}),
    )


def _contact_cells(contact: Figures) -> tuple[str, ...]:
    if contact.first is None:
        return NONE, NONE, NONE, NONE, "never touches"
    return (
        figure(contact.force),
        figure(contact.total),
        quantity(contact.deepest, "m"),
        moment(contact.deepest_at),
        "in the end" if contact.ends else short_time(contact.last or 0.0),
    )


def unmatched(run: SidesRun | None) -> list[Block]:
    """What one side has nothing of, what could not be matched, and what was not by name."""
    lines = [*missing(run.missing), *run.unmatched] if run else []
    return [Items([sentence(line) for line in lines])] if lines else []


def loop_note(run: SidesRun | None) -> list[Block]:
    """Whether the two sides were told the same, where that takes one sentence."""
    if run is None:
        return []
    lacking = run.matched.only[0].get("actuator", ()) if run.matched else ()
    commands = run.commands
    return template.blocks(
        "loops_told",
        same=if_true(commands == "the same" and not without_actuation(run.traces)),
        recorded=if_true(commands == "recorded"),
        more=if_true(commands == "more than ctrl"),
        lacking=if_true(lacking and commands != "its own"),
    )


def loops(comparison: Comparison, played: Comparison | None) -> list[Block]:
    """The figures of both loops, quantity by quantity; nothing where they are the same."""
    if played is None:
        return []
    closed = {agreement.name: agreement for agreement in comparison.agreements}
    opened = {agreement.name: agreement for agreement in played.agreements}
    rows = [
        (name_of(name), *_cells(closed.get(name)), *_cells(opened.get(name)))
        for name in closed | opened
    ]
    left, right = short_labels(comparison)
    table = Table(
        ("quantity", "closed loop", "largest", "open loop", "largest"),
        rows,
        f"{left} against {right}: each with its own commands, and both with the left's",
        words=frozenset({0, 1, 3}),
    )
    return [Section("loops", "Closed loop and open loop", template.blocks("loops", table=table))]


def also_open(headline: Headline, played: Comparison | None) -> Headline:
    """The headline, and what the open loop says where it says something else."""
    if played is None or played.agrees == headline.holds:
        return headline
    verdict = "agree" if played.agrees else "do not agree"
    lead = f"{headline.lead}; in open loop, with the left's commands on both, they {verdict}"
    return replace(headline, lead=lead, holds=headline.holds and played.agrees)


def _cells(agreement: Agreement | None) -> tuple[str, str]:
    if agreement is None:
        return NONE, NONE
    note = agreement.note if agreement.kind == "contact" else ""
    verdict = TableCell(agreement.verdict, verdict=agreement.verdict)
    return verdict, note or quantity(agreement.max, agreement.unit)


def emulated(comparison: Comparison) -> list[Block]:
    """What of the model a backend keeps instead of its engine."""
    sides = {
        side.trace.header.label: side.trace.header.provenance.emulated
        for side in (comparison.left, comparison.right)
        if side.trace.header.provenance.emulated and side.trace.header.defaults == "model"
    }
    blocks: list[Block] = []
    for engine, promises in sides.items():
        moving = [PHYSICS[name] for name in promises if name in PHYSICS]
        rest = "; ".join(name for name in promises if name not in PHYSICS)
        text = Text(f"Promises of this library, and conventions of its states and forces: {rest}.")
        heading = f"What else this library adds to {engine}"
        blocks += template.blocks(
            "provenance",
            engine=engine,
            backend=engine.split()[0],
            moving=listed(moving) if moving else None,
            rest=[Section("", heading, [text], folded=True, detail=True)] if rest else [],
        )
    return blocks


def provenance(comparison: Comparison) -> Table:
    """What made both sides."""
    headers = comparison.left.trace.header, comparison.right.trace.header
    left, right = (header.provenance.versions for header in headers)
    a, b = (facts_of(header) for header in headers)
    ran = ["recorded, opened here" if h.recorded else "run for this page" for h in headers]
    rows = [
        ("ran as", *ran),
        *((name, left.get(name, NONE), right.get(name, NONE)) for name in left | right),
        ("rows", f"{comparison.left.rows}", f"{comparison.right.rows}"),
        *((name, a[name], b[name]) for name in a if a[name] or b[name]),
    ]
    return Table(
        ("what", *long_labels(comparison)),
        rows,
        "What made the two runs",
        words=frozenset({0, 1, 2}),
    )


def facts_of(header: Header) -> dict[str, str]:
    """What made a run, apart from versions."""
    source = header.provenance
    substeps = f" in {header.substeps} substeps" if header.substeps > 1 else ""
    return {
        "model": source.model_file,
        "its SHA-256": TableCell(source.model_sha256, code=True),
        "defaults": header.defaults,
        "options": ", ".join(f"{name} {value}" for name, value in header.options.items()) or "none",
        "starts in": header.keyframe or "the default state",
        "timestep": milliseconds(header.timestep) + substeps,
        "gravity": numbers(header.gravity) + " m/s²",
        "seed": "none drawn" if source.seed is None else f"{source.seed}",
        "energies by": header.energy_by or NONE,
        "made again by": TableCell(header.command, code=True),
    }


def trace_page(trace: Trace, name: str) -> Page:
    """What was done on what, then every column with its range."""
    header = trace.header
    facts = {
        "experiment": header.experiment,
        "engine": header.label,
        "time": f"{trace.time[0]:g} to {trace.time[-1]:g} s, {len(trace)} rows",
        "versions": versions_of(header.provenance.versions),
        **facts_of(header),
        "rewritten": f"the controller wrote into the state in {header.rewritten} rows"
        * bool(header.rewritten),
        "ended": header.ended,
    }
    touches = [
        (
            pair,
            short_time(trace.time[int(np.argmax(rows))] - trace.time[0]),
            f"{int(rows.sum())} of {len(trace)}",
        )
        for pair, rows in trace.touches().items()
    ]
    columns = [_row(column, trace) for column in COLUMNS if column in trace]
    tables = [
        Table(
            ("what", "is"),
            [fact for fact in facts.items() if fact[1]],
            "What it is of",
            words=frozenset({0, 1}),
        ),
        Table(("column", "shape", "smallest", "largest"), columns, "What is in it"),
        Table(("bodies", "first touch", "rows"), touches, "What touches what"),
    ]
    return template.page(
        "trace",
        name=name,
        experiment=header.experiment,
        engine=header.label,
        says=header.says or None,
        tables=tables,
        nothing=if_true("contact_row" in trace and not touches),
    )


def _row(column: str, trace: Trace) -> tuple[str, ...]:
    array = trace[column]
    shape = " × ".join(str(length) for length in array.shape)
    if not array.size or not np.isfinite(array).any():
        return (column, shape, "not told" if array.size else "", "")
    return (column, shape, figure(float(np.nanmin(array))), figure(float(np.nanmax(array))))
