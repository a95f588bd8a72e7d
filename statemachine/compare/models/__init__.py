"""Two readings of a robot, or what two engines make of one, before anything moves.

`read` makes a reading of a file, `compare` says where two of them differ, as one list:

- `engines.description` has the records, the reader of URDF, rigid groups and which joint is which;
  an engine's own is read by its room
- `ledger`: the list. Every figure has a key, element and quantity
- `compiled`: what the files differ in as compiled models, by key; `..why` explains a gap with that
- `diff`: walks two readings and enters their figures; by subject in `geometry` and `figures`
"""

from __future__ import annotations

import os
import platform
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ... import __version__
from ...backends import check_backend, load
from ...engines import room, rooms_with
from ...engines.description import urdf
from ...engines.description.match import renamed
from ...engines.description.records import Robot
from ...engines.description.tree import GroupTree
from ...errors import EngineWarning, StateMachineError, UnsupportedError
from ...installed import DEFAULT
from ...model_files import checked_file
from ...models import resolve
from ...page import Figures
from ...release_names import engine_of, is_release
from .compiled import compiled, enter_rest
from .diff import diff
from .ledger import Ledger

__all__ = [
    "Robot",
    "compare",
    "read",
]


def read(
    model: str | os.PathLike[str],
    engine: str | None = None,
    menagerie: str | os.PathLike[str] | None = None,
) -> Robot:
    """A description.

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
) -> Figures:
    """Every difference between two descriptions.

    Args:
        left: A name or a file.
        right: The other.
        engines: For each the engine that it is asked of; None for the file itself.
        frames: Frames of `left` that go by other names in `right`.
        rename: Joints, links and frames of `left` that go by other names in `right`.
        digits: Figures that agree to so many count as equal, 1 to 17.
        seed: Of the poses at which both are compared.
        menagerie: A folder to look names up in.

    Returns:
        left, right: The sides: the file with its folder; its format, URDF, MJCF, MJB
            or the engine that it was loaded into; what read it; how many links, joints and shapes
            it has; notes of the reader.
        differences: The weightiest subjects first, and in each the weightiest difference.
        agreements: How well the rest agrees.
        posed: Whether the same positions give the same poses.
        mass: Of each robot in all [kg], what stands still in the world apart.
        notes: What a reader should know, in sentences.
        digits: Figures that agree to so many counted as equal.
        versions: Of what computed it.
        skipped: What was not compared, in sentences.
        equal: Whether everything was compared, and nothing was found that matters.

    Raises:
        UnknownNameError: No such model, engine, joint or frame.
        MissingEngineError, ModelError, ModelFileError, UnsupportedError: As `read`.
    """
    robots = [read(m, e, menagerie) for m, e in zip((left, right), engines, strict=True)]
    trees = [GroupTree(renamed(robots[0], rename or {})), GroupTree(robots[1])]
    formats, skipped = [robot.format for robot in robots], list[str]()
    compilers = [engine or DEFAULT for engine in engines]
    differences, matched = {}, None
    if all(engine_of(name) == DEFAULT for name in compilers) and formats != ["URDF"] * 2:
        try:
            models = [
                load(resolve(m, menagerie), backend=name, defaults="engine")
                for m, name in zip((left, right), compilers, strict=True)
            ]
            differences, matched = compiled(models, rename or {}, trees[0])
        except StateMachineError as error:
            why = str(error).splitlines()[0]
            skipped.append(f"what only a compiled model tells was not compared: {why}")
    book = Ledger(digits, differences, complete=matched is not None and "URDF" not in formats)
    posed, notes = diff(book, trees[0], trees[1], frames, seed)
    if matched:
        skipped += enter_rest(book, matched, robots, max(tree.reach for tree in trees))
    versions = {
        "statemachine": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    # A URDF was read by no engine.
    readers = [robot.reader.partition(" ") for robot in robots if robot.format != "URDF"]
    versions |= {engine: version for engine, _, version in readers}
    left_side, right_side = [
        Figures(
            file=robot.name,
            format=robot.format,
            reader=robot.reader,
            links=len(robot.links),
            joints=len(robot.joints),
            shapes=sum(len(link.shapes) for link in robot.links),
            _mass=mass,
            _driven=bool(robot.actuators),
            _emulated=bool(engine) and room(engine_of(engine)).emulated,
            _written=resolve(model, menagerie).suffix.lower() != ".urdf",
            _unlike=_unlike_its_users(resolve(model, menagerie), engine),
            notes=robot.notes,
        )
        for robot, mass, engine, model in zip(
            (trees[0].robot, robots[1]),
            (r.mass for r in robots),
            engines,
            (left, right),
            strict=True,
        )
    ]
    rows = book.ordered()
    return Figures(
        left=left_side,
        right=right_side,
        differences=rows,
        agreements=tuple(book.agreements()),
        posed=posed,
        mass=tuple(robot.mass for robot in robots),
        notes=tuple(dict.fromkeys(notes)),
        digits=digits,
        versions=versions,
        skipped=tuple(skipped),
        equal=not skipped and not any(row.matters for row in rows),
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
