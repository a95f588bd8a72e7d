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
    every: int = 1,
    keyframe: str | None = None,
    reporter: Reporter = QUIET,
) -> OneStepResult:
    """Return which stage of a step differs first, from each state of the left side.

        lab.one_step("a.xml", "b.xml", what="hold").first

    Args:
        left: The left side: "FILE", "FILE@ENGINE" or "FILE@ENGINE:engine" with options behind it,
            as in "a.xml@pybullet timestep=0.001"; a path; a loaded Model; or a Side. Without a
            right side a name or path of a model, which runs on both backends; None for the
            experiment's own. Or a Request of what is run, such as `result.request.run`; or a
            OneStepRequest, which says all of it.
        right: The right side.
        what: The name of an experiment; a function f(model, data) that returns ctrl (nu,) or None
            to leave it, or "FILE.py:FUNCTION"; or one or two traces, or their files.
        backends: Where no sides are given: "mujoco", "pybullet", "pybullet:engine" or a release,
            "mujoco==3.3.7".
        menagerie: A menagerie folder to look names up in; None for $MENAGERIE.
        seconds: Simulated time [s]; None for the experiment's own, or 2 of a function.
        timestep: Length of a step on both sides [s]; None for each file's own.
        seed: Of what an experiment draws.
        names: Joints, bodies, sites and actuators of the left by the names that the right has.
        actuators: "left" or "right": both sides have the actuators of that one.
        floor: "left" or "right": both sides have the floor of that one.
        every: Steps for which what a function returned holds.
        keyframe: Where it starts, on both sides; None for the experiment's own, and for the default
            state of a function.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: Arguments contradict each other, or a function takes something else than
            (model, data).
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    if isinstance(left, OneStepRequest):
        check_alone(one_step, locals())
        return steps.answer(left, reporter)
    run = RunArguments(
        left=left,
        right=right,
        what=what,
        backends=backends,
        menagerie=menagerie,
        seconds=seconds,
        timestep=timestep,
        seed=seed,
        names={} if names is None else names,
        actuators=actuators,
        floor=floor,
        every=every,
        keyframe=keyframe,
    ).request()
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
    every: int = 1,
    keyframe: str | None = None,
    reporter: Reporter = QUIET,
) -> ConvergeResult:
    """Return what of a gap vanishes with the timestep h: runs at h, h/2, h/4, and at most h/16.

        lab.converge("a.xml@mujoco", "a.xml@pybullet", what="fall").vanishes

    Args:
        left: The left side: "FILE", "FILE@ENGINE" or "FILE@ENGINE:engine" with options behind it,
            as in "a.xml@pybullet timestep=0.001"; a path; a loaded Model; or a Side. Without a
            right side a name or path of a model, which runs on both backends; None for the
            experiment's own. Or a Request of what is run, such as `result.request.run`; or a
            ConvergeRequest, which says all of it.
        right: The right side.
        what: The name of an experiment; a function f(model, data) that returns ctrl (nu,) or None
            to leave it, or "FILE.py:FUNCTION"; or one or two traces, or their files.
        backends: Where no sides are given: "mujoco", "pybullet", "pybullet:engine" or a release,
            "mujoco==3.3.7".
        menagerie: A menagerie folder to look names up in; None for $MENAGERIE.
        seconds: Simulated time [s]; None for the experiment's own, or 2 of a function.
        timestep: Length of a step on both sides [s]; None for each file's own.
        seed: Of what an experiment draws.
        names: Joints, bodies, sites and actuators of the left by the names that the right has.
        actuators: "left" or "right": both sides have the actuators of that one.
        floor: "left" or "right": both sides have the floor of that one.
        every: Steps for which what a function returned holds.
        keyframe: Where it starts, on both sides; None for the experiment's own, and for the default
            state of a function.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: Arguments contradict each other, or a function takes something else than
            (model, data).
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    if isinstance(left, ConvergeRequest):
        check_alone(converge, locals())
        return limits.answer(left, reporter)
    run = RunArguments(
        left=left,
        right=right,
        what=what,
        backends=backends,
        menagerie=menagerie,
        seconds=seconds,
        timestep=timestep,
        seed=seed,
        names={} if names is None else names,
        actuators=actuators,
        floor=floor,
        every=every,
        keyframe=keyframe,
    ).request()
    return limits.answer(ConvergeRequest(run), reporter)
