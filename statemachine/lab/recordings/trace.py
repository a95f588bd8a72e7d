"""A trace: everything that a run did, row by row. Opening one needs no engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import TraceError
from ...interface import MOCAP, Array, Ints
from ...interface.checks import HUGE, index_of
from ...measures import ContactNames, overlaps
from ...measures.text import grouped
from .header import COLUMNS, CONTACTS, INPUTS, Header

# Bytes that a trace may unfold into: this many, or so many times the size of its file.
# Recorded runs are 2 to 3 times as large as their files.
_ALWAYS_ALLOWED, _MAX_COMPRESSION, _MAX_SIZE = 2**28, 100, 2**32
INTEGER_COLUMNS = ("contact_row", "contact_geom")  # columns of whole numbers
# No number of a run is larger, and what is computed from smaller ones stays finite.
LARGEST_ENTRY = 1e100


def check_shapes(header: Header, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Check that the columns of a trace are there, and as long and as wide as its header says.

    Raises:
        TraceError: One is not.
    """
    rows = shapes.get("time", ())
    known = {*COLUMNS, *CONTACTS}
    if len(rows) != 1 or not rows[0]:
        raise TraceError("a trace has at least one row, and a column 'time'")
    for name in shapes:
        if name not in known:
            raise TraceError(f"a trace has no column {name[:40]!r}")
    for name in INPUTS:
        if name not in shapes:
            raise TraceError(f"a trace needs the column {name!r}")
    for name, shape in shapes.items():
        first = shapes.get("contact_row", ()) if name in CONTACTS else rows
        expected = (*first[:1], *header.shape(name))
        if shape != expected:
            raise TraceError(f"column {name!r} has shape {shape}; expected {expected}")


def _check_entries(name: str, array: NDArray[Any]) -> None:
    """Check that inputs are numbers that an engine takes; the rest may be NaN: not told."""
    is_input = name in (*INPUTS, *MOCAP)
    most = HUGE if is_input else LARGEST_ENTRY
    if is_input and not np.isfinite(array).all():
        raise TraceError(f"column {name!r} has an entry that is not a finite number")
    # fmax and fmin pass over NaN.
    smallest = np.fmin.reduce(array, None, initial=0)
    largest = np.fmax.reduce(array, None, initial=0)
    if not -most <= smallest <= largest <= most:
        raise TraceError(f"column {name!r} has an entry beyond {most:g}")


def check_size(unfolded: int, path: Path) -> None:
    """Refuse a file that unfolds into more than a recorded run would.

    Raises:
        TraceError: It does.
    """
    most = min(max(_ALWAYS_ALLOWED, _MAX_COMPRESSION * path.stat().st_size), _MAX_SIZE)
    if unfolded > most:
        raise TraceError(
            f"unfolds into {unfolded / 2**20:,.0f} MB; a file of this size may into "
            f"{most / 2**20:,.0f}"
        )


def as_column(name: str, array: Any) -> Any:
    """Return an array of a file as a column: int64, or float64."""
    return np.asarray(array, dtype=np.int64 if name in INTEGER_COLUMNS else np.float64)


@dataclass(frozen=True, eq=False, repr=False)
class Trace:
    """A recorded run. All arrays are read-only, SI units, MuJoCo's conventions.

    Row k is one moment: its state, what the engine derives from it, and the ctrl that is
    in force from then on. n rows are n - 1 steps.

    Attributes:
        header: What it is of, and what made it.
        columns: The arrays by name; see `COLUMNS` and `CONTACTS`. One that the engine
            does not tell holds NaN; one that was not recorded is not there.
    """

    header: Header
    columns: Mapping[str, NDArray[Any]]

    def __post_init__(self) -> None:
        check_shapes(self.header, {name: array.shape for name, array in self.columns.items()})
        for name, array in self.columns.items():
            array.setflags(write=False)
            _check_entries(name, array)
        time = self.time
        if not (np.diff(time) > 0).all():
            row = int(np.argmin(np.diff(time) > 0))
            raise TraceError(f"time does not go on after row {row}, at {time[row]:g} s")
        contact = [name for name in CONTACTS if name in self.columns]
        if contact and len(contact) != len(CONTACTS):
            raise TraceError(f"of the contacts only {', '.join(contact)} are there")
        if contact:
            self._check_contacts(len(time))

    def _check_contacts(self, rows: int) -> None:
        row, geom = self.columns["contact_row"], self.columns["contact_geom"]
        if len(row):
            is_of_a_row = row.min() >= 0 and row.max() < rows
            if not is_of_a_row or (np.diff(row) < 0).any():
                raise TraceError("contact_row is not an ascending list of rows")
        if len(geom) and (geom.min() < 0 or geom.max() >= len(self.header.geoms)):
            raise TraceError("contact_geom names a geom that is not there")

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return (
            f"<Trace {self.header.experiment} on {self.header.label}: "
            f"{len(self)} rows, {self.time[0]:g} to {self.time[-1]:g} s>"
        )

    def __getitem__(self, column: str) -> NDArray[Any]:
        if column not in self.columns:
            index_of("column of the trace", column, tuple(self.columns))
        return self.columns[column]

    def __contains__(self, column: object) -> bool:
        return column in self.columns

    @property
    def timestep(self) -> float:
        """Return the simulated time between two rows [s]."""
        return self.header.timestep

    @property
    def time(self) -> Array:
        """Return the time of each row (n,) [s]."""
        return self.columns["time"]

    @property
    def qpos(self) -> Array:
        """Return the positions (n, nq) [rad or m]."""
        return self.columns["qpos"]

    @property
    def qvel(self) -> Array:
        """Return the velocities (n, nv) [rad/s or m/s]."""
        return self.columns["qvel"]

    @property
    def ctrl(self) -> Array:
        """Return the commands (n, nu) [unit of the actuator].

        Those of a row are in force from its time on.
        """
        return self.columns["ctrl"]

    def site(self, name: str) -> tuple[Array, Array]:
        """Return positions (n, 3) [m] and rotation matrices (n, 3, 3) of a site."""
        number = index_of("site", name, self.header.sites)
        return self["site_xpos"][:, number], self["site_xmat"][:, number].reshape(-1, 3, 3)

    @cached_property
    def contact_pairs(self) -> Mapping[str, Ints]:
        """Return the places of the contacts of each pair of bodies, by "gripper on box"."""
        geoms = self["contact_geom"].tolist() if "contact_geom" in self else []
        of_pair = grouped((self._contact_names.pair(*pair), k) for k, pair in enumerate(geoms))
        return {pair: np.array(places) for pair, places in of_pair.items()}

    @cached_property
    def _contact_names(self) -> ContactNames:
        known = self.header
        return ContactNames(known.body_labels, known.geoms, known.geom_bodyid, known.body_parentid)

    @cached_property
    def overlaps(self) -> list[str]:
        """Return shapes that overlap in the first row, as `measures.overlaps` does."""
        if "contact_row" not in self:
            return []
        first = self["contact_row"] == 0
        geoms, distances = self["contact_geom"][first], self["contact_dist"][first]
        return overlaps(self._contact_names, geoms, distances)

    def touches(self) -> dict[str, NDArray[np.bool_]]:
        """Return when each pair of bodies touches: (n,) bool by "gripper on box"."""
        touching = {}
        for pair, places in self.contact_pairs.items():
            touching[pair] = np.zeros(len(self), dtype=bool)
            touching[pair][self["contact_row"][places]] = True
        return touching
