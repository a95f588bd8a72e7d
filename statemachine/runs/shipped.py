"""Recorded traces that come with the package, for where an engine has no wheel."""

from __future__ import annotations

from pathlib import Path

from ..errors import unknown_name
from .files import read
from .trace import Trace

_FOLDER = Path(__file__).resolve().parent / "recorded"


def shipped_names() -> list[str]:
    """Names as EXPERIMENT.BACKEND, and EXPERIMENT.BACKEND.engine for the engine's defaults."""
    return sorted(path.stem for path in _FOLDER.glob("*.npz"))


def shipped(experiment: str, backend: str, defaults: str = "model") -> Trace:
    """A trace that was recorded elsewhere; its header says on what.

    Raises:
        UnknownNameError: None was recorded of this.
    """
    name = f"{experiment}.{backend}" + (".engine" if defaults == "engine" else "")
    if name not in shipped_names():
        raise unknown_name("recorded trace", name, shipped_names())
    return read(_FOLDER / f"{name}.npz")
