"""Another release of MuJoCo behind the contract: in a process and an environment of its own.

The child compiles the file itself. Here the same file is compiled by the release that is
installed, and takes over every number that the child reads in it: so a Model shows what the
child's release makes of the file, and edits reach the child by the names of fields.
"""

from __future__ import annotations

import copy
import hashlib
import json
import os
import threading
import weakref
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast

import mujoco
import numpy as np

from ..errors import EngineError, ModelError, UnsupportedError
from ..interface import DERIVED, Array, Contacts
from ..processes.pipes import PipedChild
from ..releases import python_of, version_of
from . import _release_child as child
from ._edits import held, put
from ._hidden_data import HiddenModel
from ._hidden_world import HiddenWorld, Memory, Moment, Read
from .binary import is_binary
from .compiled import check_numbers, facts, fastest, spec_with_packages
from .mujoco_backend import MujocoModel
from .mujoco_backend import load as load_installed

# Arrays that no motion depends on, and those that each release lays out in a way of its own.
_OWN = (
    *("bvh", "cam", "flex", "hfield", "light", "mat_", "mesh", "name", "oct", "sensor", "skin"),
    *("tex", "paths", "efm", "B_", "D_", "M_", "mapM", "mapD", "flg_", "ten_J"),
    *("dof_length", "actuator_history", "sensor_history"),
)
_SAME = ("nq", "nv", "nu", "na", "nbody", "njnt", "ngeom", "nsite", "ntendon", "neq", "nkey")
_FLAGS = {"opt.disableflags": mujoco.mjtDisableBit, "opt.enableflags": mujoco.mjtEnableBit}


def load(
    path: str | os.PathLike[str], defaults: Literal["model", "engine"] = "model", *, release: str
) -> ReleaseModel:
    """Compile a file in both releases.

    Args:
        path: An MJCF or URDF file.
        defaults: As of the installed MuJoCo.
        release: As "mujoco==3.3.7".

    Raises:
        MissingEngineError: That release has no environment here.
        ModelError: One of the two cannot read the file, or they read different parts in it.
    """
    engine = f"MuJoCo {version_of(release)}"
    if is_binary(os.fspath(path)):
        raise ModelError(f"{path} was compiled by one release of MuJoCo; {engine} wants its XML")
    server = Server.of(release)
    installed = load_installed(path, defaults)
    return ReleaseModel(server.compiled(Path(path), installed), release)


class FileReading(NamedTuple):
    """What a release makes of a file.

    Attributes:
        model: In the installed release's terms.
        shared: Names of the fields that both have.
        digest: Of what the release read, by which a file that changed since then is seen.
    """

    model: MujocoModel
    shared: frozenset[str]
    digest: str


class LostError(Exception):
    """The process of a release has ended."""


