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
    from .files import export_csv, model_file, read, read_shipped_trace, shipped_trace_names, write
    from .header import COLUMNS, CONTACTS, Header
    from .recorder import RunMetadata, RunStart, record
    from .rerun import (
        Rerun,
        SideStart,
        controller_of_trace,
        play,
        record_scenario,
        rerun_of,
        rerun_of_trace,
        start_of,
        start_of_scenario,
        with_first_ctrl,
    )
    from .trace import Trace

_MODULES = {
    "COLUMNS": "header",
    "CONTACTS": "header",
    "Header": "header",
    "Rerun": "rerun",
    "RunMetadata": "recorder",
    "RunStart": "recorder",
    "SideStart": "rerun",
    "Trace": "trace",
    "with_first_ctrl": "rerun",
    "controller_of_trace": "rerun",
    "export_csv": "files",
    "model_file": "files",
    "play": "rerun",
    "read": "files",
    "record": "recorder",
    "record_scenario": "rerun",
    "rerun_of_trace": "rerun",
    "rerun_of": "rerun",
    "read_shipped_trace": "files",
    "shipped_trace_names": "files",
    "start_of": "rerun",
    "start_of_scenario": "rerun",
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
    "controller_of_trace",
    "export_csv",
    "model_file",
    "play",
    "read",
    "read_shipped_trace",
    "record",
    "record_scenario",
    "rerun_of",
    "rerun_of_trace",
    "shipped_trace_names",
    "start_of",
    "start_of_scenario",
    "with_first_ctrl",
    "write",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = value  # so that the next use is an ordinary look-up
    return value
