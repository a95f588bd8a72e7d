"""An engine in a Python of its own behind the contract: another release of one, or any other.

Its process compiles the file itself. Here the same file is compiled by the release that is
installed, and takes over every number that the process reads in it: so a Model shows what the
engine there makes of the file, and edits reach it by the names of fields.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np

from ...errors import EngineError, EngineWarning, ModelError, one_line
from ...interface import Capabilities
from ...interface.checks import unsupported_by
from ...interface.read_options import told
from ...interface.records import AS_WRITTEN, Arrays, Defaults, ReadOptions
from ...release_names import is_release, version_of
from ...releases import python_of
from ..binary import is_binary
from ..compiled import check_numbers, compiler_warnings, facts, fastest
from ..edits import put
from ..hidden_data import HiddenModel
from ..mujoco_backend import MujocoModel
from ..mujoco_backend import load as load_installed
from ..spec_files import ENGINE_ERRORS, read_spec
from ..unshared import UnsharedElement, unshared_elements
from . import release_child as child
from .engine_process import AnswerError, LoadedModel, LostError, ServedEngine, ServedWorld, Server
from .release_parts import held

# Arrays that no motion depends on, and what each release computes of the others in its own way.
_OWN = (
    *("bvh", "cam", "hfield_path", "light", "mat_", "mesh_path", "name", "sensor", "skin", "tex"),
    *("paths", "efm", "B_", "D_", "M_", "mapM", "mapD", "flg_", "ten_J", "dof_length"),
    *("actuator_history", "sensor_history", "flexedge_invweight0"),
)
# What is large and laid out in each release's own way: nobody sends it to another.
_UNSENT = ("flex", "mesh", "oct")
_SAME = (
    *("nq", "nv", "nu", "na", "nbody", "njnt", "ngeom", "ntendon", "neq", "nkey"),
    "nmocap",
)
_NO_EDITS = MappingProxyType[str, Any]({})
_INSTALLED = f"MuJoCo {mujoco.__version__}"
_FLAGS = {"opt.disableflags": mujoco.mjtDisableBit, "opt.enableflags": mujoco.mjtEnableBit}


def load(
    path: Path,
    defaults: Defaults = "model",
    read_options: ReadOptions = AS_WRITTEN,
    *,
    release: str,
) -> HiddenModel:
    """Compile a file in both releases.

    Args:
        path: An MJCF or URDF file.
        defaults: As of the installed engine.
        read_options: How the file is read.
        release: As "mujoco==3.3.7".

    Raises:
        MissingEngineError: That release has no environment here.
        ModelError: One of the two cannot read the file.
    """
    python, version = str(python_of(release)), version_of(release)
    engine = ServedEngine(release, python, child.__file__, f"MuJoCo {version}")
    return served(engine)(path, defaults, read_options)


def served(
    engine: ServedEngine, capabilities: Capabilities | None = None
) -> Callable[..., ServedModel]:
    """The loader of an engine that runs in a Python of its own.

    Args:
        engine: Its Python, and the file that knows it there.
        capabilities: What the backend says of itself; None for what is said of MuJoCo.
    """

    def load_there(
        path: Path, defaults: Defaults = "model", read_options: ReadOptions = AS_WRITTEN
    ) -> ServedModel:
        if is_binary(path):
            raise ModelError(
                f"{path} was compiled by one release of MuJoCo; {engine.title} wants its XML"
            )
        installed = load_installed(path, defaults, read_options)
        source = _source(engine, installed.path, read_options)
        model = ServedModel(_compiled(engine, installed, source), capabilities)
        if model.unshared:
            sentences = "; ".join(str(element) for element in model.unshared)
            warnings.warn(f"{path}: {sentences}", EngineWarning, stacklevel=4)
        return model

    return load_there


@dataclass(frozen=True)
class EngineSource:
    """What an engine in a Python of its own reads of a file.

    Attributes:
        text: Instead of the file; "" for the file itself.
        read: How it reads the file, by names of `READ_OPTIONS`; empty where the text says it, or
            the file is read as it is written.
    """

    text: str = ""
    read: Mapping[str, bool] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class EngineReading:
    """What an engine makes of a file that the installed release has compiled.

    Attributes:
        engine: That read it.
        version: Of the engine.
        model: In the installed release's terms.
        shared: Names of the fields that both have.
        digest: Of what was read, by which a file that changed since then is seen.
        source: What the engine read of the file.
        frames: Ids of the sites that the engine has not: the frames of fused bodies.
        unshared: What only this engine, or only the installed release, reads in the file.
    """

    engine: ServedEngine
    version: str
    model: MujocoModel
    shared: frozenset[str]
    digest: str
    source: EngineSource
    frames: tuple[int, ...]
    unshared: tuple[UnsharedElement, ...]


def _opened(reading: EngineReading, edits: Mapping[str, Any], server: Server) -> int:
    """Return the number that the model of a file with some fields edited has there."""
    return _loaded(server, reading.model, reading.source, edits, digest=reading.digest).number


def _source(engine: ServedEngine, path: Path, options: ReadOptions) -> EngineSource:
    """Return what an engine reads of a file.

    Of a URDF it is a text with the meshes named by the places where they are, and with the options
    in it. An MJCF may include others: so a release of MuJoCo is told the options.

    Raises:
        UnsupportedError: The engine is none, and reads an MJCF as it is written.
    """
    if path.suffix.lower() == ".urdf":
        from ..file_text import urdf_text

        moments: dict[str, float] = {}
        if options.balance_inertia:
            from ..reading import balanced_moments

            moments = balanced_moments(path)
        text = urdf_text(path, options=options, moments=moments)
        return EngineSource() if text is None else EngineSource(text)
    if options == AS_WRITTEN:
        return EngineSource()
    if not is_release(engine.name):
        wanted = next(iter(told(options)))
        raise unsupported_by(engine.name, wanted, "it reads an MJCF as it is written")
    return EngineSource(read=asdict(options))


def _frames(installed: MujocoModel) -> tuple[int, ...]:
    """Return the ids of the sites that the file of a model does not have, but its frames."""
    spec = read_spec(installed.path)
    if not spec.compiler.fusestatic:
        return ()
    written = {site.name for site in spec.sites}
    names = enumerate(installed.site_names)
    return tuple(k for k, name in names if name and name not in written)


def _compiled(engine: ServedEngine, installed: MujocoModel, source: EngineSource) -> EngineReading:
    """Let an engine read a file that the installed release has compiled.

    Args:
        engine: The engine.
        installed: What the installed release makes of the file.
        source: What the engine reads of the file.

    Raises:
        ModelError: It cannot read the file, or what it reads cannot be told in these terms.
        EngineError: It cannot be run.
    """
    path, title = installed.path, engine.title
    try:
        server = Server.of(engine)
        loaded = _loaded(server, installed, source)
    except AnswerError as error:
        raise ModelError(f"{title} cannot read {path}: {error}") from error
    except (LostError, OSError) as error:
        anew = f"; to make it anew: {engine.anew}" if is_release(engine.name) else ""
        raise EngineError(f"{title} cannot be run: {error}{anew}") from error
    server.forgotten.append(loaded.number)
    fields, raw, frames = loaded.fields, copy.copy(installed.raw), _frames(installed)
    frame_names = [installed.site_names[k] for k in frames]
    if _reads_otherwise(loaded, raw, frames):
        raw, frames = _reading_of(server, loaded, source, path, title), ()
    shared = _take_over(raw, fields) | set(loaded.flags)
    for name, set_there in loaded.flags.items():
        _take_over_flags(raw, name, set_there)
    check_numbers(raw, f"{path} in {title}")
    return EngineReading(
        engine=engine,
        version=loaded.version,
        model=MujocoModel(raw, path, installed.substeps),
        shared=frozenset(shared),
        digest=loaded.digest,
        source=source,
        frames=frames,
        unshared=unshared_elements(installed.raw, raw, _INSTALLED, title, frame_names),
    )


def _reads_otherwise(loaded: LoadedModel, raw: mujoco.MjModel, frames: tuple[int, ...]) -> bool:
    """Return whether an engine finds other elements in a file than a compiled model has.

    Args:
        loaded: What the engine found.
        raw: The compiled model.
        frames: Ids of its sites that are no elements of the file.
    """
    names = child.names_of(raw)
    names["site"] = [name for k, name in enumerate(names["site"]) if k not in frames]
    if any(loaded.names[kind] != names[kind] for kind in loaded.names):
        return True
    return bool(_other_sizes(loaded, raw, len(frames)))


def _other_sizes(loaded: LoadedModel, raw: mujoco.MjModel, frames: int = 0) -> str:
    """Return the first size that an engine has otherwise than a compiled model; "" for none.

    Args:
        loaded: What the engine found.
        raw: The compiled model.
        frames: How many of its sites are no elements of the file.
    """
    sizes = {name: int(getattr(raw, name)) for name in _SAME}
    sizes["nsite"] = raw.nsite - frames
    for name, here in sizes.items():
        if name in loaded.fields and int(loaded.fields[name]) != here:
            return f"{name} is {int(loaded.fields[name])} there and {here} in {_INSTALLED}"
    return ""


def _reading_of(
    server: Server, loaded: LoadedModel, source: EngineSource, path: Path, title: str
) -> mujoco.MjModel:
    """Compile what an engine reads in a file, which it writes as MJCF, in the installed release.

    Raises:
        ModelError: It has other elements than the engine, still.
    """
    try:
        text = server.written(source.text, str(path.absolute()), **_read(source))
        reading = mujoco.MjSpec.from_string(text)
        reading.modelfiledir = str(path.parent.resolve())
        with compiler_warnings():  # the file's own are told already
            raw = reading.compile()
    except (AnswerError, ValueError, *ENGINE_ERRORS) as error:
        raise ModelError(
            f"{title} reads {path} as another robot than {_INSTALLED}, and what it reads cannot be "
            f"compiled here: {one_line(error)}"
        ) from error
    if difference := _other_sizes(loaded, raw):
        raise ModelError(f"{title} reads {path} as another robot: {difference}")
    return raw


def _read(source: EngineSource) -> dict[str, dict[str, bool]]:
    """Return how an engine reads a file, as an argument of its process, if not as it is written."""
    return {"read": dict(source.read)} if source.read else {}


def _take_over(raw: mujoco.MjModel, fields: Arrays) -> set[str]:
    """Write the numbers that an engine read into a compiled model; the fields that both have.

    Args:
        raw: The compiled model of the installed release.
        fields: What the engine read, by name.
    """
    shared = set[str]()
    for name in _fields(raw):
        now = np.asarray(_field(raw, name))
        if name not in fields or fields[name].shape != now.shape:
            continue
        shared.add(name)
        if not name.endswith("type") and not np.array_equal(fields[name], now):
            put(raw, name, fields[name] if now.ndim else fields[name].item())
    return shared


def _take_over_flags(raw: mujoco.MjModel, name: str, set_there: list[str]) -> None:
    """Set the flags of a compiled model that are set in an engine.

    Args:
        raw: The compiled model of the installed release.
        name: Of `_FLAGS`.
        set_there: Names of the flags that are set in the engine.
    """
    kinds, bits = _FLAGS[name].__members__, 0
    for flag in set_there:
        for own in child.SPLIT.get(flag, (flag,)):
            if own in kinds:
                bits += int(kinds[own])
    setattr(*held(raw, name), bits)


def _loaded(
    server: Server,
    model: MujocoModel,
    source: EngineSource,
    edits: Mapping[str, Any] = _NO_EDITS,
    **digest: str,
) -> LoadedModel:
    """Let an engine read the file of a model: as `Server.load`.

    Args:
        server: Its process.
        model: What the installed release makes of the file.
        source: What it reads of the file.
        edits: Numeric fields that are then another than in the file; flags by their names.
        **digest: Of what was read in the file before.
    """
    file = str(model.path.absolute())
    numbers = {name: value for name, value in edits.items() if name not in _FLAGS}
    flags = {name: value for name, value in edits.items() if name in _FLAGS}
    fields = [*_SAME, "nsite", *_fields(model.raw)]
    more = {**_read(source), **digest}
    return server.load(source.text, file, numbers, fields=fields, flags=flags, **more)


def _fields(raw: mujoco.MjModel, without: tuple[str, ...] = _UNSENT) -> Iterator[str]:
    """Names of the numeric fields of a compiled model that releases may have in common."""
    for name in dir(raw):
        sent = not name.startswith(("_", *_OWN, *without))
        if sent and isinstance(getattr(raw, name), np.ndarray):
            yield name
    for holder in ("opt", "stat"):
        names = {f"{holder}.{name}" for name in dir(getattr(raw, holder)) if name[0] != "_"}
        yield from sorted(names - _FLAGS.keys())


def _field(raw: mujoco.MjModel, name: str) -> Any:
    return getattr(*held(raw, name))


def _edits(reading: EngineReading, raw: mujoco.MjModel) -> dict[str, Any]:
    """Fields of a compiled model that are another than those of the file; flags by their names.

    Raises:
        UnsupportedError: The engine has no such field.
    """
    edits, base = dict[str, Any](), reading.model.raw
    for name in (*_fields(raw, ()), *_FLAGS):
        if np.array_equal(_field(raw, name), _field(base, name)):
            continue
        if name not in reading.shared:
            reason = "it has no such field, or lays it out in a way of its own"
            raise unsupported_by(reading.engine.name, name, reason)
        kind = name.removeprefix("opt.").removesuffix("flags")
        edits[name] = child.flags_of(raw, kind) if name in _FLAGS else np.array(_field(raw, name))
    return edits


def _taken_over(model: MujocoModel) -> dict[str, Any]:
    """Return the facts that a Model of another engine has of the installed release's Model."""
    known = facts(model.raw)
    known["raw"], known["path"] = model.raw, model.path
    known["timestep"], known["substeps"] = model.timestep, model.substeps
    known["max_qvel"] = fastest(model.raw)
    return known


