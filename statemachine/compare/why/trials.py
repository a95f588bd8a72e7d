"""Runs of two sides with some of their differences brought to the same, each made once.

Runs that are wanted together are shared among forks of this process. Threads are no faster, since
the loop of a run is Python's: six runs took 1.1 times as long on two.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from ...backends import load
from ...engines import room
from ...engines.records import ModelDifference
from ...errors import DivergedError, EngineError, ModelError, UnsupportedError
from ...installed import DEFAULT
from ...interface import Data, Model
from ...measures import Deviation
from ...page import Figures
from ...processes import checked_jobs
from ...processes.parallel import forks_for, in_forks
from ...runs import Rerun, SideStart, Trace, beginning_with, commands_of, start_of
from ...runs.scenarios import Controller, Scenario
from .. import perturbed
from ..alike import commands_alike, controller_for_right, translated
from ..matching import Matched
from ..perturbed import Uncertainty, perturbed_run
from .causes import (
    COMMANDS,
    EXTRA_ACTUATOR,
    ORDER,
    ORDER_OF_MOCAP,
    ORDER_OF_QPOS,
    START,
    Cause,
    built,
    causes,
    differences_of,
    of_the_run,
    orders_of,
)
from .gap import Curves, Ruler, first_touch
from .order import commands_by_number, in_order_of_left, seen_in_order_of_left, slots_of_ctrl
from .settings import ENGINE_CAN_BE_WITHOUT, NEEDS, TITLES, OwnSettings, leave_out

Measure = Literal["worst", "end", "rms"]
# What the right is given of the left by `Model.replace`, by the name of its cause: the timestep,
# which a compiled model has no substeps of, and all that is known where there is none.
BY_OPTION = {
    "timestep": {"timestep": "timestep", "substeps": "substeps"},
    "gravity": {"gravity": "gravity"},
    "armature": {"armature": "dof_armature"},
    "damping": {"damping": "dof_damping"},
    "dry friction": {"frictionloss": "dof_frictionloss"},
}
_LOST = "its process ended before it was done, twice"
_NONE = frozenset[str]()


class _Run(NamedTuple):
    """What makes one run.

    Attributes:
        side: 0 or 1.
        brought: Names of the causes that are brought to the same, as far as they change it.
        without: Names of the features that are left out.
        integrator: Another one than the file's; "" for that.
    """

    side: int
    brought: frozenset[str]
    without: frozenset[str] = _NONE
    integrator: str = ""


class Trials:
    """Two sides, and what becomes of the gap between them.

    Args:
        models: Both as loaded; the second is brought to the first.
        matched: What of one is what of the other.
        scenario: What is run, as it is on the first.
        recordings: Of the left, and of the right or none: whose start and commands are taken.
        seconds: Simulated time.
        seed: Of what the scenario draws.
        ran: Called after each run.
        jobs: How many runs are made at once; None for one a processor where that pays,
            and for one where a function of the user's commands.
        quantity: What was asked for; see `Ruler`.

    Attributes:
        traces: Both runs as they come, with what the engines derive.
        ruler: What all runs are measured by.
        ended: Why the last run that did not stand did not.

    Raises:
        BadInputError: `jobs` is less than 1.
    """

    def __init__(
        self,
        models: tuple[Model, Model],
        matched: Matched,
        scenario: Scenario,
        recordings: Sequence[Trace],
        seconds: float,
        seed: int,
        ran: Callable[[], None],
        jobs: int | None = None,
        quantity: str | None = None,
    ) -> None:
        checked_jobs(jobs)  # refuses what is not a number of them
        options = dict(scenario.options)
        self._own = _own_settings(models, options)
        left, right = (model.replace(**options) if options else model for model in models)
        self._models, self._matched, self._jobs = (left, right), matched, jobs
        self.seconds, self.seed, self._ran = seconds, seed, ran
        self._scenario = scenario
        key, left_start = scenario.keyframe, start_of(left, scenario.keyframe)
        # The second, if it has no such keyframe, starts where the first does.
        known = key is None or key in [frame.name for frame in right.keyframes]
        self._keyframes = key, key if known else None
        right_start = start_of(right, self._keyframes[1])
        self._starts = left_start, right_start if known else matched.start(left_start, right_start)
        self._recordings = tuple(recordings)
        if recordings:
            first = recordings[0]
            self._recordings = first, (*recordings, translated(first, matched, right_start))[1]
            left_start, right_start = (
                SideStart(t.qpos[0], t.qvel[0], t.ctrl[0]) for t in self._recordings
            )
            self._starts = left_start, right_start
        self.ended, self._repeated = "", 0
        self._runs: dict[_Run, Figures] = {}
        self._by_name: dict[str, Cause] = {}
        self._replaced = _NONE  # causes that are brought over by `Model.replace`
        traces, began = [], time.perf_counter()
        for side in (0, 1):
            traces.append(self._rerun(_Run(side, _NONE), self._models[side]).record())
            ran()
        # What is derived is read from a second run: so four were made.
        self._took = (time.perf_counter() - began) / 4
        self.traces: tuple[Trace, Trace] = traces[0], traces[1]
        self.ruler = Ruler(matched, traces[0], traces[1], quantity)
        for side, trace in enumerate(traces):
            self._runs[_Run(side, _NONE)] = self._measured(side, self._models[side], trace)
            self.ended = self.ended or trace.header.ended

    @property
    def count(self) -> int:
        """How many runs were made, but for those of the floor."""
        return self._repeated + sum(outcome.ran for outcome in self._runs.values())

    def causes(self, finer: bool) -> tuple[Cause, ...]:
        """All that can be one: of the files, of an engine's own settings, of the run.

        Args:
            finer: Differences of files by their single entries, each by itself.
        """
        left, right = self._models
        own = any(self._own)
        rows: list[ModelDifference] = []
        if left.compiled is not None and right.compiled is not None:
            files = differences_of(
                left, right, self._matched, not own, finer, readable=self._scenario.own
            )
            # An integrator that one side does not read is chosen on the other, see `locate`.
            apart = ("timestep", "integrator" * (len(self.selects) == 1))
            rows += [row for row in files if row.subject not in apart]
            rows += of_the_run(self._matched, self._starts, self._keyframes[1])
        if self._recordings:
            left_recording, right_recording = self._recordings
            given = translated(left_recording, self._matched, self._starts[1])
            rows += (
                []
                if commands_alike(given, right_recording)
                else [ModelDifference(COMMANDS, "run", "", ())]
            )
        for side, settings in enumerate(self._own):
            rows += settings.differences(side) if settings else []
        replaced = [] if own else list(self._by_option())
        self._replaced = frozenset(row.subject for row in replaced)
        rows += replaced
        if self._scenario.own and not self._recordings:
            rows += orders_of(self._matched)
        listed = causes(rows, finer)
        self._by_name = {cause.name: cause for cause in listed}
        return listed

    def _by_option(self) -> Iterator[ModelDifference]:
        """What differs and is brought over by `Model.replace`."""
        left, right = self._models
        names = (
            ["timestep"] if left.compiled is not None and right.compiled is not None else BY_OPTION
        )
        for name in names:
            values = tuple(
                (option, getattr(left, fact), getattr(right, fact))
                for option, fact in BY_OPTION[name].items()
                if not np.array_equal(getattr(left, fact), getattr(right, fact))
            )
            if values and set(BY_OPTION[name]) <= set(right.capabilities.options):
                yield ModelDifference(name, "option", "", values, "s" if name == "timestep" else "")

    def touch(self, quantity: str) -> Figures | None:
        """The first contact of either side; None where nothing touches, or it is not told."""
        left, right = (self._runs[_Run(side, _NONE)].curves for side in (0, 1))
        gap = self.ruler.distances(quantity, left, right)
        return first_touch(self.traces, self.ruler.time, gap)

    @property
    def needs(self) -> dict[str, str]:
        """Of a cause the one that has to be brought to the same before it."""
        known = self._by_name.keys() if any(self._own) else set[str]()
        return {a: b for a, b in NEEDS.items() if {a, b} <= known}

    def gaps(
        self, brought: frozenset[str], without: frozenset[str] = _NONE, integrator: str = ""
    ) -> dict[str, Deviation]:
        """The gap in each quantity; {} if a side did not stand.

        Args:
            brought: Causes that are brought to the same.
            without: Features that are left out on both sides.
            integrator: Another one, on the side that has several.
        """
        left, right = (self._run(run) for run in self._pair(brought, without, integrator))
        return self.ruler.gaps(left, right) if left and right else {}

    def _pair(
        self, brought: frozenset[str], without: frozenset[str] = _NONE, integrator: str = ""
    ) -> list[_Run]:
        return [
            _Run(k, self._acting(k, brought), without, integrator if k in self.selects else "")
            for k in (0, 1)
        ]

    @property
    def selects(self) -> tuple[int, ...]:
        """The sides, 0 and 1, that have integrators to choose from."""
        return tuple(k for k in (0, 1) if self._models[k].capabilities.integrators)

    @property
    def integrators(self) -> list[str]:
        """Those that all sides with several have."""
        choices = [set(self._models[side].capabilities.integrators) for side in self.selects]
        return sorted(set[str].intersection(*choices)) if choices else []

    def integrator_of(self, side: int) -> str:
        """What a side integrates with as it comes."""
        model = self._models[side]
        chosen = side in self.selects and model.compiled is not None
        return room(DEFAULT).integrator(model.compiled) if chosen else "its own"

    def can_be_without(self, feature: Figures) -> bool:
        """Whether a feature can be left out on both sides, and is not what the experiment sets."""
        own = [
            feature.name in ENGINE_CAN_BE_WITHOUT
            if own
            else feature.option in model.capabilities.options
            for own, model in zip(self._own, self._models, strict=True)
        ]
        return all(own) and feature.option not in self._scenario.options

    def extent(self, quantity: str, without: frozenset[str] = _NONE) -> float:
        """How far the left moves from where it starts, as it comes or without some features."""
        curves = self._run(_Run(0, _NONE, without))
        if not curves:
            return 0.0
        start = {name: curve[:1] for name, curve in curves.items()}
        return float(self.ruler.distances(quantity, curves, start).max())

    def ahead(self, wanted: Iterable[frozenset[str]]) -> None:
        """Make the runs now that `gaps` of some sets of causes will want, several at once."""
        runs = dict.fromkeys(run for brought in wanted for run in self._pair(brought))
        new = [run for run in runs if run not in self._runs]
        jobs = self._forks_for(len(new))
        if jobs > 1:
            work = [partial(self._outcome, run) for run in new]
            for run, outcome in zip(new, in_forks(work, jobs, self._ran, self._took), strict=True):
                self._runs[run] = outcome or Figures(curves=None, reason=_LOST, ran=True)

    def _forks_for(self, number: int) -> int:
        """How many forks are to share some runs."""
        alone = self._jobs is None and self._scenario.own  # it may keep something between runs
        return 1 if alone else forks_for(number, self._took, self._jobs)

    def _run(self, run: _Run) -> Curves | None:
        """A run; None, with a reason in `ended`, if it cannot be made or did not stand."""
        if run not in self._runs:
            self._runs[run] = self._outcome(run)
            self._ran()
        outcome = self._runs[run]
        if outcome.curves is None:
            self.ended = outcome.reason or self.ended
        return outcome.curves

    def _outcome(self, run: _Run) -> Figures:
        """What became of a run.

        Returns:
            curves: None if it could not be made or did not stand; reason: why not.
            ran: Whether it was begun.
        """
        ran = False
        try:
            model = self._model(run)
            ran = True
            return self._measured(run.side, model, self._rerun(run, model).record(derive=False))
        except (DivergedError, EngineError, ModelError, UnsupportedError) as error:
            return Figures(curves=None, reason=str(error), ran=ran)

    def _model(self, run: _Run) -> Model:
        """The Model of a run."""
        own, model, left = self._own[run.side], self._models[run.side], self._models[0]
        edits = tuple(
            edit for name in sorted(run.brought) for edit in self._by_name[name].edits(run.side)
        )
        model = built(model, edits)
        if run.side and not own:
            replaced = [BY_OPTION[name] for name in sorted(run.brought & self._replaced)]
            options = {o: getattr(left, fact) for facts in replaced for o, fact in facts.items()}
            model = model.replace(**options) if options else model
        if run.integrator:
            model = model.replace(integrator=run.integrator)
        names = frozenset(
            setting
            for setting, title in TITLES.items()
            if title in run.brought and self._by_name[title].kind == "engine"
        )
        if own and (names or run.without):
            return own.build(model, built(own.emulated, edits), names, run.without)
        return leave_out(model, run.without)

    def _acting(self, side: int, brought: frozenset[str]) -> frozenset[str]:
        """The causes that change this side."""
        return frozenset(
            name
            for name in brought
            if self._by_name[name].edits(side)
            or (self._own[side] and self._by_name[name].kind == "engine")
            or (side == 1 and (name in self._replaced or self._by_name[name].kind == "run"))
            or (side == 1 and self._is_in_ctrl(name))
        )

    def _is_in_ctrl(self, name: str) -> bool:
        """Whether a cause moves the numbers of ctrl that a function of the user's writes."""
        rows = self._by_name[name].differences
        return self._scenario.own and any(row.subject == EXTRA_ACTUATOR for row in rows)

    def _rerun(self, run: _Run, model: Model) -> Rerun:
        start, brought = self._starts[run.side], run.brought
        qpos, qvel = start.qpos, start.qvel
        if START in brought:
            first = self._starts[0]
            qpos = self._matched.moved("qpos", first.qpos, qpos)
            qvel = self._matched.moved("qvel", first.qvel, qvel)
        return Rerun(
            model,
            lambda model: self._controller(run.side, model, brought),
            self.seconds,
            keyframe=self._keyframes[run.side],
            qpos=qpos,
            qvel=qvel,
        )

    def _controller(self, side: int, model: Model, brought: frozenset[str]) -> Controller:
        """A function of the user's answers each side; what an experiment commands is the left's.

        It is that of the left as it comes, whatever is edited.
        """
        own = self._scenario.own
        if own and side and not self._recordings:
            return self._own_controller(model, brought)
        if self._recordings and side and COMMANDS not in brought:
            return commands_of(self._recordings[1])
        if self._recordings:  # in the order of the left's actuators
            controller = commands_of(self._recordings[0])
        else:
            controller = self._scenario.controller(model if own else self._models[0], self.seed)
        if side == 0:
            return controller
        start = self._starts[1].ctrl
        controller = controller_for_right(controller, self._matched, start)
        return self._from_start(controller)

    def _own_controller(self, model: Model, brought: frozenset[str]) -> Controller:
        """A function of the user's on the right, as far as that has the order of the left.

        An actuator that only one side has is put back, or taken out, in its place of ctrl: the
        numbers of the others are then those of the left.
        """
        matched, starts = self._matched, (self._starts[0].ctrl, self._starts[1].ctrl)
        completed = any(
            row.subject == EXTRA_ACTUATOR
            for name in brought
            for row in self._by_name[name].differences
        )
        ordered = ORDER in brought
        reads_in_order = ORDER_OF_QPOS in brought or not matched.joints_elsewhere
        mocap_in_order = ORDER_OF_MOCAP in brought
        if not (ordered or completed or mocap_in_order or ORDER_OF_QPOS in brought):
            return self._from_start(self._scenario.controller(model, self.seed))
        slots = slots_of_ctrl(matched, ordered=ordered, completed=completed)
        if reads_in_order and model.compiled is not None:
            left = self._model(_Run(0, self._acting(0, brought)))
            controller = seen_in_order_of_left(
                lambda shown: self._scenario.controller(shown, self.seed),
                in_order_of_left(left, model, matched),
                matched,
                slots,
                starts,
                mocap_in_order=mocap_in_order,
            )
            return self._from_start(controller)
        as_it_is = self._scenario.controller(model, self.seed)

        def by_number(time: float, data: Data) -> Any:
            ctrl = as_it_is(time, data)
            if ctrl is None:
                return None
            return commands_by_number(np.asarray(ctrl, np.float64), slots, starts[1])

        return self._from_start(by_number)

    def _from_start(self, controller: Controller) -> Controller:
        """A controller of the right.

        Without a keyframe of its own it starts with the commands of the left, too.
        """
        if self._keyframes[0] == self._keyframes[1]:
            return controller
        start = self._starts[1].ctrl
        return beginning_with(lambda _: start, controller)

    def repeats(self) -> bool:
        """Whether the left moves the same when it is run again, so that a gap can have causes."""
        run = _Run(0, _NONE)
        again, first = self._outcome(run).curves, self._runs[run].curves
        self._repeated = 1
        self._ran()
        return again is not None and all(
            np.array_equal(values, again[name]) for name, values in first.items()
        )

    def floor(self, uncertain: Uncertainty, measure: Measure) -> dict[str, float]:
        """Compute the chaos floor of each quantity, in its unit.

        Args:
            uncertain: What is not known of the start.
            measure: Which figure of a gap; the largest of all perturbed runs of both sides counts.

        Raises:
            EngineError: A process ended before its run was done, twice.
        """
        draws = perturbed.RUNS
        reruns = [self._rerun(_Run(side, _NONE), self._models[side]) for side in (0, 1)]
        posed = [self._posed(model) for model in self._models]  # a model is loaded once a side

        def run(side: int, k: int) -> tuple[Curves | None]:
            trace = perturbed_run(
                reruns[side], k, seed=self.seed, uncertain=uncertain, derive=False
            )
            return (self.ruler.curves(trace, posed[side], side),)

        def called(call: Callable[[], tuple[Curves | None]]) -> tuple[Curves | None]:
            outcome = call()
            self._ran()
            return outcome

        runs = [partial(run, side, k) for side in (0, 1) for k in range(draws)]
        jobs = self._forks_for(len(runs))
        if jobs > 1:
            outcomes = in_forks(runs, jobs, self._ran, self._took)
        else:
            outcomes = [called(call) for call in runs]
        curves = [outcome[0] for outcome in outcomes if outcome is not None]
        if len(curves) < len(runs):
            raise EngineError(f"a run for the chaos floor could not be made: {_LOST}")
        floors = [
            self.ruler.floor(
                self._runs[_Run(side, _NONE)].curves, curves[side * draws :][:draws], measure
            )
            for side in (0, 1)
        ]
        return {name: max(floor[name] for floor in floors) for name in self.ruler.units}

    def _measured(self, side: int, model: Model, trace: Trace) -> Figures:
        curves = self.ruler.curves(trace, self._posed(model), side)
        return Figures(curves=curves, reason=trace.header.ended or "it left every bound", ran=True)

    def _posed(self, model: Model) -> Model:
        """A Model of the same bodies by which poses are computed, on the engine that is fastest."""
        if model.backend == DEFAULT:
            return model
        first = self._models[0]
        base = first if first.backend == DEFAULT else load(model.path)
        return base if model.compiled is None else base.with_compiled(model.compiled)


def _own_settings(models: tuple[Model, Model], options: dict[str, Any]) -> list[OwnSettings | None]:
    """Of each side that comes with its engine's settings, where the other does not."""
    dials = [room(model.backend).dials(model, options) for model in models]
    return [
        OwnSettings(own, other.replace(**options), options.get("actuation", True))
        if own and not all(dials)
        else None
        for own, other in zip(dials, reversed(models), strict=True)
    ]
