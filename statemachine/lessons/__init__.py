"""The lessons: what each is called, asks and takes. Importing this loads no engine.

A lesson is a module with two functions: `run(model, options, progress)` computes its
result on one backend, `page(results)` says what the results, by backend, mean.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, cast


@dataclass(frozen=True)
class Option:
    """An option of a lesson: a flag of the command line, a key of `options`."""

    flag: str
    default: Any
    help: str
    kind: type = str
    choices: tuple[str, ...] | None = None
    many: bool = False

    @property
    def key(self) -> str:
        """Its key in `options`."""
        return self.flag.removeprefix("--").replace("-", "_")


@dataclass(frozen=True)
class Lesson:
    """An entry of the table of lessons."""

    name: str
    question: str
    model: str
    options: tuple[Option, ...] = ()


class Module(Protocol):
    """What a lesson's module offers."""

    def run(self, model: Any, options: Mapping[str, Any], progress: Any) -> Any:
        """Compute the lesson's result on one backend."""
        ...

    def page(self, results: Mapping[str, Any]) -> Any:
        """Say what the results, by backend, mean."""
        ...


# In the order of the course.
LESSONS = {
    lesson.name: lesson
    for lesson in (
        Lesson(
            "state",
            "Which numbers are the state?",
            "so101/scene_box",
        ),
        Lesson(
            "forward",
            "Why is a fresh arm's fingertip at the origin?",
            "so101/scene",
            (
                Option("--joint", "shoulder_lift", "joint to write"),
                Option("--value", 0.8, "what to write [rad]", float),
                Option("--site", "gripperframe", "the fingertip"),
            ),
        ),
        Lesson(
            "hold",
            "Six numbers in: how does the arm follow?",
            "so101/scene",
            (
                Option("--seconds", 2.0, "simulated time", float),
                Option("--target", None, "command, one number an actuator", float, many=True),
                Option("--site", "gripperframe", "the fingertip"),
            ),
        ),
        Lesson(
            "gravity",
            "You never wrote ctrl. Who holds the arm up?",
            "so101/scene",
            (
                Option("--seconds", 4.0, "simulated time", float),
                Option("--joint", "shoulder_lift", "joint to watch"),
            ),
        ),
        Lesson(
            "replay",
            "Same start, same commands: the same bits?",
            "so101/scene_box",
            (
                Option("--steps", 600, "steps of each run", int),
                Option("--ctrl", None, "command, one number an actuator", float, many=True),
                Option(
                    "--break",
                    None,
                    "make the second run differ",
                    choices=("extra-step", "late-ctrl"),
                ),
            ),
        ),
        Lesson(
            "speed",
            "What does one second of your machine buy?",
            "so101/scene_box",
            (Option("--steps", 20_000, "steps of each run", int),),
        ),
    )
}


def module(name: str) -> Module:
    """The module of a lesson."""
    return cast("Module", importlib.import_module(f".{name}", __name__))
