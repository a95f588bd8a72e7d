"""How far two sides are apart, and which difference explains how much of that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...installed import PAIR
from ...models import AnyPath
from ..compare.perturbed import Uncertainty
from ..compare.sides import Request
from ..questions.requests import causes, gap
from ..questions.requests.causes import ExplainRequest, ExplainResult
from ..questions.requests.gap import CompareRequest, CompareResult
from ..runs.call_period import Every
from ..runs.reporter import QUIET, Reporter
from ..why.gap import Measure
from .arguments import (
    AnySide,
    AnyWhat,
    RunArguments,
    Which,
    check_alone,
    tolerances_of,
    uncertainty_of,
)


def compare(
    left: CompareRequest | Request | AnySide | None = None,
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
    tolerances: Mapping[str, float | str] | None = None,
    uncertainty: Uncertainty | str | Sequence[str] = (),
    chaos: bool = True,
    reporter: Reporter = QUIET,
) -> CompareResult:
    """Run something on two sides, or open traces, and return how far apart they are.

        result = lab.compare("a.xml", "b.urdf@pybullet", what=policy, seconds=5)
        print(result)
        table = pandas.DataFrame(result.to_dict())

    Args:
        left: The left side: "FILE", "FILE@ENGINE" or "FILE@ENGINE:engine" with options behind it,
            as in "a.xml@pybullet timestep=0.001"; a path; a loaded Model; or a Side. Without a
            right side a name or path of a model, which runs on both backends; None for the
            experiment's own. Or a Request of what is run, such as `result.request.run`; or a
            CompareRequest, which says all of it.
        right: The right side.
        what: The name of an experiment; a function f(model, data) that returns ctrl (nu,) or None
            to leave it, or "FILE.py:FUNCTION"; "POLICY.onnx", a network; or one or two traces, or
            their files.
        backends: Where no sides are given: "mujoco", "pybullet", "pybullet:engine" or a release,
            "mujoco==3.3.7".
        menagerie: A menagerie folder to look names up in; None for $MENAGERIE.
        seconds: Simulated time [s]; None for the experiment's own, or 2 of a function, 4 of a
            policy.
        timestep: Length of a step on both sides [s]; None for each file's own.
        seed: Of what an experiment draws.
        names: Joints, bodies, sites and actuators of the left by the names that the right has.
        actuators: "left" or "right": both sides have the actuators of that one.
        floor: "left" or "right": both sides have the floor of that one.
        every: Steps for which what a function returned holds, or a time such as "5ms".
        keyframe: Where it starts, on both sides; None for the experiment's own, for the default
            state of a function, and for "home" of a policy.
        contract: What a policy expects of the simulator: a YAML file.
        command: Speeds that a policy is asked for, vx, vy [m/s], wz [rad/s]; None for straight on.
        tolerances: By kind of quantity, over the usual ones: SI, or words as in
            {"joint": "0.5deg", "tip": 0.002}.
        uncertainty: How uncertain the start of the robot is, as ("0.1mm", "0.1deg"), for the chaos
            floor.
        chaos: Whether the chaos floor is looked for: how far apart runs get that differ by
            rounding alone.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: Arguments contradict each other, or a function takes something else than
            (model, data).
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    arguments = locals()
    if isinstance(left, CompareRequest):
        check_alone(compare, arguments)
        return gap.answer(left, reporter)
    run = RunArguments.of(arguments).request()
    return gap.answer(
        CompareRequest(run, tolerances_of(tolerances), uncertainty_of(uncertainty, chaos)), reporter
    )


def why(
    left: ExplainRequest | Request | AnySide | None = None,
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
    quantity: str | None = None,
    measure: Measure = "worst",
    finer: bool = False,
    time_limit: float | None = None,
    write: AnyPath | None = None,
    uncertainty: Uncertainty | str | Sequence[str] = (),
    chaos: bool = True,
    jobs: int | None = None,
    reporter: Reporter = QUIET,
) -> ExplainResult:
    """Return which difference of two sides explains how much of their gap.

        lab.why("a.xml", "b.xml", what="hold", quantity="elbow").to_dict()["share"]

    Args:
        left: As of `compare`; or an ExplainRequest, which says all that is asked.
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
        quantity: What the gap is measured in: "joints", one joint, a body, a site; None for what
            fits the run.
        measure: Which figure of the gap is explained: "worst" at any moment, at the "end", or the
            "rms".
        finer: Whether every difference is divided into its entries.
        time_limit: After how long the search ends, by the clock [s], above 0: what is known by then
            is the answer; None for until all is known.
        write: Where the right side's file is written with the left's values; it is run then, and
            the result says what stays. None for nowhere.
        uncertainty: As of `compare`.
        chaos: As of `compare`.
        jobs: Number of processes; None for one a processor where that pays, and for one where a
            function commands.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        EndedEarlyError: As they come, a side does not reach the end.
        BadInputError: Arguments contradict each other, or a function takes something else than
            (model, data).
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    arguments = locals()
    if isinstance(left, ExplainRequest):
        check_alone(why, arguments)
        return causes.answer(left, reporter)
    run = RunArguments.of(arguments).request()
    return causes.answer(
        ExplainRequest(
            run,
            quantity=quantity,
            measure=measure,
            finer=finer,
            time_limit=time_limit,
            write=write,
            uncertainty=uncertainty_of(uncertainty, chaos),
            jobs=jobs,
        ),
        reporter,
    )
