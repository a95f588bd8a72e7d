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
from ...measures.text import degrees, duration
from ..grading.inside.worlds import Scenes
from . import LESSONS, forward, gravity, objects, replay, state, time
from ._falling import SERVO
from .session import CodeRun, LessonModule, Options, fitted, load_line, slots_of

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
_RIGHT = {"forward": 2, "state": 0, "replay": 1, "gravity": 0, "objects": 2, "time": 0}


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


def slots(result: QuestionsResult) -> dict[str, Any]:
    """Return the slots of each lesson under its name, and what the page says beside them.

    Each lesson's have two more: `holds`, whether its run bears out the right choice, and `right`,
    the number of that choice, or None.
    """
    answers = result.answers
    slots: dict[str, Any] = {}
    for name, holds in _verdicts(result).items():
        slots[name] = slots_of(name, getattr(answers, name))
        slots[name]["holds"] = holds
        slots[name]["right"] = _RIGHT[name] if holds else None
    slots["state"]["joint_count"] = len(answers.state.joints)
    slots["crate"] = vars(result.behind_crate) | {"joint": result.behind_crate.name}
    on, off = _ends(answers.gravity)
    slots["finer"] = _differs_with_half_the_timestep(answers.replay)
    slots["sagged"] = degrees(on, 3)
    slots["fallen"] = degrees(off)
    slots["load"] = duration(answers.objects.loading)
    slots["load_steps"] = f"{answers.objects.ratio:,.0f}"
    slots["unpaced"] = duration(answers.time.free)
    slots["paced"] = f"{answers.time.paced:.3f} s"
    return slots


def _verdicts(result: QuestionsResult) -> dict[str, bool]:
    """Return whether each run bears out the right choice, by the name of the lesson."""
    answers = result.answers
    return {
        "forward": _waits_for_forward(answers.forward),
        "state": _fails_behind_crate(answers.state, result.behind_crate),
        "replay": _repeats_without_being_true(answers.replay),
        "gravity": _servo_carries_the_load(answers.gravity),
        "objects": _worlds_share_a_model(answers.objects),
        "time": _waiting_changes_nothing(answers.time),
    }


def _waits_for_forward(result: ForwardResult) -> bool:
    """Tell whether a reading stays as it was after the write, until `forward` moves it."""
    return (1, 2) in result.equal and result.moved > 0


def _fails_behind_crate(result: StateResult, behind_crate: JointSlots) -> bool:
    """Tell whether each joint here has one address, and a joint behind a crate has two."""
    same_here = all(joint.qpos_start == joint.qvel_start for joint in result.joints)
    return same_here and behind_crate.qpos_start != behind_crate.qvel_start


def _repeats_without_being_true(result: ReplayResult) -> bool:
    """Tell whether runs repeat, and yet end elsewhere with half the timestep, if that was tried."""
    tried = result.finer is not None
    return result.identical and (not tried or _differs_with_half_the_timestep(result))


def _differs_with_half_the_timestep(result: ReplayResult) -> bool:
    """Tell whether runs with half the timestep repeat, too, and end elsewhere."""
    finer = result.finer
    return finer is not None and finer.identical and finer.difference > 0


def _servo_carries_the_load(result: GravityResult) -> bool:
    """Tell whether the servo holds the joint against gravity, which moves it without the servo."""
    servos_on, servos_off = result.servos_on, result.servos_off
    balanced = servos_on.balanced and servos_off.balanced
    on, off = _ends(result)
    return balanced and servos_on.held_by == SERVO and abs(off) > abs(on)


def _ends(result: GravityResult) -> tuple[float, float]:
    """Return where the joint is at the end, with the servos on and off [rad]."""
    return float(result.servos_on.position[-1]), float(result.servos_off.position[-1])


def _worlds_share_a_model(result: ObjectsResult) -> bool:
    """Tell whether Data of one Model leave it and each other alone, and a load is worth steps."""
    return result.alone and result.constant and result.ratio > 1


def _waiting_changes_nothing(result: TimeResult) -> bool:
    """Tell whether time and state stand still while nothing is called, and pacing is no physics."""
    return result.identical and time.is_still(result)
