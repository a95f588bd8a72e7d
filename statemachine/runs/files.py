"""Traces in files: npz, which NumPy reads, or parquet, which tables read; and their models."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

from ..errors import (
    BadInputError,
    MissingEngineError,
    ModelFileError,
    StateMachineError,
    TraceError,
    check_name,
    did_you_mean,
)
from ..models import resolve
from .formats import read_npz, read_parquet, write_npz, write_parquet
from .header import Header
from .provenance import model_digest
from .trace import Trace
from .whole import replace_file

SUFFIXES = (".npz", ".parquet")
# Recorded traces that come with the package, for where an engine has no wheel.
_FOLDER = Path(__file__).resolve().parent / "recorded"


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
    fill = write_parquet if target.suffix.lower() == ".parquet" else write_npz
    replace_file(target, partial(fill, trace))
    return target


def read(path: str | os.PathLike[str]) -> Trace:
    """Open a trace. No engine is needed; nothing in the file is run.

    A file is not trusted: it may unfold into 256 MB or into a hundred times its size, and
    into 4 GB at most. A parquet file carries a digest of its numbers, which is verified; an npz
    file has a checksum of each array.

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
        reason = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise TraceError(f"{source.name} is no trace: {reason}") from None


def shipped_names() -> list[str]:
    """Names as EXPERIMENT.BACKEND, and EXPERIMENT.BACKEND.engine for the engine's defaults."""
    return sorted(path.stem for path in _FOLDER.glob("*.npz"))


def shipped(experiment: str, backend: str, defaults: str = "model") -> Trace:
    """A trace that was recorded elsewhere; its header says on what.

    Raises:
        UnknownNameError: None was recorded of this.
    """
    name = f"{experiment}.{backend}" + (".engine" if defaults == "engine" else "")
    check_name("recorded trace", name, shipped_names())
    return read(_FOLDER / f"{name}.npz")


def model_file(
    header: Header,
    menagerie: str | os.PathLike[str] | None = None,
    beside: str | os.PathLike[str] | None = None,
) -> tuple[Path, bool]:
    """The file of the model that a trace is of, and whether it has the digest of that one.

    A header says folder and name and no machine's path. So the file is looked for under that
    name from here, among the models of the library and in the menagerie, then by its name
    alone here and beside the trace. One with the digest that the header has is preferred.

    Args:
        header: Of the trace.
        menagerie: A menagerie folder; $MENAGERIE if it is not given.
        beside: The trace's own file.

    Raises:
        ModelFileError: It is nowhere.
    """
    known = header.provenance
    candidates = list(dict.fromkeys(_candidates(known.model_file, menagerie, beside)))
    for path in candidates:
        if model_digest(path) == known.model_sha256:
            return path, True
    if not candidates:
        raise ModelFileError(
            f"the trace's model {known.model_file} is not here: say which it is with --model"
        )
    return candidates[0], False


def _known(path: str | os.PathLike[str]) -> Path:
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a trace is a file {' or '.join(SUFFIXES)}; got {target.name!r}")
    return target


def _missing(path: Path) -> TraceError:
    """The error for a file that is not there, with the nearest name beside it."""
    message = f"there is no trace {path}"
    if path.is_dir():
        message = f"{path} is a folder, not a trace"
    elif path.parent.is_dir():
        names = [file.name for file in path.parent.iterdir() if file.suffix in SUFFIXES]
        message += did_you_mean(path.name, names, 0.6)
    return TraceError(message)


def _candidates(
    name: str, menagerie: str | os.PathLike[str] | None, beside: str | os.PathLike[str] | None
) -> Iterator[Path]:
    folder = menagerie or os.environ.get("MENAGERIE") or None
    for where in (None, folder) if folder else (None,):
        with suppress(StateMachineError):
            yield resolve(name, where)
    last = Path(name).name
    for place in (Path(), Path(beside).parent) if beside is not None else (Path(),):
        with suppress(StateMachineError):
            yield resolve(place.absolute() / last)
