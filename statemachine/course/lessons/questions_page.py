"""The page of the six questions: the right choices, and what the runs show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...show.engine_tables import Results
from ...show.templates import PageContent
from . import time
from ._falling import SERVO
from .frame import LessonFrame
from .questions import QuestionsResult

if TYPE_CHECKING:
    from .forward import ForwardResult
    from .gravity import GravityResult
    from .objects import ObjectsResult
    from .replay import ReplayResult
    from .state import JointSlots, StateResult
    from .time import TimeResult

_RIGHT = {"forward": 2, "state": 0, "replay": 1, "gravity": 0, "objects": 2, "time": 0}


@dataclass(frozen=True)
class Choice:
    """The right choice of a question, and whether a run bears it out.

    Attributes:
        right: Its number; None where the run does not.
        holds: Whether the run does.
    """

    right: int | None
    holds: bool


@dataclass(frozen=True)
class QuestionsPage(PageContent):
    """What the page of the questions shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        forward: The right choice after a write into the state.
        state: That of how joints are found.
        replay: That of what a repeated run does not show.
        gravity: That of who holds the arm.
        objects: That of why there are two objects.
        time: That of a clock that nobody reads.
    """

    template = "questions.md.j2"
    lesson: LessonFrame
    result: QuestionsResult
    forward: Choice
    state: Choice
    replay: Choice
    gravity: Choice
    objects: Choice
    time: Choice

    @property
    def peak(self) -> float:
        """Return the largest difference of two runs [rad, m or part of a quaternion]."""
        return float(self.result.answers.replay.difference.max())

    @property
    def is_finer_elsewhere(self) -> bool:
        """Tell whether runs with half the timestep repeat, too, and end elsewhere."""
        return _differs_with_half_the_timestep(self.result.answers.replay)

    @property
    def seconds(self) -> float:
        """Return the simulated time of the arm under gravity [s]."""
        return float(self.result.answers.gravity.servos_on.time[-1])

    @property
    def forces_told(self) -> bool:
        """Tell whether the engine tells the forces on the joint."""
        return _forces_are_told(self.result.answers.gravity)

    @property
    def load_on(self) -> float:
        """Return the size of the force of gravity on the joint [N·m]; 0 where it is not known."""
        bias = self.result.answers.gravity.servos_on.forces.bias
        return 0.0 if bias is None else abs(bias)

    @property
    def servo_force(self) -> float:
        """Return the size of the servo's force on it [N·m]; 0 where it is not known."""
        force = self.result.answers.gravity.servos_on.forces.actuator
        return 0.0 if force is None else abs(force)

    @property
    def sagged(self) -> float:
        """Return where the joint is with the servos on [rad]."""
        return _ends(self.result.answers.gravity)[0]

    @property
    def fallen(self) -> float:
        """Return where it is with the servos off [rad]."""
        return _ends(self.result.answers.gravity)[1]


def contents(results: Results[QuestionsResult], frame: LessonFrame) -> dict[str, QuestionsPage]:
    """Return what the page shows of each engine."""
    return {name: _content(result, frame) for name, result in results.items()}


def _content(result: QuestionsResult, frame: LessonFrame) -> QuestionsPage:
    """Return what the page shows of one engine."""
    answers = result.answers
    has_two_addresses = _fails_behind_crate(answers.state, result.behind_crate)
    repeats = _repeats_without_being_true(answers.replay)
    is_held = _servo_carries_the_load(answers.gravity)
    is_shared = _worlds_share_a_model(answers.objects)
    is_still = _waiting_changes_nothing(answers.time)
    return QuestionsPage(
        lesson=frame,
        result=result,
        forward=_choice("forward", _waits_for_forward(answers.forward)),
        state=_choice("state", has_two_addresses),
        replay=_choice("replay", repeats),
        gravity=_choice("gravity", is_held),
        objects=_choice("objects", is_shared),
        time=_choice("time", is_still),
    )


def _choice(name: str, holds: bool) -> Choice:
    """Return the right choice of the question that a lesson answers."""
    return Choice(_RIGHT[name] if holds else None, holds)


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
    by_servo = servos_on.held_by == SERVO or not _forces_are_told(result)
    return balanced and by_servo and abs(off) > abs(on)


def _forces_are_told(result: GravityResult) -> bool:
    """Tell whether the engine tells the forces on the joint; without, where it is shows enough."""
    return result.servos_on.forces.total is not None


def _ends(result: GravityResult) -> tuple[float, float]:
    """Return where the joint is at the end, with the servos on and off [rad]."""
    return float(result.servos_on.position[-1]), float(result.servos_off.position[-1])


def _worlds_share_a_model(result: ObjectsResult) -> bool:
    """Tell whether Data of one Model leave it and each other alone, and a load is worth steps."""
    return result.alone and result.constant and result.ratio > 1


def _waiting_changes_nothing(result: TimeResult) -> bool:
    """Tell whether time and state stand still while nothing is called, and pacing is no physics."""
    return result.identical and time.is_still(result)
