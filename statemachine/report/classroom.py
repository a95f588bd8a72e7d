"""The files of a class, judged, as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..grading.class_table import NOTHING, ClassEntry
from ..grading.judges import JUDGES
from ..measures.text import count
from ..page import Page, Table, Text, Verdict
from . import template


def page(entries: Sequence[ClassEntry], ignored: Sequence[str] = ()) -> Page:
    """A row a file, and what a teacher should look at.

    Args:
        entries: What became of each submission.
        ignored: Names of files that were not looked at.
    """
    columns: dict[str, Callable[[ClassEntry], str]] = {
        "file": lambda entry: entry.student or entry.name,
        "right": lambda entry: f"{entry.right} of {len(JUDGES)}" if entry.judged else "?",
        "what is not right": lambda entry: entry.reasons,
        "tests": lambda entry: entry.tests.partition(";")[0],
        "predictions": lambda entry: entry.predictions,
        "alike": lambda entry: entry.alike,
    }
    shown = {name: cell for name, cell in columns.items() if any(map(cell, entries))}
    table = Table.of(entries, shown, words=shown, wide={"predictions", "alike"})
    copies = [(e.name, f"has the same code as {e.same_as}.") for e in entries if e.same_as]
    looks = [(f"{entry.name}:", look) for entry in entries for look in entry.looks]
    unjudged = {
        entry.name: entry.refusal or next(e.remarks[0] for e in entry.functions if not e.judged)
        for entry in entries
        if not entry.judged
    }
    return template.page(
        "classroom",
        files=count(sum(entry.refusal != NOTHING for entry in entries), "file"),
        made_with=entries[0].made_with,
        table=table,
        solved=sum(entry.right == len(JUDGES) for entry in entries),
        ignored=", ".join(ignored) or None,
        notes=[Text(f"{name} {note}") for name, note in (*copies, *looks)],
        unjudged=[Verdict(f"{n} could not be judged: {why}", False) for n, why in unjudged.items()],
        all_judged=None if unjudged else True,
    )
