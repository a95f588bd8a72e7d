"""An engine in a Python of its own behind the contract: another release of MuJoCo, or any other.

Its process compiles the file itself. Here the same file is compiled by the release that is
installed, and takes over every number that the process reads in it: so a Model shows what the
engine there makes of the file, and edits reach it by the names of fields.
"""

from __future__ import annotations

import copy
import hashlib
import os
import weakref
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast

import mujoco
import numpy as np

from ..errors import EngineError, ModelError, UnsupportedError
from ..interface import DERIVED, Array, Capabilities, Contacts
from ..interface.checks import HUGE
from ..releases import is_release, python_of, version_of
from . import _release_child as child
from ._edits import held, put
from ._hidden_data import HiddenModel
from ._hidden_world import HiddenWorld, Memory, Moment, Read
from ._served import LostError, ServedEngine, Server
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
) -> ServedModel:
    """Compile a file in both releases.

    Args:
        path: An MJCF or URDF file.
        defaults: As of the installed MuJoCo.
        release: As "mujoco==3.3.7".

    Raises:
        MissingEngineError: That release has no environment here.
        ModelError: One of the two cannot read the file, or they read different parts in it.
    """
    title, python = f"MuJoCo {version_of(release)}", str(python_of(release))
    return served(ServedEngine(release, python, child.__file__, title))(path, defaults)


def served(
    engine: ServedEngine, capabilities: Capabilities | None = None
) -> Callable[..., ServedModel]:
    """The loader of an engine that runs in a Python of its own.

    Args:
        engine: Its Python, and the file that knows it there.
        capabilities: What the backend says of itself; None for what is said of MuJoCo.
    """

    def load_there(
        path: str | os.PathLike[str], defaults: Literal["model", "engine"] = "model"
    ) -> ServedModel:
        if is_binary(os.fspath(path)):
            raise ModelError(
                f"{path} was compiled by one release of MuJoCo; {engine.title} wants its XML"
            )
        installed = load_installed(path, defaults)
        return ServedModel(_compiled(engine, Path(path), installed), capabilities)

    return load_there


class FileReading(NamedTuple):
    """What an engine makes of a file.

    Attributes:
        engine: That read it.
        version: Of the engine.
        model: In the installed release's terms.
        shared: Names of the fields that both have.
        memory: Name and length of each array that the engine remembers from step to step.
        untold: Names of what is derived that it does not tell.
        digest: Of what was read, by which a file that changed since then is seen.
    """

    engine: ServedEngine
    version: str
    model: MujocoModel
    shared: frozenset[str]
    memory: tuple[tuple[str, int], ...]
    untold: frozenset[str]
    digest: str


def _compiled(engine: ServedEngine, path: Path, installed: MujocoModel) -> FileReading:
    """What an engine makes of a file that the installed release has compiled.

    Raises:
        ModelError: It cannot read the file, or finds other parts in it.
    """
    server, raw, title = Server.of(engine), copy.copy(installed.raw), engine.title
    try:
        answer, fields, digest = _loaded(server, path, raw)
    except ValueError as error:
        raise ModelError(f"{title} cannot read {path}: {error}") from error
    except LostError as error:
        anew = f"; to make it anew: statemachine engines remove {engine.name}, then add"
        advice = anew if is_release(engine.name) else ""
        raise EngineError(f"{title} cannot be run: {error}{advice}") from error
    server.forgotten.append(answer["model"])
    for name in _SAME:
        if name in fields and int(fields[name]) != getattr(raw, name):
            raise ModelError(
                f"{title} reads {path} as another robot: {name} is {int(fields[name])} there "
                f"and {getattr(raw, name)} in MuJoCo {mujoco.__version__}"
            )
    flags = answer.get("flags", {})
    shared = set(flags)
    for name in _fields(raw):
        now = np.asarray(_field(raw, name))
        if name in fields and fields[name].shape == now.shape:
            shared.add(name)
            if not name.endswith("type") and not np.array_equal(fields[name], now):
                put(raw, name, fields[name] if now.ndim else fields[name].item())
    for name, set_there in flags.items():
        kinds = _FLAGS[name].__members__
        names = [own for flag in set_there for own in child.SPLIT.get(flag, (flag,))]
        setattr(*held(raw, name), sum(int(kinds[own]) for own in names if own in kinds))
    check_numbers(raw, f"{path} in {title}")
    return FileReading(
        engine,
        answer["version"],
        MujocoModel(raw, path, installed.substeps),
        frozenset(shared),
        tuple((name, int(length)) for name, length in answer["memory"]),
        frozenset(answer.get("untold", ())),
        digest,
    )


def _loaded(
    server: Server, path: Path, raw: mujoco.MjModel
) -> tuple[dict[str, Any], dict[str, Array], str]:
    """The number of a model and what is said of it, its fields, and a digest of both."""
    spec = spec_with_packages(path)
    text, names = spec.to_xml() if spec else "", [*_SAME, *_fields(raw)]
    answer, fields = server.ask("load", file=str(path.absolute()), text=text, fields=names)
    said = repr([answer.get("flags"), answer["memory"], answer["version"]]).encode()
    read = b"".join([said, *(array.tobytes() for array in fields.values())])
    return answer, fields, hashlib.sha256(read).hexdigest()


