"""The dataset of a sweep: a row a cell, in Parquet files by backend."""

from __future__ import annotations

import hashlib
import io
import json
import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

from ...atomic_files import replace_bytes
from ...errors import BadInputError
from ...installed import require_extra
from ...models import check_is_file
from .design import Vary

DONE, FAILED = "done", "failed"  # the status of a cell
CELLS = "cells"  # the folder of the dataset, in that of the sweep
KEY = b"statemachine.sweep"  # of the provenance, in the metadata of each file
_DIGEST = b"statemachine.sha256"  # beside it, of all other bytes of the file
_DIGITS = hashlib.sha256().digest_size * 2


class Column(NamedTuple):
    """A column of a dataset.

    Attributes:
        name: Of the column.
        type: Arrow's, as "list<double>".
        unit: SI; "" for none.
        meaning: What it says.
    """

    name: str
    type: str
    unit: str
    meaning: str


# The columns beside those of the factors. docs/sweeps.md shows them.
COLUMNS = (
    Column("cell", "string", "", "digest of point, seed and backend: what names a row"),
    Column(
        "point", "string", "", "digest of the varied values: the same for every seed and backend"
    ),
    Column("seed", "int64", "", "what was drawn from"),
    Column("status", "string", "", "done or failed"),
    Column("error_class", "string", "", "of a failed cell, such as DivergedError or TimedOutError"),
    Column("error", "string", "", "of a failed cell: what happened, in one line"),
    Column(
        "wall_seconds", "double", "s", "by the clock, loading included; all else can be repeated"
    ),
    Column("steps", "int64", "", "timesteps that were taken"),
    Column("time", "double", "s", "simulated time at the end"),
    Column("qpos", "list<double>", "rad or m", "(nq,) at the end"),
    Column("qvel", "list<double>", "rad/s or m/s", "(nv,) at the end"),
    Column(
        "tip",
        "list<double>",
        "m",
        "(3,) the usual site at the end, in world axes; none without a site",
    ),
    Column(
        "base",
        "list<double>",
        "m",
        "(3,) the origin of the floating base at the end, in world axes; none of a fixed base",
    ),
    Column(
        "distance",
        "double",
        "m",
        "how far the floating base is from its start at the end, level; none of a fixed base",
    ),
    Column(
        "fell",
        "double",
        "",
        "1 if the floating base was below a third of its height at the start after any step, or "
        "turned over; else 0; none of a fixed base",
    ),
    Column(
        "tracking_error",
        "double",
        "rad",
        "root mean square, over steps and position servos of hinges, of joint minus target; none "
        "without",
    ),
    Column("slide_tracking_error", "double", "m", "the same of the position servos of slides"),
    Column("max_qvel", "double", "rad/s or m/s", "the largest size of a velocity in any step"),
    Column("energy_start", "double", "J", "kinetic and potential energy at the start"),
    Column("energy", "double", "J", "the same at the end"),
    Column("first_touch", "double", "s", "when the first step began in contact; none if none did"),
    Column("touch", "string", "", "which bodies touched then"),
    Column("sample_time", "list<double>", "s", "(n,) moments that are kept"),
    Column("sample_qpos", "list<list<double>>", "rad or m", "(n, nq) at these moments"),
    Column("sample_tip", "list<list<double>>", "m", "(n, 3) at these moments"),
    Column("engine_version", "string", "", "version of the engine"),
    Column("library_version", "string", "", "version of this library"),
)
MIN_PAUSE, _MAX_PAUSE, _PAUSE_SHARE = (
    5.0,
    60.0,
    0.02,
)  # seconds between two files, and of the time so far
_MAX_ROWS = 20_000  # rows of a file


def finite_or_none(figure: Any) -> float | None:
    """Return a figure; None where it is not a finite number."""
    return float(figure) if math.isfinite(figure) else None


