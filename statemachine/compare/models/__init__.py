"""Two descriptions of a robot, or what two engines make of one, before anything moves.

`read` makes a description of a file, `compare` says where two of them differ:

- `description`: a robot as frozen records, in one set of conventions
- `from_urdf`, `from_mjcf`, `from_bullet`: one reader each
- `tree`: rigid groups, composite inertia, M_ii, poses
- `match`: which joint is which, and how the frames of links lie
- `diff`: every difference with its size, entered into a `ledger`; by subject in `_places`,
  `_joints`, `_solids`, `_shapes`, `_settings`
- `engines`: what engines do of themselves
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ... import __version__
from ...backends import backend_engine, backend_names, load
from ...errors import ModelError, UnsupportedError
from ...installed import require
from ...interface import make_data
from ...models import resolve
from . import _meshless, from_bullet, from_mjcf, from_urdf
from .description import Robot
from .diff import Found, diff
from .engines import own_ways
from .ledger import Agreement, Difference
from .match import renamed
from .tree import Tree

__all__ = [
    "Agreement",
    "Compared",
    "Difference",
    "Found",
    "Robot",
    "Side",
    "compare",
    "read",
    "split",
]


@dataclass(frozen=True)
class Side:
    """One of the two descriptions, for the record.

    Attributes:
        file: With its folder.
        format: URDF, MJCF, MJB, or the engine that it was loaded into.
        reader: What read it.
        links, joints, shapes: How many.
        notes: What the reader had to say.
    """

    file: str
    format: str
    reader: str
    links: int
    joints: int
    shapes: int
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Compared:
    """What came out; `found` holds the differences.

    Attributes:
        one, two: The sides, A and B.
        found: Differences and agreements.
        digits: Figures that agree to so many counted as equal.
        versions: Of what computed it.
    """

    one: Side
    two: Side
    found: Found
    digits: int
    versions: dict[str, str]

    @property
    def equal(self) -> bool:
        """Whether nothing was found that matters."""
        return not any(each.matters for each in self.found.differences)


def split(text: str) -> tuple[str, str | None]:
    """A model and the engine that it is asked of: "so101@pybullet"; None: the file itself."""
    model, sign, engine = text.rpartition("@")
    return (model, engine) if sign and engine in backend_names() else (text, None)


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
    path = resolve(model, menagerie)
    name = "/".join(path.parts[-2:])
    if engine is None and path.suffix.lower() == ".urdf":
        return from_urdf.read(path)
    if engine not in (None, "mujoco", "pybullet"):
        backend_engine(engine)
        raise UnsupportedError(
            f"what {engine} makes of a file cannot be read here; known: mujoco, pybullet",
            backend=engine,
            feature="description",
            reason="no reader",
        )
    if engine == "pybullet":
        require("pybullet")
        if path.suffix.lower() == ".urdf":
            with from_bullet.loaded(path) as (client, bodies):
                return from_bullet.read(client, bodies, name)
        with make_data(load(path, backend="pybullet", defaults="engine")) as data:
            client = data.raw.client
            return from_bullet.read(client, from_bullet.everything(client), name)
    try:
        loaded = load(path, backend="mujoco", defaults="engine")
    except ModelError:
        robot = _meshless.read(path, name) if path.suffix.lower() == ".xml" else None
        if engine is not None or robot is None:
            raise
        return robot
    form = "engine" if engine else {".mjb": "MJB", ".urdf": "URDF"}.get(path.suffix.lower(), "MJCF")
    return from_mjcf.read(loaded.raw, name, f"mujoco {loaded.engine_version}", form)


def compare(
    one: str | os.PathLike[str],
    two: str | os.PathLike[str],
    engines: tuple[str | None, str | None] = (None, None),
    frames: Mapping[str, str] | None = None,
    rename: Mapping[str, str] | None = None,
    digits: int = 6,
    seed: int = 0,
    menagerie: str | os.PathLike[str] | None = None,
) -> Compared:
    """Every difference between two descriptions.

    Args:
        one: A name or a file.
        two: The other.
        engines: For each the engine that it is asked of; None for the file itself.
        frames: Frames of `one` that go by other names in `two`.
        rename: Joints, links and frames of `one` that go by other names in `two`.
        digits: Figures that agree to so many count as equal, 1 to 17.
        seed: Of the poses at which both are compared.
        menagerie: A folder to look names up in.

    Raises:
        UnknownNameError: No such model, engine, joint or frame.
        MissingEngineError, ModelError, ModelFileError, UnsupportedError: As `read`.
    """
    robots = [read(m, e, menagerie) for m, e in zip((one, two), engines, strict=True)]
    trees = [Tree(renamed(robots[0], rename or {})), Tree(robots[1])]
    found = diff(trees[0], trees[1], frames, digits, seed, own_ways(*engines))
    versions = {
        "statemachine": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    for robot in robots:
        engine, _, version = robot.reader.partition(" ")
        if engine in ("mujoco", "pybullet"):
            versions[engine] = version
    return Compared(_side(trees[0]), _side(trees[1]), found, digits, versions)


def _side(tree: Tree) -> Side:
    robot = tree.robot
    return Side(
        file=robot.name,
        format=robot.format,
        reader=robot.reader,
        links=len(robot.links),
        joints=len(robot.joints),
        shapes=sum(len(link.shapes) for link in robot.links),
        notes=robot.notes,
    )
