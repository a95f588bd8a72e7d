"""From a sweep to an answer: how much each parameter moves a quantity, and where it is largest.

from statemachine.lab.sweep.analysis import effects

found = effects("sweep-damping", "max_qvel")
for each in found.effects:
    print(each.parameter, each.share, each.error)
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote as quoted
from typing import Literal

import numpy as np

from ...errors import BadInputError, check_name
from ...interface import Array
from ...measures.text import listed
from ...show.blocks import only_on_pages
from .design import Design, Value
from .folder import design_of, read_manifest
from .main_effects import LevelMean, MainEffects, main_effects
from .manifest import SweepManifest
from .quantities import (
    NEEDED_FOR,
    CellValues,
    SweepQuantity,
    cell_values,
    default_quantity,
    parse_quantity,
)
from .rows import read_cells

SweepVerdict = Literal["none", "together", "tied", "one"]
_TIE_STANDARD_ERRORS = 2.0  # standard errors


@dataclass(frozen=True)
class MainEffect:
    """The effect of one parameter on a quantity, whatever the others are.

    Attributes:
        parameter: Its label, as "damping" or "qpos[elbow_flex]".
        share: Its share of the quantity's variance over the settings [1], from 0 to 1; None where
            there is nothing to compute it from.
        error: The standard error of the share [1]; None where there is nothing to compute it from.
        levels: The mean of the quantity at each value of the parameter; of a range, in each class
            of samples.
    """

    parameter: str
    share: float | None
    error: float | None
    levels: tuple[LevelMean, ...]

    @property
    @only_on_pages
    def lowest(self) -> LevelMean | None:
        """Return the value at which the mean is smallest; None where there are too few samples."""
        return min(self.levels, key=_mean_of, default=None)

    @property
    @only_on_pages
    def highest(self) -> LevelMean | None:
        """Return the value at which the mean is largest; None where there are too few samples."""
        return max(self.levels, key=_mean_of, default=None)


def _mean_of(level: LevelMean) -> float:
    return level.mean


@dataclass(frozen=True)
class ExtremeCell:
    """The cell in which a quantity is largest, or smallest.

    Attributes:
        value: The quantity there, in its SI unit.
        settings: The value of each parameter.
        seed: Of the start.
    """

    value: float
    settings: tuple[Value, ...]
    seed: int


@dataclass(frozen=True)
class SweepEffects:
    """The effects of all parameters on a quantity of one engine, or on the gap between two.

    Attributes:
        what: The experiment, or the file and function without its folder.
        model: The names of the models' files, without their folders.
        folder: Of the dataset; "" for one that is not kept.
        command: What is typed to run the sweep, with the report of this quantity.
        more_runs: What is typed behind it to have the shares with their errors, as "--seeds 3"; ""
            where they have them, or there are none.
        versions: Of what the dataset was made with.
        backends: The engine; or the two engines that the gap is between.
        quantity: A column of the dataset, or one number of it.
        unit: Of the quantity, SI.
        parameters: What was varied.
        units: The unit of each parameter that has one.
        scaled: The parameters whose values are times the model's own.
        seeds: How many starts each setting has; of its seeds the median counts.
        samples: How many samples its ranges have; 0 without a range.
        effects: One for each parameter, the largest share first.
        why_none: Why no parameter has a share; "" where one has.
        mean: The mean over the settings that the shares are of, in the unit of the quantity.
        deviation: The standard deviation over them: the root of the variance that is shared.
        largest: The cell with the largest value, of all cells that have one.
        smallest: The cell with the smallest value, of all cells that have one.
        settings: How many settings the shares are of.
        left_out: How many other settings there are: those without a value, and those that go with
            them, so that all that stays was run at every combination.
        left_out_values: The values of a list or grid that are left out so, by parameter.
        failed: How many cells failed, by the class of the error.
        missing: How many cells have not run.
    """

    what: str
    model: tuple[str, ...]
    folder: str
    command: str
    more_runs: str
    versions: Mapping[str, str]
    backends: tuple[str, ...]
    quantity: str
    unit: str
    parameters: tuple[str, ...]
    units: Mapping[str, str]
    scaled: tuple[str, ...]
    seeds: int
    samples: int
    effects: tuple[MainEffect, ...]
    why_none: str
    mean: float
    deviation: float
    largest: ExtremeCell
    smallest: ExtremeCell
    settings: int
    left_out: int
    left_out_values: Mapping[str, tuple[Value, ...]]
    failed: Mapping[str, int]
    missing: int

    @property
    @only_on_pages
    def is_of_a_gap(self) -> bool:
        """Tell whether the quantity is the gap between two engines."""
        return len(self.backends) > 1

    @property
    @only_on_pages
    def has_shares(self) -> bool:
        """Tell whether parameters have shares of the variance."""
        return not self.why_none

    @property
    @only_on_pages
    def has_no_errors(self) -> bool:
        """Tell whether there are shares, and no share has a standard error."""
        return self.has_shares and all(effect.error is None for effect in self.effects)

    @property
    @only_on_pages
    def is_sampled(self) -> bool:
        """Tell whether a range is varied, whose samples are divided into classes."""
        return self.samples > 0

    @property
    @only_on_pages
    def where_largest(self) -> Mapping[str, Value]:
        """Return the value of each parameter in the cell with the largest value."""
        return dict(zip(self.parameters, self.largest.settings, strict=True))

    @property
    @only_on_pages
    def known_effects(self) -> tuple[MainEffect, ...]:
        """Return the effects that have a share, the largest first."""
        return tuple(effect for effect in self.effects if effect.share is not None)

    @property
    @only_on_pages
    def together(self) -> float | None:
        """Return the share that no parameter explains alone [1]; None where none has a share.

        Parameters do it together; of samples it is also what the quantity does within a class.
        """
        shares = [effect.share for effect in self.effects if effect.share is not None]
        return max(0.0, 1 - sum(shares)) if shares else None

    @property
    @only_on_pages
    def verdict(self) -> SweepVerdict:
        """Return in a word which parameter moves the quantity.

        Returns:
            "none": No parameter has a share.
            "together": What no parameter explains alone is more than what any does.
            "tied": The two largest shares are nearer to each other than twice the standard error
                of their difference.
            "one": One parameter has the largest share.
        """
        known = self.known_effects
        together = self.together
        if not known or together is None:
            return "none"
        first = known[0]
        if len(known) == 1 or first.share is None:
            return "one"
        if together > first.share:
            return "together"
        return "tied" if _are_tied(first, known[1]) else "one"


def _are_tied(first: MainEffect, second: MainEffect) -> bool:
    """Tell whether two shares differ by less than twice the standard error of their difference."""
    if first.share is None or second.share is None:
        return False
    if first.error is None or second.error is None:
        return False
    return first.share - second.share < _TIE_STANDARD_ERRORS * math.hypot(first.error, second.error)


def effects(
    folder: str | Path, quantity: str | None = None, backends: str | Sequence[str] = ()
) -> SweepEffects:
    """Compute how much each parameter of a sweep moves a quantity, and where it is largest.

    The shares are first-order sensitivity indices; `main_effects` says how they are computed.

    Args:
        folder: Of the dataset.
        quantity: A column of the dataset, or one number of it: "energy", "tip[2]". By default
            "sample_tip" of two engines, "tip[2]" of one.
        backends: One engine of the dataset, or two for the gap between them; by default all that
            it has.

    Raises:
        BadInputError: There is no dataset, no cell has that quantity, or it is not one number.
        UnknownNameError: The dataset has no such engine or quantity.
        MissingEngineError: A package is missing.
    """
    manifest = read_manifest(folder)
    design, seeds = design_of(manifest), manifest["design"]["seeds"]
    asked_for = (backends,) if isinstance(backends, str) else backends
    sides = _compared_backends(manifest["design"]["backends"], asked_for)
    table = read_cells(folder)
    asked = default_quantity(table, sides) if quantity is None else parse_quantity(quantity)
    points = list(design.points())
    cells = cell_values(table, asked, sides, [point.id for point in points], seeds)
    if not np.isfinite(cells.values).any():
        both = "both " if len(sides) > 1 else ""
        raise BadInputError(
            f"no setting of this sweep has {asked} on {both}{' and '.join(sides)}: "
            f"{_why_no_values(asked, cells)}"
        )
    shares = main_effects(design, cells.values, cells.rounding)
    ranked = [
        MainEffect(label, shares.shares[label], shares.errors[label], shares.levels[label])
        for label in shares.shares
    ]
    ranked.sort(key=_share_or_less, reverse=True)
    units = {vary.label: vary.unit_on() for vary in design.factors}
    settings = [point.values for point in points]
    command = _typed_report(manifest, folder, asked, sides)
    return SweepEffects(
        what=_last_part(manifest["request"]["what"]),
        model=tuple(_last_part(name) for name in manifest["files"]),
        folder=str(folder),
        command=command,
        more_runs=_typed_with_errors(design, shares),
        versions=_versions(manifest, sides),
        backends=sides,
        quantity=str(asked),
        unit=asked.unit,
        parameters=tuple(shares.shares),
        units={label: unit for label, unit in units.items() if unit},
        scaled=tuple(vary.label for vary in design.factors if vary.times),
        seeds=seeds,
        samples=design.samples if design.sampled else 0,
        effects=tuple(ranked),
        why_none=shares.why_none,
        mean=shares.mean,
        deviation=shares.deviation,
        largest=_cell_at(cells.values, settings, int(np.nanargmax(cells.values))),
        smallest=_cell_at(cells.values, settings, int(np.nanargmin(cells.values))),
        settings=shares.settings,
        left_out=len(points) - shares.settings,
        left_out_values=shares.left_out,
        failed=cells.failed,
        missing=cells.missing,
    )


def _versions(manifest: SweepManifest, backends: Sequence[str]) -> dict[str, str]:
    """Return the versions of this library and of engines that a dataset was made with."""
    versions = {"statemachine": manifest["versions"].get("statemachine", "")}
    for backend in backends:
        versions[backend] = manifest["versions"].get(backend.removesuffix(":engine"), "")
    return versions


def _why_no_values(quantity: SweepQuantity, cells: CellValues) -> str:
    """Return why no cell has a value."""
    failed = sum(cells.failed.values())
    if failed:
        return f"{failed} cells failed, the first with {cells.first_error}"
    if cells.missing:
        return f"{cells.missing} cells have not run; the same command runs them"
    needs = NEEDED_FOR.get(quantity.column)
    if needs:
        return f"it is of a robot with {needs}"
    return "the cells ran, and it came in none"


def _share_or_less(effect: MainEffect) -> float:
    """Return the share of an effect, and less than any where there is none."""
    return -1.0 if effect.share is None else effect.share


def _cell_at(values: Array, settings: Sequence[tuple[Value, ...]], number: int) -> ExtremeCell:
    """Return a cell of values (p, s), at p settings, by its number in the flat array."""
    place, seed = divmod(number, values.shape[1])
    return ExtremeCell(float(values[place, seed]), settings[place], seed)


def without_folder(report: SweepEffects) -> SweepEffects:
    """Return a report of a dataset that is not kept: no command names its folder."""
    command = report.command.replace(f" --out {quoted(report.folder)}", "")
    more_runs = report.more_runs.replace(" --extend", "")
    return replace(report, folder="", command=command, more_runs=more_runs)


def _typed_report(
    manifest: SweepManifest, folder: str | Path, quantity: SweepQuantity, backends: Sequence[str]
) -> str:
    """Return the command that runs a sweep and reports on a quantity of it."""
    working_folder = f"{Path.cwd()}{os.sep}"
    run = manifest["command"].replace(working_folder, "")
    run = run.replace(" --out DIR", f" --out {quoted(str(folder))}")
    engines = [f"--backend {name}" for name in backends]
    if set(backends) == set(manifest["design"]["backends"]):
        engines = []  # they are in the command of the run
    return " ".join([run, *engines, "--report", f"--quantity {quoted(str(quantity))}"])


def _typed_with_errors(design: Design, shares: MainEffects) -> str:
    """Return what is typed behind a sweep's command so that shares have errors; "" for none."""
    if shares.why_none or any(error is not None for error in shares.errors.values()):
        return ""
    return "--samples 64 --extend" if design.sampled else "--seeds 3 --extend"


def _last_part(name: str) -> str:
    """Return the name of a file without its folder; a known name, as so101/scene, as it is."""
    return Path(name).name if Path(name).is_absolute() else name


def _compared_backends(available: Sequence[str], requested: Sequence[str]) -> tuple[str, ...]:
    """Return the engine, or the two engines, that a report is about.

    Raises:
        UnknownNameError: The sweep has no such engine.
        BadInputError: They are more than two.
    """
    for name in requested:
        check_name("backend of this sweep", name, available)
    chosen = tuple(dict.fromkeys(requested or available))
    if len(chosen) > 2:
        raise BadInputError(
            f"a report is of one engine, or of the gap between two; got {listed(list(chosen))}: "
            "name one or two with --backend"
        )
    return chosen
