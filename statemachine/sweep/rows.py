"""The dataset of a sweep: a row a cell, in Parquet files by backend."""

from __future__ import annotations

import importlib
import itertools
import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import BadInputError
from ..installed import require_extra
from ..traces.whole import replace_file
from .cell import DONE
from .factors import Vary

CELLS = "cells"  # the folder of the dataset, in that of the sweep
KEY = b"statemachine.sweep"  # of the provenance, in the metadata of each file
# The columns beside those of the factors: name, type, what it is. docs/sweeps.md shows it.
COLUMNS = (
    ("cell", "string", "digest of point, seed and backend: what names a row"),
    ("point", "string", "digest of the varied values: the same for every seed and backend"),
    ("seed", "int64", "what was drawn from"),
    ("status", "string", "done or failed"),
    (
        "error_class",
        "string",
        "of a failed cell, such as DivergedError or TimedOutError",
    ),
    ("error", "string", "of a failed cell: what happened, in one line"),
    (
        "wall_seconds",
        "double",
        "by the clock, loading included [s]; all else can be repeated",
    ),
    ("steps", "int64", "timesteps that were taken"),
    ("time", "double", "simulated time at the end [s]"),
    ("qpos", "list<double>", "(nq,) at the end [rad or m]"),
    ("qvel", "list<double>", "(nv,) at the end [rad/s or m/s]"),
    ("tip", "list<double>", "(3,) fingertip at the end, in world axes [m]; none without a site"),
    ("max_qvel", "double", "the largest size of a velocity in any step [rad/s or m/s]"),
    ("energy_start", "double", "kinetic and potential energy at the start [J]"),
    ("energy", "double", "the same at the end"),
    ("first_touch", "double", "when the first step began in contact [s]; none if none did"),
    ("touch", "string", "which bodies touched then"),
    ("sample_time", "list<double>", "(n,) moments that are kept [s]"),
    ("sample_qpos", "list<list<double>>", "(n, nq) at these moments"),
    ("sample_tip", "list<list<double>>", "(n, 3) at these moments"),
    ("engine_version", "string", "version of the engine"),
    ("library_version", "string", "version of this library"),
)
MEASURED = ("wall_seconds",)
_SOON, _LATE, _SHARE = 5.0, 60.0, 0.02  # seconds between two files, and of the time so far
_MOST = 20_000  # rows of a file


def require_parquet() -> tuple[Any, Any]:
    """The packages pyarrow and pyarrow.parquet.

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    names = ("pyarrow", "pyarrow.parquet", "pyarrow.compute")
    arrow, parquet, _ = (require_extra(name, "a sweep", "pyarrow", "sweep") for name in names)
    return arrow, parquet


def schema_of(factors: Sequence[Vary], provenance: Mapping[str, Any]) -> Any:
    """The schema of every file: the columns of the factors behind `seed`."""
    arrow, _ = require_parquet()
    kinds = {
        "string": arrow.string(),
        "int64": arrow.int64(),
        "double": arrow.float64(),
        "list<double>": arrow.list_(arrow.float64()),
        "list<list<double>>": arrow.list_(arrow.list_(arrow.float64())),
    }
    fields = [arrow.field(name, kinds[kind]) for name, kind, _ in COLUMNS]
    varied = [arrow.field(vary.column, _kind(arrow, vary)) for vary in factors]
    text = json.dumps(provenance, sort_keys=True)
    return arrow.schema([*fields[:3], *varied, *fields[3:]], metadata={KEY: text.encode()})


def _kind(arrow: Any, vary: Vary) -> Any:
    if vary.numeric:
        return arrow.float64()
    return arrow.bool_() if isinstance(vary.values[0], bool) else arrow.string()


class RowWriter:
    """Collects rows and writes them as files of many, each whole or not at all."""

    def __init__(
        self, folder: Path, factors: Sequence[Vary], provenance: Mapping[str, Any]
    ) -> None:
        self._folder, self._factors = folder / CELLS, tuple(factors)
        self._schema = schema_of(factors, provenance)
        self._waiting: dict[str, list[dict[str, Any]]] = {}
        self._began = self._flushed = time.monotonic()

    def add(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Take rows; from time to time, or when they are many, they are written."""
        for row in rows:
            values = zip(self._factors, row["values"], strict=True)
            varied = {vary.column: value for vary, value in values}
            kept = {name: value for name, value in row.items() if name != "values"}
            self._waiting.setdefault(kept.pop("backend"), []).append({**kept, **varied})
        now = time.monotonic()
        # Seldom in a long sweep, so that its files stay few: what a kill loses is so much work.
        pause = min(_LATE, max(_SOON, _SHARE * (now - self._began)))
        full = any(len(found) >= _MOST for found in self._waiting.values())
        if full or now - self._flushed > pause:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        arrow, _ = require_parquet()
        for backend in sorted(self._waiting):
            rows = sorted(self._waiting[backend], key=lambda row: row["cell"])
            folder = self._folder / f"backend={backend}"
            folder.mkdir(parents=True, exist_ok=True)
            table = arrow.Table.from_pylist(rows, schema=self._schema)
            _write(_unused(folder, rows[0]["cell"]), table)
            del self._waiting[backend]
        self._flushed = time.monotonic()


