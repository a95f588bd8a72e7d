"""Two readings of a robot, or what two engines make of one, before anything moves.

`read` makes a reading of a file, `compare` says where two of them differ, as one list:

- `engines.description` has the records, the reader of URDF, rigid groups and which joint is which;
  an engine's own is read by its room
- `ledger`: the list. Every figure has a key, element and quantity
- `compiled`: what the files differ in as compiled models, by key; `..why` explains a gap with that
- `diff`: walks two readings and enters their figures; by subject in `geometry`, `shapes` and
  `figures`
"""

from __future__ import annotations

import os
import platform
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ... import __version__
from ...backends import check_backend, load
from ...engines import room, rooms_with
from ...engines.description import urdf
from ...engines.description.match import renamed
from ...engines.description.records import Robot
from ...engines.description.tree import GroupTree
from ...engines.records import ModelDifference
from ...errors import EngineWarning, StateMachineError, UnsupportedError
from ...installed import DEFAULT
from ...model_files import checked_file
from ...models import resolve
from ...release_names import engine_of, is_release
from ..compare.matching import Matched
from .compiled import compiled, enter_rest
from .diff import PoseGap, diff
from .ledger import Key, Ledger, ReadingAgreement, ReadingDifference

__all__ = [
    "ModelsComparison",
    "ReadingSide",
    "Robot",
    "compare",
    "read",
]


@dataclass(frozen=True)
class ReadingSide:
    """A robot as it was read.

    Attributes:
        robot: The robot, by the names of the other side.
        mass: Of the robot in all [kg], what stands still in the world apart.
        is_emulated: Whether the engine that read it emulates the contract in a run.
        is_mjcf: Whether its file is no URDF.
        unlike_its_users: What a run behind the contract has that the engine's users do not have;
            "" if there is nothing, or no such run.
        notes: What the reader notes, in sentences.
    """

    robot: Robot = field(metadata={"json": False})
    mass: float = field(metadata={"json": False})
    is_emulated: bool = field(metadata={"json": False})
    is_mjcf: bool = field(metadata={"json": False})
    unlike_its_users: str = field(metadata={"json": False})
    notes: tuple[str, ...]

    @property
    def file(self) -> str:
        """The file, with its folder."""
        return self.robot.name

    @property
    def format(self) -> str:
        """The format: "URDF", "MJCF", "MJB", or "engine" for what an engine made of a file."""
        return self.robot.format

    @property
    def reader(self) -> str:
        """What read it, with its version."""
        return self.robot.reader

    @property
    def links(self) -> int:
        """How many links it has."""
        return len(self.robot.links)

    @property
    def joints(self) -> int:
        """How many joints it has."""
        return len(self.robot.joints)

    @property
    def shapes(self) -> int:
        """How many shapes it touches with."""
        return sum(len(link.shapes) for link in self.robot.links)


@dataclass(frozen=True)
class ModelsComparison:
    """Every difference between two readings of a robot.

    Attributes:
        left: The left side.
        right: The right side.
        differences: The weightiest subjects first, and in each the weightiest difference.
        agreements: How well the rest agrees.
        posed: Whether the same positions give the same poses.
        notes: What a reader should know, in sentences.
        digits: Figures that agree to so many counted as equal.
        versions: Of what computed it.
        skipped: What was not compared, in sentences.
    """

    left: ReadingSide
    right: ReadingSide
    differences: tuple[ReadingDifference, ...]
    agreements: tuple[ReadingAgreement, ...]
    posed: PoseGap
    notes: tuple[str, ...]
    digits: int
    versions: Mapping[str, str]
    skipped: tuple[str, ...]

    @property
    def mass(self) -> tuple[float, float]:
        """The mass of each robot in all [kg], what stands still in the world apart."""
        return self.left.mass, self.right.mass

    @property
    def equal(self) -> bool:
        """Whether everything was compared, and nothing was found that matters."""
        return not self.skipped and not any(row.matters for row in self.differences)


def read(
    model: str | os.PathLike[str],
    engine: str | None = None,
    menagerie: str | os.PathLike[str] | None = None,
) -> Robot:
    """Read a robot as its file describes it, or as an engine has it.

    Args:
        model: A name or a file, as `load` takes it.
        engine: None for what the file says: of a URDF its XML, of an MJCF what MuJoCo's
            compiler has; else what this engine makes of it, with the engine's own defaults.
        menagerie: A folder to look the name up in.

    Raises:
        UnknownNameError: No such model or engine.
        MissingEngineError: What reads it is not installed here.
        ModelError, ModelFileError: The file cannot be read.
        UnsupportedError: The engine is one of a third party, which nothing here reads.
    """
    path = checked_file(model, menagerie)
    name = "/".join(path.parts[-2:])
    if engine is None:
        if path.suffix.lower() == ".urdf":
            return urdf.read(path)
        return room(DEFAULT).read_file(path, name)
    if is_release(engine):
        loaded = load(path, backend=engine, defaults="engine")
        described = room(DEFAULT).describe(loaded.compiled, name)
        return replace(described, reader=engine.replace("==", " "), format="engine")
    check_backend("engine", engine)
    own = room(engine)
    if not own.can("read"):
        known = ", ".join(rooms_with("read"))
        raise UnsupportedError(
            f"what {engine} makes of a file cannot be read here; known: {known}",
            backend=engine,
            feature="description",
            reason="no reader",
        )
    return own.read(path, name)


