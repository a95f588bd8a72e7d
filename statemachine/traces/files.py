"""Traces in files: npz, which NumPy reads, or parquet, which tables read."""

from __future__ import annotations

import dataclasses
import difflib
import importlib
import os
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import BadInputError, MissingEngineError, TraceError
from .trace import COLUMNS, CONTACTS, INPUTS, WHOLE, Header, Trace

SUFFIXES = (".npz", ".parquet")
_MOST = 4 * 2**30  # bytes that a trace may unfold into
_KEY = b"statemachine.trace"  # of the header in a parquet file


def write(trace: Trace, path: str | os.PathLike[str]) -> Path:
    """Write a trace; the suffix, .npz or .parquet (zstd), says how.

    The file is written beside and then renamed: it is there whole or not at all. The same
    trace gives the same bytes.

    Returns:
        The path.

    Raises:
        BadInputError: Another suffix.
        MissingEngineError: Parquet, and pyarrow is not installed.
        OSError: It cannot be written.
    """
    target = _known(path)
    if target.suffix.lower() == ".parquet":
        table = _table(trace, _pyarrow())
        replace_file(target, lambda out: _write_parquet(table, out))
    else:
        replace_file(target, lambda out: _write_npz(trace, out))
    return target


def read(path: str | os.PathLike[str]) -> Trace:
    """Open a trace. No engine is needed; nothing in the file is run.

    Raises:
        TraceError: The file is not there, or is no trace.
        MissingEngineError: Parquet, and pyarrow is not installed.
        OSError: It cannot be read.
    """
    source = _known(path)
    if not source.is_file():
        raise _missing(source)
    reader = _read_parquet if source.suffix.lower() == ".parquet" else _read_npz
    try:
        text, columns = reader(source)
        header = dataclasses.replace(Header.from_json(text), recorded=True)
        return Trace(header, columns)
    except TraceError as error:
        raise TraceError(f"{source.name}: {error}") from None


@contextmanager
def beside(target: Path) -> Iterator[str]:
    """The name of a new file beside a place, which is renamed to it: whole or not at all.

    It ends as the target does, for programs that go by that.
    """
    handle, name = tempfile.mkstemp(
        dir=target.parent, prefix=f".{target.name}.", suffix=target.suffix
    )
    os.close(handle)
    try:
        yield name
        # mkstemp gives a file that its owner alone may read.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, target)
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise


def replace_file(target: Path, fill: Callable[[BinaryIO], object]) -> None:
    """Write a file beside its place and rename it: whole or not at all."""
    with beside(target) as name, open(name, "wb") as out:
        fill(out)  # closed before it is renamed


def _known(path: str | os.PathLike[str]) -> Path:
    found = Path(path)
    if found.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a trace is a file {' or '.join(SUFFIXES)}; got {found.name!r}")
    return found


def _missing(path: Path) -> TraceError:
    """The error for a file that is not there, with the nearest name beside it."""
    message = f"there is no trace {path}"
    if path.is_dir():
        message = f"{path} is a folder, not a trace"
    elif path.parent.is_dir():
        names = [file.name for file in path.parent.iterdir() if file.suffix in SUFFIXES]
        close = difflib.get_close_matches(path.name, names, n=1, cutoff=0.6)
        message += f". Did you mean {close[0]}?" if close else ""
    return TraceError(message)


def _write_npz(trace: Trace, out: BinaryIO) -> None:
    columns: dict[str, Any] = dict(trace.columns)
    if trace.header.single:
        columns = {
            name: array if name in (*INPUTS, *WHOLE) else array.astype(np.float32)
            for name, array in columns.items()
        }
    header = np.frombuffer(trace.header.as_json().encode(), dtype=np.uint8)
    np.savez_compressed(out, header=header, **columns)


