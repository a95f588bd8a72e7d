"""What a trace is of, and the columns that it may have."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from typing import Any

from ..experiments._common import Provenance

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

    @property
    def joint_labels(self) -> tuple[str, ...]:
        """A name for each joint: its own, or "joint 0" by its number."""
        return tuple(name or f"joint {k}" for k, name in enumerate(self.joints))