class Server:
    """The process of a release, which holds the models and worlds that this process has there."""

    _all: dict[tuple[int, str], Server] = {}  # noqa: RUF012
    _lock = threading.RLock()

    def __init__(self, release: str) -> None:
        command = [str(python_of(release)), "-I", "-u", child.__file__]
        self.release, self._turn, self.lives = release, threading.RLock(), True
        self.forgotten: list[int] = []  # models and worlds that it is to forget at the next call
        self._process = PipedChild(command, {**os.environ, "MUJOCO_GL": "disable"})

    @classmethod
    def of(cls, release: str) -> Server:
        """The one of a release; started where there is none, or none that lives."""
        with cls._lock:
            key = os.getpid(), release
            if key not in cls._all or not cls._all[key].lives:
                cls._all[key] = cls(release)
            return cls._all[key]

    def ask(
        self, verb: str, *content: Array, **job: Any
    ) -> tuple[dict[str, Any], dict[str, Array]]:
        """Let it do something; its answer, and arrays by name.

        Raises:
            LostError: It has ended.
            ValueError: It raised an error, with its text.
        """
        blob = b"".join(array.tobytes() for array in content)
        try:
            with self._turn:
                free, self.forgotten = self.forgotten, []
                head = json.dumps({"verb": verb, "free": free, **job}).encode()
                self._process.to.write(child.SIZES.pack(len(head), len(blob)) + head + blob)
                self._process.to.flush()
                size, rest = child.SIZES.unpack(self._process.out.read(child.SIZES.size))
                answer = json.loads(self._process.out.read(size))
                values = np.frombuffer(self._process.out.read(rest))
        except (OSError, ValueError, child.struct.error) as error:
            self.lives, ended = False, self._process.how_it_ended()
            raise LostError(f"its process is gone: {ended or error}") from error
        except BaseException:  # Ctrl-C: what it still says would be taken for another answer
            self.lives = False
            self._process.kill()
            raise
        if "error" in answer:
            raise ValueError(answer["error"])
        arrays, start = dict[str, Array](), 0
        for name, shape in answer["arrays"]:
            stop = start + int(np.prod(shape))
            arrays[name], start = values[start:stop].reshape(shape).copy(), stop
        return answer, arrays

    def compiled(self, path: Path, installed: MujocoModel) -> FileReading:
        """What it makes of a file that the installed release has compiled.

        Raises:
            ModelError: It cannot read the file, or finds other parts in it.
        """
        engine, raw = f"MuJoCo {version_of(self.release)}", copy.copy(installed.raw)
        try:
            answer, fields, digest = self._loaded(path, raw)
        except ValueError as error:
            raise ModelError(f"{engine} cannot read {path}: {error}") from error
        except LostError as error:
            raise EngineError(
                f"{engine} cannot be run: {error}; to make it anew: statemachine engines remove "
                f"{self.release}, then add"
            ) from error
        self.forgotten.append(answer["model"])
        for name in _SAME:
            if name in fields and int(fields[name]) != getattr(raw, name):
                raise ModelError(
                    f"{engine} reads {path} as another robot: {name} is {int(fields[name])} there "
                    f"and {getattr(raw, name)} in MuJoCo {mujoco.__version__}"
                )
        shared = set(_FLAGS)
        for name in _fields(raw):
            now = np.asarray(_field(raw, name))
            if name in fields and fields[name].shape == now.shape:
                shared.add(name)
                if not name.endswith("type") and not np.array_equal(fields[name], now):
                    put(raw, name, fields[name] if now.ndim else fields[name].item())
        for name, kinds in _FLAGS.items():
            names = [own for flag in answer[name] for own in child.SPLIT.get(flag, (flag,))]
            known = [int(kinds.__members__[own]) for own in names if own in kinds.__members__]
            setattr(*held(raw, name), sum(known))
        check_numbers(raw, f"{path} in {engine}")
        return FileReading(MujocoModel(raw, path, installed.substeps), frozenset(shared), digest)

    def _loaded(
        self, path: Path, raw: mujoco.MjModel
    ) -> tuple[dict[str, Any], dict[str, Array], str]:
        """The number of a model and its flags, its fields, and a digest of them."""
        spec = spec_with_packages(path)
        text, names = spec.to_xml() if spec else "", [*_SAME, *_fields(raw)]
        answer, fields = self.ask("load", file=str(path.absolute()), text=text, fields=names)
        flags = repr([answer[name] for name in _FLAGS]).encode()
        read = b"".join([flags, *(array.tobytes() for array in fields.values())])
        return answer, fields, hashlib.sha256(read).hexdigest()

    def opened(self, reading: FileReading, edits: Mapping[str, Any]) -> tuple[int, int]:
        """A world of a file with some fields edited: the numbers of its model and of itself."""
        path = reading.model.path
        answer, _, digest = self._loaded(path, reading.model.raw)
        number = answer["model"]
        if digest != reading.digest:
            raise ValueError(f"{path} is another file than when it was loaded")
        if edits:
            arrays = {name: value for name, value in edits.items() if name not in _FLAGS}
            answer, _ = self.ask(
                "edit",
                *(np.asarray(value, float).ravel() for value in arrays.values()),
                model=number,
                edits=[(name, np.size(value)) for name, value in arrays.items()],
                flags={name: value for name, value in edits.items() if name in _FLAGS},
            )
            self.forgotten.append(number)
            number = answer["model"]
        return number, self.ask("make", model=number)[0]["world"]


def _fields(raw: mujoco.MjModel) -> Iterator[str]:
    """Names of the numeric fields of a compiled model that releases may have in common."""
    for name in dir(raw):
        if not name.startswith(("_", *_OWN)) and isinstance(getattr(raw, name), np.ndarray):
            yield name
    for name in dir(raw.opt):
        if not name.startswith("_") and f"opt.{name}" not in _FLAGS:
            yield f"opt.{name}"


def _field(raw: mujoco.MjModel, name: str) -> Any:
    return getattr(*held(raw, name))


def _edits(release: str, reading: FileReading, raw: mujoco.MjModel) -> dict[str, Any]:
    """Fields of a compiled model that are another than those of the file; flags by their names.

    Raises:
        UnsupportedError: The release has no such field.
    """
    edits, base = dict[str, Any](), reading.model.raw
    for name in _fields(raw):
        if not np.array_equal(_field(raw, name), _field(base, name)):
            if name not in reading.shared:
                reason = "that release has no such field"
                raise UnsupportedError(
                    f"{release} cannot be given another {name}: {reason}",
                    backend=release,
                    feature=name,
                    reason=reason,
                )
            edits[name] = np.array(_field(raw, name))
    for name in _FLAGS:
        if _field(raw, name) != _field(base, name):
            edits[name] = child.flags_of(raw, name.removeprefix("opt.").removesuffix("flags"))
    return edits


