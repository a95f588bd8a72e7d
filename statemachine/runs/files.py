"""Traces in files: npz, which NumPy reads, or parquet, which tables read."""

from __future__ import annotations

import dataclasses
import difflib
import os
from pathlib import Path

from ..errors import BadInputError, MissingEngineError, TraceError
from .header import Header
from .npz_files import read_npz, write_npz
from .parquet_files import read_parquet, require_pyarrow, write_parquet
from .trace import Trace
from .whole import replace_file

SUFFIXES = (".npz", ".parquet")


def write(trace: Trace, path: str | os.PathLike[str]) -> Path:
    """Write a trace; the suffix, .npz or .parquet (zstd), says how.

    The file is written beside and then renamed: it is there whole or not at all. The same
    trace gives the same bytes.

    Returns:
        The path.

    Raises:
        BadInputError: Another suffix.
        TraceError: The header says something that `read` would refuse.
        MissingEngineError: Parquet, and pyarrow is not installed.
        OSError: It cannot be written.
    """
    target = _known(path)
    Header.from_json(trace.header.as_json())
    if target.suffix.lower() == ".parquet":
        require_pyarrow()
        replace_file(target, lambda out: write_parquet(trace, out))
    else:
        replace_file(target, lambda out: write_npz(trace, out))
    return target


def read(path: str | os.PathLike[str]) -> Trace:
    """Open a trace. No engine is needed; nothing in the file is run.

    A file is not trusted: it may unfold into 256 MB or into a hundred times its size, and
    into 4 GB at most. A parquet file carries a digest of its numbers, which is verified (one
    of an earlier version has none, and opens); an npz file has a checksum of each array.

    Raises:
        TraceError: The file is not there, or is no trace, or is damaged.
        MissingEngineError: Parquet, and pyarrow is not installed.
    """
    source = _known(path)
    if not source.is_file():
        raise _missing(source)
    reader = read_parquet if source.suffix.lower() == ".parquet" else read_npz
    try:
        header, columns = reader(source)
        return Trace(dataclasses.replace(header, recorded=True), columns)
    except TraceError as error:
        raise TraceError(f"{source.name}: {error}") from None
    except MemoryError:
        raise TraceError(f"{source.name}: does not fit into the memory that is free") from None
    except MissingEngineError:
        raise
    except Exception as error:  # bytes that are no trace may raise anything in those who read them
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise TraceError(f"{source.name} is no trace: {reason}") from None


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
