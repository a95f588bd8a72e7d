"""Where in a step two sides differ, and whether that vanishes with the timestep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...installed import PAIR
from ...models import AnyPath
from ..compare.sides import Request
from ..questions.requests import converge as limits
from ..questions.requests import one_step as steps
from ..questions.requests.converge import ConvergeRequest, ConvergeResult
from ..questions.requests.one_step import OneStepRequest, OneStepResult
from ..runs.call_period import Every
from ..runs.reporter import QUIET, Reporter
from .arguments import AnySide, AnyWhat, RunArguments, Which, check_alone


def one_step(
    left: OneStepRequest | Request | AnySide | None = None,
    right: AnySide | None = None,
    *,
    what: AnyWhat | Sequence[AnyWhat] | None = None,
    backends: tuple[str, str] = PAIR,
    menagerie: AnyPath | None = None,
    seconds: float | None = None,
    timestep: float | None = None,
    seed: int = 0,
    names: Mapping[str, str] | None = None,
    actuators: Which | None = None,
    floor: Which | None = None,
    every: Every = 1,
    keyframe: str | None = None,
    contract: AnyPath | None = None,
    command: Sequence[float] | None = None,
    reporter: Reporter = QUIET,
) -> OneStepResult:
    """Return which stage of a step differs first, from each state of the left side.

        lab.one_step("a.xml", "b.xml", what="hold").first

    Args:
        left: As of `compare`; or a OneStepRequest, which says all that is asked.
        right: As of `compare`.
        what: As of `compare`.
        backends: As of `compare`.
        menagerie: As of `compare`.
        seconds: As of `compare`.
        timestep: As of `compare`.
        seed: As of `compare`.
        names: As of `compare`.
        actuators: As of `compare`.
        floor: As of `compare`.
        every: As of `compare`.
        keyframe: As of `compare`.
        contract: As of `compare`.
        command: As of `compare`.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: Arguments contradict each other, or a function takes something else than
            (model, data).
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    arguments = locals()
    if isinstance(left, OneStepRequest):
        check_alone(one_step, arguments)
        return steps.answer(left, reporter)
    run = RunArguments.of(arguments).request()
    return steps.answer(OneStepRequest(run), reporter)


def converge(
    left: ConvergeRequest | Request | AnySide | None = None,
    right: AnySide | None = None,
    *,
    what: AnyWhat | Sequence[AnyWhat] | None = None,
    backends: tuple[str, str] = PAIR,
    menagerie: AnyPath | None = None,
    seconds: float | None = None,
    timestep: float | None = None,
    seed: int = 0,
    names: Mapping[str, str] | None = None,
    actuators: Which | None = None,
    floor: Which | None = None,
    every: Every = 1,
    keyframe: str | None = None,
    contract: AnyPath | None = None,
    command: Sequence[float] | None = None,
    reporter: Reporter = QUIET,
) -> ConvergeResult:
    """Return what of a gap vanishes with the timestep h: runs at h, h/2, h/4, and at most h/16.

        lab.converge("a.xml@mujoco", "a.xml@pybullet", what="fall").vanishes

    Args:
        left: As of `compare`; or a ConvergeRequest, which says all that is asked.
        right: As of `compare`.
        what: As of `compare`.
        backends: As of `compare`.
        menagerie: As of `compare`.
        seconds: As of `compare`.
        timestep: As of `compare`.
        seed: As of `compare`.
        names: As of `compare`.
        actuators: As of `compare`.
        floor: As of `compare`.
        every: As of `compare`.
        keyframe: As of `compare`.
        contract: As of `compare`.
        command: As of `compare`.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: Arguments contradict each other, or a function takes something else than
            (model, data).
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    arguments = locals()
    if isinstance(left, ConvergeRequest):
        check_alone(converge, arguments)
        return limits.answer(left, reporter)
    run = RunArguments.of(arguments).request()
    return limits.answer(ConvergeRequest(run), reporter)
