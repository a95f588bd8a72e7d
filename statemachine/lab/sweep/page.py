"""What a sweep has run, and what moves a quantity of it, as pages."""

from __future__ import annotations

from dataclasses import dataclass

from ...measures.text import NONE, fixed
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from . import SweepSummary
from .analysis import MainEffect, SweepEffects


@dataclass(frozen=True)
class SweepReportPage(PageContent):
    """Content of the page of what moves a quantity.

    Attributes:
        effects: Of all parameters.
        shares: Table with a row for each parameter.
    """

    template = "sweep_report.md.j2"
    effects: SweepEffects
    shares: Table

    @property
    def lost_cells(self) -> list[str]:
        """Cells without a result, by the reason."""
        failed = self.effects.failed.items()
        lost = [f"{number} cells failed with {kind}" for kind, number in failed]
        if self.effects.missing:
            lost.append(f"{self.effects.missing} cells have not run")
        return lost

    @property
    def left_out_values(self) -> list[str]:
        """Values of a list that are left out of the shares as a whole."""
        shown: list[str] = []
        for name, values in self.effects.left_out_values.items():
            words = [_value(self.effects, name, value) for value in values]
            shown.append(f"{name} = {', '.join(words)}")
        return shown


@dataclass(frozen=True)
class SweepPage(PageContent):
    """Content of the page of a summary.

    Attributes:
        summary: Of the dataset.
        outcomes: Table with a row for each thing that became of cells.
    """

    template = "sweep.md.j2"
    summary: SweepSummary
    outcomes: Table


def page(sweep: SweepEffects) -> Page:
    """Return the page of a report."""

    def where_largest(effect: MainEffect) -> str:
        return _value(sweep, effect.parameter, sweep.where_largest[effect.parameter])

    shares = Table.of(
        sweep.effects,
        {
            "parameter": lambda effect: effect.parameter,
            "share": lambda effect: _share(effect.share),
            "±": lambda effect: _share(effect.error),
            "where largest": where_largest,
        },
    )
    return render(SweepReportPage(sweep, shares))


def summary_page(summary: SweepSummary) -> Page:
    """Return the page of the summary, and of how the dataset is read."""
    rows = [("done", str(summary.done))]
    rows += [(kind, str(number)) for kind, number in summary.failed.items()]
    outcomes = Table(("what became of them", "cells"), rows, words=frozenset({0}))
    return render(SweepPage(summary, outcomes))


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
