"""The files of a class, judged, as a page."""

from __future__ import annotations

from collections.abc import Sequence

from ..comparison.text import count
from ..grading.class_table import ClassEntry, verdict_word
from ..grading.judges import JUDGES
from ..page import Page, Table, Text, Verdict

_SHORT = {"right": "right", "wrong": "WRONG", "not written": "–", "not judged": "?"}


def page(entries: Sequence[ClassEntry], ignored: Sequence[str] = ()) -> Page:
    """A row a file, and what a teacher should look at.

    Args:
        entries: What became of each submission.
        ignored: Names of files that were not looked at.
    """
    rows = []
    for entry in entries:
        words = {each.function: verdict_word(each) for each in entry.functions}
        rows.append(
            (
                entry.name,
                *(_SHORT[words.get(name, "not judged")] for name in JUDGES),
                f"{entry.right} of {len(JUDGES)}" if entry.judged else "?",
            )
        )
    headers = [name.removeprefix("demo_") for name in JUDGES]
    blocks: list[Text | Table | Verdict] = [
        Table(("file", *headers, "right"), rows, words=frozenset(range(len(JUDGES) + 1)))
    ]
    solved = sum(entry.right == len(JUDGES) for entry in entries)
    blocks.append(Text(f"All functions are right in {solved} of {count(len(entries), 'file')}."))
    if ignored:
        blocks.append(Text(f"No Python files, and not looked at: {', '.join(ignored)}."))
    for entry in entries:
        if entry.same_as:
            blocks.append(Text(f"{entry.name} has the same code as {entry.same_as}."))
    unjudged = [entry for entry in entries if not entry.judged]
    for entry in unjudged:
        text = entry.refusal or next(e.remarks[0] for e in entry.functions if not e.judged)
        blocks.append(Verdict(f"{entry.name} could not be judged: {text}", False))
    if not unjudged:
        blocks.append(Verdict("every file was judged", True))
    return Page(f"{count(len(entries), 'file')} of a class", entries[0].made_with, blocks)
