"""The two sides of a comparison of files, each as a compiled model."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...backends import check_backend, load, parse_backend
from ...engines import raw_engine_of, raw_engines_with
from ...engines.description.reading import Comparable, ModelReading
from ...errors import UnsupportedError
from ...installed import DEFAULT
from ...interface import JointType, Model
from ...model_files import checked_path
from ...models import resolve
from ...release_names import engine_of, is_release

_BASE = "free joint of the base"  # of a URDF, where the other side has no name for it


@dataclass(frozen=True)
class FileAsked:
    """What one side of a comparison is.

    Attributes:
        file: A name or a file.
        engine: The engine that is asked what it makes of the file; None for the file itself.
        menagerie: A folder to look the name up in.
        as_it_comes: Whether a run of it is meant as the engine's own users meet it.
    """

    file: str | os.PathLike[str]
    engine: str | None = None
    menagerie: str | os.PathLike[str] | None = None
    as_it_comes: bool = False

    @classmethod
    def typed(
        cls,
        file: str | os.PathLike[str],
        engine: str | None,
        menagerie: str | os.PathLike[str] | None,
    ) -> FileAsked:
        """Return a side by its engine as one types it: "pybullet", "pybullet:engine", None."""
        if engine is None:
            return cls(file, None, menagerie)
        choice = parse_backend(engine)
        return cls(file, choice.name, menagerie, choice.defaults == "engine")

    @property
    def path(self) -> Path:
        """Return the file, with its folder."""
        return resolve(self.file, self.menagerie)

    @property
    def label(self) -> str:
        """Return the file as one types it for a run: "a.xml", "a.xml@pybullet"."""
        if not self.engine:
            return str(self.file)
        defaults = ":engine" if self.as_it_comes else ""
        return f"{self.file}@{self.engine}{defaults}"

    @property
    def is_urdf(self) -> bool:
        """Tell whether the file is a URDF."""
        return self.path.suffix.lower() == ".urdf"

    @property
    def is_open(self) -> bool:
        """Tell whether it leaves open if its base floats: the text of a URDF does."""
        return self.is_urdf and self.engine is None


def read(
    model: str | os.PathLike[str],
    engine: str | None = None,
    menagerie: str | os.PathLike[str] | None = None,
    comparable: Comparable | None = None,
) -> ModelReading:
    """Read a robot as its file describes it, or as an engine has it.

    Args:
        model: A name or a file, as `load` takes it.
        engine: None for what the file says itself; else what this engine makes of it, with the
            engine's own defaults.
        menagerie: A folder to look the name up in.
        comparable: How the file itself is made comparable with the other side.

    Raises:
        UnknownNameError: No such model or engine.
        MissingEngineError: What reads it is not installed here.
        ModelError, ModelFileError: The file cannot be read.
        UnsupportedError: The engine is one of a third party, which nothing here reads.
    """
    path = checked_path(model, menagerie)
    if engine is None:
        return raw_engine_of(DEFAULT).read_file(path, comparable)
    if is_release(engine):
        loaded = load(path, backend=engine, defaults="engine")
        return ModelReading(loaded, "engine", f"{engine_of(engine)} {loaded.engine_version}")
    check_backend("engine", engine)
    asked = raw_engine_of(engine)
    if not asked.can("read"):
        known = ", ".join(raw_engines_with("read"))
        raise UnsupportedError(
            f"what {engine} makes of a file cannot be read here; known: {known}",
            backend=engine,
            feature="description",
            reason="no reader",
        )
    return asked.read(path)


def read_both(sides: Sequence[FileAsked], frames: Sequence[Collection[str]]) -> list[ModelReading]:
    """Read both sides, so that each has what the other can say.

    Of two MJCF nothing is added. Beside a URDF, or what an engine made of a file, the frames of
    bodies are compared, and the base of a URDF floats where that of the other does: a URDF does not
    say whether its own floats. Those of two URDFs do, so that what they weigh counts.

    Args:
        sides: The left and the right.
        frames: Of each side bodies whose frames are compared, too.

    Raises:
        StateMachineError: As `read`.
    """
    if all(side.engine is None and not side.is_urdf for side in sides):
        return [read(side.file, None, side.menagerie) for side in sides]
    readings: dict[int, ModelReading] = {}
    comparable = Comparable(capsules=all(side.engine is None for side in sides))
    if all(side.is_open for side in sides):
        comparable = replace(comparable, free_joint=_BASE)
    # What says whether its base floats first.
    for number in sorted((0, 1), key=lambda number: sides[number].is_open):
        side = sides[number]
        comparable = replace(comparable, frames=frozenset(frames[number]))
        readings[number] = read(side.file, side.engine, side.menagerie, comparable)
        if not side.is_open:
            free_joint = _floating_base(readings[number].model)
            comparable = replace(comparable, free_joint=free_joint)
    return [readings[0], readings[1]]


def _floating_base(model: Model) -> str:
    """Return the name of the first joint of a Model if that is a free one; else ""."""
    if model.njnt and model.jnt_type[0] == JointType.FREE:
        name = model.joint_names[0]
        return name if name else _BASE
    return ""