class ServedModel(HiddenModel):
    """What an engine in a Python of its own makes of a file, with what was edited in it."""

    _reading: EngineReading
    _inner: MujocoModel
    _own: Capabilities | None

    def __init__(
        self,
        reading: EngineReading,
        capabilities: Capabilities | None = None,
        inner: MujocoModel | None = None,
    ) -> None:
        inner = reading.model if inner is None else inner
        record = inner.capabilities if capabilities is None else capabilities
        engine = inner.replace(latency=0) if inner.actuator_delay.any() else inner
        opened = partial(_opened, reading, _edits(reading, engine.raw))
        timestep = float(inner.raw.opt.timestep)
        super().__init__(
            partial(ServedWorld, reading.engine, opened, inner.raw, timestep, reading.frames),
            backend=reading.engine.name,
            engine_version=reading.version,
            capabilities=record,
            _reading=reading,
            _inner=inner,
            _own=capabilities,
            **_taken_over(inner),
        )

    @property
    def unshared(self) -> tuple[UnsharedElement, ...]:
        """Return what only this engine, or only the installed MuJoCo, reads in the file."""
        return self._reading.unshared

    @property
    def compiled(self) -> mujoco.MjModel:
        """In the terms of the installed release."""
        return self.raw

    def with_compiled(self, compiled: mujoco.MjModel) -> ServedModel:
        inner = self._inner.with_compiled(compiled)
        return ServedModel(self._reading, self._own, inner)._started_as(self, {})

    def _replace(self, options: dict[str, Any]) -> ServedModel:
        return ServedModel(self._reading, self._own, self._inner._replace(options))
