"""What has become of a sweep, as a page."""

from __future__ import annotations

from ..measures.text import count, listed
from ..page import Block, Page, Table, Text, Verdict
from ..sweep import PreparedSweep, SweepSummary


def page(ready: PreparedSweep, summary: SweepSummary) -> Page:
    """The summary, and how the dataset is read."""
    asked = ready.sweep
    text = (
        f"{count(summary.points, 'point')}"
        f"{f' ({listed(asked.vary)})' if asked.vary else ''}, {count(asked.seeds, 'seed')}, "
        f"{listed(list(ready.backends))}: {count(summary.cells, 'cell')}. "
        f"{_ran(summary)}"
    )
    blocks: list[Block] = [Text(text)]
    if summary.failed:
        rows = [("done", str(summary.done))]
        rows += [(kind, str(number)) for kind, number in summary.failed.items()]
        blocks.append(Table(("what became of them", "cells"), rows, words=frozenset({0})))
    blocks.append(Text(f"Read it: import pyarrow.dataset; {summary.read}"))
    failed = sum(summary.failed.values())
    if failed:
        blocks.append(
            Verdict(
                f"{count(failed, 'cell')} failed: the column error of each says why; "
                "--retry-failed runs them again",
                False,
            )
        )
    else:
        blocks.append(Verdict(f"{count(summary.done, 'cell')} done, none failed", True))
    versions = ", ".join(f"{name} {version}" for name, version in ready.versions.items())
    return Page(f"Sweep of {ready.sweep.what.rpartition('/')[2]}", versions, blocks)


def _ran(summary: SweepSummary) -> str:
    if not summary.ran:
        return "Nothing was missing."
    before = summary.cells - summary.ran
    kept = f"; {count(before, 'cell')} there before" if before else ""
    return f"{summary.ran} of them ran now, in {summary.seconds:.3g} s{kept}."
