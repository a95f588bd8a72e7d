"""What is run on two sides, as words and objects: an experiment, a function, a policy, traces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...errors import TraceError
from ..recordings import Trace, read
from ..recordings.files import SUFFIXES
from ..runs.controllers import Function, file_and_name_of

What = str | Function | Trace  # that is run on two sides, or played again


def without_folders(model: str) -> str:
    """Return a model as one types it, without folders."""
    return Path(model).name if Path(model).is_file() else model


def is_trace(what: str | Function) -> bool:
    """Tell whether a word names a trace, by its suffix; a function does not."""
    return isinstance(what, str) and Path(what).suffix.lower() in SUFFIXES


def word_of(what: What) -> str:
    """Return what is run, in a word: as one types it without folders; else its name."""
    if isinstance(what, str):
        return Path(what).name
    if isinstance(what, Trace):
        return what.header.experiment or "a trace"
    return file_and_name_of(what)[1]


def trace_of(what: What) -> Trace:
    """Return a trace, read from its file if that is named.

    Raises:
        TraceError: The file is not a trace, or it is a function.
    """
    if isinstance(what, Trace):
        return Trace(replace(what.header, recorded=True), what.columns)
    if isinstance(what, str):
        return read(what)
    raise TraceError(f"{word_of(what)} is a function, and the other is a trace: two traces, or one")
