"""The contract of a Model: everything that never changes while a simulation runs."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Self

import numpy as np
from numpy.typing import NDArray

from ..errors import BadInputError, ReadOnlyError, unknown_name
from ..release_names import engine_of
from .checks import TINY, index_of, unsupported, whole_number
from .records import (
    AS_WRITTEN,
    OPTIONS,
    READ_OPTIONS,
    Array,
    Capabilities,
    Defaults,
    Ints,
    JointType,
    Keyframe,
    Sizes,
    StateLayout,
    read_only,
)


class Model(ABC):
    """Everything that never changes while a simulation runs.

    Made by `load`; constant from then on (`replace` gives another Model). Arrays
    are read-only. Ids are MuJoCo's, on every backend.

    Attributes:
        backend: Name of the backend.
        engine_version: Version of the engine behind it.
        path: The file that it was made from.
        raw: The engine's own object, for what this interface does not offer.
        capabilities: What this backend can do.
        timestep: Simulated time of one `step` [s].
        substeps: Engine steps that one `step` takes.
        gravity: (3,) [m/s²], as the engine has it.
        nq, nv, nu: Lengths of qpos, qvel and ctrl.
        nbody, njnt, nsite, ngeom, nmocap: Counts; body 0 is the world.
        jnt_type: (njnt,) `JointType`.
        jnt_qposadr, jnt_dofadr: (njnt,) where each joint starts in qpos and qvel.
        jnt_limited: (njnt,) bool; jnt_range: (njnt, 2) [rad or m].
        actuator_jntid: (nu,) joint that each actuator drives, -1 if none.
        actuator_ctrlrange, actuator_forcerange: (nu, 2), infinite where unlimited.
        actuator_names: (nu,) of each number of ctrl; an actuator that takes several has its
            name in all of them, as "hip.position" and "hip.velocity".
        actuator_kp, actuator_kv: (nu,) gains of a position servo, NaN for other actuators.
        actuator_gain: (nu,) force of a motor for a ctrl of 1, NaN for other actuators.
        actuator_gear: (nu,) what that force is multiplied by on the joint, and the joint's
            position where a servo compares it with ctrl.
        actuator_delay: (nu,) how late each number of ctrl acts [s], in whole engine steps.
        dof_armature, dof_damping, dof_frictionloss: (nv,) of each degree of freedom.
        body_mass: (nbody,) [kg], zero of a body without mass, as the world is.
        geom_friction: (ngeom, 3) sliding, torsional [m] and rolling [m] friction of each geom.
        body_parentid: (nbody,) the body that carries each body; the world carries itself.
        jnt_bodyid, geom_bodyid, site_bodyid: The body of each joint, geom and site.
        mocap_pos0, mocap_quat0: (nmocap, 3) [m] and (nmocap, 4) wxyz, where the file has them.
        site_pos, site_quat: (nsite, 3) [m] and (nsite, 4) wxyz, in that body's frame.
        keyframes: The states that the file names.
        read_options: How the file was read.
        defaults: "engine" for the engine as its own users meet it, else "model".
        options: The options given to `load` and `replace`, of those that `replace` takes, by name.
    """

    backend: str
    engine_version: str
    path: Path
    raw: Any
    capabilities: Capabilities
    timestep: float
    substeps: int
    gravity: Array
    nq: int
    nv: int
    nu: int
    nbody: int
    njnt: int
    nsite: int
    ngeom: int
    nmocap: int
    body_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    site_names: tuple[str, ...]
    geom_names: tuple[str, ...]
    actuator_names: tuple[str, ...]
    jnt_type: Ints
    jnt_qposadr: Ints
    jnt_dofadr: Ints
    jnt_limited: NDArray[np.bool_]
    jnt_range: Array
    actuator_jntid: Ints
    actuator_ctrlrange: Array
    actuator_forcerange: Array
    actuator_kp: Array
    actuator_kv: Array
    actuator_gain: Array
    actuator_gear: Array
    actuator_delay: Array
    dof_armature: Array
    dof_damping: Array
    dof_frictionloss: Array
    body_mass: Array
    geom_friction: Array
    body_parentid: Ints
    jnt_bodyid: Ints
    geom_bodyid: Ints
    site_bodyid: Ints
    site_pos: Array
    site_quat: Array
    mocap_pos0: Array
    mocap_quat0: Array
    keyframes: tuple[Keyframe, ...]

    read_options = AS_WRITTEN
    _holds_start = False  # whether the commands before a keyframe were that of the keyframe
    _clamps = False  # whether what acts of ctrl is always within its range
    if TYPE_CHECKING:
        defaults: Defaults
        options: Mapping[str, Any]
        _quaternions: list[tuple[int, int]]  # (joint id, address in qpos) of each

    def __init__(self, **facts: Any) -> None:
        missing = Model.__annotations__.keys() - facts.keys()
        if missing:
            raise TypeError(f"a backend must give its Model: {', '.join(sorted(missing))}")
        defaults: dict[str, Any] = {"defaults": "model", "options": {}}
        for name, value in (defaults | facts).items():
            vars(self)[name] = read_only(value) if isinstance(value, np.ndarray) else value
        # Once: NumPy swallows a Ctrl-C that falls into a comparison with an enum.
        vars(self)["_quaternions"] = _quaternions(self.jnt_type, self.jnt_qposadr)

    def __setattr__(self, name: str, value: object) -> NoReturn:
        if name in OPTIONS:
            raise ReadOnlyError(
                f"a Model never changes: model.replace({name}=…) gives another Model"
            )
        raise ReadOnlyError(
            f"a Model never changes, and {name!r} is no option of model.replace; what the engine "
            "itself lets you change is in model.raw"
        )

    if not TYPE_CHECKING:  # a type checker reports what is not there itself

        def __getattr__(self, name: str) -> NoReturn:
            if name.startswith("_"):  # Python asks for many, to copy or to show something
                raise AttributeError(f"a Model has no attribute {name!r}", name=name, obj=self)
            from .unknown_attributes import no_attribute

            raise no_attribute(self, "Model", name, vars(self).get("raw"))

    def __setstate__(self, facts: dict[str, Any]) -> None:
        Model.__init__(self, **facts)  # a pickle forgets which arrays are read-only

    def __repr__(self) -> str:
        version = self.engine_version.partition(" ")[0]
        sizes = f"nq={self.nq} nv={self.nv} nu={self.nu}"
        return (
            f"<Model {self.path.stem} on {engine_of(self.backend)} {version}: "
            f"{sizes}, {self.timestep:g} s a step>"
        )

    @property
    def compiled(self) -> Any:
        """Return the mjModel that the file was compiled to, where the backend starts from one.

        It is not to be written to. None where there is none.
        """
        return None

    @property
    def moving_sites(self) -> tuple[bool, ...]:
        """Tell of each site whether joints move it."""
        from .sites import moving_sites

        parents, jointed = self.body_parentid.tolist(), self.jnt_bodyid.tolist()
        return moving_sites(self.site_bodyid.tolist(), parents, jointed)

    def body_id(self, name: str) -> int:
        """Return the id of a body, its row in `xpos` and `xquat`."""
        return index_of("body", name, self.body_names)

    def joint_id(self, name: str) -> int:
        """Return the id of a joint; its address in qpos is `jnt_qposadr[id]`."""
        return index_of("joint", name, self.joint_names)

    def site_id(self, name: str) -> int:
        """Return the id of a site, its row in `site_xpos` and `site_xmat`."""
        return index_of("site", name, self.site_names)

    def geom_id(self, name: str) -> int:
        """Return the id of a geom, as in `Contacts.geoms`."""
        return index_of("geom", name, self.geom_names)

    def actuator_id(self, name: str) -> int:
        """Return the id of an actuator, its index in ctrl."""
        return index_of("actuator", name, self.actuator_names)

    def key_id(self, key: int | str) -> int:
        """Return the number of a keyframe, given by its number or name.

        Raises:
            UnknownNameError: There is no such keyframe.
        """
        names = [frame.name for frame in self.keyframes]
        if isinstance(key, str):
            return index_of("keyframe", key, names)
        number = whole_number(key)
        if number is None or not 0 <= number < len(names):
            raise unknown_name("keyframe", key, (f"{k} ({n})" for k, n in enumerate(names)))
        return number

    def replace(self, **options: Any) -> Model:
        """Return another Model that differs in the named options; this one stays as it is.

        Args:
            **options: Some of
                actuation, contacts, limits: bool, on or off;
                gravity: (3,) [m/s²];
                timestep: > 0 [s]; substeps: engine steps within it, at least 1;
                armature, damping, frictionloss: ≥ 0, (nv,) or one number for every
                hinge and slide joint;
                mass: > 0 [kg], (nbody,), 0 of a body that has none; the inertia of a body
                is scaled by as much;
                friction: ≥ 0, (ngeom,) or one number for every geom: the sliding friction,
                `geom_friction[:, 0]`. A pair takes the larger, as in MuJoCo. Explicit pairs
                have their own, which stays;
                kp > 0, kv ≥ 0: gains of the position servos, (nu,) with NaN where there is
                none, or one number for every servo;
                latency: ≥ 0 [s], (nu,) or one number: how late a command acts, rounded up to
                whole engine steps. Before a reset the command was that of the reset (before that
                to a keyframe a delay of the file's own finds 0, as in MuJoCo);
                integrator: a name of `capabilities.integrators`;
                max_qvel: > 0 [rad/s or m/s], (nv,) or one number: beyond it a step raises
                DivergedError. By default it is computed for each Model.

        Raises:
            UnsupportedError: This backend has no such option.
            BadInputError: The value has the wrong shape, kind or size.
        """
        from .options import checked_options

        if not options.keys().isdisjoint(READ_OPTIONS):
            from .read_options import without_read_options

            options = without_read_options(self, options)
        checked = checked_options(self, options)
        replaced = self._replace(checked)._inherit_start(self, checked)
        vars(replaced)["options"] = {**self.options, **deepcopy(options)}
        return replaced

    def with_compiled(self, compiled: Any) -> Model:
        """Return another Model of the same engine and file, made from another compiled model.

        Args:
            compiled: An edited copy of `compiled`; its timestep is that of an engine step.

        Raises:
            UnsupportedError: The backend starts from no compiled model, or cannot run this one.
            ModelError: It has a number that nothing can be computed with.
        """
        raise unsupported(self, "compiled", "it does not start from a compiled model")

    def _inherit_start(self, before: Model, options: Mapping[str, Any]) -> Self:
        """Take over the start and the read options of the Model that this one was made from."""
        vars(self)["_holds_start"] = before._holds_start or "latency" in options
        for name in ("read_options", "defaults", "options"):
            vars(self)[name] = getattr(before, name)
        return self

    def _check_quaternions(self, qpos: Array) -> None:
        """Raise BadInputError for a quaternion of `qpos` (nq,) that is zero."""
        for joint, start in self._quaternions:
            quat = qpos[start : start + 4]
            if quat.dot(quat) < TINY * TINY:
                raise self._zero_quaternion(joint, start)

    def _zero_quaternion(self, joint: int, start: int) -> BadInputError:
        """Return the error for a quaternion of a joint that is not a rotation."""
        return BadInputError(
            f"qpos[{start}:{start + 4}], the quaternion of joint {self.joint_names[joint]!r}, "
            "is zero, which is no rotation; the identity is 1 0 0 0"
        )

    def _coordinate_name(self, array: str, index: int) -> str:
        """Return ' (elbow_flex)' for an entry of qpos, qvel, qacc or ctrl; '' if it has no name."""
        label = ""
        if array == "ctrl":
            label = self.actuator_names[index]
        elif array in ("qpos", "qvel", "qacc"):
            starts = self.jnt_qposadr if array == "qpos" else self.jnt_dofadr
            label = self.joint_names[int(np.searchsorted(starts, index, side="right")) - 1]
        return f" ({label})" if label else ""

    def _acting(self, name: str, array: Array) -> Array:
        """Return an input as it acts: each number of ctrl (…, nu) clamped to its range."""
        if name != "ctrl" or not self._clamps:
            return array
        low, high = self.actuator_ctrlrange.T
        return np.minimum(np.maximum(array, low), high)

    def _with_fingerprint(self, layout: Sizes) -> StateLayout:
        """Return the layout of this Model's States, preceded by their fingerprint."""
        identity = (
            self.backend,
            layout,
            self.joint_names,
            self.jnt_type.tolist(),
            self.jnt_qposadr.tolist(),
            self.actuator_names,
        )
        return hashlib.sha256(repr(identity).encode()).hexdigest()[:16], layout

    @abstractmethod
    def _make_data(self) -> Any:
        """Return a new Data of this Model."""

    def _make_worlds(
        self, n: int, workers: int, derived: tuple[str, ...], options: dict[str, Any]
    ) -> Any:
        """Return `Worlds` of the engine's own, or None where it has none.

        Args:
            n: Number of worlds.
            workers: Threads, at least 1.
            derived: Names of `worlds.BATCHED`.
            options: Checked options of `replace`, each with a value for each world.
        """
        return None

    @abstractmethod
    def _replace(self, options: dict[str, Any]) -> Model:
        """Return another Model; `options` are checked: bools, floats and arrays of full length."""


def _quaternions(types: Ints, addresses: Ints) -> list[tuple[int, int]]:
    offsets = {int(JointType.FREE): 3, int(JointType.BALL): 0}
    return [
        (joint, address + offsets[kind])
        for joint, (kind, address) in enumerate(
            zip(types.tolist(), addresses.tolist(), strict=True)
        )
        if kind in offsets
    ]
