"""Runs of two sides with some of their differences equalized, each made once.

Runs that are wanted together are shared among forks of this process. Threads are no faster, since
the loop of a run is Python's: six runs took 1.1 times as long on two.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal

import numpy as np

from ...backends import on_default
from ...engines import raw_engine_of
from ...engines.records import KnownChange
from ...errors import DivergedError, EngineError, ModelError, UnsupportedError
from ...installed import DEFAULT
from ...interface import Model
from ...measures import Deviation
from ...processes.parallel import forks_for, in_forks
from ..compare import perturbed
from ..compare.known_changes import changes_between
from ..compare.matching import Matched
from ..compare.perturbed import Uncertainty, perturbed_run
from ..recordings import Rerun, Trace
from .deadline import Deadline
from .gap import Curves, FirstTouch, Measure, Ruler, first_touch
from .request import WhyRequest
from .setup import NONE, RunKey, Setup

_LOST = "its process ended before it was done, twice"
_AS_THEY_COME = (RunKey(0), RunKey(1))


@dataclass(frozen=True, eq=False)
class Trial:
    """What became of a run.

    Attributes:
        curves: The run by the ruler; None if it could not be made, or did not reach the end.
        reason: Why not.
        was_begun: Whether the run was begun.
        time: How far it came [s]; None if it was not begun, or its process ended.
    """

    curves: Curves | None
    reason: str
    was_begun: bool = True
    time: float | None = None


@dataclass(frozen=True)
class RunFailure:
    """A run that could not be made, or did not reach the end.

    Attributes:
        side: Of which side.
        time: How far it came [s]; None if it was not begun, or its process ended.
        reason: Why it ended there, in words.
    """

    side: Literal["left", "right"]
    time: float | None
    reason: str


class Trials:
    """Two sides, and what becomes of the gap between them.

    Attributes:
        setup: How each side is run.
        traces: Both runs as they come, with what the engines derive.
        ruler: What all runs are measured by.
        ended: Why the last run that did not reach the end did not.
        ran: Called after each run.
    """

    def __init__(self, request: WhyRequest, matched: Matched, deadline: Deadline) -> None:
        """Run both sides as they come.

        Args:
            request: The question; its scenario is as it is on the left.
            matched: What of the left is what of the right.
            deadline: When runs are to end.

        Raises:
            TimeIsUp: No time is left.
        """
        self.setup = Setup(request, matched)
        self.ran: Callable[[], None] = lambda: None
        self._jobs, self._deadline = request.jobs, deadline
        traces: list[Trace] = []
        began = time.perf_counter()
        for run in _AS_THEY_COME:
            rerun = self.setup.rerun(run, self.setup.models[run.side])
            traces.append(rerun.record(progress=deadline.check))
        # What is derived is read from a second run: so four were made.
        self._seconds_of_run = (time.perf_counter() - began) / 4
        self.traces: tuple[Trace, Trace] = traces[0], traces[1]
        self.ruler = Ruler(matched, traces[0], traces[1], request.quantity)
        self.ended, self._repeated = "", 0
        self._trials: dict[RunKey, Trial] = {}
        self._perturbed: dict[tuple[int, int], Curves | None] = {}  # by side and number
        for run, trace in zip(_AS_THEY_COME, traces, strict=True):
            self._trials[run] = self._measured(run.side, self.setup.models[run.side], trace)
            self.ended = self.ended or trace.header.ended

    @property
    def count(self) -> int:
        """Return the number of runs, without those of the chaos floor."""
        return self._repeated + sum(trial.was_begun for trial in self._trials.values())

    @cached_property
    def known_changes(self) -> tuple[KnownChange, ...]:
        """Return the known changes between the releases of both sides that concern them."""
        return changes_between(self.setup.models, self.traces)

    def touch(self, quantity: str) -> FirstTouch | None:
        """Find the first contact of either side as they come.

        It is None where nothing touches, or no engine tells of it.

        Args:
            quantity: What the gap until then is measured in.
        """
        left, right = (self._trials[run].curves for run in _AS_THEY_COME)
        if left is None or right is None:
            return None
        gaps = self.ruler.distances(quantity, left, right)
        return first_touch(self.traces, self.ruler.time, gaps)

    def gaps(
        self, equalized: frozenset[str], without: frozenset[str] = NONE, integrator: str = ""
    ) -> dict[str, Deviation]:
        """Return the gap in each quantity; {} if a side did not reach the end.

        Args:
            equalized: Causes that are equalized.
            without: Features that are left out on both sides.
            integrator: Another one, on the sides that have several.
        """
        runs = self.setup.runs_of(equalized, without, integrator)
        left, right = (self._curves(run) for run in runs)
        return self.ruler.gaps(left, right) if left and right else {}

    def gap_between(self, one: RunKey, other: RunKey, quantity: str) -> Deviation | None:
        """Return the gap between any two runs; None if one of them did not reach the end.

        Args:
            one: A run.
            other: Another, of the same side or of the other one.
            quantity: What the gap is measured in.
        """
        first, second = self._curves(one), self._curves(other)
        return self.ruler.gap(quantity, first, second) if first and second else None

    def is_run(self, equalized: frozenset[str]) -> bool:
        """Tell whether both runs with some causes equalized were made already."""
        return all(run in self._trials for run in self.setup.runs_of(equalized))

    def missing(self, sets: Iterable[frozenset[str]]) -> int:
        """Return how many runs are still to be made for some sets of causes."""
        runs = {run for equalized in sets for run in self.setup.runs_of(equalized)}
        return sum(run not in self._trials for run in runs)

    def at_once(self, runs: float) -> int:
        """Return how many of so many runs are made side by side, at most."""
        return self._forks_for(max(1, round(runs)))

    def failure(self, equalized: frozenset[str]) -> RunFailure | None:
        """Return why the gap with some causes equalized is not known, of a set that was run.

        None where both sides reached the end.
        """
        for run in self.setup.runs_of(equalized):
            trial = self._trials[run]
            if trial.curves is None:
                side: Literal["left", "right"] = "right" if run.side else "left"
                return RunFailure(side, trial.time, trial.reason)
        return None

    def extent(self, quantity: str, without: frozenset[str] = NONE) -> float:
        """Return how far the left moves from where it starts, with or without some features."""
        curves = self._curves(RunKey(0, NONE, without))
        if not curves:
            return 0.0
        quantity = self.ruler.of_motion(quantity)
        start = {name: curve[:1] for name, curve in curves.items()}
        return float(self.ruler.distances(quantity, curves, start).max())

    def run_ahead(self, subsets: Iterable[frozenset[str]]) -> None:
        """Make the runs now that `gaps` of some sets of causes will want, several at once.

        Raises:
            TimeIsUp: No time is left; what was run by then is known.
        """
        runs = dict.fromkeys(run for subset in subsets for run in self.setup.runs_of(subset))
        new = [run for run in runs if run not in self._trials]
        jobs = self._forks_for(len(new))
        if jobs > 1:

            def ended(number: int, trial: Trial) -> None:
                self._trials[new[number]] = trial
                self.ran()

            work = [partial(self.trial_of, run) for run in new]
            in_forks(work, jobs, ended, self._seconds_of_run, self._deadline.check)
            for run in new:
                self._trials.setdefault(run, Trial(None, _LOST))

    def _forks_for(self, number: int) -> int:
        """Return how many forks are to share some runs.

        A function that commands may keep something between runs: it has one, unless asked for.
        """
        if self._jobs is None and self.setup.scenario.is_user_function:
            return 1
        models = self.setup.models
        can_fork = all(raw_engine_of(model.backend).survives_fork for model in models)
        return forks_for(number, self._seconds_of_run, self._jobs, can_fork)

    def _curves(self, run: RunKey) -> Curves | None:
        """Return a run; None, with a reason in `ended`, if it did not reach the end."""
        if run not in self._trials:
            self._deadline.check()
            self._trials[run] = self.trial_of(run)
            self.ran()
        trial = self._trials[run]
        if trial.curves is None:
            self.ended = trial.reason or self.ended
        return trial.curves

    def trial_of(self, run: RunKey) -> Trial:
        """Make a run."""
        was_begun = False
        try:
            model = self.setup.model(run)
            was_begun = True
            rerun = self.setup.rerun(run, model)
            trace = rerun.record(derived="nothing", progress=self._deadline.check)
            return self._measured(run.side, model, trace)
        except DivergedError as error:
            return Trial(None, str(error), was_begun, error.time)
        except (EngineError, ModelError, UnsupportedError) as error:
            return Trial(None, str(error), was_begun)

    def _measured(self, side: int, model: Model, trace: Trace) -> Trial:
        curves = self.ruler.curves(trace, self._posed(model), side)
        time = float(trace.time[-1] - trace.time[0])
        return Trial(curves, trace.header.ended or "it left every bound", time=time)

    def _posed(self, model: Model) -> Model:
        """Return a Model of the same bodies by which poses are computed.

        It is one of the engine that is fastest.
        """
        if model.backend == DEFAULT:
            return model
        first = self.setup.models[0]
        base = first if first.backend == DEFAULT else on_default(model)
        return base if model.compiled is None else base.with_compiled(model.compiled)

    def curves_as_they_come(self, side: int) -> Curves | None:
        """Return the run of a side, 0 or 1, as it comes; None if it did not reach the end."""
        return self._trials[_AS_THEY_COME[side]].curves

    def curves_with_finer_steps(self, side: int, times: int) -> Curves | None:
        """Run a side as it comes, but with more engine steps to a command.

        Args:
            side: 0 or 1.
            times: How many times as many steps.

        Returns:
            The run at the moments of the ruler; None if it did not reach the end.

        Raises:
            TimeIsUp: No time is left.
            StateMachineError: The engine does not take the steps.
        """
        model = self.setup.models[side]
        finer = model.replace(substeps=times * model.substeps)
        rerun = self.setup.rerun(_AS_THEY_COME[side], finer)
        trace = rerun.record(derived="nothing", progress=self._deadline.check)
        return self._measured(side, finer, trace).curves

    def repeats(self) -> bool:
        """Tell whether the left moves the same when it is run again.

        Only then a gap can have causes.
        """
        first, again = self._trials[RunKey(0)].curves, self.trial_of(RunKey(0)).curves
        self._repeated = 1
        self.ran()
        if first is None or again is None:
            return False
        return all(np.array_equal(values, again[name]) for name, values in first.items())

    def perturb(self, uncertain: Uncertainty) -> None:
        """Make the perturbed runs of both sides, for the chaos floor.

        Args:
            uncertain: What is not known of the start.

        Raises:
            EngineError: A process ended before its run was done, twice.
            TimeIsUp: No time is left; what was run by then is known.
        """
        models = self.setup.models
        reruns = [self.setup.rerun(run, models[run.side]) for run in _AS_THEY_COME]
        posed = [self._posed(model) for model in models]  # a model is loaded once a side
        numbers = [(side, k) for k in range(perturbed.RUNS) for side in (0, 1)]

        def ended(number: int, curves: tuple[Curves | None]) -> None:
            (self._perturbed[numbers[number]],) = curves
            self.ran()

        work = [
            partial(self.perturbed_curves, side, k, reruns[side], posed[side], uncertain)
            for side, k in numbers
        ]
        jobs = self._forks_for(len(work))
        if jobs > 1:
            in_forks(work, jobs, ended, self._seconds_of_run, self._deadline.check)
        else:
            for number, call in enumerate(work):
                self._deadline.check()
                ended(number, call())
        if len(self._perturbed) < len(numbers):
            raise EngineError(f"a run for the chaos floor could not be made: {_LOST}")

    @property
    def perturbed_runs(self) -> int:
        """Return the number of perturbed runs that a chaos floor takes, of both sides together."""
        return 2 * perturbed.RUNS

    @property
    def draws(self) -> int:
        """Return the number of perturbed runs that were made of each side."""
        sides = [side for side, _ in self._perturbed]
        return min(sides.count(0), sides.count(1))

    def floor(self, measure: Measure) -> dict[str, float]:
        """Return the chaos floor of each quantity, in its unit, from the perturbed runs.

        Args:
            measure: Which figure of a gap; the largest of all perturbed runs of both sides counts.
        """
        floors: list[dict[str, float]] = []
        for side, run in enumerate(_AS_THEY_COME):
            curves = self._trials[run].curves
            assert curves is not None
            draws = [self._perturbed[side, k] for k in range(self.draws)]
            floors.append(self.ruler.floor(curves, draws, measure))
        return {name: max(floors[0][name], floors[1][name]) for name in self.ruler.units}

    def perturbed_curves(
        self, side: int, k: int, rerun: Rerun, posed: Model, uncertain: Uncertainty
    ) -> tuple[Curves | None]:
        """Make one perturbed run; in a tuple, since what comes from a fork is not None."""
        trace = perturbed_run(
            rerun,
            k,
            seed=self.setup.seed,
            uncertain=uncertain,
            derive=False,
            progress=self._deadline.check,
        )
        return (self.ruler.curves(trace, posed, side),)
