"""A trace as CSV: a name for every number."""

from __future__ import annotations

import csv
import itertools
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..interface import JointType
from .header import COLUMNS, Header
from .trace import Trace
from .whole import beside


def export_csv(trace: Trace, path: str | os.PathLike[str]) -> list[Path]:
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
        for name, fill in zip(names, (_write_columns, _write_contacts), strict=False):
            fill(name, trace)
    return targets


def _write_columns(file: str, trace: Trace) -> None:
    names = [name for name in COLUMNS if name in trace]
    labels = list(itertools.chain.from_iterable(column_labels(trace.header, n) for n in names))
    flat = np.hstack([np.asarray(trace[n]).reshape(len(trace), -1) for n in names])
    _write_rows(file, labels, flat.tolist())


def _write_contacts(file: str, trace: Trace) -> None:
    header = trace.header
    labels = ["time", "geom_1", "geom_2", "body_1", "body_2", "dist"]
    labels += [f"pos.{axis}" for axis in "xyz"]
    labels += ["force.normal", "force.tangent_1", "force.tangent_2"]
    columns = (
        trace[f"contact_{name}"].tolist() for name in ("row", "geom", "dist", "pos", "force")
    )
    rows = (
        [
            float(trace.time[row]),
            *(header.geoms[geom] or f"geom {geom}" for geom in geoms),
            *(header.bodies[header.geom_bodyid[geom]] for geom in geoms),
            distance,
            *position,
            *force,
        ]
        for row, geoms, distance, position, force in zip(*columns, strict=True)
    )
    _write_rows(file, labels, rows)


def column_labels(header: Header, column: str) -> list[str]:
    """A name for each number of a row of a column: "qpos.box.qw"."""
    if column == "time":
        return ["time"]
    if column == "energy":
        return ["energy.kinetic", "energy.potential"]
    if column == "ctrl":
        return [f"ctrl.{name or k}" for k, name in enumerate(header.actuators)]
    if column in ("qpos", "qvel") or column.startswith("qfrc"):
        return [f"{column}.{label}" for label in coordinate_labels(header, column == "qpos")]
    names = header.bodies if column in ("xpos", "xquat") else header.sites
    parts = {
        "xpos": "xyz",
        "site_xpos": "xyz",
        "xquat": ("qw", "qx", "qy", "qz"),
        "site_xmat": [f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)],
    }[column]
    return [f"{column}.{name or k}.{part}" for k, name in enumerate(names) for part in parts]


def coordinate_labels(header: Header, positions: bool) -> list[str]:
    """A name for each coordinate: the joint's, with parts where it has several."""
    labels = []
    ball = ("qw", "qx", "qy", "qz") if positions else ("wx", "wy", "wz")
    parts = {
        int(JointType.FREE): (*"xyz", *ball) if positions else ("vx", "vy", "vz", *ball),
        int(JointType.BALL): ball,
    }
    for label, kind in zip(header.joint_labels, header.jnt_type, strict=True):
        labels += [f"{label}.{part}" for part in parts.get(kind, ())] or [label]
    return labels


def _write_rows(name: str, labels: list[str], rows: Iterable[list[Any]]) -> None:
    with open(name, "w", encoding="utf-8", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(labels)
        writer.writerows(rows)
