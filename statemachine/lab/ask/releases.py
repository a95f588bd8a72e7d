"""Between which releases of an engine a run changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...errors import BadInputError
from ...interface import Model
from ...models import AnyPath
from ..compare.sides import Request, Side
from ..questions.requests.versions import VersionsRequest, VersionsResult, answer
from ..runs.call_period import Every
from ..runs.reporter import QUIET, Reporter
from .arguments import AnyWhat, RunArguments, check_alone, side_of, tolerances_of


def versions(
    model: VersionsRequest | Request | AnyPath | Model | None = None,
    *,
    releases: str | Sequence[str] = (),
    bisect: bool = False,
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
    reporter: Reporter = QUIET,
) -> VersionsResult:
    """Run something on releases of MuJoCo, and return between which of them it changes.

        lab.versions("a.xml", releases=("3.1.6", "3.3.7"), what="hold")

    Args:
        model: A name or a path, with options behind it as in "a.xml damping=2"; a loaded Model,
            whose file is loaded again on each release with the options that it was told; None for
            the experiment's own. Or a Request of what is run; or a VersionsRequest, which says all
            of it.
        releases: Versions, "3.1.6,3.3.7" or one by one; the one that is installed is compared, too.
        bisect: Whether releases since `releases`, which is the oldest, are added until it is known
            which of them changed it.
        what: The name of an experiment, a function f(model, data), "FILE.py:FUNCTION",
            or "POLICY.onnx".
        menagerie: A menagerie folder to look the name up in; None for $MENAGERIE.
        seconds: Simulated time [s]; None for the experiment's own, or 2 of a function.
        timestep: Length of a step [s]; None for the file's own.
        seed: Of what an experiment draws.
        every: Steps for which what a function returned holds, or a time such as "5ms".
        keyframe: Where it starts; None for the experiment's own, and for the default state of a
            function.
        contract: What a policy expects of the simulator: a YAML file.
        command: Speeds that a policy is asked for, vx, vy [m/s], wz [rad/s]; None for straight on.
        tolerances: By kind of quantity, over the usual ones: SI, or words such as "0.5deg".
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: A version is none, or the one that is installed.
        MissingEngineError: Some are not here.
        EngineError: A release cannot be installed.
        StateMachineError: The model cannot be loaded, or cannot do what was asked.
    """
    arguments = locals()
    if isinstance(model, VersionsRequest):
        check_alone(versions, arguments)
        return answer(model, reporter)
    if not releases:
        raise BadInputError('name releases of MuJoCo, as in releases=("3.1.6", "3.3.7")')
    run = RunArguments.of(arguments | {"left": _to_be_loaded(model)}).request()
    typed = releases if isinstance(releases, str) else ",".join(releases)
    request = VersionsRequest(run, typed, bisect, tolerances_of(tolerances))
    return answer(request, reporter)


def _to_be_loaded(model: Request | AnyPath | Model | None) -> Request | AnyPath | Side | None:
    """Return what each release loads: of a loaded Model its file, with the options of that."""
    return side_of(model).to_be_loaded() if isinstance(model, Model) else model
