"""The page of the lesson on reset: what it restores, and what each keyframe is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from ...interface import INPUTS
from ...measures.text import count, millimetres
from ...show.blocks import Table
from ...show.engine_tables import Results, differences, emulated
from ...show.labels import TableLabels
from ...show.templates import PageContent
from .frame import LessonFrame
from .reset import KeyframeScene, ResetResult

_SAY = TableLabels(__name__, "reset_labels.md.j2")


@dataclass(frozen=True)
class ResetPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        keyframe: What the first keyframe is; empty where the file names none.
        others: What the others are; empty where that was not asked for.
        differences: How far the engines are from each other.
    """

    template = "reset.md.j2"
    lesson: LessonFrame
    result: ResetResult
    keyframe: Sequence[Table]
    others: Sequence[Table]
    differences: Sequence[Table]

    @property
    def scene(self) -> KeyframeScene | None:
        """Return the scene of the first keyframe; None without one."""
        return self.result.scenes[0] if self.result.scenes else None

    @property
    def asks(self) -> bool:
        """Tell whether the first keyframe has a time of its own, which can be asked for."""
        return self.scene is not None and self.scene.time != 0

    @property
    def right(self) -> int:
        """Return the number of the right choice."""
        return 2 if self.scene is not None and "time" in self.scene.exact else 0

    @property
    def same(self) -> bool:
        """Tell whether a Data is after a reset as a fresh one is, and goes on as it does."""
        return set(self.result.restored) == {*INPUTS, "time"} and self.result.same_future

    @property
    def emulated(self) -> str:
        """Return what this interface does in place of the engine; "" for nothing."""
        return emulated(self.result, "zeros when fresh")

    @property
    def held(self) -> KeyframeScene | None:
        """Return the scene of the first keyframe if it has a name, and the robot holds the body."""
        is_held = self.scene is not None and self.scene.name != "" and self.scene.held
        return self.scene if is_held else None

    @property
    def ungrasped(self) -> KeyframeScene | None:
        """Return that of the public file of the arm, whose robot does not touch the body."""
        is_public = self.result.provenance.model_file.startswith("robotstudio_so101")
        is_untouched = self.scene is not None and self.scene.on_robot == 0
        return self.scene if is_public and is_untouched else None


def contents(results: Results[ResetResult], frame: LessonFrame) -> dict[str, ResetPage]:
    """Return what the page shows of each engine."""
    keyframes: list[Table] = []
    rises: dict[str, Callable[[ResetResult, ResetResult], str]] = {}
    for number, scene in enumerate(next(iter(results.values())).scenes):
        keyframes.append(_keyframe(number, results))
        if scene.body:
            rises[_SAY("rise", body=scene.body, keyframe=scene.name)] = partial(_rises, number)
    apart = differences(results, rises)
    return {
        name: ResetPage(frame, result, keyframes[:1], keyframes[1:], apart)
        for name, result in results.items()
    }


def _rises(number: int, left: ResetResult, right: ResetResult) -> str:
    """Write how far the body of a keyframe rises on the right, and on the left."""
    on_left, on_right = (millimetres(r.scenes[number].rise, 3) for r in (left, right))
    return f"{on_right} instead of {on_left}"


def _keyframe(number: int, results: Mapping[str, ResetResult]) -> Table:
    """Return what a keyframe shows on each engine, and what becomes of it."""
    scenes = [result.scenes[number] for result in results.values()]
    first = scenes[0]
    rows = _contact_rows(scenes)
    if first.body:
        rows += _later_rows(first.body, scenes)
    if not rows:
        rows = [("nothing", *("" for _ in scenes))]
    title = _SAY("keyframe", number=number, name=first.name, time=f"{first.time:g} s")
    return Table((_SAY("touches"), *results), rows, title)


def _contact_rows(scenes: Sequence[KeyframeScene]) -> list[tuple[str, ...]]:
    """Return the number of contacts of each pair of bodies, a scene a column."""
    pairs = dict.fromkeys(pair for scene in scenes for pair in scene.contacts)
    rows = []
    for pair in pairs:
        counts = (count(scene.contacts.get(pair, 0), "contact") for scene in scenes)
        rows.append((pair, *counts))
    return rows


def _later_rows(body: str, scenes: Sequence[KeyframeScene]) -> list[tuple[str, ...]]:
    """Return what becomes of a body after a keyframe, a scene a column."""
    by_robot = [str(scene.robot_steps) for scene in scenes]
    by_world = [str(scene.world_steps) for scene in scenes]
    moves = [_moved(scene.rise) for scene in scenes]
    steps = scenes[0].nstep
    return [
        (_SAY("robot_steps", steps=steps, body=body), *by_robot),
        (_SAY("world_steps", steps=steps, body=body), *by_world),
        (_SAY("moves", steps=steps, body=body), *moves),
    ]


def _moved(rise: float) -> str:
    """Write how far a body rises or sinks [m]."""
    height = millimetres(abs(rise))
    return _SAY("sinks", height=height) if rise < 0 else _SAY("rises", height=height)
