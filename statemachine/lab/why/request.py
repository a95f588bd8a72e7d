"""The question why two sides differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...errors import BadInputError
from ...interface import Model
from ...processes import checked_jobs
from ...release_names import engine_of
from ..compare.labels import files_apart
from ..compare.matching import Matched, match_alike, match_models
from ..compare.perturbed import EXACT, Uncertainty
from ..recordings import Trace
from ..runs.call_period import CallPeriods
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
        time_limit: After how long the search ends, by the clock [s]: what is known by then is the
            answer. None for as long as it takes until each share is exact, or estimated from some
            200 sets of causes; with a limit estimates are refined until it is over, or their
            standard errors are below a hundredth of the gap.
        labels: What the sides are called; None for their files and engines.
        uncertain: What is not known of the start, for the chaos floor; None for no floor.
        jobs: How many processes make the runs; None for one a processor where that pays, and
            for one where a function commands. Without forks the runs are made in this process. The
            figures are the same.
        periods: How often a function is called on each side; None where none is run.

    Raises:
        BadInputError: `jobs` is less than 1, or the time limit is no time above 0.
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
    time_limit: float | None = None
    labels: tuple[str, str] | None = None
    uncertain: Uncertainty | None = EXACT
    jobs: int | None = None
    periods: CallPeriods | None = None

    def __post_init__(self) -> None:
        checked_jobs(self.jobs)
        if self.time_limit is not None and not self.time_limit > 0:
            raise BadInputError(f"a time limit is a time above 0 s; got {self.time_limit:g}")

    @property
    def duration(self) -> float:
        """Return the simulated time [s]."""
        return self.scenario.seconds if self.seconds is None else self.seconds

    @property
    def side_labels(self) -> tuple[str, str]:
        """Return the labels of the sides: by default their files and engines.

        Two files of one name have the folders by which they differ.
        """
        if self.labels is not None:
            return self.labels
        left_file, right_file = files_apart(self.left.path.parts, self.right.path.parts)
        return _label(left_file, self.left), _label(right_file, self.right)

    @property
    def are_compiled(self) -> bool:
        """Tell whether both sides have a compiled model, by which they are matched and edited."""
        return self.left.compiled is not None and self.right.compiled is not None

    def matched(self) -> Matched:
        """Find what of the left is what of the right."""
        if self.are_compiled:
            return match_models(self.left, self.right, self.names)
        return match_alike(self.left, self.right)


def is_one_engine(left: Model, right: Model) -> bool:
    """Tell whether two sides are computed by one engine and release, with settings of one kind."""
    sides = [(model.backend, model.engine_version, settings_of(model)) for model in (left, right)]
    return sides[0] == sides[1]


def settings_of(model: Model) -> str:
    """Return whose settings a Model has: "model", or "engine" for an engine as it comes."""
    return getattr(model, "defaults", "model")


def _label(file: str, model: Model) -> str:
    label = f"{file} on {engine_of(model.backend)} {model.engine_version}"
    return f"{label}, engine defaults" if settings_of(model) == "engine" else label
