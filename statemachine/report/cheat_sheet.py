"""One page to print: what to type, with this library and on each engine, and what to remember."""

from __future__ import annotations

from html import escape

from ..probes.phrasebook import CONCEPTS, Phrasebook
from .template import versions_of

# With this library, concept by concept: a program, as the engines' own cells are.
OURS = {
    "load": 'import statemachine as sm\nm = sm.load("so101/scene")\nd = sm.make_data(m)',
    "state": "d.qpos[0], d.qvel[0] = 0.4, 0",
    "command": "d.ctrl[0] = 1.0",
    "step": "sm.step(m, d)",
    "recompute": "sm.forward(m, d)",
    "read a site": 'tip = d.site_xpos[m.site_id("gripperframe")]',
    "reset": "sm.reset(m, d)",
    "save": "saved = sm.get_state(m, d)\nsm.step(m, d, 100)\nsm.set_state(m, d, saved)  # back",
    "many worlds": "worlds = [sm.make_data(m) for _ in range(3)]",
}
# What each lesson of the path shows, in a line.
REMEMBER = (
    ("objects", "A Model never changes. A Data is everything that does."),
    ("state", "A joint's slots in qpos and in qvel differ: jnt_qposadr, jnt_dofadr."),
    ("write", "data.qpos is the array itself; a copy is data.qpos.copy()."),
    ("forward", "A write changes nothing that is derived. forward recomputes it; no time passes."),
    ("forward", "step computes, then moves: what it leaves is of the state before. Call forward."),
    ("hold", "ctrl is the only wire in: one number for each actuator."),
    ("gravity", "ctrl = 0 is a command: a servo holds its joint at 0."),
    ("reset", "A keyframe has a time of its own."),
    ("replay", "The same state and the same commands give the same bits. That is not truth."),
    ("time", "Nothing waits. Count steps; do not compare times."),
)


def cheat_sheet(table: Phrasebook) -> str:
    """The page as Markdown, with a table in HTML.

    Args:
        table: The engines' own cells, as they were run; those that did not work are left out.
    """
    cells = {
        engine: {phrase.concept: phrase.code for phrase in phrases if phrase.works}
        for engine, phrases in table.engines.items()
    }
    columns = {"statemachine": OURS} | {name: each for name, each in cells.items() if each}
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *columns))
    rows = []
    for concept in CONCEPTS:
        row = "".join(
            f"<td><pre>{escape(column[concept])}</pre></td>" if concept in column else "<td></td>"
            for column in columns.values()
        )
        rows.append(f"<tr><th>{escape(concept)}</th>{row}</tr>")
    versions = versions_of(table.versions)
    lines = "\n".join(f"- {text} (`lesson {lesson}`)" for lesson, text in REMEMBER)
    body = "\n".join(rows)
    return (
        "# Cheat sheet\n\n"
        f"*Every cell was run on {versions}.*\n\n"
        '<table class="cheat-sheet">\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>\n\n"
        f"## What to remember\n\n{lines}\n"
    )
