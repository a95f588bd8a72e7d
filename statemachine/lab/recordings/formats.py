"""A trace as npz, a zip archive of NumPy arrays and of the header as text; or as parquet.

Parquet is a table that other programs read, with the header in its metadata.
"""

from __future__ import annotations

import hashlib
import importlib
import math
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from ...errors import TraceError
from ...installed import require_extra
from ...interface import MOCAP
from .header import COLUMNS, CONTACTS, INPUTS, Header
from .trace import INTEGER_COLUMNS, Trace, as_column, check_shapes, check_size

_MAX_HEADER_SIZE = 2**24  # bytes of a header
# Of the header in the metadata: a digest of header and columns, then the header. Parquet
# has no checksum of its own that every reader looks at.
_DIGEST_KEY = b"statemachine.trace.sha256"
_DIGEST_LENGTH = hashlib.sha256().digest_size * 2


def write_npz(trace: Trace, out: BinaryIO) -> None:
    """Write it; in single precision, but for the inputs, if its header says so."""
    columns: dict[str, Any] = dict(trace.columns)
    if trace.header.single_precision:
        columns = {
            name: array if name in (*INPUTS, *MOCAP, *INTEGER_COLUMNS) else array.astype(np.float32)
            for name, array in columns.items()
        }
    header = np.frombuffer(trace.header.as_json().encode(), dtype=np.uint8)
    np.savez_compressed(out, header=header, **columns)


def read_npz(path: Path) -> tuple[Header, dict[str, Any]]:
    """Read header and columns; what the archive states is checked before it is unpacked."""
    with zipfile.ZipFile(path) as archive:
        entries = _archive_entries(archive)
        if "header" not in entries:
            raise TraceError("has no header: it is not a trace")
        header = _read_header(archive, entries.pop("header"))
        described = {name: _shape_and_dtype(archive, entry) for name, entry in entries.items()}
        for name, (_, kind) in described.items():
            if kind.kind not in ("iu" if name in INTEGER_COLUMNS else "fiu"):
                what = "whole numbers" if name in INTEGER_COLUMNS else "numbers"
                raise TraceError(f"column {name!r} holds {kind}, not {what}")
        check_shapes(header, {name: shape for name, (shape, _) in described.items()})
        check_size(sum(8 * int(np.prod(shape)) for shape, _ in described.values()), path)
        return header, {
            name: as_column(name, _array_of(archive, entry)) for name, entry in entries.items()
        }


