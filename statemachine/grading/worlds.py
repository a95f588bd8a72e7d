"""The worlds that a student's function is called on: the course's own, and others.

The others have the same names and another layout, so that what was counted, typed in or
taken from the course's own model shows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ..backends import load
from ..errors import UnsupportedError
from ..interface import Model
from ..models import resolve
from ..page import Figures
from ..witness.mjcf_text import parse, with_includes

ELSEWHERE = "on a scene with a crate before the arm"
_CRATE = """
<body name="crate" pos="-0.4 0.3 0.05">
  <freejoint name="crate"/>
  <geom name="crate" type="box" size="0.05 0.05 0.05" mass="0.3" contype="2" conaffinity="1"/>
</body>
"""
# Bodies that come last, with their qpos and qvel: a ball joint, and a slide that nothing drives
# or limits.
_BALL = (
    """
<body name="globe" pos="-0.4 -0.3 0.3">
  <joint name="globe" type="ball"/>
  <geom name="globe" size="0.05" mass="0.2" contype="0" conaffinity="0"/>
</body>
""",
    " 1 0 0 0",
    " 0 0 0",
)
_DRAWER = (
    """
<body name="drawer" pos="-0.5 0 0.3">
  <joint name="drawer" type="slide" axis="1 0 0"/>
  <geom name="drawer" type="box" size="0.05 0.05 0.02" mass="0.2" contype="0" conaffinity="0"/>
</body>
""",
    " 0",
    " 0",
)
_CRATE_QPOS, _CRATE_QVEL = "-0.4 0.3 0.05 1 0 0 0", "0 0 0 0 0 0"
_TIME = "2.5"  # [s] of the first keyframe there
_TIP = "0.03 0.01 -0.08"  # [m] of the fingertip in the gripper's frame there


@dataclass(frozen=True)
class ExerciseWorld:
    """One call of a student's function.

    Attributes:
        where: What sets it apart; nothing on the course's own model.
        model: What the function gets.
        arguments: What it gets beside it.
        nudge: See `watch.StudentWatch`.
    """

    where: str
    model: Model
    arguments: tuple[Any, ...] = ()
    nudge: Figures | None = None


class Scenes:
    """Makes Models for one backend, each once, from files that it writes into a folder."""

    def __init__(self, backend: str, folder: Path) -> None:
        self._backend = backend
        self._folder = folder
        self._models: dict[str, Model] = {}

    def ordinary(self, name: str) -> Model:
        """The course's own scene, without what is only seen."""
        return self._load(name, "ordinary", lambda _: None)

    def crowded(self, name: str) -> Model:
        """The scene with a free body before the arm, another fingertip and another time."""
        try:
            return self._load(name, "crowded", lambda root: _crowd(root, [_BALL, _DRAWER]))
        except UnsupportedError:  # a ball joint
            return self._load(name, "crowded", lambda root: _crowd(root, [_DRAWER]))

    def _load(self, name: str, kind: str, edit: Callable[[ElementTree.Element], None]) -> Model:
        file = self._folder / f"{kind}_{name.rpartition('/')[2]}.xml"
        if file.name not in self._models:
            path = resolve(name)
            root, _ = with_includes(parse(path), path)
            _bare(root)
            edit(root)
            ElementTree.ElementTree(root).write(file)
            self._models[file.name] = load(file, backend=self._backend)
        return self._models[file.name]


def _bare(root: ElementTree.Element) -> None:
    """Leave out the meshes, which touch nothing and take most of the time to load."""
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag == "mesh" or (child.tag == "geom" and child.get("class") == "look"):
                parent.remove(child)


def _crowd(root: ElementTree.Element, last: Sequence[tuple[str, str, str]]) -> None:
    """Put a crate first and other bodies last."""
    for body in root.findall("worldbody")[:1]:
        body.insert(0, ElementTree.fromstring(_CRATE))
    for body in root.findall("worldbody")[-1:]:
        body.extend(ElementTree.fromstring(text) for text, _, _ in last)
    for site in root.iter("site"):
        if site.get("name") == "gripperframe":
            site.set("pos", _TIP)
    for number, key in enumerate(root.iter("key")):
        key.set("qpos", f"{_CRATE_QPOS} {key.get('qpos')}" + "".join(q for _, q, _ in last))
        key.set("qvel", f"{_CRATE_QVEL} {key.get('qvel')}" + "".join(v for _, _, v in last))
        if number == 0:
            key.set("time", _TIME)
