"""The refusal of a walking robot without a floor, with the scenes that have one."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ...errors import BadInputError
from ...interface import Model
from ...models import kind_of_path, models_dir
from ..runs.floating import free_joint_of_base
from ..runs.floor import has_floor

_GROUNDS: Final = ('"plane"', '"hfield"')


def check_floor(model: Model) -> None:
    """Check that a robot with a floating base has a floor.

    Nothing is checked where shapes are not known.

    Raises:
        BadInputError: It has none; the message names a scene that has the robot on a floor.
    """
    if free_joint_of_base(model) is None or has_floor(model) is not False:
        return
    scenes = [typed_name(scene) for scene in scenes_of(model.path)]
    instead = f": take {' or '.join(scenes)}" if scenes else ""
    raise BadInputError(
        f"{model.path.name} has no floor, nor anything else that the robot could walk on{instead}"
    )


def scenes_of(path: Path) -> list[Path]:
    """Return the files beside that of a robot which include it, and have a floor."""
    scenes: list[Path] = []
    for scene in sorted(path.parent.glob("*.xml")):
        if scene == path or kind_of_path(scene) != "a file":
            continue
        try:
            text = scene.read_text("utf-8", errors="replace")
        except OSError:  # what cannot be read is no scene
            continue
        if f'"{path.name}"' in text and any(ground in text for ground in _GROUNDS):
            scenes.append(scene)
    return scenes


def typed_name(path: Path) -> str:
    """Return what to type for a model: the name of one of ours, or the shortest path."""
    if path.is_relative_to(models_dir()):
        return path.relative_to(models_dir()).with_suffix("").as_posix()
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else str(path)
