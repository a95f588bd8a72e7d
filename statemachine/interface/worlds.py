"""The contract of Worlds: many Data of one Model, in arrays with one row for each world."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, NoReturn

from .model import Model
from .records import FORCES, POSES, Array, Ints, State

BATCHED = (*POSES, "qacc", *FORCES)  # the derived arrays that worlds can keep


class Worlds(ABC):
    """n worlds: each what one Data of its Model would be, bit for bit.

    The inputs are writable in place and the same arrays for the whole life; `worlds.ctrl = x`
    copies in, and one row is given to all worlds. The derived arrays are those that
    `make_worlds` was asked for. They are read-only, zero in a fresh or reset world, and belong
    to the state before the last engine step or to that of the last `forward`, as in a Data.

    A world that diverges is told of by a DivergedWarning, listed in `diverged` and left out of
    every call until `reset` or `set_state`; the others go on.

    Attributes:
        model: The Model.
        n: Number of worlds.
        workers: Threads or processes that step them.
        qpos, qvel, ctrl: (n, nq), (n, nv) and (n, nu), as in a Data.
        time: (n,) simulated time of each world [s].
        xpos: (n, nbody, 3), and so on for each name of `derived`.
        derived: Names of the derived arrays that are kept, of `BATCHED`.
        diverged: The error of each world that is left out, by its number.
    """

    model: Model
    n: int
    workers: int
    derived: tuple[str, ...]
    diverged: Mapping[int, Exception]
    if TYPE_CHECKING:
        qpos: Array
        qvel: Array
        ctrl: Array
        time: Array
        xpos: Array
        xquat: Array
        site_xpos: Array
        site_xmat: Array
        qacc: Array
        qfrc_bias: Array
        qfrc_actuator: Array
        qfrc_passive: Array
        qfrc_constraint: Array

    @abstractmethod
    def model_of(self, world: int) -> Model:
        """The Model of one world: `model`, with the options that were given for this world."""

    @abstractmethod
    def close(self) -> None:
        """Give back threads, processes and memory. Idempotent.

        The last qpos, qvel, ctrl and time stay readable; every other use is an error.
        """

    # Hooks of the functions in statemachine.worlds, which check their arguments. `ids` are
    # world numbers, each once and in order; where time passes, none of them has diverged.

    @abstractmethod
    def _step(self, ids: Ints, nstep: int) -> Mapping[int, Exception]:
        """Advance these worlds; the error of each that diverged."""

    @abstractmethod
    def _forward(self, ids: Ints) -> Mapping[int, Exception]:
        """Recompute what is derived; the error of each that cannot be."""

    @abstractmethod
    def _reset(self, ids: Ints, key: int | None) -> None:
        """Put these worlds to the default state or a keyframe."""

    @abstractmethod
    def _get_state(self, world: int) -> State: ...

    @abstractmethod
    def _set_state(self, world: int, state: State) -> None: ...

    @abstractmethod
    def _record(
        self, ids: Ints, nstep: int, every: int, arrays: Mapping[str, Array], ctrl: Array | None
    ) -> Mapping[int, Exception]:
        """Advance by `nstep`, and after each `every` steps write into arrays[name][world, k].

        Args:
            ids: The worlds.
            nstep: Number of timesteps, a multiple of `every`.
            every: Steps between two records.
            arrays: (n, nstep // every, ...) of each name, of the inputs, time and `derived`.
            ctrl: (n, nstep // every, nu), the command from each record to the next, or None.
        """

    def __enter__(self) -> Worlds:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def __len__(self) -> int:
        return self.n

    def __reduce__(self) -> NoReturn:
        raise TypeError("Worlds are live simulations: pickle the State of each, by get_state")
