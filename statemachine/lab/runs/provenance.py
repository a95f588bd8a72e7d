"""What a result was computed with, so that it can be computed again."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ... import __version__
from ...interface import Model
from ...models import included_file


@dataclass(frozen=True)
class Provenance:
    """What a result was computed with, so that it can be computed again.

    Attributes:
        backend: What ran the model.
        versions: Of the package, the engine and what else counts, by name.
        model_file: The model's file and its folder.
        model_sha256: The digest of that file and of those it includes.
        timestep: Simulated time of a step [s].
        emulated: The promises of the contract that the backend keeps instead of its engine.
        seed: Of what was drawn; None if nothing was.
    """

    backend: str
    versions: dict[str, str]
    model_file: str
    model_sha256: str
    timestep: float
    emulated: tuple[str, ...]
    seed: int | None = None


def provenance(model: Model, seed: int | None = None, **others: str) -> Provenance:
    """Say what a run on `model` is computed with; `others` are further versions by name."""
    versions = {
        "statemachine": __version__,
        model.backend: model.engine_version,
        "numpy": np.__version__,
        "python": platform.python_version(),
        **others,
    }
    # The folder and name, not the machine's path: a result is read elsewhere.
    model_file = "/".join(model.path.parts[-2:]).encode(errors="replace").decode()
    emulated = [
        name
        for name, behaviour in model.capabilities.behaviours.items()
        if behaviour.support == "emulated"
    ]
    return Provenance(
        backend=model.backend,
        versions=versions,
        model_file=model_file,
        model_sha256=model_digest(model.path),
        timestep=model.timestep,
        emulated=tuple(emulated),
        seed=seed,
    )


def model_digest(path: Path) -> str:
    """Return the SHA-256 of a model's file and of those it includes or attaches."""
    return hashlib.sha256(b"".join(file.read_bytes() for file in model_files(path))).hexdigest()


def model_files(path: Path) -> Iterator[Path]:
    """Yield a model's file, then those it includes or attaches, theirs and so on, each once."""
    if not path.is_file():
        return
    waiting, seen = [path], set[Path]()
    while waiting:
        file = waiting.pop(0)
        if file.resolve() in seen:
            continue
        seen.add(file.resolve())
        yield file
        try:
            root = ElementTree.parse(file)
        except ElementTree.ParseError:  # a binary model
            continue
        parts = [*root.iter("include"), *root.iterfind("asset/model")]
        included = [included_file(element.get("file", ""), path, file) for element in parts]
        waiting += [part for part in included if part is not None]
