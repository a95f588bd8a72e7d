"""What a sweep has run, and what moves a quantity of it, as pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...measures.text import NONE, fixed, listed, percent, quantity
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from . import SweepSummary
from .analysis import ExtremeCell, MainEffect, SweepEffects
from .design import Value
from .main_effects import LevelMean
from .results import SweepReportResult, SweepResult

_ROWS = 6  # parameters on the first screen
_DECIMALS = 2  # of a share


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
        """The parameter with the largest share; "" where none has one."""
        return _label(self.effects, 0)

    @property
    def second(self) -> str:
        """The parameter with the second largest share; "" where there is none."""
        return _label(self.effects, 1)

    @property
    def leader_share(self) -> str:
        """The largest share."""
        return _percent(self.effects, 0)

    @property
    def second_share(self) -> str:
        """The second largest share."""
        return _percent(self.effects, 1)

    @property
    def leads_alone(self) -> bool:
        """Whether the largest share is more than nothing."""
        shares = [effect.share for effect in self.effects.effects if effect.share is not None]
        return round(max(shares, default=0.0), _DECIMALS) > 0

    @property
    def has_together(self) -> bool:
        """Whether several parameters have shares, which may do something together."""
        return len(self.effects.known_effects) > 1

    @property
    def smallest(self) -> str:
        """The smallest value of all runs."""
        return quantity(self.effects.smallest.value, self.effects.unit)

    @property
    def largest(self) -> str:
        """The largest value of all runs."""
        return quantity(self.effects.largest.value, self.effects.unit)

    @property
    def command_of_details(self) -> str:
        """The command that shows all of it."""
        return f"{self.effects.command} --details"

    @property
    def not_shown(self) -> int:
        """How many parameters are left out of the table."""
        return len(self.effects.effects) - len(self.shares.rows)

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
    rows = len(sweep.effects) if details else _ROWS
    content = SweepReportPage(
        effects=sweep,
        details=details,
        shares=_shares(sweep, rows),
        extremes=_extremes(sweep),
        levels=tuple(_levels(sweep, effect) for effect in sweep.effects if effect.levels),
    )
    return render(content)


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

    return Table.of(
        sweep.effects[:rows],
        {
            "parameter": lambda effect: effect.parameter,
            "share": lambda effect: _share(effect.share),
            "±": lambda effect: _share(effect.error),
            "lowest mean": lowest,
            "highest mean": highest,
        },
    )


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
    return percent(known[place].share) if len(known) > place else NONE


def _level(sweep: SweepEffects, effect: MainEffect, level: LevelMean | None) -> str:
    """Return a mean and the value of the parameter that it is at."""
    if level is None:
        return NONE
    mean = quantity(level.mean, sweep.unit)
    return f"{mean} at {_value(sweep, effect.parameter, level.value)}"


def _setting(sweep: SweepEffects, cell: ExtremeCell) -> str:
    """Return the setting of a cell: "gain = 2 and friction = 0.4"."""
    values: Mapping[str, Value] = dict(zip(sweep.parameters, cell.settings, strict=True))
    return listed([f"{name} = {_value(sweep, name, value)}" for name, value in values.items()])


def _share(share: float | None) -> str:
    return NONE if share is None else fixed(share, _DECIMALS)


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
    """Return the page of what moves a quantity; there are no further details."""
    return page(result.effects)
