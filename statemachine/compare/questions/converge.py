"""What of a gap vanishes with the timestep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...runs import Trace
from ...runs.reporter import QUIET, Reporter
from ..convergence import convergence
from ..sides import Request
from ..two_sides import run_sides
from .one_step import check_runs


@dataclass(frozen=True)
class ConvergeRequest:
    """Question what of a gap vanishes where the steps are halved and quartered.

    Attributes:
        run: What is run on two sides; not recorded traces alone.
    """

    run: Request

    def __post_init__(self) -> None:
        check_runs(self.run, "--converge")

    def with_finer_steps(self, times: int) -> Request:
        """Return what is run, with so many times as many steps of the engine on both sides."""
        usual = self.run.options.get("substeps", 1)
        sides = tuple(
            replace(side, options=_finer(side.options, usual, times)) for side in self.run.sides
        )
        return replace(self.run, options=_finer(self.run.options, 1, times), sides=sides)


def answer(request: ConvergeRequest, reporter: Reporter = QUIET):
    """Run both sides with ever finer steps, and compare.

    Raises:
        StateMachineError: As `run_sides` does.
    """

    def run(times: int) -> tuple[Trace, Trace]:
        return run_sides(request.with_finer_steps(times)).traces

    with reporter.stage("converge") as progress:
        return convergence(run, progress=progress)


def _finer(options: Mapping[str, Any], usual: int, times: int) -> dict[str, Any]:
    """Return options with so many times as many substeps.

    Args:
        options: As `Model.replace` takes them.
        usual: How many substeps there are where they name none.
        times: So many times as many.
    """
    return {**options, "substeps": options.get("substeps", usual) * times}
