"""An engine in a Python of its own, its process, and worlds there; see `child_server`."""

from __future__ import annotations

import os
import pickle
import threading
import weakref
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import numpy as np

from ...errors import EngineError
from ...interface import DERIVED, Array, Contacts
from ...interface.checks import HUGE
from ...interface.records import Arrays, Sizes
from ...processes import PipedChild
from ...release_names import is_release, version_of
from ...rotations import matrix_from_quat
from ..hidden_world import HiddenWorld, Memory, Moment, Read
from . import child_server

_FILE = child_server.__file__


class ServedEngine(NamedTuple):
    """An engine in a Python of its own.

    Attributes:
        name: Of the backend.
        python: Its interpreter, which has NumPy and the engine.
        child: The file that knows the engine, as `child_server` says.
        title: What messages call it.
    """

    name: str
    python: str
    child: str
    title: str

    @property
    def remedy(self) -> str:
        """Return what to type to make the environment of a release anew."""
        return f"statemachine engines remove {self.name}, then add"


@dataclass(frozen=True, eq=False)
class LoadedModel:
    """What an engine says of a model that it has loaded.

    Attributes:
        number: Of the model, in the process of the engine.
        version: Of the engine.
        digest: Of what it read, by which a file that changed since then is seen.
        flags: Names of the flags that are set, by the names of their sets; empty where the engine
            reports none.
        names: Names of the elements, by kind; empty where the engine reports none.
        fields: Numeric fields that were asked for, by name, as far as the engine has them.
    """

    number: int
    version: str
    digest: str
    flags: Mapping[str, list[str]]
    names: Mapping[str, list[str]]
    fields: Arrays


@dataclass(frozen=True)
class MadeWorld:
    """What an engine says of a world that it has made.

    Attributes:
        number: Of the world, in the process of the engine.
        memory: As `HiddenWorld.memory_layout`.
        kept_memory: As in a HiddenWorld.
        unavailable: As `HiddenWorld.unavailable`.
    """

    number: int
    memory: Sizes
    kept_memory: tuple[str, ...]
    unavailable: frozenset[str]


@dataclass(frozen=True, eq=False)
class RunSteps:
    """Steps that an engine has taken.

    Attributes:
        taken: How many.
        before: qpos, qvel and the memory, in a row, after these steps.
        after: The same after one step more; None where that was not taken.
    """

    taken: int
    before: Array
    after: Array | None


class LostError(Exception):
    """The process of an engine has ended."""


class AnswerError(Exception):
    """What is asked of an engine in its process raised an error there."""


