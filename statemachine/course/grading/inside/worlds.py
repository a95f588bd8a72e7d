"""The worlds that a student's function is called on: the course's own, and others.

The others have the same names and another layout, so that what was counted, typed in or
taken from the course's own model shows.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar
from xml.etree import ElementTree

import numpy as np

from ....backends import load
from ....errors import EngineWarning, UnsupportedError
from ....interface import Array, Model
from ....models import resolve
from ....witness.mjcf_text import parse, with_includes
from .watch import Nudge

ELSEWHERE = "in a scene whose file has a crate before the arm"
_CRATE = """
<body name="crate" pos="-0.4 0.3 0.05">
  <freejoint name="crate"/>
  <geom name="crate" type="box" size="0.05 0.05 0.05" mass="0.3" contype="2" conaffinity="1"/>
</body>
"""


class _Body(NamedTuple):
    """Body that is added to a scene.

    Attributes:
        mjcf: The element.
        qpos: Its part of a keyframe's.
        qvel: Its part of a keyframe's.
    """

    mjcf: str
    qpos: str
    qvel: str


# They come last: a ball joint, and a slide that nothing drives or limits.
_BALL = _Body(
    """
<body name="globe" pos="-0.4 -0.3 0.3">
  <joint name="globe" type="ball"/>
  <geom name="globe" size="0.05" mass="0.2" contype="0" conaffinity="0"/>
</body>
""",
    " 1 0 0 0",
    " 0 0 0",
)
_DRAWER = _Body(
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


A = TypeVar("A", bound=tuple[Array | int, ...])  # what a function gets beside the model


@dataclass(frozen=True)
class ExerciseWorld(Generic[A]):
    """One call of a student's function.

    Attributes:
        where: What sets it apart; nothing on the course's own model.
        model: What the function gets.
        arguments: What it gets beside it.
        nudge: See `watch.StudentWatch`; None for none.
    """

    where: str
    model: Model
    arguments: A
    nudge: Nudge | None = None


FallWorld = ExerciseWorld[tuple[int]]  # seconds
NoArgumentsWorld = ExerciseWorld[tuple[()]]
ReplayWorld = ExerciseWorld[tuple[Array, int]]  # ctrl (nu,) and number of steps
AnyWorld = FallWorld | NoArgumentsWorld | ReplayWorld


class Scenes:
    """Makes Models for one backend, each once, from files that it writes into a folder."""

    def __init__(self, backend: str, folder: Path) -> None:
        self._backend = backend
        self._folder = folder
        self._models: dict[str, Model] = {}

    def ordinary(self, name: str) -> Model:
        """Return the course's own scene, without what is only seen."""
        return self._load(name, "ordinary", lambda _: None)

    def crowded(self, name: str) -> Model:
        """Return the scene with a free body before the arm, another fingertip and another time."""
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
            with warnings.catch_warnings():
                # What an engine ignores of a scene of ours is nothing that a student wrote.
                warnings.simplefilter("ignore", EngineWarning)
                self._models[file.name] = load(file, backend=self._backend)
        return self._models[file.name]


def _bare(root: ElementTree.Element) -> None:
    """Leave out the meshes, which touch nothing and take most of the time to load."""
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag == "mesh" or (child.tag == "geom" and child.get("class") == "look"):
                parent.remove(child)


def _crowd(root: ElementTree.Element, last: Sequence[_Body]) -> None:
    """Put a crate first and other bodies last."""
    for body in root.findall("worldbody")[:1]:
        body.insert(0, ElementTree.fromstring(_CRATE))
    for body in root.findall("worldbody")[-1:]:
        body.extend(ElementTree.fromstring(more.mjcf) for more in last)
    for site in root.iter("site"):
        if site.get("name") == "gripperframe":
            site.set("pos", _TIP)
    for number, key in enumerate(root.iter("key")):
        key.set("qpos", f"{_CRATE_QPOS} {key.get('qpos')}" + "".join(body.qpos for body in last))
        key.set("qvel", f"{_CRATE_QVEL} {key.get('qvel')}" + "".join(body.qvel for body in last))
        if number == 0:
            key.set("time", _TIME)