def _read_npz(path: Path) -> tuple[str, dict[str, Any]]:
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
        _bearable(sum(entry.file_size for entry in entries))
        strange = [entry.filename for entry in entries if not entry.filename.endswith(".npy")]
        if strange:
            raise TraceError(f"holds {strange[0][:40]!r}, which is no array")
        with np.load(path, allow_pickle=False) as file:
            if "header" not in file:
                raise TraceError("has no header: it is no trace")
            if file["header"].dtype != np.uint8:
                raise TraceError("has a header that is no text: it is no trace")
            text = file["header"].tobytes().decode()
            columns = {
                name: _as_column(name, file[name]) for name in file.files if name != "header"
            }
    except TraceError:
        raise
    except (
        OSError,
        ValueError,
        EOFError,
        KeyError,
        RuntimeError,  # a password; NotImplementedError: another packing
        MemoryError,  # an array that says it is larger than it is
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise TraceError(f"is no trace: {error or type(error).__name__}") from None
    return text, columns


def _bearable(size: int) -> None:
    if size > _MOST:
        raise TraceError(f"unfolds into {size / 2**30:.1f} GB; at most {_MOST >> 30}")


def _as_column(name: str, array: Any) -> Any:
    kinds = "iu" if name in WHOLE else "fiu"
    if array.dtype.kind not in kinds:
        what = "whole numbers" if name in WHOLE else "numbers"
        raise TraceError(f"column {name!r} holds {array.dtype}, not {what}")
    return array.astype(np.int64 if name in WHOLE else np.float64)


def _pyarrow() -> Any:
    try:
        importlib.import_module("pyarrow.parquet")
    except ImportError as error:
        raise MissingEngineError(
            "parquet needs pyarrow: pip install 'statemachine-sim[parquet]'; "
            "npz needs nothing more",
            engine="pyarrow",
        ) from error
    return importlib.import_module("pyarrow")


def _table(trace: Trace, arrow: Any) -> Any:
    """Columns of one number, or of a list of as many as a row has; contacts as lists of rows."""
    columns = {}
    for name in COLUMNS:
        if name in trace:
            width = int(np.prod(trace.header.shape(name), dtype=int))
            if width:  # a column of empty lists cannot be written
                columns[name] = _fixed(arrow, trace[name], width, name == "time")
    if "contact_row" in trace:
        counts = np.bincount(trace["contact_row"], minlength=len(trace))
        offsets = arrow.array(np.concatenate([[0], np.cumsum(counts)]).astype(np.int32))
        for name, shape in CONTACTS.items():
            if name != "contact_row":
                width = int(np.prod(shape, dtype=int))
                values = _fixed(arrow, trace[name], width, not shape)
                columns[name] = arrow.ListArray.from_arrays(offsets, values)
    table = arrow.table(columns)
    return table.replace_schema_metadata({_KEY: trace.header.as_json().encode()})


def _fixed(arrow: Any, values: Any, width: int, alone: bool) -> Any:
    flat = arrow.array(np.ascontiguousarray(values).reshape(-1))
    return flat if alone else arrow.FixedSizeListArray.from_arrays(flat, width)


def _write_parquet(table: Any, out: BinaryIO) -> None:
    parquet = importlib.import_module("pyarrow.parquet")
    parquet.write_table(table, out, compression="zstd")


def _read_parquet(path: Path) -> tuple[str, dict[str, Any]]:
    arrow = _pyarrow()
    parquet = importlib.import_module("pyarrow.parquet")
    try:
        with parquet.ParquetFile(path) as file:
            groups = (file.metadata.row_group(k) for k in range(file.metadata.num_row_groups))
            _bearable(sum(group.total_byte_size for group in groups))
            table = file.read()
        text = (table.schema.metadata or {}).get(_KEY, b"").decode()
        if not text:
            raise TraceError("has no header: it is no trace")
        header = Header.from_json(text)
        columns: dict[str, Any] = {}
        for name in table.column_names:
            if name in CONTACTS:
                _contacts(name, table[name].combine_chunks(), columns)
            elif name in COLUMNS:
                array = table[name].combine_chunks()
                flat = array if name == "time" else array.flatten()
                values = np.asarray(flat.to_numpy(zero_copy_only=False), dtype=np.float64)
                columns[name] = values.reshape(table.num_rows, *header.shape(name))
        for name in ("qpos", "qvel", "ctrl", "xpos", "xquat", "site_xpos", "site_xmat"):
            if name not in columns and 0 in header.shape(name):
                columns[name] = np.empty((table.num_rows, *header.shape(name)))
    except TraceError:
        raise
    except (
        OSError,
        ValueError,
        TypeError,
        AttributeError,
        MemoryError,
        arrow.ArrowException,
    ) as error:
        raise TraceError(f"is no trace: {str(error).splitlines()[0]}") from None
    return text, columns


def _contacts(name: str, array: Any, columns: dict[str, Any]) -> None:
    counts = np.diff(array.offsets.to_numpy())
    columns["contact_row"] = np.repeat(np.arange(len(array)), counts)
    values = array.flatten()
    if CONTACTS[name]:
        values = values.flatten()
    kind = np.int64 if name in WHOLE else np.float64
    columns[name] = np.asarray(values.to_numpy(zero_copy_only=False), dtype=kind).reshape(
        -1, *CONTACTS[name]
    )
