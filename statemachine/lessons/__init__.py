"""The lessons: what each is called, asks and takes. Importing this loads no engine.

A lesson is a page `NAME.md`, a template (see `template.py`), and a module `NAME.py` with these
functions, in the order in which one reads them: `code(model, options, load)` is what a student
types for a Model, where `load` is the call that loads it; `run(play, options, progress)` calls
`play` (a `session.CodeRun`) once, which runs that code, looks on, and returns what was measured;
`slots(result)` gives what the page's slots take beside the fields of the result; and
`tables(results, first)` its tables and curves, if it has any, from the results by backend, of which
`first` is the first. One whose
options depend on the robot also has `fit(model, options)`, which gives them back with nothing left
open. Terminal, documentation and notebook show the same page.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Option:
    """An option of a lesson: a flag of the command line, a key of `options`.

    Attributes:
        more: Whether it shows more of the lesson; JSON and documentation show all.
    """

    flag: str
    default: Any
    help: str
    kind: type = str
    choices: tuple[str, ...] | None = None
    many: bool = False
    more: bool = False

    @property
    def key(self) -> str:
        """Its key in `options`."""
        return self.flag.removeprefix("--").replace("-", "_")


@dataclass(frozen=True)
class Lesson:
    """An entry of the table of lessons; `on_path`: whether the guided path has it."""

    name: str
    question: str
    model: str
    options: tuple[Option, ...] = ()
    on_path: bool = True

    @property
    def defaults(self) -> dict[str, Any]:
        """Its options where nobody sets one."""
        return {option.key: option.default for option in self.options}

    @property
    def all_shown(self) -> dict[str, Any]:
        """The options that show all of it."""
        return {option.key: True for option in self.options if option.more}


# What depends on the robot has no default here: `fit` of the lesson's module gives it one.
_JOINT = Option("--joint", None, "joint to write (default shoulder_lift, if there is one)")
_VALUE = Option("--value", None, "what to write [rad or m] (default 0.8, if in range)", float)

# The lessons of the path, in order, and those beside it.
LESSONS = {
    lesson.name: lesson
    for lesson in (
        Lesson(
            "objects",
            "What never changes, and what does?",
            "so101/scene",
            (Option("--worlds", 10, "how many Data of one Model", int),),
        ),
        Lesson(
            "state",
            "Which numbers are the state?",
            "so101/scene_box",
        ),
        Lesson(
            "write",
            "You wrote into qpos. Who noticed?",
            "so101/scene",
            (_JOINT, _VALUE),
        ),
        Lesson(
            "forward",
            "Why is a fresh arm's fingertip at the origin?",
            "so101/scene",
            (
                _JOINT,
                _VALUE,
                Option("--site", None, "the fingertip (default gripperframe, or the last site)"),
                Option("--arrays", False, "show which arrays each call changes", bool, more=True),
                Option("--lag", False, "show how far behind a step leaves it", bool, more=True),
                Option("--seconds", None, "simulated time of --lag (default 2)", float),
            ),
        ),
        Lesson(
            "hold",
            "Six numbers in: how does the arm follow?",
            "so101/scene",
            (
                Option("--seconds", 2.0, "simulated time", float),
                Option("--target", None, "command, one number an actuator", float, many=True),
            ),
        ),
        Lesson(
            "gravity",
            "You never wrote ctrl. Who holds the arm up?",
            "so101/scene",
            (
                Option("--seconds", None, "simulated time (default 4)", float),
                Option(
                    "--joint",
                    None,
                    "joint to watch, with a servo (default shoulder_lift, or that with most load)",
                ),
                Option(
                    "--longer", None, "simulated time of the fall; 0 for none (default 100)", float
                ),
            ),
        ),
        Lesson(
            "reset",
            "Back to a known state: what is in it?",
            "so101/scene_box",
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
            "time",
            "What time is it in a simulator?",
            "so101/scene",
            (
                Option("--realtime", False, "wait for the clock", bool),
                Option("--seconds", None, "simulated time with --realtime (default 4)", float),
            ),
        ),
        Lesson(
            "speed",
            "What does one second of your machine buy?",
            "so101/scene_box",
            (Option("--steps", 4000, "steps of each run", int),),
        ),
        Lesson(
            "worlds",
            "Many worlds: what does a shared Model save?",
            "so101/scene_box",
            (Option("--most", 4096, "the largest number of worlds", int),),
            on_path=False,
        ),
        Lesson("questions", "Check yourself: six questions.", "so101/scene_box", on_path=False),
    )
}
PATH = tuple(lesson for lesson in LESSONS.values() if lesson.on_path)
BESIDE = tuple(lesson for lesson in LESSONS.values() if not lesson.on_path)


def module(name: str) -> Any:
    """The module of a lesson."""
    return importlib.import_module(f".{name}", __name__)
