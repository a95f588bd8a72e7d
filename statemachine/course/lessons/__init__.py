"""The lessons: what each is called, asks and takes. Importing this loads no engine.

A lesson `NAME` is two modules and a template. `NAME.py` has `code(model, options, load)`, which is
what a student types for a Model, where `load` is the call that loads it; and
`run(play, options, progress)`, which calls `play` (a `session.CodeRun`) once, looks on, and returns
what was measured, a dataclass. One that draws a diagram also has `diagram(model)`; one whose
options depend on the robot has `fit(model, options)`, which gives them back with nothing left open.
NAME_page.py has `contents(results, frame)`: of the results by backend, and of what every lesson
shows (`frame`), it makes a `PageContent` for each backend. The template `NAME.md.j2` says it (see
`show/templates.py`); labels of tables are macros in NAME_labels.md.j2. Terminal, documentation
and notebook show the same page.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

from ...errors import UnknownNameError, check_name

_NOTHING: Mapping[str, Any] = MappingProxyType({})


class Option(NamedTuple):
    """An option of a lesson on the command line.

    Attributes:
        flag: What is typed, "--joint".
        metavar: What its value is called; "" of a switch, which takes none.
        help: What it is, for a user.
        settings: What else argparse is told, such as its default or its choices.
    """

    flag: str
    metavar: str
    help: str
    settings: Mapping[str, Any] = _NOTHING

    @property
    def key(self) -> str:
        """Return its name among the values of a lesson's options."""
        return self.flag.removeprefix("--")

    @property
    def default(self) -> Any:
        """Return its value where nobody sets it; None of one that depends on the robot."""
        return self.settings.get("default", None if self.metavar else False)


@dataclass(frozen=True)
class Lesson:
    """An entry of the table of lessons.

    Attributes:
        name: Of its modules, of its template and on the command line.
        question: What it answers.
        model: The model that it is about.
        options: On the command line.
        on_path: Whether the guided path has it.
        plots: Whether it has pictures for a file.
        ends_course: Whether the exercises come next, and no further lesson.
    """

    name: str
    question: str
    model: str
    options: tuple[Option, ...] = ()
    on_path: bool = True
    plots: bool = False
    ends_course: bool = False

    @property
    def defaults(self) -> dict[str, Any]:
        """Return its options where nobody sets one."""
        return {option.key: option.default for option in self.options}

    @property
    def more(self) -> tuple[str, ...]:
        """Return the switch that shows what goes further, if any; JSON and documentation set it."""
        return tuple(option.key for option in self.options if option is FURTHER)


FURTHER = Option("--further", "", "show what goes further, after the lesson")

# What depends on the robot has no default here: `fit` of the lesson's module gives it one.
_JOINT = Option("--joint", "JOINT", "joint to write (default shoulder_lift, if there is one)")
_VALUE = Option("--value", "X", "what to write [rad or m] (default 0.8, if in range)")
_CTRL = Option("--ctrl", "X,X,…", "command, one number an actuator [rad for a servo]")
_SITE = Option("--site", "SITE", "the fingertip (default gripperframe, or the last site)")

_LESSONS = (
    Lesson(
        "nowhere",
        "The arm that is nowhere: where is it?",
        "so101/scene",
        (_SITE, FURTHER),
    ),
    Lesson(
        "objects",
        "Two objects and one function: what is in which?",
        "so101/scene",
        (
            Option("--worlds", "N", "how many Data of one Model (default 10)", {"default": 10}),
            Option("--most", "N", "most worlds with --further (default 4096)", {"default": 4096}),
            FURTHER,
        ),
        plots=True,
    ),
    Lesson(
        "state",
        "Which numbers are the state of the robot?",
        "so101/scene_box",
        plots=True,
    ),
    Lesson(
        "forward",
        "You wrote into the state. Who noticed?",
        "so101/scene",
        (
            _JOINT,
            _VALUE,
            _SITE,
            Option("--seconds", "S", "simulated time with --further (default 2)"),
            FURTHER,
        ),
        plots=True,
    ),
    Lesson(
        "hold",
        "Six numbers in: how does the arm follow?",
        "so101/scene",
        (
            Option("--seconds", "S", "simulated time (default 2)", {"default": 2.0}),
            _CTRL,
            FURTHER,
        ),
        plots=True,
    ),
    Lesson(
        "gravity",
        "You never wrote ctrl. Who holds the arm up?",
        "so101/scene",
        (
            Option("--seconds", "S", "simulated time (default 4)"),
            Option(
                "--joint",
                "JOINT",
                "joint to watch, with a servo (default shoulder_lift, or that with most load)",
            ),
            Option("--longer", "S", "simulated time of the fall with --further (default 100)"),
            FURTHER,
        ),
        plots=True,
    ),
    Lesson(
        "reset",
        "How do you get back to a known state?",
        "so101/scene_box",
        (FURTHER,),
    ),
    Lesson(
        "replay",
        "Same start, same commands: the same bits?",
        "so101/scene_box",
        (
            Option("--steps", "N", "steps of each run (default 600)", {"default": 600}),
            _CTRL,
            Option(
                "--break",
                "extra-step|late-ctrl",
                "make the second run differ: one step more, or the command one step late",
                {"choices": ("extra-step", "late-ctrl")},
            ),
            FURTHER,
        ),
        plots=True,
    ),
    Lesson(
        "time",
        "What time is it in a simulator?",
        "so101/scene_box",
        (
            Option("--steps", "N", "steps of the run (default 4000)", {"default": 4000}),
            Option("--realtime", "", "wait for the clock"),
            Option("--seconds", "S", "simulated time with --realtime (default 4)"),
            FURTHER,
        ),
    ),
    Lesson(
        "summary",
        "What can you do now, and what is next?",
        "so101/scene_box",
    ),
    Lesson(
        "questions",
        "Check yourself: six questions.",
        "so101/scene_box",
        on_path=False,
        ends_course=True,
    ),
    Lesson(
        "step",
        "What does one step do?",
        "so101/scene",
        (Option("--seconds", "S", "simulated time (default 2)", {"default": 2.0}),),
        on_path=False,
    ),
    Lesson(
        "energy",
        "Which integrator keeps energy?",
        "tumbling",
        (Option("--seconds", "S", "simulated time (default 20)", {"default": 20.0}),),
        on_path=False,
        plots=True,
    ),
    Lesson(
        "recording",
        "Is it my arm or my simulator?",
        "so101",
        on_path=False,
        plots=True,
    ),
)

# Lessons that were, and the command that now shows what they taught.
MOVED = {
    "write": "lesson forward",
    "speed": "lesson time",
    "worlds": "lesson objects --further",
}


def moved(name: str) -> str:
    """Return where a lesson went that is none any more, as the end of a message; "" for others."""
    if name not in MOVED:
        return ""
    return f"what it taught is in: statemachine {MOVED[name]}"


def check_lesson(name: str) -> None:
    """Raise UnknownNameError where no lesson has a name."""
    if moved(name):
        raise UnknownNameError(f"no lesson named {name!r} any more; {moved(name)}")
    check_name("lesson", name, LESSONS)


# The lessons of the path, in order, and those beside it.
LESSONS = {lesson.name: lesson for lesson in _LESSONS}
PATH = tuple(lesson for lesson in LESSONS.values() if lesson.on_path)
BESIDE = tuple(lesson for lesson in LESSONS.values() if not lesson.on_path)


def module(name: str) -> Any:
    """Import the module of a lesson, or that of its page."""
    return importlib.import_module(f".{name}", __name__)
