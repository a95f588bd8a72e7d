"""What has become of a sweep, as a page."""

from __future__ import annotations

from ..measures.text import count, listed
from ..page import Page, Table
from ..sweep import PreparedSweep, SweepSummary
from . import template
from .template import if_true, versions_of


def page(ready: PreparedSweep, summary: SweepSummary) -> Page:
    """The summary, and how the dataset is read."""
    asked, failed = ready.sweep, sum(summary.failed.values())
    before = summary.cells - summary.ran
    rows = [(kind, str(n)) for kind, n in {"done": summary.done, **summary.failed}.items()]
    outcomes = Table(("what became of them", "cells"), rows, words=frozenset({0}))
    return template.page(
        "sweep",
        what=asked.what.rpartition("/")[2],
        versions=versions_of(ready.versions),
        points=count(summary.points, "point"),
        varied=f" ({listed(asked.vary)})" if asked.vary else "",
        seeds=count(asked.seeds, "seed"),
        backends=listed(list(ready.backends)),
        cells=count(summary.cells, "cell"),
        idle=if_true(not summary.ran),
        ran=summary.ran or None,
        seconds=summary.seconds,
        before=f"; {count(before, 'cell')} there before" if before else "",
        outcomes=[outcomes] if summary.failed else [],
        read=summary.read,
        bad=False if failed else None,
        failed=count(failed, "cell"),
        good=None if failed else True,
        done=count(summary.done, "cell"),
    )
