"""The files of a class, judged, as a page."""

from __future__ import annotations

from collections.abc import Sequence

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
    columns = {
        "file": [entry.student or entry.name for entry in entries],
        "right": [f"{e.right} of {len(JUDGES)}" if e.judged else "?" for e in entries],
        "what is not right": [entry.reasons for entry in entries],
        "tests": [entry.tests.partition(";")[0] for entry in entries],
        "predictions": [entry.predictions for entry in entries],
        "alike": [entry.alike for entry in entries],
    }
    shown = {name: cells for name, cells in columns.items() if any(cells)}
    rows = list(zip(*shown.values(), strict=True))
    all_words, wide = range(len(shown)), {"predictions", "alike"}
    table = Table(
        list(shown),
        rows,
        words=frozenset(all_words),
        wide=frozenset(k for k, name in enumerate(shown) if name in wide),
    )
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
        table=[table],
        solved=sum(entry.right == len(JUDGES) for entry in entries),
        ignored=", ".join(ignored) or None,
        notes=[Text(f"{name} {note}") for name, note in (*copies, *looks)],
        unjudged=[Verdict(f"{n} could not be judged: {why}", False) for n, why in unjudged.items()],
        all_judged=None if unjudged else True,
    )