class Server:
    """The process of an engine, which holds the models and worlds that this process has there."""

    _all: dict[tuple[int, ServedEngine], Server] = {}  # noqa: RUF012
    _lock = threading.RLock()

    def __init__(self, engine: ServedEngine) -> None:
        command = [engine.python, "-I", "-u", _FILE, engine.child]
        self._engine, self._turn, self.lives = engine, threading.RLock(), True
        self._patience = child_server.SPIN  # with which an answer is looked for [s]
        self.forgotten = deque[int]()  # models and worlds that it is to forget at the next call
        self._models = weakref.WeakKeyDictionary[Callable[..., Any], int]()
        self._process = PipedChild(command, {**os.environ, "MUJOCO_GL": "disable"})
        self.pid = self._process.pid

    @classmethod
    def of(cls, engine: ServedEngine) -> Server:
        """Return the process of an engine; start one where there is none that lives."""
        with cls._lock:
            key = os.getpid(), engine
            if key not in cls._all or not cls._all[key].lives:
                cls._all[key] = cls(engine)
            return cls._all[key]

    def ask(
        self, verb: str, arrays: Mapping[str, Array] = MappingProxyType({}), **job: Any
    ) -> tuple[dict[str, Any], Arrays]:
        """Let it do something, and return its answer, and arrays by name.

        Raises:
            LostError: It has ended.
            AnswerError: It raised an error, with its text.
        """
        try:
            with self._turn:
                free = [self.forgotten.popleft() for _ in range(len(self.forgotten))]
                child_server.send(self._process.to, {"verb": verb, "free": free, **job}, arrays)
                answer, values, self._patience = child_server.receive(
                    self._process.out, self._patience
                )
        except (OSError, ValueError, EOFError, pickle.UnpicklingError) as error:
            self.lives, ended = False, self._process.how_it_ended()
            self._process.kill()  # one that lives is asked nothing more
            raise LostError(f"its process is gone: {ended or error}") from error
        except BaseException:  # Ctrl-C: what it still says would be taken for another answer
            self.lives = False
            self._process.kill()
            raise
        if "error" in answer:
            raise AnswerError(answer["error"])
        return answer, values

    def load(
        self,
        text: str,
        file: str,
        edits: Mapping[str, Array] = MappingProxyType({}),
        **job: Any,
    ) -> LoadedModel:
        """Let it load a model.

        Args:
            text: Of the file, or "".
            file: Its path.
            edits: Numeric fields that are then another than in the file, by name.
            **job: "fields", names of those that are told; "digest" of what was read before; and
                "flags", by the names of their sets.

        Raises:
            LostError, AnswerError: As `ask`.
            EngineError: The environment of a release has another one.
        """
        answer, fields = self.ask("load", edits, file=file, text=text, **job)
        loaded = LoadedModel(
            number=answer["model"],
            version=answer["version"],
            digest=answer["digest"],
            flags=answer.get("flags", {}),
            names=answer.get("names", {}),
            fields=fields,
        )
        name, version = self._engine.name, loaded.version
        if is_release(name) and version != version_of(name):
            self.forgotten.append(loaded.number)
            raise EngineError(f"the environment of {name} has {version}: {self._engine.remedy}")
        return loaded

    def written(self, text: str, file: str, **job: Any) -> str:
        """Return as MJCF what it reads in a file.

        Args:
            text: Of the file, or "".
            file: Its path.
            **job: "read", how it reads the file.

        Raises:
            LostError, AnswerError: As `ask`.
        """
        answer, _ = self.ask("written", file=file, text=text, **job)
        return answer["text"]

    def make(self, model: int) -> MadeWorld:
        """Let it make a world of a model, which is given by its number.

        Raises:
            LostError, AnswerError: As `ask`.
        """
        answer, _ = self.ask("make", model=model)
        return MadeWorld(
            number=answer["world"],
            memory=tuple((name, int(length)) for name, length in answer["memory"]),
            kept_memory=tuple(answer["kept_memory"]),
            unavailable=frozenset(answer["unavailable"]),
        )

    def run(self, world: int, arrays: Mapping[str, Array], steps: int, **job: Any) -> RunSteps:
        """Let it take steps.

        Args:
            world: The number of the world.
            arrays: "ctrl", the command; and "state" where the world is to be placed first.
            steps: Number of steps; fewer are taken where a coordinate goes beyond its bound.
            **job: "fastest", that bound of a velocity; and "ahead", whether one step more is taken.

        Raises:
            LostError, AnswerError: As `ask`.
        """
        answer, states = self.ask("run", arrays, world=world, steps=steps, **job)
        return RunSteps(answer["taken"], states["before"], states.get("after"))

    def number(self, opened: Callable[[Server], int]) -> int:
        """Return the number of a model in that process: all worlds that are opened alike share
        it.
        """
        with self._turn:
            if opened not in self._models:
                self._models[opened] = opened(self)
                weakref.finalize(opened, self.forgotten.append, self._models[opened])
            return self._models[opened]


