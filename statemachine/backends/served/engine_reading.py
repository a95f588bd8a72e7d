"""What an engine in a Python of its own reads in a file, told in the installed release's terms.

The file is compiled in both. The installed release's model takes over the engine's numbers; where
the engine finds other elements, it is compiled anew of what the engine writes.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import mujoco

from ...errors import EngineError, ModelError, one_line
from ...interface.checks import unsupported_by
from ...interface.read_options import non_default_options
from ...interface.records import AS_WRITTEN, ReadOptions
from ...release_names import is_release
from ..compiled.model import check_numbers, compiler_warnings
from ..compiled.spec_files import ENGINE_ERRORS, read_spec
from ..mujoco_backend import MujocoModel
from ..unshared import UnsharedElement, unshared_elements
from . import release_child as child
from .engine_process import AnswerError, LoadedModel, LostError, ServedEngine, Server
from .shared_fields import FLAGS, field_names, take_over, take_over_flags

_SAME = (
    *("nq", "nv", "nu", "na", "nbody", "njnt", "ngeom", "ntendon", "neq", "nkey"),
    "nmocap",
)
_NO_EDITS = MappingProxyType[str, Any]({})
_INSTALLED = f"MuJoCo {mujoco.__version__}"


# Of an option of reading: a switch, whether a base floats, or where it starts, by "pos" and "quat".
ReadValue = bool | str | None | Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class EngineSource:
    """What an engine in a Python of its own reads of a file.

    Attributes:
        text: Instead of the file; "" for the file itself.
        read: How it reads the file, by names of `READ_OPTIONS`; empty where the text says it, or
            the file is read as it is written.
    """

    text: str = ""
    read: Mapping[str, ReadValue] = field(default_factory=dict)


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


def source_of(engine: ServedEngine, path: Path, options: ReadOptions) -> EngineSource:
    """Return what an engine reads of a file.

    Of a URDF it is a text with the meshes named by the places where they are, and with the options
    in it. An MJCF may include others: so a release of MuJoCo is told the options.

    Raises:
        UnsupportedError: The engine is none, and reads an MJCF as it is written.
    """
    if path.suffix.lower() == ".urdf":
        from ..compiled.reading import balanced_moments, base_of_text
        from ..file_text import urdf_text

        moments: dict[str, float] = {}
        if options.balance_inertia:
            moments = balanced_moments(path)
        text = urdf_text(path, options=options, moments=moments, base=base_of_text(path, options))
        return EngineSource() if text is None else EngineSource(text)
    if options == AS_WRITTEN:
        return EngineSource()
    if not is_release(engine.name):
        wanted = next(iter(non_default_options(options)))
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


def read_by(engine: ServedEngine, installed: MujocoModel, source: EngineSource) -> EngineReading:
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
        loaded = load_file(server, installed, source)
    except AnswerError as error:
        raise ModelError(f"{title} cannot read {path}: {error}") from error
    except (LostError, OSError) as error:
        anew = f"; to make it anew: {engine.remedy}" if is_release(engine.name) else ""
        raise EngineError(f"{title} cannot be run: {error}{anew}") from error
    server.forgotten.append(loaded.number)
    fields, raw, frames = loaded.fields, copy.copy(installed.raw), _frames(installed)
    frame_names = [installed.site_names[k] for k in frames]
    if _reads_otherwise(loaded, raw, frames):
        raw, frames = _reading_of(server, loaded, source, path, title), ()
    shared = take_over(raw, fields) | set(loaded.flags)
    for name, set_there in loaded.flags.items():
        take_over_flags(raw, name, set_there)
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


def _read(source: EngineSource) -> dict[str, dict[str, ReadValue]]:
    """Return how an engine reads a file, as an argument of its process, if not as it is written."""
    return {"read": dict(source.read)} if source.read else {}


def load_file(
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
    numbers = {name: value for name, value in edits.items() if name not in FLAGS}
    flags = {name: value for name, value in edits.items() if name in FLAGS}
    fields = [*_SAME, "nsite", *field_names(model.raw)]
    more = {**_read(source), **digest}
    return server.load(source.text, file, numbers, fields=fields, flags=flags, **more)