class ReleaseModel(HiddenModel):
    """What a release makes of a file, with what was edited in it.

    Attributes:
        release: As "mujoco==3.3.7".
    """

    release: str
    _reading: FileReading
    _inner: MujocoModel

    def __init__(
        self, reading: FileReading, release: str, inner: MujocoModel | None = None
    ) -> None:
        inner = inner or reading.model
        engine = inner.replace(latency=0) if inner.actuator_delay.any() else inner
        edits = _edits(release, reading, engine.raw)
        names = ("path", "capabilities", "timestep", "substeps")
        super().__init__(
            partial(ReleaseWorld, release, reading, edits, float(inner.raw.opt.timestep)),
            backend=release,
            engine_version=version_of(release),
            raw=inner.raw,
            release=release,
            max_qvel=fastest(inner.raw),
            _reading=reading,
            _inner=inner,
            **facts(inner.raw),
            **{name: getattr(inner, name) for name in names},
        )

    @property
    def compiled(self) -> mujoco.MjModel:
        """In the terms of the installed release."""
        return self.raw

    def with_compiled(self, compiled: mujoco.MjModel) -> ReleaseModel:
        inner = self._inner.with_compiled(compiled)
        return ReleaseModel(self._reading, self.release, inner)._started_as(self, {})

    def _replace(self, options: dict[str, Any]) -> ReleaseModel:
        return ReleaseModel(self._reading, self.release, self._inner._replace(options))


class ReleaseWorld(HiddenWorld):
    """A world in the process of a release; the engine's own object is there."""

    errors, raw = (LostError,), None

    def __init__(
        self, release: str, reading: FileReading, edits: Mapping[str, Any], timestep: float
    ) -> None:
        """Open it; `timestep` is that of an engine step [s]."""
        raw = reading.model.raw
        self.engine, self.timestep = f"MuJoCo {version_of(release)}", timestep
        self._opening, self.qpos0 = (release, reading, edits, timestep), np.array(raw.qpos0)
        nv, na, nu = raw.nv, raw.na, raw.nu
        self._sizes = np.cumsum([raw.nq, nv, nv])
        self.memory_layout = (("warmstart", nv), ("act", na))[: 1 + bool(na)]
        self._ctrl, self._fastest = np.zeros(nu), child.HUGE
        self._state, self._reserve = np.zeros(self._sizes[-1] + na), None
        self._derived: dict[str, Array] | None = None
        self._begin()

    def _begin(self) -> None:
        """Be in the process of the release, which begins anew where it has ended."""
        release, reading, edits, _ = self._opening
        self._server, self._placed = Server.of(release), True
        try:
            self._model, self._world = self._server.opened(reading, edits)
        except (LostError, ValueError) as error:
            raise EngineError(f"{self.engine} cannot make a world: {error}") from error
        # No call: it may be collected in the midst of another.
        self._end = weakref.finalize(self, _forget, self._server, self._model, self._world)

    def place(self, qpos: Array, qvel: Array, memory: Memory) -> None:
        self._state, self._placed = np.concatenate([qpos, qvel, *memory]), True
        self._reserve = None

    def command(self, ctrl: Array) -> None:
        self._ctrl = ctrl
        if self._reserve is not None:  # it was taken under another command
            self._placed, self._reserve = True, None

    def _run(self, steps: int) -> int:
        if not self._server.lives:
            self._begin()
        placed = [self._state] if self._placed else []
        answer, states = self._server.ask(
            "run", self._ctrl, *placed, world=self._world, steps=steps, fastest=self._fastest
        )
        self._placed, self._derived, self._state = False, None, states["before"]
        self._reserve = states.get("after")
        return answer["taken"]

    def advance(self, steps: int, fastest: float) -> int:
        self._fastest = fastest
        return self._run(steps)

    def step(self) -> None:
        if self._reserve is None:
            self._run(0)
        self._state, self._reserve = cast("Array", self._reserve), None

    def read(self) -> tuple[Array, Array]:
        qpos, qvel, *_ = np.split(self._state, self._sizes)
        return qpos.copy(), qvel.copy()

    @property
    def memory(self) -> Memory:
        _, _, warmstart, act = np.split(self._state, self._sizes)
        return (warmstart.copy(), act.copy())[: len(self.memory_layout)]

    def look(self, moment: Moment) -> None:
        if not self._server.lives:
            self._begin()
        state = np.concatenate([moment.qpos, moment.qvel, *moment.memory])
        _, self._derived = self._server.ask("look", moment.ctrl, state, world=self._world)
        self._placed = True

    def derive(self, name: str, moment: Moment, read: Read) -> dict[str, Any]:
        if self._derived is None:
            _, self._derived = self._server.ask("look", world=self._world)
        arrays = dict(self._derived)
        values: dict[str, Any] = {name: arrays.pop(name) for name in DERIVED}
        geom = arrays.pop("geom").astype(np.int64)
        return {**values, "contacts": Contacts(geom=geom, **arrays)}

    def close(self) -> None:
        self._end()


def _forget(server: Server, *numbers: int) -> None:
    server.forgotten.extend(numbers)
