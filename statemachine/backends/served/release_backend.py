"""An engine in a Python of its own behind the contract: another release of one, or any other.

Its process compiles the file itself. Here the same file is compiled by the release that is
installed, and takes over every number that the process reads in it: so a Model shows what the
engine there makes of the file, and edits reach it by the names of fields.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ...errors import EngineWarning, ModelError
from ...interface import Capabilities
from ...interface.checks import unsupported_by
from ...interface.records import AS_WRITTEN, Defaults, ReadOptions
from ...release_names import version_of
from ...releases import python_of
from ..binary import is_binary
from ..compiled.model import facts, fastest
from ..hidden_data import HiddenModel
from ..mujoco_backend import MujocoModel
from ..mujoco_backend import load as load_installed
from ..unshared import UnsharedElement
from . import release_child as child
from .engine_process import ServedEngine, ServedWorld, Server
from .engine_reading import EngineReading, load_file, read_by, source_of
from .shared_fields import FLAGS, field_names, field_of


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
    """Return the loader of an engine that runs in a Python of its own.

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
        source = source_of(engine, installed.path, read_options)
        model = ServedModel(read_by(engine, installed, source), capabilities)
        if model.unshared:
            sentences = "; ".join(str(element) for element in model.unshared)
            warnings.warn(f"{path}: {sentences}", EngineWarning, stacklevel=4)
        return model

    return load_there


def _opened(reading: EngineReading, edits: Mapping[str, Any], server: Server) -> int:
    """Return the number that the model of a file with some fields edited has there."""
    return load_file(server, reading.model, reading.source, edits, digest=reading.digest).number


def _edits(reading: EngineReading, raw: mujoco.MjModel) -> dict[str, Any]:
    """Return the fields of a compiled model that differ from those of the file; flags by their
    names.

    Raises:
        UnsupportedError: The engine has no such field.
    """
    edits, base = dict[str, Any](), reading.model.raw
    for name in (*field_names(raw, ()), *FLAGS):
        if np.array_equal(field_of(raw, name), field_of(base, name)):
            continue
        if name not in reading.shared:
            reason = "it has no such field, or lays it out in a way of its own"
            raise unsupported_by(reading.engine.name, name, reason)
        kind = name.removeprefix("opt.").removesuffix("flags")
        edits[name] = child.flags_of(raw, kind) if name in FLAGS else np.array(field_of(raw, name))
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

    reading: EngineReading
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
            reading=reading,
            _inner=inner,
            _own=capabilities,
            **_taken_over(inner),
        )

    @property
    def unshared(self) -> tuple[UnsharedElement, ...]:
        """Return what only this engine, or only the installed MuJoCo, reads in the file."""
        return self.reading.unshared

    @property
    def compiled(self) -> mujoco.MjModel:
        """Return the compiled model in the terms of the installed release."""
        return self.raw

    def with_compiled(self, compiled: mujoco.MjModel) -> ServedModel:
        inner = self._inner.with_compiled(compiled)
        return ServedModel(self.reading, self._own, inner)._inherit_start(self, {})

    def _replace(self, options: dict[str, Any]) -> ServedModel:
        return ServedModel(self.reading, self._own, self._inner._replace(options))
