"""The records of the contract: capabilities, keyframes, contacts, States."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import unknown_name
from ..release_names import engine_of

if TYPE_CHECKING:
    from .free_base import FreeBase

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Arrays = dict[str, Array]  # by name
Sizes = tuple[tuple[str, int], ...]  # name and length of each part
StateLayout = tuple[str, Sizes]  # fingerprint of a Model's States, and what they consist of
Errors = dict[int, Exception]  # by number of a world
Base = Literal["free", "fixed"]  # whether the base of a robot floats, or is fixed to the world
Defaults = Literal["model", "engine"]  # with the model's contract, or as the engine comes
INPUTS = ("qpos", "qvel", "ctrl")
MOCAP = ("mocap_pos", "mocap_quat")  # further inputs: where the mocap bodies of a model are
# What is derived from them, as far as it is one array; contacts are several.
POSES = ("xpos", "xquat", "site_xpos", "site_xmat")
FORCES = ("qfrc_bias", "qfrc_actuator", "qfrc_passive", "qfrc_constraint")
PARTS = ("qfrc_contact", "qfrc_friction", "qfrc_limit", "qfrc_equality")  # of qfrc_constraint
DERIVED = (*POSES, "qacc", *FORCES, *PARTS)


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only copy of an array."""
    copy = np.array(array)
    copy.setflags(write=False)
    return copy


class JointType(IntEnum):
    """MuJoCo's mjtJoint."""

    FREE = 0
    BALL = 1
    SLIDE = 2
    HINGE = 3

    @property
    def nq(self) -> int:
        """Return how many numbers a joint of this type has in qpos."""
        return {JointType.FREE: 7, JointType.BALL: 4}.get(self, 1)

    @property
    def nv(self) -> int:
        """Return how many numbers a joint of this type has in qvel."""
        return {JointType.FREE: 6, JointType.BALL: 3}.get(self, 1)


# What `Model.replace` can take, of any backend.
OPTIONS = (
    "actuation",
    "gravity",
    "timestep",
    "substeps",
    "contacts",
    "armature",
    "damping",
    "frictionloss",
    "mass",
    "friction",
    "kp",
    "kv",
    "latency",
    "limits",
    "integrator",
    "max_qvel",
)


@dataclass(frozen=True)
class ReadOptions:
    """How the file of a Model is read, beyond what the file says: options of `load` only.

    Attributes:
        balance_inertia: Whether principal moments of an inertia that break A + B >= C, or of which
            one is not positive, all become their mean: MuJoCo refuses such an inertia.
        meshes: Whether shapes that are meshes are read; without them the file needs none of
            their files, and nothing touches, or weighs, what they alone gave shape.
        base: "free" where the base of the robot gets a free joint, "fixed" where it has none; None
            for what the file says. A URDF without a floating joint says nothing, and is fixed.
        start: Where a free base is in the default state; None for where it stands in the file.
        least_mass: Whether a body that moves without mass or inertia, which MuJoCo refuses, gets
            the least that it takes: enough for places, and for no motion. `load` does not take it;
            `backends.load_for_places` reads a file so.
    """

    balance_inertia: bool = False
    meshes: bool = True
    base: Base | None = None
    start: FreeBase | None = None
    least_mass: bool = False


AS_WRITTEN = ReadOptions()
READ_OPTIONS = ("base", "balance_inertia", "meshes")

Precision = Literal["float64", "float32"]
# Of each, how far poses of a robot of about a metre may be off [m, and of quaternions 1]: some
# eight roundings along a chain of links.
_ROUNDINGS: Mapping[Precision, float] = {"float64": 1e-12, "float32": 1e-6}

# The promises of the contract that a capability record speaks of, all of them.
BEHAVIOURS = (
    "stale after a write",
    "stale after a step",
    "zeros when fresh",
    "position servo",
    "latency",
    "armature",
    "joint damping",
    "dry friction",
    "joint limits",
    "free joint conventions",
    "forces by part",
    "contacts",
    "exact restore",
    "no automatic reset",
)


@dataclass(frozen=True)
class Behaviour:
    """One promise of the contract and how a backend keeps it."""

    support: Literal["native", "emulated", "unsupported"]
    note: str


