"""The search for the causes of a gap, stage by stage: what is known can be had at any time.

The order is that of what a reader wants first. The gap and its chaos floor; each cause alone, and
last, which ranks them; where the rest comes from that no cause explains; and only then the shares,
for which most runs are made.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from ...errors import BadInputError
from ...measures import Deviation
from ..runs.reporter import Reporter
from .causes import Cause
from .deadline import Deadline, TimeIsUp
from .explained_gap import ExplainedGap, explained_gap
from .explanation import EndedBy
from .game import Game, Subset
from .gap import size_of
from .locate import Localisation, Remainder, locate
from .request import WhyRequest
from .shapley import SETS, Attribution
from .split import GapSplit, split_of
from .trials import Trials

_SETS_MOST = 4096  # of all sets, where a time limit says how many can be run
_HALF = 0.5  # of the time that is left: if all sets take less, all are run
LONG_SEARCH = 5.0  # [s] that the shares take: for less nobody is told the ranking before


class Search:
    """A search for the causes of a gap, as far as it has come.

    Attributes:
        request: The question.
        trials: The runs.
        deadline: When it is to end.
        first: The gap in each quantity, as the sides come.
        causes: What differs.
        gap: The gap that is explained; None before it is known.
        attribution: The parts of the causes; None before there are any.
        located: Where the rest was found, so far.
        split: The gap divided by where it arises; None before that.
        ended_by: What ended it before it was complete; "" if nothing did.
    """

    def __init__(
        self,
        request: WhyRequest,
        trials: Trials,
        deadline: Deadline,
        first: Mapping[str, Deviation],
        causes: Sequence[Cause],
        quantity: str | None,
        reporter: Reporter,
    ) -> None:
        """Begin with what is known of the sides as they come.

        Args:
            request: The question.
            trials: The runs.
            deadline: When it is to end.
            first: The gap in each quantity, as the sides come.
            causes: What differs.
            quantity: The one that is asked for; None if none is.
            reporter: Told how it gets on.
        """
        self.request, self.trials, self.deadline = request, trials, deadline
        self.first, self.causes = first, tuple(causes)
        self.gap: ExplainedGap | None = None
        self.attribution: Attribution | None = None
        self.located: list[Localisation] = []
        self.split: GapSplit | None = None
        self.ended_by: EndedBy = ""
        self._quantity, self._reporter = quantity, reporter
        self._runs_of_a_set = self._seconds_of_a_set = 0.0  # as measured

    def run(self, ranked: Callable[[], None]) -> None:
        """Search, until all is known, or the time is up.

        Args:
            ranked: Called once each cause was equalized alone and last, if the shares take long.

        Raises:
            BadInputError: The commands do not repeat.
            KeyboardInterrupt: It was interrupted; what is known by then stays.
        """
        try:
            self._check_that_it_repeats()
            self._find_gap()
            self._rank()
            self._locate()
            self._split()
            self._divide(ranked)
        except TimeIsUp:
            self.ended_by = "time limit"
            self._take_what_is_known()
        except KeyboardInterrupt:
            self.ended_by = "interrupt"
            self._take_what_is_known()
            raise

    @property
    def equalizable(self) -> list[str]:
        """Return the names of the causes that can be equalized."""
        return [cause.name for cause in self.causes if not cause.refused]

    @property
    def equalized_gap(self) -> float | None:
        """Return the gap with all causes equalized that can be; None if that is not known."""
        if self.gap is None or self.attribution is None or self.attribution.core is None:
            return None
        return self._value(self.attribution.core)

    def _check_that_it_repeats(self) -> None:
        """Check that a function commands the same twice.

        Raises:
            BadInputError: It does not.
        """
        scenario = self.request.scenario
        if scenario.is_user_function and not self.trials.repeats():
            raise BadInputError(
                f"two runs of {self.request.side_labels[0]} from the same start differ: "
                f"{scenario.name} does not command the same twice, and so no gap has a cause; give "
                "what it draws a seed, and let it keep nothing from one run to the next"
            )

    def _find_gap(self) -> None:
        """Make the runs of the chaos floor, and choose what is explained."""
        uncertain = self.request.uncertain
        if uncertain is not None:
            with self._stage("chaos floor", self.trials.perturbed_runs):
                self.trials.perturb(uncertain)
        self._choose_gap()

    def _choose_gap(self) -> None:
        self.gap = explained_gap(self.trials, self.request, self._quantity, self.first)
        if not self.gap.is_divided:
            self.causes = tuple(cause for cause in self.causes if not cause.only_read)
        equalizable = self.equalizable if self.gap.is_divided else []
        game = Game(
            self._value, self.gap.size or 1.0, self.trials.run_ahead, self.trials.setup.needs
        )
        self.attribution = Attribution(equalizable, game, self.request.seed)

    def _value(self, equalized: Subset) -> float | None:
        """Return the gap with some causes equalized; None where that cannot be run."""
        assert self.gap is not None
        gaps = self.trials.gaps(equalized)
        return size_of(gaps[self.gap.quantity], self.gap.measure) if gaps else None

    def _rank(self) -> None:
        """Equalize each cause alone, and last."""
        assert self.attribution is not None
        sets = self.attribution.first_sets()
        began, runs = self.deadline.elapsed, self.trials.missing(sets)
        with self._stage("each difference alone and last", runs):
            self.attribution.rank()
        if sets:
            self._seconds_of_a_set = (self.deadline.elapsed - began) / len(sets)
            self._runs_of_a_set = runs / len(sets)

    def _locate(self) -> None:
        """Look where what no cause explains comes from."""
        assert self.gap is not None
        assert self.attribution is not None
        assert self.attribution.core is not None
        equalized_gap = self.equalized_gap
        if equalized_gap is None or not self.gap.is_divided:
            return
        remainder = Remainder(
            trials=self.trials,
            equalized=self.attribution.core,
            quantity=self.gap.quantity,
            measure=self.gap.measure,
            gap=self.gap.size,
            left=equalized_gap,
            bound=max(self.gap.negligible, self.gap.floor),
        )
        with self._reporter.stage("why: where the rest comes from"):
            for part in locate(remainder):
                self.located.append(part)

    def _split(self) -> None:
        """Divide the gap by where it arises: import, joint dynamics, contact."""
        assert self.gap is not None
        if self.gap.is_divided:
            with self._reporter.stage("why: import, joint dynamics, contact"):
                self.split = split_of(self.trials, self.gap, self.causes)

    def _divide(self, ranked: Callable[[], None]) -> None:
        """Divide the gap among the causes.

        Args:
            ranked: Called before, if it takes long.
        """
        attribution = self.attribution
        assert attribution is not None
        is_limited = self.deadline.seconds is not None
        method = attribution.choose(self._sets_at_most())
        if method == "all sets":
            sets = attribution.count_of_all_sets()
            self._tell_if_long(sets, ranked)
            with self._stage("shares", sets * self._runs_of_a_set):
                attribution.evaluate_all_sets()
        elif method == "drawn orders":
            most = None if is_limited else SETS
            sets = attribution.count_of_first_orders()
            self._tell_if_long(sets, ranked)
            with self._stage("shares", sets * self._runs_of_a_set):
                attribution.draw_first_orders()
            sets = attribution.count_of_more_orders(most)
            with self._stage("shares, more precisely", sets * self._runs_of_a_set):
                attribution.draw_more_orders(most)

    def _sets_at_most(self) -> int:
        """Return how many sets may be run for all of them to be."""
        if self.deadline.seconds is None or not self._seconds_of_a_set:
            return SETS
        possible = int(_HALF * max(0.0, self.deadline.left) / self._seconds_of_a_set)
        return min(max(SETS, possible), _SETS_MOST)

    def _tell_if_long(self, sets: int, ranked: Callable[[], None]) -> None:
        """Say that the causes are ranked, if what follows takes long."""
        if min(sets * self._seconds_of_a_set, self.deadline.left) > LONG_SEARCH:
            ranked()

    def _take_what_is_known(self) -> None:
        """Take what runs say that were made; make none."""
        self.trials.ran = _nothing
        if self.gap is None:
            self._choose_gap()
        assert self.attribution is not None
        self.attribution.game.collect(self.trials.is_run)

    @contextmanager
    def _stage(self, what: str, runs: float) -> Iterator[None]:
        """Report a stage that makes about so many runs, or ends with the time.

        Args:
            what: What is done.
            runs: How many runs it makes.
        """
        with self._reporter.stage(f"why: {what}", self.trials.at_once(runs)) as progress:
            run_count, began, left = 0, self.deadline.elapsed, self.deadline.left

            def ran() -> None:
                nonlocal run_count
                run_count += 1
                of_time = (self.deadline.elapsed - began) / left
                progress(min(1.0, max(run_count / max(runs, 1.0), of_time)))

            self.trials.ran = ran
            try:
                yield
            finally:
                self.trials.ran = _nothing


def _nothing() -> None:
    """Do nothing."""
