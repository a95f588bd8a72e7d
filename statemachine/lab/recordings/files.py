"""Traces in files: npz, which NumPy reads, or parquet, which tables read; and their models."""

from __future__ import annotations

import csv
import dataclasses
import itertools
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from ...atomic_files import beside, replace_file
from ...errors import (
    BadInputError,
    MissingEngineError,
    ModelFileError,
    StateMachineError,
    TraceError,
    check_name,
    did_you_mean,
)
from ...interface import MOCAP, JointType
from ...measures.text import command
from ...models import AnyPath, kind_of_path, resolve
from ..runs.provenance import model_digest
from ..runs.scenarios import SCENARIOS
from .formats import read_npz, read_parquet, write_npz, write_parquet
from .header import COLUMNS, Header
from .trace import Trace

SUFFIXES = (".npz", ".parquet")
# Recorded traces that come with the package, for where an engine has no wheel.
_FOLDER = Path(__file__).resolve().parent / "recorded"


def write(trace: Trace, path: AnyPath) -> Path:
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
    target = _checked_suffix(path)
    Header.from_json(trace.header.as_json())
    fill = write_parquet if target.suffix.lower() == ".parquet" else write_npz
    replace_file(target, partial(fill, trace))
    return target


def read(path: AnyPath) -> Trace:
    """Open a trace. No engine is needed; nothing in the file is run.

    A file is not trusted: it may unfold into 256 MB or into a hundred times its size, and
    into 4 GB at most. A parquet file carries a digest of its numbers, which is verified; an npz
    file has a checksum of each array.

    Raises:
        TraceError: The file is not there, or is not a trace, or is damaged.
        MissingEngineError: Parquet, and pyarrow is not installed.
    """
    source = _checked_suffix(path)
    if not source.is_file():
        raise _missing_trace_error(source)
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
    except Exception as error:  # damaged bytes may raise anything in NumPy and pyarrow
        reason = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise TraceError(f"{source.name} is not a trace: {reason}") from None


def shipped_trace_names() -> list[str]:
    """Return the names of the shipped traces.

    They read EXPERIMENT.BACKEND, or EXPERIMENT.BACKEND.engine for the engine's defaults.
    """
    return sorted(path.stem for path in _FOLDER.glob("*.npz"))


def read_shipped_trace(experiment: str, backend: str, defaults: str = "model") -> Trace:
    """Load a trace that was recorded elsewhere; its header says on what.

    Raises:
        UnknownNameError: None was recorded of this.
    """
    name = f"{experiment}.{backend}" + (".engine" if defaults == "engine" else "")
    check_name("recorded trace", name, shipped_trace_names())
    return read(_FOLDER / f"{name}.npz")


