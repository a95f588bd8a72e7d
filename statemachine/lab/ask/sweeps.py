"""Sweeps, and what moves a quantity of one."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from ...errors import BadInputError
from ...models import AnyPath
from ..runs.controllers import Function
from ..runs.reporter import QUIET, Reporter
from ..sweep.questions import SweepReportRequest, SweepRequest
from ..sweep.request import Sweep
from ..sweep.results import SweepReportResult, SweepResult, answer, answer_report
from .arguments import check_alone
from .kept_functions import file_of_function

Values = str | Sequence[float | str | bool]


def sweep(
    what: SweepRequest | str | Function,
    model: str | None = None,
    *,
    out: AnyPath = "",
    vary: Mapping[str, Values] | Sequence[str] = (),
    backends: Sequence[str] = ("all",),
    seeds: int = 1,
    spread: str = "1deg,1mm",
    samples: int = 0,
    design_seed: int = 0,
    seconds: float | None = None,
    keyframe: str | None = None,
    every: int = 1,
    moments: int = 20,
    timeout: float = 600.0,
    jobs: int | None = None,
    scheduler: str | None = None,
    extend: bool = False,
    retry_failed: bool = False,
    menagerie: str | None = None,
    reporter: Reporter = QUIET,
) -> SweepResult:
    """Run something at every combination of settings, and return the dataset of it.

        def policy(model, data, gain=1.0):
            return gain * data.qpos[: model.nu]

        result = lab.sweep(policy, "a.xml", vary={"gain": [1, 2], "kp": "0.5x:2x:5"}, out="runs")
        table = pandas.DataFrame(result.to_dict())

    Args:
        what: The name of an experiment; a function f(model, data, …) whose further keyword
            arguments can be varied, or "FILE.py:FUNCTION"; or a SweepRequest, which says all that
            is asked. A function of no file, as of a notebook, is kept beside the dataset, by value.
        model: A name or a path; None for the experiment's own.
        out: The folder of the dataset; what it has of the same sweep is not run again.
        vary: Values of what is varied, by its name: a list, or what is typed behind --vary, such as
            "0.5x:2x:5"; or words "NAME=VALUES".
        backends: Engines, or "all".
        seeds: Number of starts for each setting.
        spread: How far a seed other than 0 puts the start away.
        samples: Number of Sobol points of the ranges among `vary`, a power of 2.
        design_seed: Of what is drawn for them.
        seconds: Simulated time [s]; None for the experiment's own, or 2 of a function.
        keyframe: Where a function starts.
        every: Steps for which what a function returned holds.
        moments: Number of moments of each run that are kept.
        timeout: What a cell may take on the clock [s].
        jobs: Number of processes; None for one a processor.
        scheduler: Address of a Dask scheduler, whose workers run it instead.
        extend: Whether the design may be larger than that of the folder.
        retry_failed: Whether cells that failed are run again.
        menagerie: A menagerie folder to look the model up in; None for $MENAGERIE.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: A value is invalid, or the folder is of another sweep, or in use.
        StateMachineError: A model cannot be loaded on any backend.
        OSError: A file cannot be written; what was written is kept.
    """
    if isinstance(what, SweepRequest):
        check_alone(sweep, locals())
        return answer(what, reporter)
    if not os.fspath(out):
        raise BadInputError('name the folder of the dataset, as in out="runs"')
    function = what if isinstance(what, str) else file_of_function(what, out)
    asked = Sweep(
        what=function,
        vary=_words(vary),
        backends=tuple(backends),
        seeds=seeds,
        samples=samples,
        design_seed=design_seed,
        model=model,
        menagerie=menagerie,
        seconds=seconds,
        every=every,
        keyframe=keyframe,
        spread=spread,
        moments=moments,
        timeout=timeout,
    )
    return answer(SweepRequest(asked, out, jobs, scheduler, extend, retry_failed), reporter)


def sweep_report(
    folder: SweepReportRequest | AnyPath,
    quantity: str | None = None,
    *,
    backends: Sequence[str] = (),
) -> SweepReportResult:
    """Return how much each parameter of a sweep moves a quantity, and where it is largest.

        lab.sweep_report("runs", "max_qvel").to_dict()

    Args:
        folder: Of the dataset; or a SweepReportRequest, which says all that is asked.
        quantity: A column of the dataset, or one number of it, such as "base x" or "energy"; None
            for that of a floating base, or else of the usual site.
        backends: One engine of the dataset, or two for the gap between them; empty for all.

    Raises:
        BadInputError: There is no dataset, no cell has that quantity, or it is not one number.
        UnknownNameError: The dataset has no such engine or quantity.
        MissingEngineError: A package is missing.
    """
    if isinstance(folder, SweepReportRequest):
        check_alone(sweep_report, locals())
        return answer_report(folder)
    return answer_report(SweepReportRequest(folder, quantity, tuple(backends)))


def _words(vary: Mapping[str, Values] | Sequence[str]) -> tuple[str, ...]:
    """Return what is varied as it is typed, "NAME=VALUES"."""
    if not isinstance(vary, Mapping):
        return tuple(vary)
    words: list[str] = []
    for name, values in vary.items():
        typed = values
        if not isinstance(values, str):
            typed = ",".join(_word(value) for value in values)
        words.append(f"{name}={typed}")
    return tuple(words)


def _word(value: float | str | bool) -> str:
    """Return a value as it is typed."""
    if isinstance(value, bool):
        return "on" if value else "off"
    return value if isinstance(value, str) else f"{value:.17g}"
