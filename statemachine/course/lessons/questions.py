"""Check yourself: six questions, each answered by a run of the lesson that it is about."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeVar

from ...errors import BadInputError
from ...interface import Model
from ...lab.runs.drive import Progress, progress_of_stage
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.robot import is_so101
from ..grading.inside.worlds import Scenes
from . import LESSONS, forward, gravity, objects, replay, state, time
from .session import CodeRun, LessonModule, Options, fitted, load_line

if TYPE_CHECKING:
    from .forward import ForwardResult
    from .gravity import GravityResult
    from .objects import ObjectsResult
    from .replay import ReplayResult
    from .state import JointSlots, StateResult
    from .time import TimeResult

R = TypeVar("R")  # the result of a lesson

# The lessons that answer, one for each question, with options for little to do.
ASKED: dict[str, dict[str, Any]] = {
    "forward": {},
    "state": {},
    "replay": {"steps": 150},
    "gravity": {"seconds": 4.0, "longer": 0.0},
    "objects": {"worlds": 3},
    "time": {},
}
# The number of the right choice of each question, where its run bears it out.


@dataclass(frozen=True)
class Answers:
    """Results of the lessons that answer the questions."""

    forward: ForwardResult
    state: StateResult
    replay: ReplayResult
    gravity: GravityResult
    objects: ObjectsResult
    time: TimeResult


@dataclass(frozen=True)
class QuestionsResult:
    """What the lessons measured that answer the questions.

    Attributes:
        answers: By the names of the lessons.
        behind_crate: Slots of the arm's first joint, where a crate with a free joint comes before
            the arm.
        provenance: What it was computed with.
    """

    answers: Answers
    behind_crate: JointSlots
    provenance: Provenance


def code(model: Model, options: Options, load: str) -> str:
    """Return no code: that of the lessons has been shown."""
    if not is_so101(model):
        raise BadInputError(
            f"these questions are about the SO-101, and {model.path.name} is another robot"
        )
    return ""


def run(play: CodeRun, options: Options, progress: Progress) -> QuestionsResult:
    """Run each of the lessons that answer."""
    play()
    model, names = play.model, list(ASKED)

    def measured(lesson: LessonModule[R], name: str) -> R:
        share = progress_of_stage(progress, names.index(name) / len(names), 1 / len(names))
        return _result_of(lesson, name, model, share)

    answers = Answers(
        forward=measured(forward, "forward"),
        state=measured(state, "state"),
        replay=measured(replay, "replay"),
        gravity=measured(gravity, "gravity"),
        objects=measured(objects, "objects"),
        time=measured(time, "time"),
    )
    return QuestionsResult(answers, _behind_crate(model), provenance(model))


def _behind_crate(model: Model) -> JointSlots:
    """Return the slots of the arm's first joint in the scene that has a crate before the arm."""
    with TemporaryDirectory() as folder:
        crowded = Scenes(model.backend, Path(folder)).crowded("so101/scene_box")
    return state.slots_of_joint(crowded, crowded.joint_id("shoulder_pan"))


def _result_of(lesson: LessonModule[R], name: str, model: Model, progress: Progress) -> R:
    """Run a lesson that answers, and return what it measured.

    Args:
        lesson: Its module.
        name: Its name.
        model: The Model to run it on.
        progress: Told the fraction that is done.
    """
    entry = LESSONS[name]
    options = fitted(entry, model, ASKED[name])
    code = lesson.code(model, options, load_line(entry.model, model.backend))
    with CodeRun(code, model) as play:
        return lesson.run(play, options, progress)