def require_parquet() -> tuple[Any, Any]:
    """Import the packages pyarrow and pyarrow.parquet.

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    names = ("pyarrow", "pyarrow.parquet", "pyarrow.compute")
    arrow, parquet, _ = (require_extra(name, "a sweep", "pyarrow", "sweep") for name in names)
    return arrow, parquet


def schema_of(factors: Sequence[Vary], provenance: Mapping[str, object]) -> Any:
    """Return the schema of every file: the columns of the factors behind `seed`."""
    arrow, _ = require_parquet()
    kinds = {
        "bool": arrow.bool_(),
        "string": arrow.string(),
        "int64": arrow.int64(),
        "double": arrow.float64(),
        "list<double>": arrow.list_(arrow.float64()),
        "list<list<double>>": arrow.list_(arrow.list_(arrow.float64())),
    }
    fields = [
        arrow.field(
            column.name,
            kinds[column.type],
            metadata={"unit": column.unit, "meaning": column.meaning},
        )
        for column in columns_of(factors)
    ]
    text = json.dumps(provenance, sort_keys=True)
    return arrow.schema(fields, metadata={KEY: text.encode()})


def columns_of(factors: Sequence[Vary]) -> list[Column]:
    """Return every column: those of `COLUMNS`, and those of the factors."""
    varied = [Column(vary.column, vary.type, vary.unit_on(), vary.meaning) for vary in factors]
    return [*COLUMNS[:3], *varied, *COLUMNS[3:]]


class RowWriter:
    """Collects rows and writes them as files of many, each whole or not at all."""

    def __init__(
        self, folder: Path, factors: Sequence[Vary], provenance: Mapping[str, object]
    ) -> None:
        self._folder = folder / CELLS
        self._schema = schema_of(factors, provenance)
        self._waiting: dict[str, list[Mapping[str, Any]]] = {}
        self._began = self._flushed = time.monotonic()

    def add(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Take rows; from time to time, or when they are many, they are written."""
        for row in rows:
            self._waiting.setdefault(row["backend"], []).append(row)
        now = time.monotonic()
        # Seldom in a long sweep, so that its files stay few: what a kill loses is so much work.
        pause = min(_MAX_PAUSE, max(MIN_PAUSE, _PAUSE_SHARE * (now - self._began)))
        most = max(map(len, self._waiting.values()), default=0)
        if most >= _MAX_ROWS or now - self._flushed > pause:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        arrow, _ = require_parquet()
        for backend, rows in list(self._waiting.items()):
            folder = self._folder / f"backend={quote(backend, safe='=')}"
            folder.mkdir(parents=True, exist_ok=True)
            table = arrow.Table.from_pylist(rows, schema=self._schema).sort_by("cell")
            _write(folder / f"part-{time.time_ns()}.parquet", table)
            del self._waiting[backend]
        self._flushed = time.monotonic()


def _dataset_files(folder: Path) -> list[Path]:
    return sorted((folder / CELLS).glob("backend=*/part-*.parquet"))


def outcome_of(row: Mapping[str, Any]) -> str:
    """Return what became of a cell: "done", or the class of its error."""
    error = row.get("error_class")
    return row["status"] if error is None else error


def iter_cell_outcomes(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the id of every cell that the dataset has, and what became of it.

    Raises:
        BadInputError: A file does not belong to the dataset.
    """
    for part in _dataset_files(folder):
        for row in _read(part, ["cell", "status", "error_class"]).to_pylist():
            yield row["cell"], outcome_of(row)


def remove_failed(folder: Path) -> None:
    """Remove the rows of failed cells, file by file, each whole or not at all.

    A cell without a row is missing: whoever goes on runs it, however this ended.
    """
    arrow, _ = require_parquet()
    for part in _dataset_files(folder):
        table = _read(part)
        done = table.filter(arrow.compute.equal(table["status"], DONE))
        if not done.num_rows:
            part.unlink()
        elif done.num_rows < table.num_rows:
            _write(part, done)


def _read(part: Path, columns: Sequence[str] | None = None) -> Any:
    """Read a file of the dataset as a Table.

    Raises:
        BadInputError: It is damaged, or this library did not write it.
        OSError: It cannot be opened.
    """
    arrow, parquet = require_parquet()
    check_is_file(part)
    content = part.read_bytes()
    if _with_digest(content) != content:
        raise BadInputError(
            f"{part} cannot be read: it is not as it was written. Remove it, and its cells are run "
            "again"
        )
    # On this thread alone: one of Arrow's that still holds `content` when Python ends takes the
    # process down with it ("terminate called without an active exception").
    file = parquet.ParquetFile(arrow.BufferReader(content), page_checksum_verification=True)
    return file.read(columns, use_threads=False)


def _write(part: Path, table: Any) -> None:
    """Write a file: each page with Parquet's checksum, and all of it with a digest."""
    _, parquet = require_parquet()
    out = io.BytesIO()
    with parquet.ParquetWriter(
        out, table.schema, compression="zstd", write_page_checksum=True
    ) as writer:
        writer.write_table(table)
        writer.add_key_value_metadata({_DIGEST.decode(): "0" * _DIGITS})
    replace_bytes(part, _with_digest(out.getvalue()))


def _with_digest(content: bytes) -> bytes:
    """Return a file with the digest of all its other bytes where its footer has a place for it."""
    start = content.rfind(_DIGEST) + len(_DIGEST) + 2  # behind the key a type and a length
    before, after = content[:start], content[start + _DIGITS :]
    return before + hashlib.sha256(before + after).hexdigest().encode() + after


def read_cells(folder: str | Path) -> Any:
    """Read the dataset of a sweep as a pyarrow Table, in the order of the cells' ids.

    The column `backend`, which the folders' names tell, is the last.

    Raises:
        BadInputError: There is no dataset, or a file of it is damaged or of another one.
        MissingEngineError: pyarrow is not installed.
    """
    arrow, _ = require_parquet()
    tables: list[Any] = []
    for part in _dataset_files(Path(folder)):
        table = _read(part)
        backend = unquote(part.parent.name.partition("=")[2])
        names = arrow.repeat(arrow.scalar(backend, arrow.string()), table.num_rows)
        tables.append(table.append_column("backend", names))
        if not tables[0].schema.equals(tables[-1].schema):
            raise BadInputError(f"{part} has other columns than the files before it: remove it")
    if not tables:
        raise BadInputError(f"{folder} has no cells of a sweep")
    return arrow.concat_tables(tables).sort_by("cell")