def _unused(folder: Path, cell: str) -> Path:
    """The name of a new file: that of its first cell, which another one had if that failed."""
    names = (folder / f"part-{cell}{f'-{k}' if k else ''}.parquet" for k in itertools.count())
    return next(path for path in names if not path.exists())


def _parts(folder: Path) -> list[Path]:
    return sorted((folder / CELLS).glob("backend=*/part-*.parquet"))


def counted(folder: Path) -> Iterator[tuple[str, str]]:
    """Id of every cell that the dataset has, and "done" or the class of its error.

    Raises:
        BadInputError: A file is none of the dataset.
    """
    for part in _parts(folder):
        table = _read(part, ["cell", "status", "error_class"])
        columns = (table[name].to_pylist() for name in table.column_names)
        for cell, status, error_class in zip(*columns, strict=True):
            yield cell, error_class or status


def remove_failed(folder: Path) -> None:
    """Remove the rows of failed cells, file by file, each whole or not at all.

    A cell without a row is missing: whoever goes on runs it, however this ended.
    """
    arrow, _ = require_parquet()
    for part in _parts(folder):
        table = _read(part)
        done = arrow.compute.equal(table["status"], DONE)
        kept = table.filter(done)
        if kept.num_rows == table.num_rows:
            continue
        if kept.num_rows:
            _write(part, kept)
        else:
            part.unlink()


def _read(part: Path, columns: Sequence[str] | None = None) -> Any:
    """A file of the dataset as a Table.

    Raises:
        BadInputError: It is damaged.
    """
    _, parquet = require_parquet()
    try:
        return parquet.read_table(part, columns=columns, partitioning=None)
    except Exception as error:
        raise BadInputError(
            f"{part} cannot be read ({type(error).__name__}); remove it, and its cells are "
            "run again"
        ) from None


def _write(part: Path, table: Any) -> None:
    _, parquet = require_parquet()
    replace_file(part, lambda out: parquet.write_table(table, out, compression="zstd"))


def read_cells(folder: str | Path) -> Any:
    """The dataset of a sweep as a pyarrow Table, in the order of its cells' ids.

    The column `backend`, which the folders' names tell, is the last.

    Raises:
        BadInputError: There is no dataset, or a file of it is damaged.
        MissingEngineError: pyarrow is not installed.
    """
    arrow, _ = require_parquet()
    folder = Path(folder)
    if not _parts(folder):
        raise BadInputError(f"{folder} has no cells of a sweep")
    dataset = importlib.import_module("pyarrow.dataset")
    backend = arrow.schema([("backend", arrow.string())])
    try:
        found = dataset.dataset(
            folder / CELLS,
            format="parquet",
            partitioning=dataset.partitioning(backend, flavor="hive"),
            exclude_invalid_files=False,
        )
        return found.to_table().sort_by("cell")
    except (arrow.ArrowException, OSError):
        for part in _parts(folder):
            _read(part)  # says which one
        raise