# The worlds of each function of the exercise. Nothing here tells what is right on one.

LIFT = "shoulder_lift"
_ARM, _ARM_AND_BOX = "so101/scene", "so101/scene_box"
_MOON = (0.0, 0.0, -1.62)  # [m/s²]
_CTRL = (0.4, -0.8, 0.5, 1.6, 1.57, 0.28)  # [rad]
_OTHER_CTRL = (-0.2, -0.5, 0.4, 1.5, 1.5, 0.28)  # [rad]
_STEPS = 100  # of the runs that are made to end apart


def address(model: Model, joint: str = LIFT) -> int:
    """Return where a joint begins in qpos."""
    return int(model.jnt_qposadr[model.joint_id(joint)])


def worlds_of(function: str, scenes: Scenes) -> Sequence[AnyWorld]:
    """Make the worlds that a function of the exercise is called on, the course's own first."""
    return _WORLDS[function](scenes)


def _gravity(scenes: Scenes) -> list[FallWorld]:
    """Make the course's scene; the Moon's gravity at another timestep; a crate before the arm."""
    course = scenes.ordinary(_ARM)
    moon = course.replace(gravity=_MOON, timestep=0.004)
    return [
        ExerciseWorld("", course, (4,)),
        ExerciseWorld("with the Moon's gravity and 4 ms a step", moon, (3,)),
        ExerciseWorld(ELSEWHERE, scenes.crowded(_ARM), (2,)),
    ]


def _state(scenes: Scenes) -> list[NoArgumentsWorld]:
    """Make the course's scene; a crate before the arm, and a keyframe with another time."""
    return [
        ExerciseWorld("", scenes.ordinary(_ARM_AND_BOX), ()),
        ExerciseWorld(ELSEWHERE, scenes.crowded(_ARM_AND_BOX), ()),
    ]


def _forward(scenes: Scenes) -> list[NoArgumentsWorld]:
    """Make the course's scene; a crate before the arm, and the fingertip elsewhere."""
    return [
        ExerciseWorld("", scenes.ordinary(_ARM), ()),
        ExerciseWorld(ELSEWHERE, scenes.crowded(_ARM), ()),
    ]


def _replay(scenes: Scenes) -> list[ReplayWorld]:
    """Make the course's scene; fewer steps with a crate before the arm; runs that end apart."""
    course = scenes.ordinary(_ARM_AND_BOX)
    crowded = scenes.crowded(_ARM_AND_BOX).replace(timestep=0.004)
    # One bit, in the middle and upwards, at the end and downwards: nearly equal, equal in
    # part, equal in sum and not smaller all pass for equal in one of the two. Before that far
    # apart, where only who compares nothing says that they are equal.
    elbow = address(course, "elbow_flex")
    nudges = {
        "where we end the second run 0.1 rad apart": Nudge(elbow, np.inf, _STEPS, by=0.1),
        "where we end the second run one bit apart in a joint": Nudge(elbow, np.inf, _STEPS),
        "where we end the second run one bit apart in the box": Nudge(
            course.nq - 1, -np.inf, _STEPS
        ),
    }
    worlds: list[ReplayWorld] = [
        ExerciseWorld("", course, (np.array(_CTRL), 600)),
        ExerciseWorld(ELSEWHERE, crowded, (np.array(_OTHER_CTRL), 150)),
    ]
    for where, nudge in nudges.items():
        worlds.append(ExerciseWorld(where, course, (np.array(_CTRL), _STEPS), nudge))
    return worlds


_WORLDS: dict[str, Callable[[Scenes], Sequence[AnyWorld]]] = {
    "demo_gravity": _gravity,
    "demo_state": _state,
    "demo_forward": _forward,
    "demo_replay": _replay,
}
FUNCTIONS = tuple(_WORLDS)  # of the exercise
