"""The files of a class, judged, as a page."""

from __future__ import annotations

from collections.abc import Sequence

from ..grading.class_table import NOTHING, ClassEntry
from ..grading.judges import JUDGES
from ..measures.text import count
from ..page import Page, Table, Text, Verdict


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
    blocks: list[Text | Table | Verdict] = [table]
    solved = sum(entry.right == len(JUDGES) for entry in entries)
    files = count(sum(entry.refusal != NOTHING for entry in entries), "file")
    blocks.append(Text(f"All functions are right in {solved} of {files}."))
    if ignored:
        blocks.append(Text(f"No Python files, and not looked at: {', '.join(ignored)}."))
    for entry in entries:
        if entry.same_as:
            blocks.append(Text(f"{entry.name} has the same code as {entry.same_as}."))
        blocks += [Text(f"{entry.name}: {look}") for look in entry.looks]
    unjudged = [entry for entry in entries if not entry.judged]
    for entry in unjudged:
        text = entry.refusal or next(e.remarks[0] for e in entry.functions if not e.judged)
        blocks.append(Verdict(f"{entry.name} could not be judged: {text}", False))
    if not unjudged:
        blocks.append(Verdict("every file was judged", True))
    return Page(f"{files} of a class", entries[0].made_with, blocks)