def _opened(server: Server, reading: FileReading, edits: Mapping[str, Any]) -> tuple[int, int]:
    """A world of a file with some fields edited: the numbers of its model and of itself."""
    path = reading.model.path
    answer, _, digest = _loaded(server, path, reading.model.raw)
    number = answer["model"]
    if digest != reading.digest:
        raise ValueError(f"{path} is another file than when it was loaded")
    if edits:
        arrays = {name: value for name, value in edits.items() if name not in _FLAGS}
        answer, _ = server.ask(
            "edit",
            *(np.asarray(value, float).ravel() for value in arrays.values()),
            model=number,
            edits=[(name, np.size(value)) for name, value in arrays.items()],
            flags={name: value for name, value in edits.items() if name in _FLAGS},
        )
        server.forgotten.append(number)
        number = answer["model"]
    return number, server.ask("make", model=number)[0]["world"]


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


def _edits(reading: FileReading, raw: mujoco.MjModel) -> dict[str, Any]:
    """Fields of a compiled model that are another than those of the file; flags by their names.

    Raises:
        UnsupportedError: The engine has no such field.
    """
    edits, base, backend = dict[str, Any](), reading.model.raw, reading.engine.name
    for name in (*_fields(raw), *_FLAGS):
        if np.array_equal(_field(raw, name), _field(base, name)):
            continue
        if name not in reading.shared:
            reason = "it has no such field"
            text = f"{backend} cannot be given another {name}: {reason}"
            raise UnsupportedError(text, backend=backend, feature=name, reason=reason)
        kind = name.removeprefix("opt.").removesuffix("flags")
        edits[name] = child.flags_of(raw, kind) if name in _FLAGS else np.array(_field(raw, name))
    return edits


class ServedModel(HiddenModel):
    """What an engine in a Python of its own makes of a file, with what was edited in it."""

    _reading: FileReading
    _inner: MujocoModel
    _own: Capabilities | None

    def __init__(
        self,
        reading: FileReading,
        capabilities: Capabilities | None = None,
        inner: MujocoModel | None = None,
    ) -> None:
        inner = inner or reading.model
        engine = inner.replace(latency=0) if inner.actuator_delay.any() else inner
        edits = _edits(reading, engine.raw)
        super().__init__(
            partial(ServedWorld, reading, edits, float(inner.raw.opt.timestep)),
            backend=reading.engine.name,
            engine_version=reading.version,
            raw=inner.raw,
            path=inner.path,
            capabilities=capabilities or inner.capabilities,
            timestep=inner.timestep,
            substeps=inner.substeps,
            max_qvel=fastest(inner.raw),
            _reading=reading,
            _inner=inner,
            _own=capabilities,
            **facts(inner.raw),
        )

    @property
    def compiled(self) -> mujoco.MjModel:
        """In the terms of the installed release."""
        return self.raw

    def with_compiled(self, compiled: mujoco.MjModel) -> ServedModel:
        inner = self._inner.with_compiled(compiled)
        return ServedModel(self._reading, self._own, inner)._started_as(self, {})

    def _replace(self, options: dict[str, Any]) -> ServedModel:
        return ServedModel(self._reading, self._own, self._inner._replace(options))


class ServedWorld(HiddenWorld):
    """A world in the process of an engine; the engine's own object is there."""

    errors, raw = (LostError,), None

    def __init__(self, reading: FileReading, edits: Mapping[str, Any], timestep: float) -> None:
        """Open it; `timestep` is that of an engine step [s]."""
        raw = reading.model.raw
        self.engine, self.timestep = reading.engine.title, timestep
        self._reading, self._edits, self.qpos0 = reading, edits, np.array(raw.qpos0)
        self.memory_layout, self.untold = reading.memory, reading.untold
        lengths = [raw.nq, raw.nv, *(length for _, length in reading.memory)]
        self._cuts = np.cumsum(lengths)[:-1]
        self._ctrl, self._fastest = np.zeros(raw.nu), HUGE
        self._state, self._reserve = np.zeros(sum(lengths)), None
        self._derived: dict[str, Array] | None = None
        self._begin()

    def _begin(self) -> None:
        """Be in the process of the engine, which begins anew where it has ended."""
        self._server, self._placed = Server.of(self._reading.engine), True
        try:
            self._model, self._world = _opened(self._server, self._reading, self._edits)
        except (LostError, ValueError) as error:
            raise EngineError(f"{self.engine} cannot make a world: {error}") from error
        # No call: it may be collected in the midst of another.
        self._end = weakref.finalize(self, _forget, self._server, self._model, self._world)

    def _ask(self, verb: str, *content: Array, **job: Any) -> tuple[Any, dict[str, Array]]:
        return self._server.ask(verb, *content, world=self._world, nu=len(self._ctrl), **job)

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
        answer, states = self._ask("run", self._ctrl, *placed, steps=steps, fastest=self._fastest)
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
        qpos, qvel, *_ = np.split(self._state, self._cuts)
        return qpos.copy(), qvel.copy()

    @property
    def memory(self) -> Memory:
        return tuple(part.copy() for part in np.split(self._state, self._cuts)[2:])

    def look(self, moment: Moment) -> None:
        if not self._server.lives:
            self._begin()
        state = np.concatenate([moment.qpos, moment.qvel, *moment.memory])
        _, self._derived = self._ask("look", moment.ctrl, state)
        self._placed = True

    def derive(self, name: str, moment: Moment, read: Read) -> dict[str, Any]:
        if self._derived is None:
            _, self._derived = self._ask("look")
        arrays = dict(self._derived)
        values: dict[str, Any] = {n: arrays.pop(n) for n in DERIVED if n not in self.untold}
        if "contacts" not in self.untold:
            geom = arrays.pop("geom").astype(np.int64)
            values["contacts"] = Contacts(geom=geom, **arrays)
        return values

    def close(self) -> None:
        self._end()


def _forget(server: Server, *numbers: int) -> None:
    server.forgotten.extend(numbers)
