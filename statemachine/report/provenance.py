"""What made two runs, and what of the model is emulated."""

from __future__ import annotations

from ..compare import Comparison
from ..measures.text import listed, milliseconds, numbers
from ..page import Block, Section, Table, TableCell, Text
from ..runs import Header
from . import template

# Of the promises that a backend may emulate, those that move the arm, in plain words.
PHYSICS = {
    "position servo": "servos with the gains of the model",
    "armature": "armature",
    "joint damping": "damping",
    "dry friction": "dry friction",
    "joint limits": "joint limits",
}


def emulated(comparison: Comparison) -> list[Block]:
    """What of the model a backend keeps instead of its engine."""
    blocks: list[Block] = []
    engines = set()
    for side in (comparison.one, comparison.two):
        kept = side.provenance.emulated
        if not kept or side.defaults != "model" or side.engine in engines:
            continue
        engines.add(side.engine)
        moving = [PHYSICS[name] for name in kept if name in PHYSICS]
        rest = [name for name in kept if name not in PHYSICS]
        text = Text(
            "Promises of this library, and conventions of its states and forces: "
            f"{'; '.join(rest)}."
        )
        heading = f"What else this library adds to {side.engine}"
        blocks += template.blocks(
            "provenance",
            engine=side.engine,
            moving=listed(moving) if moving else None,
            rest=[Section("", heading, [text], folded=True, detail=True)] if rest else [],
        )
    return blocks


def provenance(headers: tuple[Header, Header], comparison: Comparison) -> Table:
    """What made both sides."""
    a, b = (header.provenance for header in headers)
    rows: list[tuple[str, ...]] = [
        (
            "ran as",
            *("recorded, opened here" if h.recorded else "run for this page" for h in headers),
        ),
        *(
            (e, a.versions.get(e, "–"), b.versions.get(e, "–"))
            for e in {**a.versions, **b.versions}
        ),
        ("model", a.model_file, b.model_file),
        ("its SHA-256", *(TableCell(p.model_sha256, code=True) for p in (a, b))),
        ("defaults", *(header.defaults for header in headers)),
        ("options", *(_options(header) for header in headers)),
        ("starts in", *(h.keyframe or "the default state" for h in headers)),
        ("timestep", *(milliseconds(h.timestep) + _substeps(h) for h in headers)),
        ("gravity", *(numbers(h.gravity) + " m/s²" for h in headers)),
        ("rows", f"{comparison.one.rows}", f"{comparison.two.rows}"),
        ("seed", *("none drawn" if p.seed is None else f"{p.seed}" for p in (a, b))),
        ("energies by", *(header.energy_by or "–" for header in headers)),
        ("made again by", *(TableCell(h.command, code=True) for h in headers)),
    ]
    labels = comparison.one.label, comparison.two.label
    told = [row for row in rows if any(row[1:])]
    return Table(("what", *labels), told, "What made the two runs", words=frozenset({0, 1, 2}))


def _options(header: Header) -> str:
    return ", ".join(f"{name} {value}" for name, value in header.options.items()) or "none"


def _substeps(header: Header) -> str:
    return f" in {header.substeps} substeps" if header.substeps > 1 else ""