class ServedWorld(HiddenWorld):
    """A world in the process of an engine; the engine's own object is there."""

    errors, raw = (LostError, AnswerError), None

    def __init__(
        self,
        engine: ServedEngine,
        opened: Callable[[Server], int],
        compiled: Any,
        timestep: float,
        frames: Sequence[int] = (),
    ) -> None:
        """Open it.

        Args:
            engine: Whose process it is in.
            opened: Loads the model there; its number. All worlds of a Model have the same one.
            compiled: The mjModel, in the terms of the installed release.
            timestep: Of an engine step [s]: that of the mjModel, when the model was made.
            frames: Ids of the sites of the mjModel that the engine has not; they are fixed to its
                bodies.
        """
        self.engine, self._engine, self._opened = engine.title, engine, opened
        self._compiled, self.timestep, self.qpos0 = compiled, timestep, compiled.qpos0
        self._frames = list(frames)
        # Steps of a call that have one command take one exchange.
        self._ahead = not compiled.actuator_delay.any()
        self._ctrl = np.zeros(compiled.nu)
        self._derived: Arrays | None = None
        self._begin()
        lengths = [compiled.nq, compiled.nv, *(length for _, length in self.memory_layout)]
        self._places = np.split(np.arange(sum(lengths)), np.cumsum(lengths)[:-1])
        self._state, self._reserve = np.zeros(sum(lengths)), None

    def _begin(self) -> None:
        """Be in the process of the engine, which begins anew where it has ended."""
        self._placed = True
        try:
            self._server = server = Server.of(self._engine)
            made = server.make(server.number(self._opened))
        except (LostError, AnswerError, OSError) as error:
            raise EngineError(f"{self.engine} cannot make a world: {error}") from error
        self._world = made.number
        # No call: it may be collected in the midst of another.
        self._end = weakref.finalize(self, server.forgotten.append, self._world)
        self.memory_layout, self.kept_memory = made.memory, made.kept_memory
        self.unavailable = made.unavailable

    def place(self, qpos: Array, qvel: Array, memory: Memory) -> None:
        self._state, self._placed = np.concatenate([qpos, qvel, *memory]), True
        self._reserve = None

    def command(self, ctrl: Array) -> None:
        self._ctrl = ctrl
        if self._reserve is not None:  # it was taken under another command
            self._placed, self._reserve = True, None

    def advance(self, steps: int, fastest: float) -> int:
        if not self._server.lives:
            self._begin()
        arrays = {"ctrl": self._ctrl}
        if self._placed:
            arrays["state"] = self._state
        ahead = self._ahead or not steps
        run = self._server.run(self._world, arrays, steps, fastest=fastest, ahead=ahead)
        self._placed, self._derived, self._state = False, None, run.before
        self._reserve = run.after
        return run.taken

    def step(self) -> None:
        if self._reserve is None:
            self.advance(0, HUGE)
        self._state, self._reserve = cast("Array", self._reserve), None

    def read(self) -> tuple[Array, Array]:
        qpos, qvel, *_ = self._places
        return self._state[qpos], self._state[qvel]

    def memory_at(self, key: int | None) -> Memory:
        return tuple(
            zeros if key is None or name != "act" else self._compiled.key_act[key]
            for (name, _), zeros in zip(self.memory_layout, super().memory_at(key), strict=True)
        )

    @property
    def memory(self) -> Memory:
        return tuple(self._state[places] for places in self._places[2:])

    def look(self, moment: Moment) -> None:
        if not self._server.lives:
            self._begin()
        self.place(moment.qpos, moment.qvel, moment.memory)
        given = {"ctrl": moment.ctrl, "state": self._state}
        _, self._derived = self._server.ask("look", given, world=self._world)

    def derive(self, name: str, moment: Moment, read: Read) -> dict[str, Any]:
        if self._derived is None:
            state = np.concatenate([moment.qpos, moment.qvel, *moment.memory])
            _, self._derived = self._server.ask("look", {"state": state}, world=self._world)
        arrays: dict[str, Any] = dict(self._derived)
        if self._frames:
            arrays |= self._with_frames(arrays)
        values = {n: arrays.pop(n) for n in DERIVED if n not in self.unavailable}
        if "contacts" not in self.unavailable:
            values["contacts"] = Contacts(**arrays)
        return values

    def _with_frames(self, arrays: Arrays) -> Arrays:
        """Return site_xpos and site_xmat of all sites, those that the engine has not among them.

        Args:
            arrays: Derived by the engine: xpos, xquat, and those of its own sites.
        """
        raw, frames = self._compiled, self._frames
        own = np.setdiff1d(np.arange(raw.nsite), frames)
        bodies = raw.site_bodyid[frames]
        turns = matrix_from_quat(arrays["xquat"][bodies])
        offsets = np.einsum("bij,bj->bi", turns, raw.site_pos[frames])
        mats = np.einsum("bij,bjk->bik", turns, matrix_from_quat(raw.site_quat[frames]))
        places, axes = np.empty((raw.nsite, 3)), np.empty((raw.nsite, 9))
        places[own], axes[own] = arrays["site_xpos"], arrays["site_xmat"]
        places[frames] = arrays["xpos"][bodies] + offsets
        axes[frames] = mats.reshape(-1, 9)
        return {"site_xpos": places, "site_xmat": axes}

    def close(self) -> None:
        self._end()
