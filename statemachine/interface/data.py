"""The contract of a Data: everything that changes while a simulation runs.

A backend subclasses Model and Data. An engine whose caller owns the state (MuJoCo) lets the
arrays of a Data be its memory; an engine with a hidden world (PyBullet) keeps the
arrays beside it and moves values across in the hooks, whose names begin with `_`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NoReturn, cast

from numpy.typing import ArrayLike

from ..errors import ClosedDataError, DivergedError, ReadOnlyError, did_you_mean
from .checks import as_scalar, as_vector, check_writable
from .exclusive_access import Closable, Owner, refuse_other_thread, with_exclusive_access
from .model import Model
from .records import INPUTS, MOCAP, Array, Contacts, State, StateLayout, read_only

# By name, so that type checkers take the inputs for the descriptors below.
_WRITABLE = (*INPUTS, *MOCAP)
_ENGINE = ("_advance", "_raw_model", "_raw", "_pending_warnings", "_seen_warnings")
_SLOTS = ("__weakref__", "_model", "_owner", "_unusable", "_layout", *_ENGINE, *_WRITABLE)

if TYPE_CHECKING:

    class InputArray:
        """An input as a type checker sees it: read as an array, assigned array-likes."""

        def __get__(self, data: object, owner: object) -> Array: ...
        def __set__(self, data: object, value: ArrayLike) -> None: ...

    class _Time:
        """The time as a type checker sees it."""

        def __get__(self, data: object, owner: object) -> float: ...
        def __set__(self, data: object, value: float) -> None: ...

    class _Derived:
        """A derived array as a type checker sees it."""

        def __get__(self, data: object, owner: object) -> Array: ...


def _derived(name: str, doc: str) -> _Derived:
    """Return a property of Data that reads one of its derived arrays, with this docstring."""

    def get(data: Data) -> Array:
        return with_exclusive_access(data, data._derive, name)

    return cast("_Derived", property(get, doc=doc))


class Data(Closable, ABC):
    """Everything that changes: the state, the command, and what follows from them.

    The inputs `qpos`, `qvel` and `ctrl`, and where mocap bodies are, are writable in place, and the
    same arrays for the whole life of the Data; `data.ctrl = x` copies in. An assignment is checked
    before anything changes. NumPy's in-place operators (`data.ctrl *= x`) write first: what they
    leave is checked then, and by the verbs.

    All else is derived and read-only. It belongs to the state before the last engine
    step, or to that of the last `forward`; a write to an input changes none of it.
    On a fresh or reset Data it is zero. The equation of motion that it satisfies:
    M·qacc + qfrc_bias = qfrc_actuator + qfrc_passive + qfrc_constraint.

    A Data belongs to one thread at a time; several Data of one Model may run in several
    threads. A verb or a derived attribute refuses a Data that another thread is using just
    then (BusyDataError). Reading and writing the arrays of the inputs, and all that is
    done to `raw`, is not guarded: there a lock of the caller's has to keep threads apart.

    Attributes:
        qpos: (nq,) positions [rad or m]; quaternions wxyz.
        qvel: (nv,) velocities [rad/s or m/s]; of a free joint, linear in world axes,
            then angular in body axes.
        ctrl: (nu,) commands [unit of the actuator]. What acts is each clamped to its range,
            an infinite one too; the array and a State keep what was written.
        mocap_pos: (nmocap, 3) positions of the bodies that the file calls mocap, in the order of
            the bodies [m]. Nothing moves them but who writes; none on an engine without them.
        mocap_quat: (nmocap, 4) their orientations, wxyz; normalised before they act.
        time: Simulated time [s].
    """

    __slots__ = _SLOTS

    _model: Model
    _owner: Owner
    _unusable: str  # the reason why it is unusable; "" if it is usable
    _layout: StateLayout  # fingerprint and layout of its States
    _advance: Any  # the engine's own step: (_raw_model, _raw, nstep=1)
    _raw_model: Any  # all of `_ENGINE` is None once closed
    _raw: Any
    _pending_warnings: Any  # differs from `_seen_warnings` when the engine has something to say
    _seen_warnings: Any
    if TYPE_CHECKING:
        qpos = InputArray()
        qvel = InputArray()
        ctrl = InputArray()
        mocap_pos = InputArray()
        mocap_quat = InputArray()
        time = _Time()
    else:

        @property
        @abstractmethod
        def time(self) -> float:
            """Return the simulated time [s]; it may be assigned to."""

    def __init__(
        self,
        model: Model,
        advance: Callable[..., None],
        inputs: Mapping[str, Array],
        warnings: tuple[Any, Any] = (None, None),
        engine: tuple[Any, Any] = (None, None),
    ) -> None:
        """Fill the slots; a backend's own `__init__` calls this.

        Args:
            model: The Model that makes this Data.
            advance: The engine's own step, called with the two of `engine` and, for more
                than one step, their number. (Bound to them it would cost 0.5 % of a step.)
            inputs: The arrays qpos, qvel, ctrl, mocap_pos and mocap_quat, the same for the whole
                life.
            warnings: The engine's count of its warnings, pending and seen; when the two differ
                after a step, the verb calls `_raise_pending_warnings`.
            engine: The engine's model and data, or whatever `advance` takes first.
        """
        self._model, self._advance = model, advance
        self._owner = Owner(self)
        self._raw_model, self._raw = engine
        self._pending_warnings, self._seen_warnings = warnings
        for name in _WRITABLE:
            super().__setattr__(name, inputs[name])
        self._make_usable()

    @property
    @abstractmethod
    def raw(self) -> Any:
        """Return the engine's own object, for what this interface does not offer."""

    xpos = _derived("xpos", "(nbody, 3) body origins in world axes [m].")
    xquat = _derived("xquat", "(nbody, 4) body orientations, wxyz.")
    site_xpos = _derived("site_xpos", "(nsite, 3) site positions in world axes [m].")
    site_xmat = _derived("site_xmat", "(nsite, 9) site rotation matrices, row by row.")
    qacc = _derived("qacc", "(nv,) accelerations [rad/s² or m/s²].")
    qfrc_bias = _derived(
        "qfrc_bias", "(nv,) gravity, centrifugal and Coriolis [N·m or N]; on the left-hand side."
    )
    qfrc_actuator = _derived("qfrc_actuator", "(nv,) what the actuators exert [N·m or N].")
    qfrc_passive = _derived("qfrc_passive", "(nv,) springs and viscous damping [N·m or N].")
    qfrc_constraint = _derived(
        "qfrc_constraint", "(nv,) contact, dry friction and limits together [N·m or N]."
    )
    qfrc_contact = _derived(
        "qfrc_contact", "(nv,) the part of qfrc_constraint that contacts exert."
    )
    qfrc_friction = _derived(
        "qfrc_friction", "(nv,) the part that dry friction in the joints exerts."
    )
    qfrc_limit = _derived("qfrc_limit", "(nv,) the part that joint limits exert.")
    qfrc_equality = _derived("qfrc_equality", "(nv,) the part that equality constraints exert.")

    @property
    def contacts(self) -> Contacts:
        """Return the contacts of the state that derived values belong to; see `Contacts`."""
        return with_exclusive_access(self, self._derive, "contacts")

    @property
    def model(self) -> Model:
        """Return the Model that made this Data."""
        return self._model

    def _close_once(self) -> None:
        self._make_unusable("closed")
        for name in _WRITABLE:
            # The last values stay readable, apart from the engine's memory, which a view
            # would keep alive; a view that the caller kept can no longer be written into.
            view = getattr(self, name)
            super().__setattr__(name, read_only(view))
            view.setflags(write=False)
        for name in _ENGINE:
            super().__setattr__(name, None)
        self._close()

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _WRITABLE:
            self._refuse_if_unusable()
            self._check_writable()
            target = getattr(self, name)
            checked = as_vector(value, target.shape, name)
            if name == "qpos":
                self._model._check_quaternions(checked)
            target[:] = checked
        elif name == "time":
            self._refuse_if_unusable()
            self._set_time(as_scalar(value, "time"))
        elif name.startswith("_"):  # what a backend keeps, and Python its class
            super().__setattr__(name, value)
        elif hasattr(type(self), name):
            raise ReadOnlyError(
                f"{name!r} is read-only: it is derived; write qpos, qvel or ctrl and call forward"
            )
        else:
            raise ReadOnlyError(
                f"a Data has no attribute {name!r}; its inputs are {', '.join(_WRITABLE)} and time"
                f"{did_you_mean(name, (*_WRITABLE, 'time'))}"
            )

    if not TYPE_CHECKING:  # a type checker reports what is not there itself

        def __getattr__(self, name: str) -> NoReturn:
            if name.startswith("_"):  # a slot that is empty yet, or what Python asks for
                raise AttributeError(f"a Data has no attribute {name!r}", name=name, obj=self)
            from .unknown_attributes import no_attribute

            raise no_attribute(self, "Data", name, getattr(self, "_raw", None))

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Data is a live simulation: copy or pickle get_state(model, data)")

    def __repr__(self) -> str:
        if self._unusable:
            return f"<Data of {self._model!r}: {self._unusable}>"
        return f"<Data of {self._model!r} at {self.time:g} s>"

    def _refuse_if_unusable(self) -> None:
        if self._unusable == "closed":
            raise ClosedDataError("this Data is closed: make another with make_data")
        if self._unusable:
            refuse_other_thread(self)  # which may be in the middle of a reset
        if reason := self._unusable:
            raise DivergedError(
                f"this Data is not usable any more ({reason}): reset it, or set_state"
            )

    def _check_writable(self) -> None:
        """Raise ReadOnlyError where the caller made an input read-only."""
        for name in _WRITABLE:
            check_writable(getattr(self, name), name)

    def _make_unusable(self, reason: str) -> None:
        """Refuse, for this reason and once the verb has ended, all but `reset` and `set_state`."""
        self._unusable = reason

    def _make_usable(self) -> None:
        self._unusable = ""

    def _raise_pending_warnings(self) -> None:
        """Raise an error, or warn, for what the engine has warned of since the last call."""

    def _failed(self, error: Exception) -> None:
        """Make this Data unusable where `error` calls for it, and raise what it means to a user."""

    @abstractmethod
    def _derive(self, name: str) -> Any:
        """Return a read-only array of `records.DERIVED`, or Contacts; `data` is usable."""

    @abstractmethod
    def _recompute(self) -> None: ...

    @abstractmethod
    def _reset(self, key: int | None) -> None: ...

    @abstractmethod
    def _get_state(self) -> State: ...

    @abstractmethod
    def _set_state(self, state: State) -> None:
        """Take a State of the right layout; BadInputError only before anything changes."""

    @abstractmethod
    def _set_time(self, time: float) -> None: ...

    @abstractmethod
    def _close(self) -> None: ...