def _archive_entries(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """Return the archive's arrays by name."""
    entries: dict[str, zipfile.ZipInfo] = {}
    for entry in archive.infolist():
        name = entry.filename.removesuffix(".npy")
        if name == entry.filename:
            raise TraceError(f"holds {name[:40]!r}, which is not an array")
        if entry.comment or entry.extra:  # where a damaged list of contents hides its next entries
            raise TraceError("has a damaged list of contents")
        if name in entries:
            raise TraceError(f"holds two arrays {name[:40]!r}")
        entries[name] = entry
    return entries


def _shape_and_dtype(
    archive: zipfile.ZipFile, entry: zipfile.ZipInfo
) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Return shape and dtype of an array, from its first bytes."""
    with archive.open(entry) as file:
        version = npy.read_magic(file)
        if version not in ((1, 0), (2, 0)):
            raise TraceError(f"holds an array of npy version {version}")
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, _, kind = read(file)
    return shape, kind


def _read_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Header:
    shape, kind = _shape_and_dtype(archive, entry)
    if kind != np.uint8 or len(shape) != 1:
        raise TraceError("has a header that is not text: it is not a trace")
    size = math.prod(shape)
    if size > _MAX_HEADER_SIZE:
        raise TraceError(f"has a header of {size:,} bytes; at most {_MAX_HEADER_SIZE:,}")
    return Header.from_json(_array_of(archive, entry).tobytes().decode())


def _array_of(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Any:
    with archive.open(entry) as file:
        array = npy.read_array(file, allow_pickle=False)
        if file.read(1):  # its checksum is looked at when its end is reached
            raise TraceError(f"has more in {entry.filename!r} than its array")
    return array


def write_parquet(trace: Trace, out: BinaryIO) -> None:
    """Write it, compressed with zstd.

    Raises:
        MissingEngineError: pyarrow is not installed.
    """
    arrow, parquet = _pyarrow()
    parquet.write_table(_arrow_table(trace, arrow), out, compression="zstd")


def read_parquet(path: Path) -> tuple[Header, dict[str, Any]]:
    """Read header and columns; they are refused unless their digest is the one that was written.

    Raises:
        MissingEngineError: pyarrow is not installed.
    """
    _, parquet = _pyarrow()
    with parquet.ParquetFile(path) as file:
        known = (file.metadata.metadata or {}).get(_DIGEST_KEY)
        if known is None:
            raise TraceError("has no header: it is not a trace")
        digest, text = known[:_DIGEST_LENGTH].decode(), known[_DIGEST_LENGTH:].decode()
        header = Header.from_json(text)
        check_size(_uncompressed_size(file.metadata, header), path)
        columns = _columns(file.read(), header)
    if digest != content_digest(text, columns):
        raise TraceError("is damaged: its numbers are not those that were written")
    return header, columns


def _pyarrow() -> tuple[Any, Any]:
    """Import the package pyarrow, and its part for parquet.

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    require_extra("pyarrow.parquet", "parquet", "pyarrow", "parquet", "npz needs nothing more")
    return importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")


def content_digest(text: str, columns: dict[str, Any]) -> str:
    """Return the SHA-256 of a header and of the numbers that a file stores, as hex digits."""
    digest = hashlib.sha256(text.encode())
    for name in sorted(columns):
        array = columns[name]
        if 0 in array.shape[1:]:  # of no width, and not in the file
            continue
        if array.dtype.kind == "f":  # files do not tell one NaN from another
            array = np.where(np.isnan(array), np.nan, array)
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _uncompressed_size(metadata: Any, header: Header) -> int:
    """Return the size of all numbers of a file [bytes], as its metadata state it.

    Contacts, whose number no header says, count as they are packed. What the file says of a
    single column is not asked for: where it is damaged, pyarrow ends the process.
    """
    width = sum(int(np.prod(header.shape(name), dtype=int)) for name in COLUMNS)
    groups = (metadata.row_group(k) for k in range(metadata.num_row_groups))
    return 8 * width * metadata.num_rows + sum(group.total_byte_size for group in groups)


def _arrow_table(trace: Trace, arrow: Any) -> Any:
    """Return columns of numbers, or of lists of as many as a row has; contacts as lists of rows."""
    columns, offsets = {}, None
    if "contact_row" in trace:
        counts = np.bincount(trace["contact_row"], minlength=len(trace))
        offsets = arrow.array(np.concatenate([[0], np.cumsum(counts)]).astype(np.int32))
    for name in (*COLUMNS, *CONTACTS):
        shape = trace.header.shape(name)
        width = int(np.prod(shape, dtype=int))  # a column of empty lists cannot be written
        if name in trace and width and name != "contact_row":
            values = arrow.array(np.ascontiguousarray(trace[name]).reshape(-1))
            values = arrow.FixedSizeListArray.from_arrays(values, width) if shape else values
            is_contact = name in CONTACTS
            columns[name] = arrow.ListArray.from_arrays(offsets, values) if is_contact else values
    text = trace.header.as_json()
    numbers = {name: as_column(name, array) for name, array in trace.columns.items()}
    value = (content_digest(text, numbers) + text).encode()
    return arrow.table(columns).replace_schema_metadata({_DIGEST_KEY: value})


def _columns(table: Any, header: Header) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    for name in (name for name in table.column_names if name in COLUMNS or name in CONTACTS):
        values, shape = table[name].combine_chunks(), header.shape(name)
        if name in CONTACTS:
            counts = np.diff(values.offsets.to_numpy())
            columns["contact_row"] = np.repeat(np.arange(len(values)), counts)
            values = values.flatten()
        flat = values.flatten() if shape else values
        numbers = as_column(name, flat.to_numpy(zero_copy_only=False))
        columns[name] = numbers.reshape(-1, *shape)
    for name in ("qpos", "qvel", "ctrl", "xpos", "xquat", "site_xpos", "site_xmat"):
        if name not in columns and 0 in header.shape(name):
            columns[name] = np.empty((table.num_rows, *header.shape(name)))
    return columns