def model_file(
    header: Header,
    menagerie: AnyPath | None = None,
    beside: AnyPath | None = None,
) -> tuple[Path, bool]:
    """Return the model's file of a trace, and whether its digest is the one of the header.

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
    candidates = list(dict.fromkeys(_candidate_model_files(known.model_file, menagerie, beside)))
    for path in candidates:
        if model_digest(path) == known.model_sha256:
            return path, True
    if not candidates:
        raise ModelFileError(
            f"the trace's model {known.model_file} is not here: name it behind the trace"
        )
    return candidates[0], False


def _checked_suffix(path: AnyPath) -> Path:
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a trace is a file {' or '.join(SUFFIXES)}; got {target.name!r}")
    return target


def _missing_trace_error(path: Path) -> TraceError:
    """Return the error for a missing file, with the nearest name beside it."""
    message = f"there is no trace {path}"
    if (kind := kind_of_path(path)) != "nothing":
        message = f"{path} is {kind}, not a trace"
    elif path.parent.is_dir():
        names = [file.name for file in path.parent.iterdir() if file.suffix in SUFFIXES]
        if path.stem in SCENARIOS and path.suffix in SUFFIXES:
            words = ("statemachine", "trace", "record", path.stem, "-o", str(path))
            message += f"; to record it, type {command(words)}"
        else:
            message += did_you_mean(path.name, names, 0.6)
    return TraceError(message)


def _candidate_model_files(
    name: str, menagerie: AnyPath | None, beside: AnyPath | None
) -> Iterator[Path]:
    folder = menagerie or os.environ.get("MENAGERIE") or None
    for where in (None, folder) if folder else (None,):
        with suppress(StateMachineError):
            yield resolve(name, where)
    file_name = Path(name).name
    for place in (Path(), Path(beside).parent) if beside is not None else (Path(),):
        with suppress(StateMachineError):
            yield resolve(place.absolute() / file_name)


def export_csv(trace: Trace, path: AnyPath) -> list[Path]:
    """Write the columns as CSV, one row for each moment, units SI.

    Columns are named after joints, bodies, sites and actuators: "qpos.elbow_flex",
    "site_xpos.gripperframe.x". Contacts, which are many to a moment, go into a second
    file beside it, NAME.contacts.csv; both are written before either is put in its place.

    Returns:
        The files that were written.
    """
    target = Path(path)
    contacts = target.with_name(f"{target.stem}.contacts.csv")
    targets = [target, contacts] if "contact_row" in trace else [target]
    with beside(*targets) as names:
        for name, fill in zip(names, (_write_columns, write_contacts), strict=False):
            fill(name, trace)
    return targets


def _write_columns(file: str, trace: Trace) -> None:
    names = [name for name in COLUMNS if name in trace]
    labels = list(itertools.chain.from_iterable(column_labels(trace.header, n) for n in names))
    flat = np.hstack([np.asarray(trace[n]).reshape(len(trace), -1) for n in names])
    _write_rows(file, labels, flat.tolist())


def write_contacts(file: str, trace: Trace) -> None:
    """Write the contacts of a trace as CSV, a row for each: time, geoms, bodies, place, force.

    Args:
        file: Where to write them.
        trace: One that has contacts.
    """
    header = trace.header
    labels = [
        *("time", "geom_1", "geom_2", "body_1", "body_2", "dist", "pos.x", "pos.y", "pos.z"),
        *("force.normal", "force.tangent_1", "force.tangent_2"),
    ]
    columns = (
        trace[f"contact_{name}"].tolist() for name in ("row", "geom", "dist", "pos", "force")
    )
    rows: list[list[str | float]] = []
    for row, geoms, distance, position, force in zip(*columns, strict=True):
        names = [header.geoms[geom] or f"geom {geom}" for geom in geoms]
        bodies = [header.bodies[header.geom_bodyid[geom]] for geom in geoms]
        time = float(trace.time[row])
        rows.append([time, *names, *bodies, distance, *position, *force])
    _write_rows(file, labels, rows)


def column_labels(header: Header, column: str) -> list[str]:
    """Return a name for each number of a row of a column: "qpos.box.qw"."""
    if column == "time":
        return ["time"]
    if column == "energy":
        return ["energy.kinetic", "energy.potential"]
    if column == "ctrl":
        return [f"ctrl.{name or k}" for k, name in enumerate(header.actuators)]
    if column in ("qpos", "qvel") or column.startswith("qfrc"):
        return [f"{column}.{label}" for label in coordinate_labels(header, column == "qpos")]
    names = header.bodies if column in ("xpos", "xquat") else header.sites
    if column in MOCAP:
        names = [""] * header.nmocap
    parts = {
        "mocap_pos": "xyz",
        "mocap_quat": ("qw", "qx", "qy", "qz"),
        "xpos": "xyz",
        "site_xpos": "xyz",
        "xquat": ("qw", "qx", "qy", "qz"),
        "site_xmat": [f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)],
    }[column]
    return [f"{column}.{name or k}.{part}" for k, name in enumerate(names) for part in parts]


def coordinate_labels(header: Header, positions: bool) -> list[str]:
    """Return a name for each coordinate: the joint's, with the component where it has several."""
    labels = []
    ball = ("qw", "qx", "qy", "qz") if positions else ("wx", "wy", "wz")
    parts = {
        int(JointType.FREE): (*"xyz", *ball) if positions else ("vx", "vy", "vz", *ball),
        int(JointType.BALL): ball,
    }
    for label, kind in zip(header.joint_labels, header.jnt_type, strict=True):
        labels += [f"{label}.{part}" for part in parts.get(kind, ())] or [label]
    return labels


def _write_rows(name: str, labels: list[str], rows: Iterable[Sequence[str | float]]) -> None:
    with open(name, "w", encoding="utf-8", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(labels)
        writer.writerows(rows)