@dataclass(frozen=True)
class Capabilities:
    """What a backend can do, and which of it is the engine's own doing.

    Attributes:
        options: Names that `Model.replace` takes.
        integrators: Values of its `integrator`.
        behaviours: How each promise in `BEHAVIOURS` is kept.
        shared_model: Whether several Data share one compiled model in memory.
        exact_restore: Whether `set_state` continues bit-exactly from any State,
            mid-contact too; otherwise two restores of one State agree bit by bit.
        data_per_process: How many Data one process can hold, each of a Model of its own; None
            for as many as there is memory for.
        refused: Why `Model.replace` does not take some others, by their names; of the rest
            the engine has no such setting.
        precision: Of the numbers that the engine stores. What follows from qpos is as exact as
            `rounding` says, and what was written into qpos is rounded by the next step.
    """

    options: tuple[str, ...]
    integrators: tuple[str, ...]
    behaviours: Mapping[str, Behaviour]
    shared_model: bool
    exact_restore: bool
    data_per_process: int | None = None
    refused: Mapping[str, str] = field(default_factory=dict[str, str])
    precision: Precision = "float64"

    @property
    def rounding(self) -> float:
        """Return how far two poses may differ that are equal but for rounding [m, and 1]."""
        return _ROUNDINGS[self.precision]

    def __str__(self) -> str:
        names_by_reason: dict[str, list[str]] = {}
        for name, reason in self.refused.items():
            names_by_reason.setdefault(reason, []).append(name)
        lines = [f"options of replace: {', '.join(self.options)}"]
        for reason, names in names_by_reason.items():
            lines.append(f"not {', '.join(names)}: {reason}")
        without = self.refused.get("integrator", "as in the file")
        lines.append(f"integrators: {', '.join(self.integrators) or without}")
        shared = "share the compiled model" if self.shared_model else "share its description only"
        lines.append(f"several Data of a Model {shared}")
        lines.append(f"numbers: {self.precision}; poses are exact to {self.rounding:g}")
        if self.data_per_process is not None:
            lines.append(f"Data that one process can hold: {self.data_per_process}")
        for name, behaviour in self.behaviours.items():
            lines.append(f"{name}: {behaviour.support}; {behaviour.note}")
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class Keyframe:
    """A state that a model's file names; arrays are read-only, their shapes those of a Data."""

    name: str
    time: float
    qpos: Array
    qvel: Array
    ctrl: Array
    mocap_pos: Array
    mocap_quat: Array

    def __post_init__(self) -> None:
        for name in (*INPUTS, *MOCAP):
            vars(self)[name] = read_only(getattr(self, name))

    def __reduce__(self) -> tuple[Any, ...]:
        # A pickle forgets that an array was read-only; making it anew does not.
        return Keyframe, tuple(vars(self).values())


@dataclass(frozen=True, eq=False, repr=False)
class Contacts:
    """The n contacts of one moment, as arrays.

    Attributes:
        geom: (n, 2) geom ids.
        dist: (n,) distance between the surfaces [m]; negative is penetration.
        pos: (n, 3) midpoint in world axes [m].
        frame: (n, 3, 3) rows are the contact axes in world coordinates; the first
            is the normal, from geom 0 to geom 1.
        force: (n, 3) force of geom 0 on geom 1 along those axes [N], normal first.
        torque: (n, 3) torsional and rolling friction about them [N·m]; zero where the
            contact has none, or the engine does not tell it.

    All are read-only.
    """

    geom: Ints
    dist: Array
    pos: Array
    frame: Array
    force: Array
    torque: Array

    def __post_init__(self) -> None:
        for array in (self.geom, self.dist, self.pos, self.frame, self.force, self.torque):
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.dist)

    def __repr__(self) -> str:
        return f"<Contacts: {len(self)}, between geoms {self.geom.tolist()}>"


@dataclass(frozen=True, repr=False)
class State:
    """All that decides the future of a Data, as far as its engine exposes it.

    Immutable, comparable, hashable, and picklable between processes.
    `state["qpos"]` is a read-only view of one part.

    Attributes:
        backend: Name of the backend that made it.
        engine_version: Version of the engine that made it, for the record.
        fingerprint: Digest of the layout; `set_state` takes only its own.
        layout: (name, length) of each part, in order.
        blob: The parts as float64 bytes.
    """

    backend: str
    engine_version: str
    fingerprint: str
    layout: Sizes
    blob: bytes

    def __repr__(self) -> str:
        parts = ", ".join(f"{name} {size}" for name, size in self.layout)
        return (
            f"<State of {engine_of(self.backend)} {self.engine_version} "
            f"at {self.time:g} s: {parts}>"
        )

    @property
    def vector(self) -> Array:
        """Return all parts in one read-only array."""
        return np.frombuffer(self.blob, dtype=np.float64)

    def __getitem__(self, part: str) -> Array:
        start = 0
        for name, size in self.layout:
            if name == part:
                return self.vector[start : start + size]
            start += size
        raise unknown_name("part of the State", part, (name for name, _ in self.layout))

    def with_parts(self, **parts: Array) -> State:
        """Return this State with some parts replaced; a part that it does not have is ignored."""
        arrays = [parts.get(name, self[name]) for name, _ in self.layout]
        return replace(self, blob=np.concatenate(arrays, dtype=np.float64).tobytes())

    @property
    def time(self) -> float:
        """Return the simulated time [s]."""
        return float(self["time"][0])
