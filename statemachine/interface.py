"""The contract that every backend keeps: Model and Data.

A simulator is a state machine. A `Model` never changes; a `Data` holds all that
does; `step` (see `verbs`) turns one Data into the next.

A backend subclasses both. An engine whose caller owns the state (MuJoCo) lets the
arrays of a Data be its memory; an engine with a hidden world (PyBullet) keeps the
arrays beside it and moves values across in the hooks, whose names begin with `_`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .checks import TINY, as_count, as_scalar, as_switch, as_vector, index_of, whole_number
from .errors import (
    BadInputError,
    ClosedDataError,
    DivergedError,
    ReadOnlyError,
    UnsupportedError,
    unknown_name,
)
from .records import (
    INPUTS,
    Array,
    Capabilities,
    Contacts,
    Ints,
    JointType,
    Keyframe,
    State,
    read_only,
)

OPTIONS = (
    "actuation",
    "gravity",
    "timestep",
    "substeps",
    "contacts",
    "armature",
    "damping",
    "frictionloss",
    "limits",
    "integrator",
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
        nq, nv, nu: Lengths of qpos, qvel and ctrl.
        nbody, njnt, nsite, ngeom: Counts; body 0 is the world.
        jnt_type: (njnt,) `JointType`.
        jnt_qposadr, jnt_dofadr: (njnt,) where each joint starts in qpos and qvel.
        jnt_limited: (njnt,) bool; jnt_range: (njnt, 2) [rad or m].
        actuator_jntid: (nu,) joint that each actuator drives, -1 if none.
        actuator_ctrlrange, actuator_forcerange: (nu, 2), infinite where unlimited.
        actuator_kp, actuator_kv: (nu,) gains of a position servo, NaN if it is none.
        dof_armature, dof_damping, dof_frictionloss: (nv,) of each degree of freedom.
        body_parentid: (nbody,) the body that carries each body; the world carries itself.
        jnt_bodyid, geom_bodyid, site_bodyid: The body of each joint, geom and site.
        site_pos, site_quat: (nsite, 3) [m] and (nsite, 4) wxyz, in that body's frame.
        keyframes: The states that the file names.
    """

    backend: str
    engine_version: str
    path: Path
    raw: Any
    capabilities: Capabilities
    timestep: float
    substeps: int
    nq: int
    nv: int
    nu: int
    nbody: int
    njnt: int
    nsite: int
    ngeom: int
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
    dof_armature: Array
    dof_damping: Array
    dof_frictionloss: Array
    body_parentid: Ints
    jnt_bodyid: Ints
    geom_bodyid: Ints
    site_bodyid: Ints
    site_pos: Array
    site_quat: Array
    keyframes: tuple[Keyframe, ...]

    if TYPE_CHECKING:
        _quaternions: list[tuple[int, int]]  # (joint id, address in qpos) of each

    def __init__(self, **facts: Any) -> None:
        missing = Model.__annotations__.keys() - facts.keys()
        if missing:
            raise TypeError(f"a backend must give its Model: {', '.join(sorted(missing))}")
        for name, value in facts.items():
            constant = read_only(value) if isinstance(value, np.ndarray) else value
            object.__setattr__(self, name, constant)
        # Once: NumPy swallows a Ctrl-C that falls into a comparison with an enum.
        object.__setattr__(self, "_quaternions", _quaternions(self.jnt_type, self.jnt_qposadr))

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise ReadOnlyError(
            f"a Model never changes: use model.replace({name}=…) where that is an option, "
            "or the engine's own model.raw"
        )

    def __setstate__(self, facts: dict[str, Any]) -> None:
        Model.__init__(self, **facts)  # a pickle forgets which arrays are read-only

    def __repr__(self) -> str:
        return (
            f"<Model {self.path.stem} on {self.backend} {self.engine_version}: "
            f"nq={self.nq} nv={self.nv} nu={self.nu}, {self.timestep:g} s a step>"
        )

    def body_id(self, name: str) -> int:
        """Id of a body."""
        return index_of("body", name, self.body_names)

    def joint_id(self, name: str) -> int:
        """Id of a joint; its address in qpos is `jnt_qposadr[id]`."""
        return index_of("joint", name, self.joint_names)

    def site_id(self, name: str) -> int:
        """Id of a site."""
        return index_of("site", name, self.site_names)

    def geom_id(self, name: str) -> int:
        """Id of a geom."""
        return index_of("geom", name, self.geom_names)

    def actuator_id(self, name: str) -> int:
        """Id of an actuator, its place in ctrl."""
        return index_of("actuator", name, self.actuator_names)

    def key_id(self, key: int | str) -> int:
        """Number of a keyframe, given by number or name.

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
        """Another Model that differs in the named options; this one stays as it is.

        Args:
            **options: Some of
                actuation, contacts, limits: bool, on or off;
                gravity: (3,) [m/s²];
                timestep: > 0 [s]; substeps: engine steps within it, at least 1;
                armature, damping, frictionloss: ≥ 0, (nv,) or one number for every
                hinge and slide joint;
                integrator: a name of `capabilities.integrators`.

        Raises:
            UnsupportedError: This backend has no such option.
            BadInputError: The value has the wrong shape, kind or size.
        """
        checked = {}
        for name, value in options.items():
            if name not in OPTIONS:
                error = unknown_name("option", name, OPTIONS)
                raise UnsupportedError(
                    str(error), backend=self.backend, feature=name, reason="unknown"
                ) from None
            if name not in self.capabilities.options:
                raise self._unsupported(name)
            checked[name] = self._checked_option(name, value)
        return self._replace(checked)

    def _unsupported(self, feature: str) -> UnsupportedError:
        """The error for what this backend cannot do; the reason is in its record."""
        known = self.capabilities.behaviours.get(feature)
        reason = known.note if known else "the engine has no such setting"
        return UnsupportedError(
            f"backend {self.backend!r} does not support {feature!r}: {reason}",
            backend=self.backend,
            feature=feature,
            reason=reason,
        )

    def _check_quaternions(self, qpos: Array) -> None:
        """Raise BadInputError for a quaternion of `qpos` (nq,) that is zero."""
        for joint, start in self._quaternions:
            quat = qpos[start : start + 4]
            if quat.dot(quat) < TINY * TINY:
                raise self._zero_quaternion(joint, start)

    def _zero_quaternion(self, joint: int, start: int) -> BadInputError:
        """The error for a quaternion of a joint that is no rotation."""
        return BadInputError(
            f"qpos[{start}:{start + 4}], the quaternion of joint {self.joint_names[joint]!r}, "
            "is zero: it names no rotation; the identity is 1 0 0 0"
        )

    def _coordinate_name(self, array: str, index: int) -> str:
        """' (elbow_flex)' for an entry of qpos, qvel, qacc or ctrl; '' if it has no name."""
        label = ""
        if array == "ctrl":
            label = self.actuator_names[index]
        elif array in ("qpos", "qvel", "qacc"):
            starts = self.jnt_qposadr if array == "qpos" else self.jnt_dofadr
            label = self.joint_names[int(np.searchsorted(starts, index, side="right")) - 1]
        return f" ({label})" if label else ""

    def _checked_option(self, name: str, value: Any) -> Any:
        if name in ("actuation", "contacts", "limits"):
            return as_switch(value, name)
        if name == "gravity":
            return as_vector(value, (3,), name)
        if name == "substeps":
            return as_count(value, name)
        if name == "integrator":
            if value not in self.capabilities.integrators:
                raise unknown_name("integrator", value, self.capabilities.integrators)
            return value
        if name == "timestep":
            seconds = as_scalar(value, name)
            if seconds <= 0:
                raise BadInputError(f"timestep must be above 0 s; got {seconds}")
            return seconds
        return self._per_dof(name, value)

    def _per_dof(self, name: str, value: Any) -> Array:
        each = as_vector(value, (self.nv,) if np.ndim(value) else (), name)
        if (each < 0).any():
            raise BadInputError(f"{name} must not be negative; got {value!r}")
        if each.ndim:
            return each
        # One number is meant for the joints of the robot, not for a free body.
        array = np.array(getattr(self, f"dof_{name}"))
        scalar = np.isin(self.jnt_type, (JointType.SLIDE, JointType.HINGE))
        array[self.jnt_dofadr[scalar]] = each
        return array

    @abstractmethod
    def _make_data(self) -> Data: ...

    @abstractmethod
    def _replace(self, options: dict[str, Any]) -> Model:
        """Another Model; `options` are checked: bools, floats, (3,) and (nv,) arrays."""


def _quaternions(types: Ints, addresses: Ints) -> list[tuple[int, int]]:
    offsets = {int(JointType.FREE): 3, int(JointType.BALL): 0}
    return [
        (joint, address + offsets[kind])
        for joint, (kind, address) in enumerate(
            zip(types.tolist(), addresses.tolist(), strict=True)
        )
        if kind in offsets
    ]


# By name, so that type checkers take the inputs for the descriptors below.
_SLOTS = ("_home", "_model", "_trouble", "_alarms", "_advance", *INPUTS)

if TYPE_CHECKING:

    class _Input:
        """An input as a type checker sees it: read as an array, assigned array-likes."""

        def __get__(self, data: object, owner: object) -> Array: ...
        def __set__(self, data: object, value: ArrayLike) -> None: ...

    class _Time:
        """The time as a type checker sees it."""

        def __get__(self, data: object, owner: object) -> float: ...
        def __set__(self, data: object, value: float) -> None: ...


class Data(ABC):
    """Everything that changes: the state, the command, and what follows from them.

    Inputs, writable in place, the same arrays for the whole life of the Data
    (`data.ctrl = x` copies in):
        qpos: (nq,) positions [rad or m]; quaternions wxyz.
        qvel: (nv,) velocities [rad/s or m/s]; of a free joint, linear in world axes,
            then angular in body axes.
        ctrl: (nu,) commands [unit of the actuator].
        time: simulated time [s].
    An assignment is checked before anything changes. NumPy's in-place operators
    (`data.ctrl *= x`) write first: what they leave is checked then, and by the verbs.

    All else is derived and read-only. It belongs to the state before the last engine
    step, or to that of the last `forward`; a write to an input changes none of it.
    On a fresh or reset Data it is zero. The equation of motion that it satisfies:
    M·qacc + qfrc_bias = qfrc_actuator + qfrc_passive + qfrc_constraint.
    """

    # `_model` is the owner while the Data is usable and None while it refuses, so
    # that a verb needs one comparison; `_home` is the owner for good.
    __slots__ = _SLOTS

    _home: Model
    _model: Model | None
    _trouble: str
    _alarms: list[Any]  # truthy when the engine has something to say
    _advance: Callable[..., None]  # the engine's own step: (nstep=1)
    if TYPE_CHECKING:
        qpos = _Input()
        qvel = _Input()
        ctrl = _Input()
        time = _Time()
    else:

        @property
        @abstractmethod
        def time(self) -> float:
            """Simulated time [s]; may be assigned to."""

    def __init__(
        self,
        model: Model,
        advance: Callable[..., None],
        alarms: list[Any],
        inputs: Mapping[str, Array],
    ) -> None:
        """Fill the slots; a backend's own `__init__` calls this.

        Args:
            model: The Model that makes this Data.
            advance: The engine's own step, called with a number of steps or, for
                one, with nothing.
            alarms: A list; whatever is in it after a step makes the verb call `_attend`.
            inputs: The arrays qpos, qvel and ctrl, the same for the whole life.
        """
        for name, value in (("_home", model), ("_advance", advance), ("_alarms", alarms)):
            object.__setattr__(self, name, value)
        for name in INPUTS:
            object.__setattr__(self, name, inputs[name])
        self._recover()

    @property
    @abstractmethod
    def raw(self) -> Any:
        """The engine's own object, for what this interface does not offer."""

    @property
    @abstractmethod
    def xpos(self) -> Array:
        """(nbody, 3) body origins in world axes [m]."""

    @property
    @abstractmethod
    def xquat(self) -> Array:
        """(nbody, 4) body orientations, wxyz."""

    @property
    @abstractmethod
    def site_xpos(self) -> Array:
        """(nsite, 3) site positions in world axes [m]."""

    @property
    @abstractmethod
    def site_xmat(self) -> Array:
        """(nsite, 9) site rotation matrices, row by row."""

    @property
    @abstractmethod
    def contacts(self) -> Contacts:
        """The contacts; see `Contacts`."""

    @property
    @abstractmethod
    def qacc(self) -> Array:
        """(nv,) accelerations [rad/s² or m/s²]."""

    @property
    @abstractmethod
    def qfrc_bias(self) -> Array:
        """(nv,) gravity, centrifugal and Coriolis [N·m or N]; on the left-hand side."""

    @property
    @abstractmethod
    def qfrc_actuator(self) -> Array:
        """(nv,) what the actuators exert [N·m or N]."""

    @property
    @abstractmethod
    def qfrc_passive(self) -> Array:
        """(nv,) springs and viscous damping [N·m or N]."""

    @property
    @abstractmethod
    def qfrc_constraint(self) -> Array:
        """(nv,) contact, dry friction and limits together [N·m or N]."""

    @property
    @abstractmethod
    def qfrc_contact(self) -> Array:
        """(nv,) the part of qfrc_constraint that contacts exert."""

    @property
    @abstractmethod
    def qfrc_friction(self) -> Array:
        """(nv,) the part that dry friction in the joints exerts."""

    @property
    @abstractmethod
    def qfrc_limit(self) -> Array:
        """(nv,) the part that joint limits exert."""

    @property
    @abstractmethod
    def qfrc_equality(self) -> Array:
        """(nv,) the part that equality constraints exert."""

    @property
    def model(self) -> Model:
        """The Model that made this Data."""
        return self._home

    def close(self) -> None:
        """Give back what the engine holds. Idempotent; every later use is an error."""
        if self._trouble == "closed":
            return
        self._give_up("closed")
        for name in INPUTS:
            # The last values stay readable, apart from the engine's memory, which a view
            # would keep alive; a view that the caller kept can no longer be written into.
            view = getattr(self, name)
            object.__setattr__(self, name, read_only(view))
            view.setflags(write=False)
        object.__setattr__(self, "_advance", None)
        self._close()

    def __enter__(self) -> Data:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def __setattr__(self, name: str, value: Any) -> None:
        if name in INPUTS:
            self._refuse_if_troubled()
            target = getattr(self, name)
            checked = as_vector(value, target.shape, name)
            if name == "qpos":
                self._home._check_quaternions(checked)
            target[:] = checked
        elif name == "time":
            self._refuse_if_troubled()
            self._set_time(as_scalar(value, "time"))
        elif hasattr(type(self), name):
            raise ReadOnlyError(
                f"{name!r} is read-only: it is derived; write qpos, qvel or ctrl and call forward"
            )
        else:
            raise ReadOnlyError(
                f"a Data has no attribute {name!r}; its inputs are qpos, qvel, ctrl"
            )

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Data is a live simulation: copy or pickle get_state(model, data)")

    def __repr__(self) -> str:
        if self._trouble:
            return f"<Data of {self._home!r}: {self._trouble}>"
        return f"<Data of {self._home!r} at {self.time:g} s>"

    def _refuse_if_troubled(self) -> None:
        if self._trouble == "closed":
            raise ClosedDataError("this Data is closed: make another with make_data")
        if self._trouble:
            raise DivergedError(
                f"this Data is not usable any more ({self._trouble}): reset it, or set_state"
            )

    def _give_up(self, why: str) -> None:
        """Refuse everything but `reset` and `set_state` from now on."""
        object.__setattr__(self, "_model", None)
        object.__setattr__(self, "_trouble", why)

    def _recover(self) -> None:
        object.__setattr__(self, "_model", self._home)
        object.__setattr__(self, "_trouble", "")

    def _attend(self) -> None:  # noqa: B027  (optional hook)
        """Look into a non-empty `_alarms`; raise what concerns this Data."""

    @abstractmethod
    def _recompute(self) -> None: ...

    @abstractmethod
    def _reset(self, key: int | None) -> None: ...

    @abstractmethod
    def _get_state(self) -> State: ...

    @abstractmethod
    def _set_state(self, state: State) -> None: ...

    @abstractmethod
    def _state_layout(self) -> tuple[str, tuple[tuple[str, int], ...]]:
        """Fingerprint and layout of this Data's States."""

    @abstractmethod
    def _set_time(self, time: float) -> None: ...

    @abstractmethod
    def _close(self) -> None: ...
