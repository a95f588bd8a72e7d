"""What a trace is of, and what made it; and whether that can be believed."""

from __future__ import annotations

import dataclasses
import json
from collections import Counter
from collections.abc import Iterable, Sequence, Sized
from dataclasses import dataclass
from typing import Any

from ...errors import TraceError
from ...interface import JointType
from ...interface.options import OptionValue
from ...interface.sites import moving_sites
from ...release_names import engine_of
from ..runs.provenance import Provenance
from .header_fields import KINDS, PROVENANCE_KINDS

SCHEMA = 2
# Columns of numbers, one row for each moment; widths are numbers or counts of the header.
COLUMNS: dict[str, tuple[str | int, ...]] = {
    "time": (),
    "qpos": ("nq",),
    "qvel": ("nv",),
    "ctrl": ("nu",),
    "mocap_pos": ("nmocap", 3),
    "mocap_quat": ("nmocap", 4),
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
INPUTS = ("time", "qpos", "qvel", "ctrl")  # mocap poses only where there are any
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
        schema: Version of the header and the columns.
        experiment: Name of what was done.
        description: What happens in it, in a sentence.
        command: The command that makes it again, or "".
        provenance: Engine, versions, the model's file and digest, seed.
        defaults: "model", or "engine" for the engine as its own users meet it.
        options: What `Model.replace` was given, and `load` of `READ_OPTIONS`.
        keyframe: Where it started; None for the default state, or one that was given.
        timestep: Simulated time between rows [s].
        substeps: Steps of the engine within it.
        gravity: (3,) [m/s²], as the engine had it.
        nq, nv, nu, nmocap: Lengths of qpos, qvel, ctrl and mocap_pos.
        joints, sites, bodies, geoms, actuators: Names by id.
        jnt_type, jnt_qposadr, jnt_dofadr: As in a Model.
        geom_bodyid, body_parentid, actuator_jntid: As in a Model.
        jnt_bodyid, site_bodyid: As in a Model; empty where the trace does not tell them, as some
            that come with the package.
        ctrlrange: (nu, 2), infinite where unlimited.
        servo_gear: (nu,) the gear of each position servo on a hinge or a slide, whose ctrl is the
            target of the joint times the gear; 0 of another actuator. Empty where the trace does
            not tell it.
        energy_by: The engine that computed the energies, or "".
        rewritten: Rows whose state is not what the step before left: the controller wrote it
            (or the engine does not give the same bits twice).
        ended: Why the run ended before its time, or "".
        single_precision: Whether an npz file of it keeps all but the inputs in single precision.
        recorded: Whether this was read from a file: nothing ran here.
    """

    experiment: str
    description: str
    command: str
    provenance: Provenance
    defaults: str
    options: dict[str, OptionValue]
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
    single_precision: bool = False
    recorded: bool = False
    nmocap: int = 0
    jnt_bodyid: tuple[int, ...] = ()
    site_bodyid: tuple[int, ...] = ()
    servo_gear: tuple[float, ...] = ()
    schema: int = SCHEMA

    @property
    def backend(self) -> str:
        """Name of the backend that ran it."""
        return self.provenance.backend

    @property
    def label(self) -> str:
        """Return the backend and its version, and what is unusual about them."""
        version = self.provenance.versions.get(self.backend, "")
        text = f"{engine_of(self.backend)} {version}".strip()
        if self.defaults == "engine":
            text += ", engine defaults"
        return text + (", recorded" if self.recorded else "")

    @property
    def counts(self) -> dict[str, int]:
        """Return the lengths that `COLUMNS` speaks of."""
        return {
            "nq": self.nq,
            "nv": self.nv,
            "nu": self.nu,
            "nmocap": self.nmocap,
            "nbody": len(self.bodies),
            "nsite": len(self.sites),
        }

    def shape(self, column: str) -> tuple[int, ...]:
        """Return the shape of one row of a column."""
        if column in CONTACTS:
            return CONTACTS[column]
        counts = self.counts
        return tuple(counts[w] if isinstance(w, str) else w for w in COLUMNS[column])

    def as_json(self) -> str:
        """Return the header as JSON."""
        return json.dumps(dataclasses.asdict(self), ensure_ascii=False, allow_nan=True)

    @classmethod
    def from_json(cls, text: str) -> Header:
        """Parse the header that `as_json` wrote.

        Raises:
            TraceError: It is not a header, or of a schema that this version does not know.
        """
        try:
            facts = json.loads(text)
            if facts.get("schema") != SCHEMA:
                given = repr(facts.get("schema"))[:20]
                raise TraceError(f"this trace has schema {given}; this version reads {SCHEMA}")
            by = {name: _as_tuples(value) for name, value in facts.pop("provenance").items()}
            frozen = {name: _as_tuples(value) for name, value in facts.items()}
            header = cls(provenance=Provenance(**by), **frozen)
            header._check()
        except TraceError:
            raise
        except (ValueError, TypeError, AttributeError, KeyError, RecursionError) as error:
            raise TraceError(f"this is not a header of a trace: {error}") from None
        return header

    @property
    def joint_labels(self) -> tuple[str, ...]:
        """Return a name for each joint: its own, or "joint 0"; of a free joint that of its body."""
        return labels_of_joints(self.joints, self.jnt_type, self.jnt_bodyid, self.bodies)

    @property
    def moving_sites(self) -> tuple[bool, ...] | None:
        """Tell which sites are moved by joints; None of a trace that does not tell."""
        if len(self.site_bodyid) != len(self.sites):
            return None
        return moving_sites(self.site_bodyid, self.body_parentid, self.jnt_bodyid)

    @property
    def body_labels(self) -> tuple[str, ...]:
        """Return a name for each body: its own, or "body 1" by its number."""
        return tuple(name or f"body {k}" for k, name in enumerate(self.bodies))

    def _check(self) -> None:
        _check_fields(self)
        joints, bodies = len(self.joints), len(self.bodies)
        _check_ids("jnt_type", self.jnt_type, joints, range(len(JointType)))
        _check_ids("jnt_qposadr", self.jnt_qposadr, joints, range(self.nq))
        _check_ids("jnt_dofadr", self.jnt_dofadr, joints, range(self.nv))
        _check_ids("geom_bodyid", self.geom_bodyid, len(self.geoms), range(bodies))
        _check_ids("body_parentid", self.body_parentid, bodies, range(bodies))
        _check_ids("actuator_jntid", self.actuator_jntid, self.nu, range(-1, joints))
        _check_length("actuators", self.actuators, self.nu)
        _check_length("ctrlrange", self.ctrlrange, self.nu)
        if self.jnt_bodyid:
            _check_ids("jnt_bodyid", self.jnt_bodyid, joints, range(bodies))
        if self.site_bodyid:
            _check_ids("site_bodyid", self.site_bodyid, len(self.sites), range(bodies))
        if self.servo_gear:
            _check_length("servo_gear", self.servo_gear, self.nu)
        for name, kind, qpos, dof in zip(
            self.joint_labels, self.jnt_type, self.jnt_qposadr, self.jnt_dofadr, strict=True
        ):
            of = JointType(kind)
            if qpos + of.nq > self.nq or dof + of.nv > self.nv:
                raise TraceError(f"{name} of the trace has no place in qpos and qvel")


def _check_length(name: str, entries: Sized, length: int) -> None:
    """Check that a list of a header has as many entries as it should.

    Raises:
        TraceError: It has more or fewer.
    """
    if len(entries) != length:
        raise TraceError(f"{name} of the trace has {len(entries)} entries")


def _check_ids(name: str, ids: Sequence[int], length: int, known: range) -> None:
    """Check that a list of ids has as many as it should, each of what is there.

    Raises:
        TraceError: It has more or fewer, or one is of what is not there.
    """
    _check_length(name, ids, length)
    if not all(number in known for number in ids):
        raise TraceError(f"{name} of the trace names one that is not there")


def labels_of_joints(
    joints: Sequence[str], kinds: Iterable[int], owners: Iterable[int], bodies: Sequence[str]
) -> tuple[str, ...]:
    """Return a name for each joint, as `Header.joint_labels` does.

    Args:
        joints: Names by id.
        kinds: (njnt,) `jnt_type`.
        owners: (njnt,) `jnt_bodyid`; empty where they are not known.
        bodies: Names by id.
    """
    labels = [name or f"joint {k}" for k, name in enumerate(joints)]
    for k, (kind, body) in enumerate(zip(kinds, owners, strict=False)):
        if kind == int(JointType.FREE) and bodies[body] not in labels:
            labels[k] = bodies[body] or labels[k]
    return tuple(labels)


def _as_tuples(value: Any) -> Any:
    """Return lists of JSON as tuples."""
    return tuple(_as_tuples(item) for item in value) if isinstance(value, list) else value


def _check_fields(header: Header) -> None:
    """Check that every field is of its kind, and that no name stands twice.

    Raises:
        TraceError: One is not.
    """
    for owner, kinds in ((header, KINDS), (header.provenance, PROVENANCE_KINDS)):
        for name, fits in kinds.items():
            value = getattr(owner, name)
            if not fits(value):
                raise TraceError(f"{name} = {str(value)[:40]!r} of the trace is not what it may be")
    for what in ("joints", "sites", "bodies", "actuators"):
        names = Counter(name for name in getattr(header, what) if name)
        if names and (most := names.most_common(1)[0])[1] > 1:
            raise TraceError(f"two {what} of the trace are called {most[0][:40]!r}")
