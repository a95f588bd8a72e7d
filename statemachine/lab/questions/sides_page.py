"""Sides of a comparison: their commands, what made them, their contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...measures.text import (
    NONE,
    figure,
    listed,
    milliseconds,
    numbers,
    quantity,
    sentence,
    short_time,
)
from ...show import report_template as template
from ...show.blocks import Block, Headline, Items, Section, Table, TableCell, Text
from ...show.report_template import if_true
from ..compare import Agreement, Comparison, SidesRun
from ..compare.alike import commands_alike
from ..compare.series import PairContacts, Touch
from ..recordings import Header, Trace
from ..why.answer_page import missing
from .compared_names import long_labels, moment, name_of, short_labels, traces_of, window

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
    if commands_alike(left, right):
        heading = "What was commanded (the same on both sides)"
        traces = {"": left}
    else:
        heading = "What was commanded (not the same on both sides)"
        traces = {f"{labels[0]}, ": left, f"{labels[1]}, ": right}
    columns: dict[str, list[str]] = {"actuator": list(actuators)}
    for side, trace in traces.items():
        columns[f"{side}at the start"] = [figure(value) for value in trace.ctrl[0].tolist()]
        columns[f"{side}in the end"] = [figure(value) for value in trace.ctrl[-1].tolist()]
    rows = list(zip(*columns.values(), strict=True))
    table = Table(list(columns), rows, "ctrl, by actuator")
    return [Section("", heading, [table], folded=True, detail=True)]


def without_actuation(traces: Sequence[Trace]) -> bool:
    """Whether nobody commands any of some runs."""
    return all(trace.header.options.get("actuation") is False for trace in traces)


def contact_words(comparison: Comparison) -> Table:
    """How hard each pair of bodies presses in the end on each side, and how deep it overlaps."""
    touches = comparison.touches
    hardest = sorted(touches, key=_pressing, reverse=True)[:_PAIRS_SHOWN]
    left, right = short_labels(comparison)
    rows = []
    for touch in hardest:
        rows.append((touch.pair, left, *_contact_cells(touch.left)))
        rows.append((touch.pair, right, *_contact_cells(touch.right)))
    return Table(
        ("bodies", "side", "force, N", "with friction, N", "deepest", "at, s", "last touch"),
        rows,
        f"Who presses hardest ({len(hardest)} of {len(touches)} pairs; forces are means over "
        f"{window(comparison)}, depths are of the whole run)",
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
        return NONE, NONE, NONE, NONE, "never touches"
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


def unmatched(run: SidesRun | None) -> list[Block]:
    """What one side has nothing of, what could not be matched, and what was not by name."""
    if run is None:
        return []
    lines = [*missing(run.missing), *run.unmatched]
    return [Items([sentence(line) for line in lines])] if lines else []


def loop_note(run: SidesRun | None) -> list[Block]:
    """Whether the two sides were told the same, where that takes one sentence."""
    if run is None:
        return []
    lacking = run.matched.only[0].get("actuator", ()) if run.matched else ()
    commands = run.commands
    return template.blocks(
        "lab/questions/loops_told",
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
    return [
        Section(
            "loops",
            "Closed loop and open loop",
            template.blocks("lab/questions/loops", table=table),
        )
    ]


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
    verdict = TableCell(agreement.verdict, verdict=agreement.verdict)
    if agreement.kind == "contact" and agreement.note:
        return verdict, agreement.note
    return verdict, quantity(agreement.max, agreement.unit)


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
            "lab/questions/provenance",
            engine=engine,
            backend=engine.split()[0],
            moving=listed(moving) if moving else None,
            rest=[Section("", heading, [text], folded=True, detail=True)] if rest else [],
        )
    return blocks


def provenance(comparison: Comparison) -> Table:
    """What made both sides."""
    left, right = comparison.left.trace.header, comparison.right.trace.header
    rows = [("ran as", _ran_as(left), _ran_as(right))]
    versions, others = left.provenance.versions, right.provenance.versions
    for name in versions | others:
        rows.append((name, versions.get(name, NONE), others.get(name, NONE)))
    rows.append(("rows", f"{comparison.left.rows}", f"{comparison.right.rows}"))
    facts, other_facts = facts_of(left), facts_of(right)
    for name, fact in facts.items():
        if fact or other_facts[name]:
            rows.append((name, fact, other_facts[name]))
    return Table(
        ("what", *long_labels(comparison)),
        rows,
        "What made the two runs",
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
    facts["energies by"] = header.energy_by if header.energy_by else NONE
    facts["made again by"] = TableCell(header.command, code=True)
    return facts
