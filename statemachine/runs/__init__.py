"""Traces: what a run did, recorded on any engine, opened again on none.

    trace = record(model, controller, seconds=2.0)
    write(trace, "hold.npz")
    again = read("hold.npz")

A recorder stands on the public face of the core; a file is npz, or parquet with the extra.
"""

from __future__ import annotations

from .files import export_csv, model_file, read, shipped, shipped_names, write
from .header import COLUMNS, CONTACTS, Header
from .recorder import record
from .rerun import play, record_scenario
from .trace import Trace

__all__ = [
    "COLUMNS",
    "CONTACTS",
    "Header",
    "Trace",
    "export_csv",
    "model_file",
    "play",
    "read",
    "record",
    "record_scenario",
    "shipped",
    "shipped_names",
    "write",
]
