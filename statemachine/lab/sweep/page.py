"""What a sweep has run, and what moves a quantity of it, as pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from ...measures.text import NO_NUMBER, fixed, listed, percent, quantity
from ...show.blocks import Page, Table
from ...show.first_screen import first_screen
from ...show.templates import PageContent, render
from . import SweepSummary
from .analysis import ExtremeCell, MainEffect, SweepEffects
from .design import Value
from .main_effects import LevelMean
from .results import SweepReportResult, SweepResult

_NextStep = Literal["more runs", "more runs in words", "details", "details in words", ""]
_DECIMALS = 2  # of a share
_MAX_COMMAND_LENGTH = 230  # characters of a command: three lines of a terminal
_INTERACTIONS_ROW = "(none alone)"  # the row of what no parameter explains alone


@dataclass(frozen=True)
class SweepReportPage(PageContent):
    """Content of the page of what moves a quantity.

    Attributes:
        effects: Of all parameters.
        details: Whether all of it is shown, and not the first screen alone.
        shares: Table with a row for each of the parameters that move it most.
        extremes: Table of the runs in which the quantity is smallest and largest.
        levels: Tables of the mean at each value, one for each parameter.
    """

    template = "sweep_report.md.j2"
    effects: SweepEffects
    details: bool
    shares: Table
    extremes: Table
    levels: tuple[Table, ...]

    @property
    def leader(self) -> str:
        """Return the parameter with the largest share; "" where none has one."""
        return _label(self.effects, 0)

    @property
    def second(self) -> str:
        """Return the parameter with the second largest share; "" where there is none."""
        return _label(self.effects, 1)

    @property
    def leader_share(self) -> str:
        """Return the largest share, in per cent."""
        return _percent(self.effects, 0)

    @property
    def second_share(self) -> str:
        """Return the second largest share, in per cent."""
        return _percent(self.effects, 1)

    @property
    def leads_alone(self) -> bool:
        """Tell whether the largest share is more than nothing, as it is printed."""
        shares = [effect.share for effect in self.effects.effects if effect.share is not None]
        return round(max(shares, default=0.0), _DECIMALS) > 0

    @property
    def smallest(self) -> str:
        """Return the smallest value of all runs, with its unit."""
        return quantity(self.effects.smallest.value, self.effects.unit)

    @property
    def largest(self) -> str:
        """Return the largest value of all runs, with its unit."""
        return quantity(self.effects.largest.value, self.effects.unit)

    @property
    def next_step(self) -> _NextStep:
        """Return what to do next.

        That is to run more where the shares have no errors, else to look at the details.
        """
        if self.effects.more_runs:
            return "more runs" if self._fits(self.effects.more_runs) else "more runs in words"
        if self.details:
            return ""
        return "details" if self._fits("--details") else "details in words"

    @property
    def next_command(self) -> str:
        """Return the command to type next; "" where there is none, or it is too wide."""
        behind = {"more runs": self.effects.more_runs, "details": "--details"}.get(self.next_step)
        return f"{self.effects.command} {behind}" if behind else ""

    def _fits(self, words: str) -> bool:
        """Tell whether the command with some words behind it is short enough."""
        return len(self.effects.command) + len(words) < _MAX_COMMAND_LENGTH

    @property
    def not_shown(self) -> int:
        """Return the number of parameters that are left out of the table."""
        shown = sum(1 for row in self.shares.rows if row[0] != _INTERACTIONS_ROW)
        return len(self.effects.effects) - shown

    @property
    def lost_count(self) -> int:
        """Return the number of cells without a result."""
        return sum(self.effects.failed.values()) + self.effects.missing

    @property
    def lost_cells(self) -> list[str]:
        """Return the number of cells without a result, by the reason."""
        lost = [f"{kind}: {number}" for kind, number in self.effects.failed.items()]
        if self.effects.missing:
            lost.append(f"not run: {self.effects.missing}")
        return lost

    @property
    def left_out_values(self) -> list[str]:
        """Return the values of a list that are left out of the shares as a whole."""
        parts: list[str] = []
        for name, values in self.effects.left_out_values.items():
            words = [_value(self.effects, name, value) for value in values]
            parts.append(f"{name} = {', '.join(words)}")
        return parts


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


def page(sweep: SweepEffects, details: bool = False) -> Page:
    """Return the page of a report: which parameter moves the quantity most comes first.

    Args:
        sweep: What moves the quantity.
        details: Whether all of it is shown, and not the first screen alone.
    """
    extremes = _extremes(sweep)
    levels = tuple(_levels(sweep, effect) for effect in sweep.effects if effect.levels)

    def with_rows(rows: int) -> Page:
        shares = _shares(sweep, rows)
        return render(SweepReportPage(sweep, details, shares, extremes, levels))

    count = len(sweep.effects)
    return with_rows(count) if details else first_screen(with_rows, count)


def summary_page(summary: SweepSummary) -> Page:
    """Return the page of the summary, and of how the dataset is read."""
    rows = [("done", str(summary.done))]
    rows += [(kind, str(number)) for kind, number in summary.failed.items()]
    outcomes = Table(("what became of them", "cells"), rows, words=frozenset({0}))
    return render(SweepPage(summary, outcomes))


def _shares(sweep: SweepEffects, rows: int) -> Table:
    """Return the shares of the parameters that move a quantity most, and which way each does."""

    def lowest(effect: MainEffect) -> str:
        return _level(sweep, effect, effect.lowest)

    def highest(effect: MainEffect) -> str:
        return _level(sweep, effect, effect.highest)

    table = Table.of(
        sweep.effects[:rows],
        {
            "parameter": lambda effect: effect.parameter,
            "share": lambda effect: _share(effect.share),
            "±": lambda effect: _share(effect.error),
            "min mean": lowest,
            "max mean": highest,
        },
    )
    if len(sweep.known_effects) < 2 or rows == 1:
        return table
    remainder = (_INTERACTIONS_ROW, _share(sweep.together), "", "", "")
    return replace(table, rows=[*table.rows, remainder])


def _extremes(sweep: SweepEffects) -> Table:
    """Return the runs in which the quantity is smallest and largest."""
    rows: list[list[str]] = []
    for name, cell in (("smallest", sweep.smallest), ("largest", sweep.largest)):
        value = quantity(cell.value, sweep.unit)
        rows.append([name, value, _setting(sweep, cell), str(cell.seed)])
    headers = ("run", "value", "at", "seed")
    return Table(headers, rows, words=frozenset({0, 2}))


def _levels(sweep: SweepEffects, effect: MainEffect) -> Table:
    """Return the mean of the quantity at each value of a parameter."""
    return Table.of(
        effect.levels,
        {
            effect.parameter: lambda level: _value(sweep, effect.parameter, level.value),
            "mean": lambda level: quantity(level.mean, sweep.unit),
        },
    )


def _label(sweep: SweepEffects, place: int) -> str:
    """Return the parameter whose share has a place among the largest; "" for none."""
    known = sweep.known_effects
    return known[place].parameter if len(known) > place else ""


def _percent(sweep: SweepEffects, place: int) -> str:
    """Return the share that has a place among the largest, in per cent."""
    known = sweep.known_effects
    return percent(known[place].share) if len(known) > place else NO_NUMBER


def _level(sweep: SweepEffects, effect: MainEffect, level: LevelMean | None) -> str:
    """Return a mean and the value of the parameter that it is at."""
    if level is None:
        return NO_NUMBER
    mean = quantity(level.mean, sweep.unit)
    return f"{mean} at {_value(sweep, effect.parameter, level.value)}"


def _setting(sweep: SweepEffects, cell: ExtremeCell) -> str:
    """Return the setting of a cell: "gain = 2 and friction = 0.4"."""
    values: Mapping[str, Value] = dict(zip(sweep.parameters, cell.settings, strict=True))
    return listed([f"{name} = {_value(sweep, name, value)}" for name, value in values.items()])


def _share(share: float | None) -> str:
    return NO_NUMBER if share is None else fixed(share, _DECIMALS)


def _value(sweep: SweepEffects, parameter: str, value: Value) -> str:
    """Return a value of a parameter as it is read: "0.5x", "on", "euler", "0.002 s"."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if not isinstance(value, float):
        return str(value)
    if parameter in sweep.scaled:
        return f"{value:.4g}x"
    return f"{value:.4g} {sweep.units.get(parameter, '')}".strip()


def result_page(result: SweepResult, details: bool = False) -> Page:
    """Return the page of a sweep that ran; there are no further details."""
    return summary_page(result.summary)


def report_page(result: SweepReportResult, details: bool = False) -> Page:
    """Return the page of what moves a quantity."""
    return page(result.effects, details)
