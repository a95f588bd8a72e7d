"""From a sweep to an answer: how much each parameter moves a quantity, and where it is largest.

from statemachine.lab.sweep.analysis import effects

found = effects("sweep-damping", "max_qvel")
for each in found.effects:
    print(each.parameter, each.share, each.error)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import BadInputError, check_name
from ...interface import Array
from ...measures.text import listed
from ...show.blocks import only_on_pages
from .design import Value
from .folder import design_of, read_manifest
from .main_effects import main_effects
from .manifest import SweepManifest
from .quantities import CellValues, cell_values, default_quantity, parse_quantity
from .rows import read_cells


@dataclass(frozen=True)
class MainEffect:
    """The effect of one parameter on a quantity, whatever the others are.

    Attributes:
        parameter: Its label, as "damping" or "qpos[elbow_flex]".
        share: Its share of the quantity's variance over the settings [1], from 0 to 1; None where
            there is nothing to compute it from.
        error: The standard error of the share [1]; None where there is nothing to compute it from.
    """

    parameter: str
    share: float | None
    error: float | None


@dataclass(frozen=True)
class LargestCell:
    """The cell in which a quantity is largest.

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
        what: The experiment.
        folder: Of the dataset.
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
        settings: How many settings the shares are of.
        left_out: How many other settings there are: those without a value, and those that go with
            them, so that all that stays was run at every combination.
        left_out_values: The values of a list or grid that are left out so, by parameter.
        failed: How many cells failed, by the class of the error.
        missing: How many cells have not run.
    """

    what: str
    folder: str
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
    largest: LargestCell
    settings: int
    left_out: int
    left_out_values: Mapping[str, tuple[Value, ...]]
    failed: Mapping[str, int]
    missing: int

    @property
    @only_on_pages
    def is_of_a_gap(self) -> bool:
        """Whether the quantity is the gap between two engines."""
        return len(self.backends) > 1

    @property
    @only_on_pages
    def has_shares(self) -> bool:
        """Whether parameters have shares of the variance."""
        return not self.why_none

    @property
    @only_on_pages
    def has_no_errors(self) -> bool:
        """Whether there are shares, and no share has a standard error."""
        return self.has_shares and all(effect.error is None for effect in self.effects)

    @property
    @only_on_pages
    def is_sampled(self) -> bool:
        """Whether a range is varied, whose samples are divided into classes."""
        return self.samples > 0

    @property
    @only_on_pages
    def where_largest(self) -> Mapping[str, Value]:
        """The value of each parameter in the cell with the largest value."""
        return dict(zip(self.parameters, self.largest.settings, strict=True))


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
    sides = _backends(manifest["design"]["backends"], asked_for)
    table = read_cells(folder)
    asked = default_quantity(table, sides) if quantity is None else parse_quantity(quantity)
    points = list(design.points())
    cells = cell_values(table, asked, sides, [point.id for point in points], seeds)
    if not np.isfinite(cells.values).any():
        both = "both " if len(sides) > 1 else ""
        raise BadInputError(
            f"no setting of this sweep has {asked} on {both}{' and '.join(sides)}: "
            f"{_why_nothing(cells)}"
        )
    shares = main_effects(design, cells.values, cells.rounding)
    found = [
        MainEffect(label, shares.shares[label], shares.errors[label]) for label in shares.shares
    ]
    found.sort(key=_share_or_less, reverse=True)
    units = {vary.label: vary.unit_on() for vary in design.factors}
    largest = _largest(cells.values, [point.values for point in points])
    return SweepEffects(
        what=manifest["request"]["what"],
        folder=str(folder),
        versions=_versions(manifest, sides),
        backends=sides,
        quantity=str(asked),
        unit=asked.unit,
        parameters=tuple(shares.shares),
        units={label: unit for label, unit in units.items() if unit},
        scaled=tuple(vary.label for vary in design.factors if vary.times),
        seeds=seeds,
        samples=design.samples if design.sampled else 0,
        effects=tuple(found),
        why_none=shares.why_none,
        mean=shares.mean,
        deviation=shares.deviation,
        largest=largest,
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


def _why_nothing(cells: CellValues) -> str:
    """Return why no cell has a value."""
    failed = sum(cells.failed.values())
    if failed:
        return f"{failed} cells failed, and the column error says why"
    if cells.missing:
        return f"{cells.missing} cells have not run; the same command runs them"
    return "the cells ran, and it came in none"


def _share_or_less(effect: MainEffect) -> float:
    """Return the share of an effect, and less than any where there is none."""
    return -1.0 if effect.share is None else effect.share


def _largest(values: Array, settings: Sequence[tuple[Value, ...]]) -> LargestCell:
    """Return the cell with the largest of values (p, s), at p settings."""
    place, seed = divmod(int(np.nanargmax(values)), values.shape[1])
    return LargestCell(float(values[place, seed]), settings[place], seed)


def _backends(there: Sequence[str], asked: Sequence[str]) -> tuple[str, ...]:
    """Return the engine, or the two engines, that a report is about.

    Raises:
        UnknownNameError: The sweep has no such engine.
        BadInputError: They are more than two.
    """
    for name in asked:
        check_name("backend of this sweep", name, there)
    chosen = tuple(dict.fromkeys(asked or there))
    if len(chosen) > 2:
        raise BadInputError(
            f"a report is of one engine, or of the gap between two; got {listed(list(chosen))}: "
            "name one or two with --backend"
        )
    return chosen