def compare(
    left: str | os.PathLike[str],
    right: str | os.PathLike[str],
    engines: tuple[str | None, str | None] = (None, None),
    frames: Mapping[str, str] | None = None,
    rename: Mapping[str, str] | None = None,
    digits: int = 6,
    seed: int = 0,
    menagerie: str | os.PathLike[str] | None = None,
) -> ModelsComparison:
    """Find every difference between two readings.

    Args:
        left: A name or a file.
        right: The other.
        engines: For each the engine that it is asked of; None for the file itself.
        frames: Frames of `left` that go by other names in `right`.
        rename: Joints, links and frames of `left` that go by other names in `right`.
        digits: Figures that agree to so many count as equal, 1 to 17.
        seed: Of the poses at which both are compared.
        menagerie: A folder to look names up in.

    Raises:
        UnknownNameError: No such model, engine, joint or frame.
        MissingEngineError, ModelError, ModelFileError, UnsupportedError: As `read`.
    """
    names, engine_names = (left, right), (engines[0] or DEFAULT, engines[1] or DEFAULT)
    robots = [read(name, engine, menagerie) for name, engine in zip(names, engines, strict=True)]
    trees = [GroupTree(renamed(robots[0], rename or {})), GroupTree(robots[1])]
    skipped: list[str] = []
    differences: Mapping[Key, Sequence[ModelDifference]] = {}
    matched: Matched | None = None
    formats = [robot.format for robot in robots]
    by_default = all(engine_of(name) == DEFAULT for name in engine_names)
    if by_default and formats != ["URDF", "URDF"]:
        paths = [resolve(name, menagerie) for name in names]
        try:
            differences, matched = _compiled(paths, engine_names, rename or {}, trees[0])
        except StateMachineError as error:
            why = str(error).splitlines()[0]
            skipped.append(f"what only a compiled model tells was not compared: {why}")
    book = Ledger(digits, differences, complete=matched is not None and "URDF" not in formats)
    posed, notes = diff(book, trees[0], trees[1], frames, seed)
    if matched:
        skipped += enter_rest(book, matched, robots, max(tree.reach for tree in trees))
    left_mass, right_mass = (robot.mass for robot in robots)
    left_side = _side(trees[0].robot, left_mass, engines[0], resolve(left, menagerie))
    right_side = _side(robots[1], right_mass, engines[1], resolve(right, menagerie))
    return ModelsComparison(
        left=left_side,
        right=right_side,
        differences=book.ordered(),
        agreements=tuple(book.agreements()),
        posed=posed,
        notes=tuple(dict.fromkeys(notes)),
        digits=digits,
        versions=_versions(robots),
        skipped=tuple(skipped),
    )


def _compiled(
    paths: Sequence[Path],
    engines: Sequence[str],
    names: Mapping[str, str],
    tree: GroupTree,
) -> tuple[Mapping[Key, Sequence[ModelDifference]], Matched]:
    """Compile two files, and find what they differ in by their compiled models."""
    models = [
        load(path, backend=engine, defaults="engine")
        for path, engine in zip(paths, engines, strict=True)
    ]
    return compiled(models, names, tree)


def _versions(robots: Sequence[Robot]) -> dict[str, str]:
    """Return the versions of what computed a comparison."""
    versions = {
        "statemachine": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    for robot in robots:
        if robot.format != "URDF":  # which was read by no engine
            engine, _, version = robot.reader.partition(" ")
            versions[engine] = version
    return versions


def _side(robot: Robot, mass: float, engine: str | None, path: Path) -> ReadingSide:
    """Return a robot as it was read.

    Args:
        robot: The robot, by the names of the other side.
        mass: Of the robot in all [kg].
        engine: That it was asked of; None for the file itself.
        path: The file.
    """
    return ReadingSide(
        robot,
        mass,
        is_emulated=engine is not None and room(engine_of(engine)).emulated,
        is_mjcf=path.suffix.lower() != ".urdf",
        unlike_its_users=_unlike_its_users(path, engine),
        notes=robot.notes,
    )


def _unlike_its_users(path: Path, engine: str | None) -> str:
    """Say what a run behind the contract has that its engine's users do not have, if anything."""
    if not engine or not room(engine_of(engine)).emulated:
        return ""
    try:
        with warnings.catch_warnings(action="ignore", category=EngineWarning):
            model = load(path, backend=engine)
    except StateMachineError:  # it has no such run
        return ""
    return "; ".join(room(engine_of(engine)).unlike_its_users(model))
