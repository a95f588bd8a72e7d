"""What a backend says of an engine that keeps a world of its own: a `HiddenWorld`.

MuJoCo lets its caller own the state. Most engines do not: functions reach a world inside. A
`HiddenData` has arrays beside such a world. A backend is then what its engine does differently,
in the hooks of a `HiddenWorld`; `tests/support/hidden_world.py` is a short one to start from.
"""

from __future__ import annotations

import os
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import DERIVED, POSES, Array
from ..interface.checks import HUGE
from ..interface.records import Sizes

_MANY = HUGE * HUGE
Read = Callable[[str], Any]
Memory = Sequence[Array]  # of the lengths in `HiddenWorld.memory_layout`


@dataclass(slots=True)
class Moment:
    """All that what is derived at one moment depends on.

    Attributes:
        qpos, qvel: (nq,) and (nv,), as in a Data.
        ctrl: What `command` takes.
        memory: What the world knew of the step before; see `HiddenWorld.memory`.
    """

    qpos: Array
    qvel: Array
    ctrl: Array
    memory: Memory


class HiddenWorld(ABC):
    """One world of an engine, and all that is the engine's own about it.

    Arrays that a hook is given are not written to, and not kept; those that it returns are new.

    Attributes:
        engine: Name of the engine, for messages.
        errors: What the engine raises when it gives up.
        unavailable: Names of `records.DERIVED`, and "contacts", that this engine does not tell.
        memory_layout: Name and length of each array of `memory`, which a State then has.
        kept_memory: Names of those that a write into qpos or qvel leaves as they are; others
            are then those of the default state.
        timestep: Simulated time of one engine step [s].
        qpos0: (nq,) positions of the default state.
        raw: The engine's own object, which `Data.raw` gives.
    """

    engine: str
    errors: tuple[type[Exception], ...] = ()
    unavailable: frozenset[str] = frozenset()
    memory_layout: Sizes = ()
    kept_memory: Collection[str] = ()
    timestep: float
    qpos0: Array
    raw: Any
    # Held while a world that several Data share is used. One for all Models.
    lock = threading.RLock()

    @abstractmethod
    def place(self, qpos: Array, qvel: Array, memory: Memory) -> None:
        """Take a state, so that what follows depends on nothing that was before.

        The command stays. What a call that was interrupted left behind is undone here.

        Args:
            qpos: (nq,) [rad or m], MuJoCo's conventions; finite, no quaternion is zero.
            qvel: (nv,) [rad/s or m/s].
            memory: Of the step before that state, or that of `memory_at` where there was none.
        """

    @abstractmethod
    def command(self, ctrl: Array) -> None:
        """Take a command (nu,) [unit of the actuator] that is in force until the next one.

        Where mocap bodies are follows it (7·nmocap,): mocap_pos, then mocap_quat, as written.

        A latency (`Model.actuator_delay`) has passed already: the Data keeps what is on its way.
        It is within its range, where the Model says that the engine clamps it.
        """

    @abstractmethod
    def step(self) -> None:
        """Take one engine step."""

    @abstractmethod
    def read(self) -> tuple[Array, Array]:
        """Return the state of the engine: qpos (nq,) and qvel (nv,), MuJoCo's conventions."""

    @abstractmethod
    def derive(self, name: str, moment: Moment, read: Read) -> Mapping[str, Any]:
        """Return the derived values of the moment that the last step, or `look`, started from.

        Args:
            name: Of `records.DERIVED`, or "contacts".
            moment: Where that step started.
            read: Gives another value of that moment, by name.

        Returns:
            Arrays of the contract's shapes by name, and "contacts": `name` at least, and what
            else comes with it.
        """

    @abstractmethod
    def close(self) -> None:
        """Give the world back. Idempotent."""

    def look(self, moment: Moment) -> None:
        """Be where `derive` computes a moment itself; only called where no Data steps.

        By default one step is taken from it.
        """
        self.place(moment.qpos, moment.qvel, moment.memory)
        self.command(moment.ctrl)
        self.step()

    def kinematics(self, moment: Moment, name: str) -> Mapping[str, Array]:
        """Return `name` of `records.POSES` at a moment, where that needs no step.

        And what comes with it. Empty by default: `derive` gives it.
        """
        return {}

    def diverging(self, fastest: float) -> bool:
        """Tell whether a coordinate is NaN or beyond its bound: a quick look between engine steps.

        If so, all are read, and the first that is raises DivergedError. All are looked at at
        the end of a call, so that this may look at some.

        Args:
            fastest: The smallest `max_qvel` of the Model [rad/s or m/s].
        """
        return not bounded(*self.read(), fastest)

    def advance(self, steps: int, fastest: float) -> int:
        """Take engine steps under one command, up to one after which it is `diverging`; how many.

        `step` follows where all were taken, and `read` and `memory` tell of before it.
        """
        for k in range(1, steps + 1):
            self.step()
            if self.diverging(fastest):
                return k
        return steps

    def renewed(self) -> HiddenWorld:
        """Return the world in which the state is overwritten: another, where `place` leaves traces.

        Then this one is closed.
        """
        return self

    def memory_at(self, key: int | None) -> Memory:
        """Return the memory that the default state has (None), or a keyframe: zeros by default."""
        return tuple(np.zeros(length) for _, length in self.memory_layout)

    @property
    def memory(self) -> Memory:
        """Return what the engine remembers of its last step, beside qpos, qvel and ctrl: new
        arrays.
        """
        return ()


def _renew() -> None:
    """Start anew in the child of a fork: another thread may have held the lock."""
    HiddenWorld.lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew)


class LookAhead:
    """A world that the Data of a Model share, in which what is derived of a moment is computed.

    Attributes:
        world: None until the first use.
    """

    def __init__(self, open_world: Callable[[], HiddenWorld]) -> None:
        self._open = open_world
        self.world: HiddenWorld | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return LookAhead, (self._open,)

    def at(self, moment: Moment) -> dict[str, Any]:
        """Return the Contacts, forces and poses of a moment, all that the engine offers."""
        with HiddenWorld.lock:
            self.world = world = self._open() if self.world is None else self.world.renewed()
            world.look(moment)
            return derived_by(world, moment)


def derived_by(world: HiddenWorld, moment: Moment) -> dict[str, Any]:
    """Return the Contacts, forces and poses of a moment that a world's last step, or `look`,
    started from.
    """
    values = dict[str, Any]()

    def read(name: str) -> Any:
        if name in POSES and name not in values:
            values.update(world.kinematics(moment, name))
        if name not in values:
            values.update(world.derive(name, moment, read))  # noqa: F821 (until `del read`)
        return values[name]

    for name in ("contacts", *DERIVED):
        if name not in world.unavailable:
            read(name)
    del read  # which knows itself, and the world: a circle that would keep it
    return values


def bounded(qpos: Array, qvel: Array, fastest: float) -> bool:
    """Tell whether no position is beyond `HUGE`, no velocity beyond `fastest`, and none is NaN.

    By a cheap sufficient condition.
    """
    return bool(qpos.dot(qpos) < _MANY and qvel.dot(qvel) < fastest * fastest)
