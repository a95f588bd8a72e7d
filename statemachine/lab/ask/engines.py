"""Which of three sides or more is odd."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from ...backends.chosen import ALL
from ...interface import Model
from ...models import AnyPath
from ..compare.perturbed import Uncertainty
from ..compare.sides import Request, Side
from ..questions.requests.engines import EnginesRequest, EnginesResult, answer
from ..runs.call_period import Every
from ..runs.reporter import QUIET, Reporter
from .arguments import (
    AnySide,
    AnyWhat,
    RunArguments,
    check_alone,
    side_of,
    tolerances_of,
    uncertainty_of,
)


def engines(
    model: EnginesRequest | Request | AnySide | Sequence[AnySide] | None = None,
    *,
    backends: Sequence[str] = (),
    what: AnyWhat | Sequence[AnyWhat] | None = None,
    menagerie: AnyPath | None = None,
    seconds: float | None = None,
    timestep: float | None = None,
    seed: int = 0,
    every: Every = 1,
    keyframe: str | None = None,
    contract: AnyPath | None = None,
    command: Sequence[float] | None = None,
    tolerances: Mapping[str, float | str] | None = None,
    uncertainty: Uncertainty | str | Sequence[str] = (),
    chaos: bool = True,
    reporter: Reporter = QUIET,
) -> EnginesResult:
    """Run something on three sides or more, and return which one is odd.

        lab.engines("a.xml", backends=("mujoco", "pybullet", "mujoco==3.3.7"), what="hold").odd

    That others agree against one is a hint, and no proof.

    Args:
        model: A name or a path of a model, with options behind it as in "a.xml damping=2"; None for
            the experiment's own. Or a list of three sides or more, each as of `compare`; a Request
            of what is run; or an EnginesRequest, which says all of it.
        backends: Three or more, as of `compare`, where no sides are named; () for all that are
            installed.
        what: As of `compare`; no traces.
        menagerie: As of `compare`.
        seconds: As of `compare`.
        timestep: As of `compare`.
        seed: As of `compare`.
        every: As of `compare`.
        keyframe: As of `compare`.
        contract: As of `compare`.
        command: As of `compare`.
        tolerances: As of `compare`.
        uncertainty: As of `compare`.
        chaos: As of `compare`.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: Arguments contradict each other, or there are fewer than three sides.
        MissingEngineError: Of all engines fewer than three are installed.
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    arguments = locals()
    if isinstance(model, EnginesRequest):
        check_alone(engines, arguments)
        return answer(model, reporter)
    sides: tuple[Side, ...] = ()
    del arguments["backends"]
    if model is None or isinstance(model, Request | Side | Model | str | os.PathLike):
        arguments["left"] = model
    else:
        sides = tuple(side_of(side, menagerie) for side in model)
    named = tuple(backends)
    if not (sides or named):
        named = (ALL,)
    run = RunArguments.of(arguments).request()
    request = EnginesRequest(
        run, named, sides, tolerances_of(tolerances), uncertainty_of(uncertainty, chaos)
    )
    return answer(request, reporter)
