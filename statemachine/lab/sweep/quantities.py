"""What a report of a sweep is about: one number for each setting and seed, from the dataset.

A quantity is a column of the dataset, or one number of a column of lists: "energy", "tip z",
"base x", "qpos[0]". On one engine it is that number; of two engines it is how far they are apart.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import BadInputError, check_name, shown
from ...interface import Array, Ints
from .rows import COLUMNS, DONE, require_parquet

_NAME = re.compile(r"(\w+)(?:\[([0-9]+)\])?")
_AXIS_NAME = re.compile(r"(\w+) ([xyz])")
_AXES = "xyz"
_NUMBERS = ("int64", "double", "list<double>", "list<list<double>>")
_INPUT_COLUMNS = ("seed", "sample_time")  # columns of numbers that say what was asked for
_KINDS = {
    column.name: column.type
    for column in COLUMNS
    if column.type in _NUMBERS and column.name not in _INPUT_COLUMNS
}
_UNITS = {column.name: column.unit for column in COLUMNS}
_MOMENTS = ("sample_qpos", "sample_tip")
_POSITION_COLUMNS = ("tip", "sample_tip", "base")  # their three numbers are one length
_FIRST_TOUCH = "first_touch"
# What a robot needs so that its runs have a column.
NEEDED_FOR = {
    "base": "a floating base",
    "distance": "a floating base",
    "fell": "a floating base",
    "tracking_error": "position servos of hinges",
    "slide_tracking_error": "position servos of slides",
    "tip": "a site",
    "sample_tip": "a site",
}
_ROUNDING = 1e-12  # of the largest number


@dataclass(frozen=True)
class SweepQuantity:
    """A column of the dataset of a sweep, or one number of it.

    Attributes:
        column: The column.
        index: Which number of a column of lists; None for all of them.
    """

    column: str
    index: int | None = None

    def __str__(self) -> str:
        if self.index is None:
            return self.column
        if self.column in _POSITION_COLUMNS and self.index < len(_AXES):
            return f"{self.column} {_AXES[self.index]}"
        return f"{self.column}[{self.index}]"

    @property
    def unit(self) -> str:
        """Return the SI unit of its column."""
        return _UNITS[self.column]


@dataclass(frozen=True, eq=False)
class CellValues:
    """A quantity in the cells of a sweep, for p points and s seeds.

    Attributes:
        values: (p, s) the quantity, or the gap of two engines in it [SI]; NaN where there is none.
        rounding: What values may differ by and be the same [SI]: a 1e-12 of the largest number.
        failed: How many cells failed, by the class of the error.
        first_error: The class and the text of the first error; "" without one.
        missing: How many cells have not run.
    """

    values: Array
    rounding: float
    failed: Mapping[str, int]
    first_error: str
    missing: int


def parse_quantity(text: str) -> SweepQuantity:
    """Read the name of a quantity: "energy", "tracking error", "base x", "qpos[0]".

    Raises:
        UnknownNameError: The dataset has no such column of numbers.
        BadInputError: It is no text.
    """
    if not isinstance(text, str):
        raise BadInputError(f"a quantity is a name, such as energy or base x; got {shown(text)}")
    place = _AXIS_NAME.fullmatch(text)
    if place and place[1] in _POSITION_COLUMNS:
        return SweepQuantity(place[1], _AXES.index(place[2]))
    words = text.replace(" ", "_")
    match = _NAME.fullmatch(words)
    column = match[1] if match else words
    check_name("quantity", column, _KINDS)
    index = match[2] if match else None
    return SweepQuantity(column, None if index is None else int(index))


def default_quantity(table: Any, backends: Sequence[str]) -> SweepQuantity:
    """Choose what a report is about where nobody said it.

    Of a robot that floats it is where the base is at the end: how far two engines are apart in
    it, or how far it got on one. Of two engines it is else the usual site at the moments that are
    kept, or the joints of a model without a site; of one engine the height of the site at the end,
    or the fastest joint.
    """
    floats = table["base"].null_count < table.num_rows
    has_site = table["tip"].null_count < table.num_rows
    if floats:
        return SweepQuantity("base" if len(backends) > 1 else "distance")
    if len(backends) > 1:
        return SweepQuantity("sample_tip" if has_site else "sample_qpos")
    return SweepQuantity("tip", 2) if has_site else SweepQuantity("max_qvel")


def cell_values(
    table: Any,
    quantity: SweepQuantity,
    backends: Sequence[str],
    points: Sequence[str],
    seeds: int,
) -> CellValues:
    """Read a quantity at every point and seed of a sweep.

    Args:
        table: The dataset, as `read_cells` gives it.
        quantity: What is read.
        backends: One engine; or two, for the gap between them.
        points: (p) the digests of the points of the design.
        seeds: How many seeds the sweep has.

    Raises:
        BadInputError: The quantity is not one number of a cell.
    """
    place = {point: k for k, point in enumerate(points)}
    keys = [table[name].to_pylist() for name in ("backend", "point", "seed")]
    rows: list[int] = []
    places: list[tuple[int, int, int]] = []
    for row, (backend, point, seed) in enumerate(zip(*keys, strict=True)):
        if backend in backends and point in place and seed < seeds:
            rows.append(row)
            places.append((backends.index(backend), place[point], seed))
    table = table.take(np.array(rows, dtype=int))
    shape = len(backends), len(points), seeds
    at = np.array(places, dtype=int).reshape(-1, 3)
    numbers = _arranged_by_cell(_numbers(table, quantity), at, shape)
    if len(backends) == 1:
        _check_is_one_number(quantity, numbers.shape[-1])
        values = numbers[0, ..., 0, 0]
    elif quantity.column == _FIRST_TOUCH:
        ends = _arranged_by_cell(_numbers(table, SweepQuantity("time")), at, shape)[..., 0, 0]
        values = _touch_gap(numbers[..., 0, 0], ends)
    else:
        values = _gap(quantity, numbers[0] - numbers[1])
    failed = Counter(kind for kind in table["error_class"].to_pylist() if kind)
    largest = float(np.fmax.reduce(np.abs(numbers), axis=None, initial=0.0))
    return CellValues(
        values,
        rounding=_ROUNDING * largest,
        failed=dict(failed.most_common()),
        first_error=_first_error(table),
        missing=int(np.prod(shape)) - len(rows),
    )


def check_is_one_number(quantity: SweepQuantity) -> None:
    """Refuse what has several numbers in a run, before there is one.

    Raises:
        BadInputError: It does.
    """
    kind = _KINDS[quantity.column]
    if quantity.index is None and quantity.column in _POSITION_COLUMNS:
        _check_is_one_number(quantity, len(_AXES))
    elif quantity.column in _MOMENTS:
        _check_is_one_number(quantity, 1)
    elif quantity.index is None and kind.startswith("list"):
        raise BadInputError(f"{quantity} has several numbers: say which one, as {quantity}[0]")
    elif quantity.index is not None and not kind.startswith("list"):
        raise BadInputError(f"there is no {quantity}: {quantity.column} is one number")


def _first_error(table: Any) -> str:
    """Return the class and the text of the first error of a dataset; "" without one."""
    for kind, text in zip(
        table["error_class"].to_pylist(), table["error"].to_pylist(), strict=True
    ):
        if kind:
            return f"{kind}: {text}"
    return ""


def _check_is_one_number(quantity: SweepQuantity, count: int) -> None:
    """Refuse what has several numbers in a cell.

    Raises:
        BadInputError: It does.
    """
    if quantity.column in _MOMENTS:
        end = quantity.column.removeprefix("sample_")
        raise BadInputError(
            f"{quantity} is of several moments, whose gap between two engines a report can be "
            f"about; of one engine {SweepQuantity(end, 0)} is the value at the end"
        )
    if count > 1:
        raise BadInputError(
            f"{quantity} has {count} numbers: say which one, {SweepQuantity(quantity.column, 0)} "
            f"to {SweepQuantity(quantity.column, count - 1)}"
        )


def _gap(quantity: SweepQuantity, difference: Array) -> Array:
    """Return how far two engines are apart (p, s): the largest of the moments.

    Args:
        quantity: What of; the numbers of a place are one length, of others the largest counts.
        difference: (p, s, m, d) of the engines; NaN where one has no run.
    """
    if quantity.column in _POSITION_COLUMNS and quantity.index is None:
        return _largest(np.linalg.norm(difference, axis=-1))
    return _largest(_largest(np.abs(difference)))


def _touch_gap(touch: Array, ends: Array) -> Array:
    """Return how far the first touches of two engines are apart (p, s) [s].

    A touch that only one engine has counts as the length of the shorter run; where neither has
    one they agree.

    Args:
        touch: (2, p, s) [s]; NaN without a touch.
        ends: (2, p, s) simulated time at the end [s]; NaN without a run.
    """
    touched = np.isfinite(touch).sum(axis=0)
    until = ends.min(axis=0)  # NaN where one has no run
    gap = np.abs(touch[0] - touch[1])
    return np.select([np.isnan(until), touched == 2, touched == 1], [np.nan, gap, until], 0.0)


def _largest(values: Array) -> Array:
    """Return the largest over the last axis of what is a number; NaN where nothing is."""
    return np.fmax.reduce(values, axis=-1, initial=np.nan)


def _arranged_by_cell(numbers: Array, at: Ints, shape: tuple[int, int, int]) -> Array:
    """Put numbers (n, m, d) of cells to their backend, point and seed: (b, p, s, m, d)."""
    placed: Array = np.full((*shape, *numbers.shape[1:]), np.nan)
    placed[tuple(at.T)] = numbers
    return placed


def _numbers(table: Any, quantity: SweepQuantity) -> Array:
    """Return the numbers (n, m, d) of a quantity in n rows, for m moments; NaN where none is.

    Raises:
        BadInputError: The column has no number of that index.
    """
    column, kind = table[quantity.column].combine_chunks(), _KINDS[quantity.column]
    if kind == "list<list<double>>":
        numbers = _by_moment(column)
    elif kind == "list<double>":
        numbers = _padded(column)[:, None]
    else:
        numbers = np.array(column.to_numpy(zero_copy_only=False), dtype=float)[:, None, None]
    # What a failed cell has was true before it failed, and is no result.
    numbers[[status != DONE for status in table["status"].to_pylist()]] = np.nan
    if quantity.index is None:
        return numbers
    if not kind.startswith("list"):
        raise BadInputError(f"there is no {quantity}: {quantity.column} is one number")
    if np.isnan(numbers).all():
        return numbers[..., :1]  # nothing is there, of any index
    if quantity.index >= numbers.shape[-1]:
        raise BadInputError(
            f"there is no {quantity}: {quantity.column} has {numbers.shape[-1]} numbers, from 0"
        )
    return numbers[..., quantity.index : quantity.index + 1]


def _padded(lists: Any) -> Array:
    """Return lists of numbers as an array (n, d), without a loop; NaN where one is short."""
    compute = require_parquet()[0].compute
    parents = compute.list_parent_indices(lists).to_numpy()
    counts = np.bincount(parents, minlength=len(lists))
    place = np.arange(len(parents)) - (np.cumsum(counts) - counts)[parents]
    values: Array = np.full((len(lists), counts.max(initial=1)), np.nan)
    values[parents, place] = compute.list_flatten(lists).to_numpy(zero_copy_only=False)
    return values


def _by_moment(lists: Any) -> Array:
    """Return lists of lists as an array (n, m, d); NaN where one is short.

    The last moment of a run stays the last: a run of few steps keeps fewer moments.
    """
    compute = require_parquet()[0].compute
    inner = _padded(compute.list_flatten(lists))
    run = compute.list_parent_indices(lists).to_numpy()  # of each moment
    counts = np.bincount(run, minlength=len(lists))
    from_end = np.cumsum(counts)[run] - np.arange(len(run))  # at least 1
    values: Array = np.full((len(lists), counts.max(initial=1), inner.shape[1]), np.nan)
    values[run, -from_end] = inner
    return values
