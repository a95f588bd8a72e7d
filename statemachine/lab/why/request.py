"""The question why two sides differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...interface import Model
from ...processes import checked_jobs
from ..compare.perturbed import EXACT, Uncertainty
from ..recordings import Trace
from ..runs.scenarios import Scenario
from .gap import Measure


@dataclass(frozen=True, eq=False)
class WhyRequest:
    """Two sides, what is run on them, and how their gap is divided.

    Attributes:
        left: The left side, as loaded; the other is brought to it.
        right: The right side, of any file and engine. Where one side comes with the settings of its
            engine and the other does not, each of them is a cause.
        scenario: What is run.
        recordings: Runs with the start and the commands of the left and of the right instead of the
            scenario's; of one alone both are given those.
        seconds: Simulated time; None for the scenario's own.
        seed: Of what the scenario draws, and of the orders that are drawn.
        names: Joints, bodies, sites and actuators of `left` that go by other names in `right`.
        quantity: What the gap is measured in; None for a free body that is touched at the start,
            relative to the tip, else the joints, or what differs most where these agree.
        measure: Which figure of it.
        finer: Every difference by its single entries, however many there are.
        budget: How many sets of causes may be run: all of them where there are no more, else as
            far as orders are drawn.
        labels: What the sides are called; None for their files and engines.
        uncertain: What is not known of the start, for the chaos floor; None for no floor.
        jobs: How many processes make the runs; None for one a processor where that pays, and
            for one where a function commands. Without forks the runs are made in this process. The
            figures are the same.

    Raises:
        BadInputError: `jobs` is less than 1.
    """

    left: Model
    right: Model
    scenario: Scenario
    recordings: tuple[Trace, ...] = ()
    seconds: float | None = None
    seed: int = 0
    names: Mapping[str, str] | None = None
    quantity: str | None = None
    measure: Measure = "worst"
    finer: bool = False
    budget: int = 200
    labels: tuple[str, str] | None = None
    uncertain: Uncertainty | None = EXACT
    jobs: int | None = None

    def __post_init__(self) -> None:
        checked_jobs(self.jobs)

    @property
    def duration(self) -> float:
        """The simulated time [s]."""
        return self.scenario.seconds if self.seconds is None else self.seconds

    @property
    def are_compiled(self) -> bool:
        """Whether both sides have a compiled model, by which they can be matched and edited."""
        return self.left.compiled is not None and self.right.compiled is not None
