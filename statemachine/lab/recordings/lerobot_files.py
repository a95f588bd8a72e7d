"""Files of a data set of LeRobot: JSON, and columns of parquet files."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...errors import BadInputError, printable, shown
from ...git_lfs import START_LENGTH, check_is_no_pointer
from ...installed import require_extra
from ...interface import Array, Ints
from ...models import check_is_file

MOST_ROWS = 10_000_000  # of a file: 90 hours at 30 frames per second


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of a parquet file.

    Attributes:
        path: Of the file.
        rows: How many it has.
        values: The numbers of each column, one after the other; lists are unfolded.
    """

    path: Path
    rows: int
    values: Mapping[str, NDArray[np.generic]]

    def integers(self, name: str) -> Ints:
        """Return a column of whole numbers, (rows,).

        Raises:
            BadInputError: It holds something else.
        """
        array = self.values[name]
        if array.dtype.kind not in "iu" or len(array) != self.rows:
            raise BadInputError(f"{self.path}: column {name} does not hold whole numbers")
        return array.astype(np.int64)

    def numbers(self, name: str) -> Array:
        """Return a column of numbers, (rows,).

        Raises:
            BadInputError: It holds something else.
        """
        return self.lists(name, 1)[:, 0]

    def lists(self, name: str, width: int) -> Array:
        """Return a column of lists of as many numbers each, (rows, width).

        Raises:
            BadInputError: It holds something else.
        """
        array = self.values[name]
        if array.dtype.kind not in "fiu":
            raise BadInputError(f"{self.path}: column {name} does not hold numbers")
        if len(array) != width * self.rows:
            raise BadInputError(
                f"{self.path}: column {name} does not hold {width} numbers in every frame, as "
                "meta/info.json states"
            )
        with np.errstate(invalid="ignore"):  # of a damaged NaN, which is refused later
            return array.astype(np.float64).reshape(-1, width)


def read_columns(path: Path, names: tuple[str, ...]) -> Columns:
    """Return some columns of a parquet file.

    Raises:
        BadInputError: It is not there, or a pointer of git-lfs, or damaged, or lacks a column.
        MissingEngineError: pyarrow is not installed.
    """
    try:
        check_is_file(path)
        with path.open("rb") as start:
            check_is_no_pointer(path, start.read(START_LENGTH))
    except FileNotFoundError:
        raise BadInputError(f"there is no file {path}, which the data set's meta/ names") from None
    except OSError as error:
        raise BadInputError(f"{path} cannot be read: {error.strerror}") from None
    require_extra("pyarrow.parquet", "a recording of LeRobot", "pyarrow", "recordings")
    try:
        columns = _columns_of(path, names)
    except BadInputError:
        raise
    except Exception as error:  # damaged bytes may raise anything in pyarrow
        reason = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise BadInputError(f"{path} is not a whole parquet file: {printable(reason)}") from None
    return columns


def _columns_of(path: Path, names: tuple[str, ...]) -> Columns:
    parquet = importlib.import_module("pyarrow.parquet")
    with parquet.ParquetFile(path) as file:
        for name in names:
            if name not in file.schema_arrow.names:
                raise BadInputError(f"{path} has no column {name}")
        if file.metadata.num_rows > MOST_ROWS:
            raise BadInputError(
                f"{path} has {file.metadata.num_rows:,} rows; at most {MOST_ROWS:,} are read"
            )
        table = file.read(columns=list(names))
    values = {name: _numbers_of(table[name].combine_chunks(), name, path) for name in names}
    return Columns(path, table.num_rows, values)


def _numbers_of(column: Any, name: str, path: Path) -> NDArray[np.generic]:
    """Return the numbers of a column of pyarrow, those of its lists if it has lists."""
    types = importlib.import_module("pyarrow.types")
    kind = column.type
    has_lists = types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)
    values = column.flatten() if has_lists else column
    if column.null_count or values.null_count:
        raise BadInputError(f"{path}: column {name} has rows without a number")
    if has_lists and not _have_one_length(column):
        raise BadInputError(f"{path}: column {name} has more numbers in some rows than in others")
    return np.asarray(values.to_numpy(zero_copy_only=False))


def _have_one_length(lists: Any) -> bool:
    """Tell whether all lists of a column of pyarrow have as many numbers."""
    compute = importlib.import_module("pyarrow.compute")
    lengths = compute.min_max(compute.list_value_length(lists)).as_py()
    return lengths["min"] == lengths["max"]


def read_text(path: Path) -> str:
    """Return the text of a file.

    Raises:
        BadInputError: It cannot be read, or is a pointer of git-lfs.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f"{path} cannot be read: {printable(error)}") from None
    check_is_no_pointer(path, text[:START_LENGTH].encode())
    return text


def parse_object(text: str, path: Path) -> dict[str, object]:
    """Return an object of JSON.

    Raises:
        BadInputError: The text is something else.
    """
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"{path} is not JSON: {printable(error)}") from None
    if not isinstance(value, dict):
        raise BadInputError(f"{path} holds {shown(value)}, not an object of JSON")
    return cast("dict[str, object]", value)
