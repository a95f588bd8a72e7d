"""The model that a trace is of: its file, looked for where it may be."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from ..errors import ModelFileError, StateMachineError
from ..models import resolve
from .header import Header
from .provenance import model_digest


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
    found = list(dict.fromkeys(_candidates(known.model_file, menagerie, beside)))
    for path in found:
        if model_digest(path) == known.model_sha256:
            return path, True
    if not found:
        raise ModelFileError(
            f"the trace's model {known.model_file} is not here: say which it is with --model"
        )
    return found[0], False


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
