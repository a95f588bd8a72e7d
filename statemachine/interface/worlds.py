"""The contract of Worlds: many Data of one Model, in arrays with one row for each world."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from ..errors import (
    BadInputError,
    ClosedDataError,
    EngineError,
    ReadOnlyError,
    StateMachineError,
    did_you_mean,
    shown,
)
from ..processes import free_memory
from .checks import HUGE, TINY, as_numbers, as_vector, check_entries, check_writable, whole_number
from .exclusive_access import Closable, Owner
from .model import Model
from .records import (
    FORCES,
    INPUTS,
    MOCAP,
    POSES,
    Array,
    Errors,
    Ints,
    State,
    StateLayout,
    read_only,
)

if TYPE_CHECKING:
    from .data import InputArray

BATCHED = (*POSES, "qacc", *FORCES)  # the derived arrays that worlds can keep
WRITABLE = (*INPUTS, *MOCAP, "time")
_SPARE = 0.95  # of the memory that is free, what worlds may take


def without(ids: Ints, ended: Collection[int]) -> Ints:
    """Return the numbers of worlds, less those that have ended."""
    return ids[~np.isin(ids, list(ended))] if ended else ids


class Worlds(Closable, ABC):
    """n worlds: each what one Data of its Model would be, bit for bit.

    The inputs and the time are writable in place and the same arrays for the whole life;
    `worlds.ctrl = x` copies in, and one row is given to all worlds. The derived arrays are
    those that `make_worlds` was asked for. They are read-only, zero in a fresh or reset world,
    and belong to the state before the last engine step or to that of the last `forward`, as
    in a Data.

    What would raise in one Data while it steps (it diverges, an entry of its input is NaN)
    ends this world only: it is told of by a DivergedWarning, listed in `diverged` and left out
    of every call until `reset` or `set_state`. The others go on.

    Worlds belong to one thread at a time, as a Data does, and to the process that made them.

    Attributes:
        model: The Model.
        n: Number of worlds.
        workers: Threads that step them.
        qpos, qvel, ctrl: (n, nq), (n, nv) and (n, nu), as in a Data.
        mocap_pos, mocap_quat: (n, nmocap, 3) and (n, nmocap, 4), as in a Data.
        time: (n,) simulated time of each world [s].
        xpos: (n, nbody, 3), and so on for each name of `derived`.
        derived: Names of the derived arrays that are kept, of `BATCHED`.
    """

    model: Model
    n: int
    workers: int
    derived: tuple[str, ...]
    _errors: Errors
    _numbers: Ints
    _process: int
    _model: Model
    _owner: Owner
    _unusable: str
    if TYPE_CHECKING:
        qpos = InputArray()
        qvel = InputArray()
        ctrl = InputArray()
        mocap_pos = InputArray()
        mocap_quat = InputArray()
        time = InputArray()
        xpos: Array
        xquat: Array
        site_xpos: Array
        site_xmat: Array
        qacc: Array
        qfrc_bias: Array
        qfrc_actuator: Array
        qfrc_passive: Array
        qfrc_constraint: Array

    def __init__(
        self,
        model: Model,
        n: int,
        workers: int,
        derived: tuple[str, ...],
        arrays: Mapping[str, Array],
    ) -> None:
        """Take the arrays; a backend's own `__init__` calls this last.

        Args:
            model: The Model.
            n: Number of worlds.
            workers: Threads that there are.
            derived: Names of the derived arrays.
            arrays: (n, ...) of each input, of time and of each name of `derived`: the same
                memory for the whole life.
        """
        kept = {name: arrays[name].view() for name in (*WRITABLE, *derived)}
        for name in derived:
            kept[name].setflags(write=False)
        vars(self).update(
            model=model,
            n=n,
            workers=workers,
            derived=derived,
            **kept,
            _errors={},
            _numbers=np.arange(n),
            _process=os.getpid(),
            # What `with_exclusive_access` asks of what it guards, as of a Data.
            _model=model,
            _unusable="",
        )
        self._owner = Owner(self)

    @property
    def diverged(self) -> Mapping[int, Exception]:
        """Return the error of each world that is left out, by its number."""
        return MappingProxyType(self._errors)

    def model_of(self, world: int) -> Model:
        """Return the Model of one world: `model`, with the options that were given for this world.

        Raises:
            BadInputError: There is no such world.
            ClosedDataError: The Worlds are closed.
        """
        self._refuse_if_unusable()
        return self._model_of(self._world(world))

    def _close_once(self) -> None:
        # Copies: a view would keep the memory of the engine alive, or outlive it.
        fields = vars(self)
        fields["_unusable"] = "closed"
        for name in self.derived:
            fields.pop(name, None)
        for name in WRITABLE:
            view = fields[name]
            fields[name] = read_only(view)
            view.setflags(write=False)  # where the caller kept it
        if self._process == os.getpid():
            self._close()

    # Hooks of the functions in statemachine.worlds, which check their arguments and keep
    # `diverged`. `ids` are world numbers, each once and in order; where time passes, none of
    # them has diverged. One thread calls at a time. Whoever implements them writes into the
    # arrays given to `__init__`.

    @abstractmethod
    def _model_of(self, world: int) -> Model:
        """Return the Model of a world that exists."""

    @abstractmethod
    def _close(self) -> None:
        """Give back threads and memory; the arrays are copied already."""

    @abstractmethod
    def _step(self, ids: Ints, nstep: int, forward: bool) -> Errors:
        """Advance these worlds; by its number the error of each where one Data would raise.

        With `forward`, recompute what is derived of the others.
        """

    @abstractmethod
    def _forward(self, ids: Ints) -> Errors:
        """Recompute what is derived, of checked inputs; the error of each that cannot be."""

    @abstractmethod
    def _reset(self, ids: Ints, key: int | None) -> None:
        """Put these worlds to the default state or a keyframe; what is derived becomes zero."""

    @abstractmethod
    def _get_states(self, ids: Ints) -> list[State]:
        """Return the States of these worlds, whose inputs are checked."""

    @abstractmethod
    def _set_states(self, ids: Ints, states: Sequence[State]) -> None:
        """Take States of the right layout; BadInputError only before anything of it changes."""

    @abstractmethod
    def _state_layout(self, world: int) -> StateLayout:
        """Return the fingerprint and layout of the States of one world."""

    @abstractmethod
    def _record(
        self, ids: Ints, nstep: int, every: int, arrays: Mapping[str, Array], ctrl: Array | None
    ) -> Errors:
        """Advance by `nstep`, and after each `every` steps write into arrays[name][world, k].

        The rows of a world that ends are left as they are from there on.

        Args:
            ids: The worlds.
            nstep: Number of timesteps, a multiple of `every`.
            every: Steps between two records.
            arrays: (n, nstep // every, ...) of each name, of the inputs, time and `derived`.
            ctrl: (n, nstep // every, nu), the command from each record to the next, or None.
        """

    def _failed(self, error: Exception) -> None:
        """Raise what `error`, out of a hook, means to a user of all worlds, if it means more."""

    def _refuse_if_unusable(self) -> None:
        if self._unusable:
            raise ClosedDataError("these Worlds are closed: make others with make_worlds")

    def _world(self, world: int) -> int:
        """Return the number of one world."""
        number = whole_number(world)
        if number is None or not 0 <= number < self.n:
            raise BadInputError(f"there is no world {shown(world)}: they are 0 to {self.n - 1}")
        return number

    def _check_inputs(self, ids: Ints) -> None:
        """Raise BadInputError for the first entry of these worlds that is not a finite number."""
        for name in (*INPUTS, *MOCAP):
            rows = self.model._acting(name, getattr(self, name)[ids]).reshape(len(ids), -1)
            if not np.abs(rows).max(initial=0.0) <= HUGE:  # NaN fails it, too
                row = int(np.flatnonzero(~(np.abs(rows) <= HUGE).all(axis=1))[0])
                try:
                    check_entries(rows[row], name, self.model._coordinate_name)
                except BadInputError as error:
                    raise in_world(int(ids[row]), error) from None
        for error in self._zero_quaternions(self.qpos[ids], ids).values():
            raise error

    def _zero_quaternions(self, qpos: Array, ids: Ints) -> dict[int, BadInputError]:
        """Return the error of each world whose `qpos`, (len(ids), nq), has a zero quaternion."""
        errors: dict[int, BadInputError] = {}
        for joint, start in self.model._quaternions:
            quats = qpos[:, start : start + 4]
            # If the first number is not zero the quaternion is not zero: the cheapest test.
            for row in np.flatnonzero(np.abs(quats[:, 0]) < TINY).tolist():
                if quats[row].dot(quats[row]) < TINY * TINY:
                    error = self.model._zero_quaternion(joint, start)
                    errors.setdefault(int(ids[row]), in_world(int(ids[row]), error))
        return errors

    def __getattr__(self, name: str) -> Any:  # only for what is not there
        if name in BATCHED and "_unusable" in vars(self):
            self._refuse_if_unusable()
            raise AttributeError(
                f"these Worlds do not keep {name!r}: name it in make_worlds(…, derived=…)"
            )
        if name == "_advance":  # what `statemachine.step` asks of a Data
            raise TypeError("step takes a Data; got Worlds, which statemachine.worlds.step takes")
        hint = "" if name.startswith("_") else did_you_mean(name, (*WRITABLE, *BATCHED))
        raise AttributeError(f"Worlds have no attribute {name!r}{hint}")

    def __setattr__(self, name: str, value: Any) -> None:
        if name in WRITABLE:
            self._refuse_if_unusable()
            for array in WRITABLE:
                check_writable(getattr(self, array), array, "worlds")
            target = getattr(self, name)
            numbers = as_numbers(value, name)
            shape = target.shape if numbers.ndim == target.ndim else target.shape[1:]
            checked = as_vector(numbers, shape, name)
            if name == "qpos":
                rows = np.broadcast_to(checked, target.shape)
                for error in self._zero_quaternions(rows, self._numbers).values():
                    raise error
            target[:] = checked
        elif name.startswith("_"):
            vars(self)[name] = value
        else:
            raise ReadOnlyError(
                f"{name!r} of Worlds cannot be assigned to; write {', '.join(WRITABLE)}"
            )

    def __delattr__(self, name: str) -> None:
        raise ReadOnlyError(f"{name!r} of Worlds cannot be deleted")

    def __len__(self) -> int:
        return self.n

    def __repr__(self) -> str:
        about = self._unusable or (f"{len(self._errors)} diverged" if self._errors else "")
        return f"<Worlds: {self.n} of {self.model!r}{about and f': {about}'}>"

    def __reduce__(self) -> NoReturn:
        raise TypeError("Worlds are live simulations: pickle the State of each, by get_state")


def in_world(world: int, error: StateMachineError) -> Any:
    """Return the same error, with the number of its world."""
    return type(error)(f"world {world}: {error}", **{**vars(error), "world": world})


def check_memory(n: int, each: float, made: int = 0, of_which: str = "") -> None:
    """Raise EngineError where the worlds that are still to be made would not fit into memory.

    Args:
        n: Number of worlds.
        each: Bytes that one takes.
        made: Worlds that have been made already.
        of_which: What most of it is, in words.
    """
    free = free_memory()
    if free is None or (n - made) * each <= _SPARE * free:
        return
    most = made + int(_SPARE * free / each)
    size = f"{each / 1e6:.0f} MB" if each >= 1e6 else f"{each / 1e3:.1f} kB"
    raise EngineError(
        f"{n} worlds do not fit into memory: one takes {size}{of_which and f', {of_which}'}, and "
        f"{free / 1e9:.1f} GB are free: {f'make {most} at most' if most else 'not even one does'}"
    )
