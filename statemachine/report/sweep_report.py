"""What a sweep has run, and what moves a quantity of it, as pages."""

from __future__ import annotations

from ..measures.text import NONE, count, fixed, listed, quantity
from ..page import Page, Table
from ..sweep import PreparedSweep, SweepSummary
from ..sweep.analysis import SweepEffects
from . import template
from .template import if_true, versions_of

# Of a range that is sampled, in the sentence of what is missing to 1.
_WITHIN = ", and what the quantity does within the classes into which samples are divided"


def page(sweep: SweepEffects) -> Page:
    """Return the page of a report."""
    gap = len(sweep.backends) > 1
    largest = dict(zip(sweep.parameters, sweep.largest.settings, strict=True))
    table = Table.of(
        sweep.effects,
        {
            "parameter": lambda each: each.parameter,
            "share": lambda each: _share(each.share),
            "±": lambda each: _share(each.error),
            "where largest": lambda each: _value(sweep, each.parameter, largest[each.parameter]),
        },
        "What moves it: shares of its variance over the settings",
    )
    failed = [f"{number} cells failed with {kind}" for kind, number in sweep.failed.items()]
    missing = [f"{sweep.missing} cells have not run"] if sweep.missing else []
    alone = [
        f"{name} = {', '.join(_value(sweep, name, value) for value in values)}"
        for name, values in sweep.left_out_values.items()
    ]
    return template.page(
        "sweep_report",
        what=sweep.what,
        quantity=sweep.quantity,
        engine=None if gap else sweep.backends[0],
        pair=listed(list(sweep.backends)) if gap else None,
        origin="; ".join(filter(None, (versions_of(sweep.versions), sweep.folder))),
        settings=count(sweep.settings, "setting"),
        seeds=sweep.seeds,
        mean=quantity(sweep.mean, sweep.unit),
        deviation=quantity(sweep.deviation, sweep.unit),
        largest=quantity(sweep.largest.value, sweep.unit),
        seed=sweep.largest.seed,
        table=table,
        shares=if_true(not sweep.why_none),
        classes=_WITHIN if sweep.samples else "",
        no_error=if_true(not sweep.why_none and all(each.error is None for each in sweep.effects)),
        why_none=sweep.why_none or None,
        lost="; ".join([*failed, *missing]) or None,
        left_out=count(sweep.left_out, "setting") if sweep.left_out else None,
        levels="; ".join(alone) or None,
    )


def _share(share: float | None) -> str:
    return NONE if share is None else fixed(share, 2)


def _value(sweep: SweepEffects, parameter: str, value: object) -> str:
    """Return a value of a parameter as it is read: "0.5x", "on", "euler", "0.002 s"."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if not isinstance(value, float):
        return str(value)
    if parameter in sweep.scaled:
        return f"{value:.4g}x"
    return f"{value:.4g} {sweep.units.get(parameter, '')}".strip()


def summary_page(ready: PreparedSweep, summary: SweepSummary) -> Page:
    """Return the page of the summary, and of how the dataset is read."""
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
        outcomes=outcomes if summary.failed else None,
        read=summary.read,
        bad=False if failed else None,
        failed=count(failed, "cell"),
        good=None if failed else True,
        done=count(summary.done, "cell"),
    )
