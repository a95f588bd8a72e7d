"""A trace as npz: a zip archive of NumPy arrays, and of the header as text."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from ..errors import TraceError, refuse
from .header import INPUTS, Header
from .trace import WHOLE, Trace, as_column, check_shapes, check_size

_HEADER_MOST = 2**24  # bytes of a header


def write_npz(trace: Trace, out: BinaryIO) -> None:
    """Write it; in single precision, but for the inputs, if its header says so."""
    columns: dict[str, Any] = dict(trace.columns)
    if trace.header.single:
        columns = {
            name: array if name in (*INPUTS, *WHOLE) else array.astype(np.float32)
            for name, array in columns.items()
        }
    header = np.frombuffer(trace.header.as_json().encode(), dtype=np.uint8)
    np.savez_compressed(out, header=header, **columns)


def read_npz(path: Path) -> tuple[Header, dict[str, Any]]:
    """Header and columns. What the archive says of itself is checked before it is unfolded."""
    with zipfile.ZipFile(path) as archive:
        entries = _entries(archive)
        if "header" not in entries:
            raise TraceError("has no header: it is no trace")
        header = _read_header(archive, entries.pop("header"))
        described = {name: _describe(archive, entry) for name, entry in entries.items()}
        for name, (_, kind) in described.items():
            if kind.kind not in ("iu" if name in WHOLE else "fiu"):
                what = "whole numbers" if name in WHOLE else "numbers"
                raise TraceError(f"column {name!r} holds {kind}, not {what}")
        check_shapes(header, {name: shape for name, (shape, _) in described.items()})
        check_size(sum(8 * int(np.prod(shape)) for shape, _ in described.values()), path)
        return header, {
            name: as_column(name, _unfold(archive, entry)) for name, entry in entries.items()
        }


def _entries(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The arrays by name."""
    entries: dict[str, zipfile.ZipInfo] = {}
    for entry in archive.infolist():
        name = entry.filename.removesuffix(".npy")
        refuse(
            (name == entry.filename, f"holds {name[:40]!r}, which is no array"),
            # Where a damaged list of contents hides its next entries.
            (entry.comment or entry.extra, "has a damaged list of contents"),
            (name in entries, f"holds two arrays {name[:40]!r}"),
            error=TraceError,
        )
        entries[name] = entry
    return entries


def _describe(
    archive: zipfile.ZipFile, entry: zipfile.ZipInfo
) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and kind of an array, from its first bytes."""
    with archive.open(entry) as file:
        version = npy.read_magic(file)
        if version not in ((1, 0), (2, 0)):
            raise TraceError(f"holds an array of npy version {version}")
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, _, kind = read(file)
    return shape, kind


def _read_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Header:
    shape, kind = _describe(archive, entry)
    size = math.prod(shape)
    refuse(
        (kind != np.uint8 or len(shape) != 1, "has a header that is no text: it is no trace"),
        (size > _HEADER_MOST, f"has a header of {size:,} bytes; at most {_HEADER_MOST:,}"),
        error=TraceError,
    )
    return Header.from_json(_unfold(archive, entry).tobytes().decode())


def _unfold(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Any:
    with archive.open(entry) as file:
        array = npy.read_array(file, allow_pickle=False)
        if file.read(1):  # its checksum is looked at when its end is reached
            raise TraceError(f"has more in {entry.filename!r} than its array")
    return array
