"""What of a gap vanishes with the timestep."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

from ....errors import BadInputError, shown
from ....interface.options import OptionValue
from ...compare.convergence import FINER, Convergence, convergence
from ...compare.sides import Request, Side
from ...compare.two_sides import run_sides
from ...recordings import Trace
from ...runs.reporter import QUIET, Reporter
from ...shown_result import Column, ShownResult, columns_of
from .one_step import check_runs


@dataclass(frozen=True)
class ConvergeRequest:
    """Question what of a gap vanishes with the timestep h: runs at h, h/2, h/4, and at most h/16.

    Attributes:
        run: What is run on two sides; not recorded traces alone.
    """

    run: Request

    def __post_init__(self) -> None:
        check_runs(self.run, "--converge")

    def with_finer_steps(self, times: int) -> Request:
        """Return what is run, with so many times as many steps of the engine on both sides."""
        common = _substeps(self.run.options, 1)
        sides: list[Side] = []
        for side in self.run.sides:
            substeps = times * _substeps(side.options, common)
            sides.append(replace(side, options={**side.options, "substeps": substeps}))
        options = {**self.run.options, "substeps": times * common}
        return replace(self.run, options=options, sides=tuple(sides))


@dataclass(frozen=True, repr=False)
class ConvergeResult(ShownResult, Convergence):
    """What becomes of each gap with finer and finer steps, and what was asked.

    Attributes:
        request: What was asked.
    """

    page_function: ClassVar[str] = "questions.convergence:page"

    request: ConvergeRequest = field(kw_only=True, metadata={"json": False})

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each quantity over the whole run.

        "gap_1" is the largest gap with the steps as given, "gap_2" with half of them, and so on
        [unit]; "limit" is what it tends to [unit].
        """
        columns: dict[str, Column] = {"quantity": [limit.name for limit in self.whole_run]}
        columns |= columns_of(self.whole_run, ("kind", "unit"))
        runs = len(self.whole_run[0].gaps) if self.whole_run else 0
        for number, finer in enumerate(FINER[:runs]):
            columns[f"gap_{finer}"] = [limit.gaps[number] for limit in self.whole_run]
        columns |= columns_of(self.whole_run, ("limit", "verdict"))
        return columns


def answer(request: ConvergeRequest, reporter: Reporter = QUIET) -> ConvergeResult:
    """Run both sides with ever finer steps, and compare.

    Raises:
        StateMachineError: As `run_sides` does.
    """
    durations: list[float] = []  # by the clock [s]

    def run(times: int) -> tuple[Trace, Trace]:
        what = "converge, steps as given"
        if times > 1:
            what = f"converge, steps {times} times finer"
        began = time.monotonic()
        with reporter.stage(what, expected_seconds=_expected(durations)) as progress:
            traces = run_sides(request.with_finer_steps(times), progress).traces
        durations.append(time.monotonic() - began)
        return traces

    limits = convergence(run)
    return ConvergeResult(**vars(limits), request=request)


def _expected(durations: list[float]) -> float | None:
    """Estimate how long runs with steps of half the length take [s]; None before two were measured.

    Args:
        durations: How long each of those before took, whose steps were halved each time [s].
            Loading takes the same each time, and is no part of what grows.
    """
    if len(durations) < 2:
        return None
    return durations[-1] + 2.0 * max(0.0, durations[-1] - durations[-2])


def _substeps(options: Mapping[str, OptionValue], usual: int) -> int:
    """Return the number of substeps that options name; `usual` where they name none."""
    value = options.get("substeps", usual)
    if not isinstance(value, int):
        raise BadInputError(f"substeps must be a whole number; got {shown(value)}")
    return value
