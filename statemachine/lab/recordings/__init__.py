"""Traces: what a run did, recorded on any engine, opened again on none.

    trace = record(model, controller, seconds=2.0)
    write(trace, "hold.npz")
    again = read("hold.npz")

A recorder stands on the public face of the core; a file is npz, or parquet with the extra. Names
are imported when they are first used: a lesson runs a robot, and records nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .files import export_csv, model_file, read, shipped, shipped_names, write
    from .header import COLUMNS, CONTACTS, Header
    from .recorder import RunMetadata, RunStart, record
    from .rerun import (
        Rerun,
        SideStart,
        beginning_with,
        commands_of,
        play,
        record_scenario,
        replayed,
        rerun_of,
        start_of,
    )
    from .trace import Trace

_HOMES = {
    "COLUMNS": "header",
    "CONTACTS": "header",
    "Header": "header",
    "Rerun": "rerun",
    "RunMetadata": "recorder",
    "RunStart": "recorder",
    "SideStart": "rerun",
    "Trace": "trace",
    "beginning_with": "rerun",
    "commands_of": "rerun",
    "export_csv": "files",
    "model_file": "files",
    "play": "rerun",
    "read": "files",
    "record": "recorder",
    "record_scenario": "rerun",
    "replayed": "rerun",
    "rerun_of": "rerun",
    "shipped": "files",
    "shipped_names": "files",
    "start_of": "rerun",
    "write": "files",
}

__all__ = [
    "COLUMNS",
    "CONTACTS",
    "Header",
    "Rerun",
    "RunMetadata",
    "RunStart",
    "SideStart",
    "Trace",
    "beginning_with",
    "commands_of",
    "export_csv",
    "model_file",
    "play",
    "read",
    "record",
    "record_scenario",
    "replayed",
    "rerun_of",
    "shipped",
    "shipped_names",
    "start_of",
    "write",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value  # so that the next use is an ordinary look-up
    return value
