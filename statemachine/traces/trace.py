"""A trace: everything that a run did, row by row. Opening one needs no engine."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..comparison import ContactNames
from ..errors import TraceError
from ..experiments._common import Provenance
from ..interface import Array, Ints
from ..interface.checks import HUGE, index_of
from .checked import LARGEST, check_header, check_places

SCHEMA = 1
# Columns of numbers, one row for each moment; widths are numbers or counts of the header.
COLUMNS: dict[str, tuple[str | int, ...]] = {
    "time": (),
    "qpos": ("nq",),
    "qvel": ("nv",),
    "ctrl": ("nu",),
    "xpos": ("nbody", 3),
    "xquat": ("nbody", 4),
    "site_xpos": ("nsite", 3),
    "site_xmat": ("nsite", 9),
    "qfrc_bias": ("nv",),
    "qfrc_actuator": ("nv",),
    "qfrc_passive": ("nv",),
    "qfrc_constraint": ("nv",),
    "qfrc_contact": ("nv",),
    "energy": (2,),
}
INPUTS = ("time", "qpos", "qvel", "ctrl")
# Contacts, one row for each contact of a moment; in order of `contact_row`.
CONTACTS: dict[str, tuple[int, ...]] = {
    "contact_row": (),
    "contact_geom": (2,),
    "contact_dist": (),
    "contact_pos": (3,),
    "contact_frame": (9,),
    "contact_force": (3,),
}


@dataclass(frozen=True)
class Header:
    """What a trace is of, and what made it.

    Attributes:
        schema: Version of the columns.
        experiment: Name of what was done.
        says: What happens in it, in a sentence.
        command: The command that makes it again, or "".
        provenance: Engine, versions, the model's file and digest, seed.
        defaults: "model", or "engine" for the engine as its own users meet it.
        options: What `Model.replace` was given.
        keyframe: Where it started; None for the default state, or one that was given.
        timestep: Simulated time between rows [s]; substeps: engine steps within it.
        gravity: (3,) [m/s²], as the engine had it.
        nq, nv, nu: Lengths of qpos, qvel and ctrl.
        joints, sites, bodies, geoms, actuators: Names by id.
        jnt_type, jnt_qposadr, jnt_dofadr: As in a Model.
        geom_bodyid, body_parentid, actuator_jntid: As in a Model.
        ctrlrange: (nu, 2), infinite where unlimited.
        energy_by: The engine that computed the energies, or "".
        rewritten: Rows whose state is not what the step before left: the controller wrote it
            (or the engine does not give the same bits twice).
        ended: Why the run ended before its time, or "".
        single: Whether an npz file of it keeps all but the inputs in single precision.
        recorded: Whether this was read from a file: nothing ran here.
    """

    experiment: str
    says: str
    command: str
    provenance: Provenance
    defaults: str
    options: dict[str, Any]
    keyframe: str | None
    timestep: float
    substeps: int
    gravity: tuple[float, ...]
    nq: int
    nv: int
    nu: int
    joints: tuple[str, ...]
    sites: tuple[str, ...]
    bodies: tuple[str, ...]
    geoms: tuple[str, ...]
    actuators: tuple[str, ...]
    jnt_type: tuple[int, ...]
    jnt_qposadr: tuple[int, ...]
    jnt_dofadr: tuple[int, ...]
    geom_bodyid: tuple[int, ...]
    body_parentid: tuple[int, ...]
    actuator_jntid: tuple[int, ...]
    ctrlrange: tuple[tuple[float, ...], ...]
    energy_by: str = ""
    rewritten: int = 0
    ended: str = ""
    single: bool = False
    recorded: bool = False
    schema: int = SCHEMA

    @property
    def backend(self) -> str:
        """Name of the backend that ran it."""
        return self.provenance.backend

    @property
    def label(self) -> str:
        """The backend and its version, and what is unusual about them."""
        text = f"{self.backend} {self.provenance.versions.get(self.backend, '')}".strip()
        if self.defaults == "engine":
            text += ", engine defaults"
        return text + (", recorded" if self.recorded else "")

    @property
    def counts(self) -> dict[str, int]:
        """The lengths that `COLUMNS` speaks of."""
        return {
            "nq": self.nq,
            "nv": self.nv,
            "nu": self.nu,
            "nbody": len(self.bodies),
            "nsite": len(self.sites),
        }

    def shape(self, column: str) -> tuple[int, ...]:
        """Shape of one row of a column."""
        if column in CONTACTS:
            return CONTACTS[column]
        counts = self.counts
        return tuple(counts[w] if isinstance(w, str) else w for w in COLUMNS[column])

    def as_json(self) -> str:
        """The header as text."""
        return json.dumps(dataclasses.asdict(self), ensure_ascii=False, allow_nan=True)

    @classmethod
    def from_json(cls, text: str) -> Header:
        """The header that `as_json` wrote.

        Raises:
            TraceError: It is none, or of a schema that this version does not know.
        """
        try:
            facts = json.loads(text)
            if facts.get("schema") != SCHEMA:
                given = repr(facts.get("schema"))[:20]
                raise TraceError(f"this trace has schema {given}; this version reads {SCHEMA}")
            known = {field.name for field in dataclasses.fields(Provenance)}
            by = {key: _frozen(value) for key, value in _known(facts["provenance"], known).items()}
            facts["provenance"] = Provenance(**by)
            known = {field.name for field in dataclasses.fields(cls)}
            header = cls(**{name: _frozen(value) for name, value in _known(facts, known).items()})
            header._check()
        except TraceError:
            raise
        except (ValueError, TypeError, AttributeError, KeyError, RecursionError) as error:
            raise TraceError(f"this is no header of a trace: {error}") from None
        return header

    @property
    def joint_labels(self) -> tuple[str, ...]:
        """A name for each joint: its own, or "joint 0" by its number."""
        return tuple(name or f"joint {k}" for k, name in enumerate(self.joints))

    def _check(self) -> None:
        check_header(self)
        for name in ("nq", "nv", "nu", "substeps"):
            value = getattr(self, name)
            if not isinstance(value, int) or not 0 <= value < 10**6:
                raise TraceError(f"{name} = {str(value)[:40]} of the trace is no count")
        if not isinstance(self.timestep, float) or not 0 < self.timestep < 1e6:
            raise TraceError(f"timestep = {self.timestep!r} of the trace is no time")
        lengths = {
            "jnt_type": len(self.joints),
            "jnt_qposadr": len(self.joints),
            "jnt_dofadr": len(self.joints),
            "geom_bodyid": len(self.geoms),
            "body_parentid": len(self.bodies),
            "actuator_jntid": self.nu,
            "actuators": self.nu,
            "ctrlrange": self.nu,
        }
        for name, length in lengths.items():
            if len(getattr(self, name)) != length:
                raise TraceError(f"{name} of the trace has {len(getattr(self, name))} entries")
        check_places(self)


def _known(facts: Mapping[str, Any], names: set[str]) -> dict[str, Any]:
    return {name: value for name, value in facts.items() if name in names}


def _frozen(value: Any) -> Any:
    """Lists of JSON as tuples."""
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value


def check_shapes(header: Header, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """The columns of a trace are there, and as long and as wide as its header says.

    Raises:
        TraceError: One is not.
    """
    rows = shapes.get("time", ())
    if len(rows) != 1 or not rows[0]:
        raise TraceError("a trace has at least one row, and a column 'time'")
    for name, shape in shapes.items():
        if name not in COLUMNS and name not in CONTACTS:
            raise TraceError(f"a trace has no column {name[:40]!r}")
        first = shapes.get("contact_row", ()) if name in CONTACTS else rows
        expected = (*first[:1], *header.shape(name))
        if shape != expected:
            raise TraceError(f"column {name!r} has shape {shape}; expected {expected}")
    for name in INPUTS:
        if name not in shapes:
            raise TraceError(f"a trace needs the column {name!r}")


def _check_entries(name: str, array: NDArray[Any]) -> None:
    """Inputs are numbers that an engine takes; the rest may be NaN, which is not told."""
    if name in INPUTS and not np.isfinite(array).all():
        raise TraceError(f"column {name!r} has an entry that is not a finite number")
    most = HUGE if name in INPUTS else LARGEST
    # fmax and fmin pass over NaN.
    ends = np.fmin.reduce(array, None, initial=0), np.fmax.reduce(array, None, initial=0)
    if not -most <= ends[0] <= ends[1] <= most:
        raise TraceError(f"column {name!r} has an entry beyond {most:g}")


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
        if len(row) and (row.min() < 0 or row.max() >= rows or (np.diff(row) < 0).any()):
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
        """Simulated time between two rows [s]."""
        return self.header.timestep

    @property
    def time(self) -> Array:
        """(n,) [s]."""
        return self.columns["time"]

    @property
    def qpos(self) -> Array:
        """(n, nq) positions."""
        return self.columns["qpos"]

    @property
    def qvel(self) -> Array:
        """(n, nv) velocities."""
        return self.columns["qvel"]

    @property
    def ctrl(self) -> Array:
        """(n, nu) commands; those of a row are in force from its time on."""
        return self.columns["ctrl"]

    def site(self, name: str) -> tuple[Array, Array]:
        """Positions (n, 3) [m] and rotation matrices (n, 3, 3) of a site."""
        number = index_of("site", name, self.header.sites)
        return self["site_xpos"][:, number], self["site_xmat"][:, number].reshape(-1, 3, 3)

    def contact_pairs(self) -> dict[str, Ints]:
        """Which contacts are of each pair of bodies: their places by "gripper on box"."""
        found: dict[str, list[int]] = {}
        if "contact_geom" in self:
            header = self.header
            names = ContactNames(
                header.bodies, header.geoms, header.geom_bodyid, header.body_parentid
            )
            for place, geoms in enumerate(self["contact_geom"].tolist()):
                found.setdefault(names.pair(*geoms), []).append(place)
        return {pair: np.array(places) for pair, places in found.items()}

    def touches(self) -> dict[str, NDArray[np.bool_]]:
        """When each pair of bodies touches: (n,) bool by "gripper on box"."""
        found = {}
        for pair, places in self.contact_pairs().items():
            found[pair] = np.zeros(len(self), dtype=bool)
            found[pair][self["contact_row"][places]] = True
        return found
