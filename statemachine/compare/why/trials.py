"""Runs of two sides with some of their differences brought to the same, each made once.

Runs that are wanted together are shared among forks of this process. Threads are no faster, since
the loop of a run is Python's: six runs took 1.1 times as long on two.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from ...backends import load
from ...engines.records import Edit, ModelDifference
from ...errors import DivergedError, EngineError, ModelError, UnsupportedError
from ...installed import DEFAULT
from ...interface import Array, Model
from ...measures import Deviation
from ...processes import checked_jobs
from ...runs import Trace
from ...runs.scenarios import Controller, Scenario
from ..alike import beginning_with, retold
from ..forks import forks_for, in_forks
from ..matching import Matched, start_of
from ..perturbed import RUNS, Rerun, Uncertainty, perturbed_run
from .causes import Cause, built
from .gap import Curves, Ruler

Measure = Literal["worst", "end", "rms"]
_Run = tuple[int, frozenset[str]]  # a side, and the causes that change it
START, ORDER = "start", "order of ctrl"
_SAME = 1e-12
_LOST = "its process ended before it was done, twice"


@dataclass(frozen=True, eq=False)
class _Outcome:
    """What became of a run.

    Attributes:
        curves: None if it could not be made or did not stand.
        reason: Why not.
        ran: Whether it was begun.
    """

    curves: Curves | None
    reason: str = ""
    ran: bool = True


class Trials:
    """Two sides, and what becomes of the gap between them.

    Args:
        one: The Model that the other is brought to; with the options of the scenario.
        two: The other.
        matched: What of one is what of the other.
        scenario: What is run, as it is on `one`.
        seconds: Simulated time.
        seed: Of what the scenario draws.
        ran: Called after each run.
        jobs: How many runs are made at once; None for one a processor where that pays,
            and for one where a function of the user's commands.

    Raises:
        BadInputError: `jobs` is less than 1.
    """

    def __init__(
        self,
        one: Model,
        two: Model,
        matched: Matched,
        scenario: Scenario,
        seconds: float,
        seed: int,
        ran: Callable[[], None],
        jobs: int | None = None,
    ) -> None:
        checked_jobs(jobs)  # refuses what is no number of them
        self._models, self._matched, self._jobs = (one, two), matched, jobs
        self.seconds, self.seed, self._ran = seconds, seed, ran
        self._scenario = scenario
        key, left = scenario.keyframe, start_of(one, scenario.keyframe)
        # The second, if it has no such keyframe, starts where the first does.
        known = key is None or key in [frame.name for frame in two.keyframes]
        self._keyframes = key, key if known else None
        right = start_of(two, self._keyframes[1])
        self._starts = left, right if known else matched.start(left, right)
        self.count, self.ended = 2, ""
        self._runs: dict[_Run, _Outcome] = {}  # those that were asked for
        self._ahead: dict[_Run, _Outcome] = {}  # those that will be
        self._by_name: dict[str, Cause] = {}
        began = time.perf_counter()
        traces = [self._trace(k, self._models[k], frozenset()) for k in (0, 1)]
        self.traces: tuple[Trace, Trace] = traces[0], traces[1]
        self.ruler = Ruler(one, traces[0], traces[1], matched)
        for k, trace in enumerate(traces):
            curves = self._curves(k, self._models[k], trace)
            self._runs[k, frozenset()] = _Outcome(curves)
            self.ended = self.ended or trace.header.ended
            ran()
        self._took = (time.perf_counter() - began) / 2

    def of_the_run(self) -> tuple[ModelDifference, ...]:
        """What of the run itself differs: where it starts, and what is commanded."""
        found, (one, two) = [], self._starts
        wanted = self._matched.qpos(one.qpos, two.qpos)
        speeds = self._matched.qvel(one.qvel, two.qvel)
        off = max(_apart(wanted, two.qpos), _apart(speeds, two.qvel))
        if off > _SAME:
            values = (("farthest coordinate", 0.0, off),)
            found.append(ModelDifference(START, "run", "", values))
        found += self._keyframe()
        if self._scenario.own and self._matched.reordered:
            values = (("order", *self._orders()),)
            found.append(ModelDifference(ORDER, "run", "", values))
        return tuple(found)

    def _keyframe(self) -> Iterator[ModelDifference]:
        """What else the keyframe sets: the time, ctrl, act, the mocap bodies."""
        name, (one, two) = self._keyframes[0], (model.compiled for model in self._models)
        if name is None or self._keyframes[1] is None:
            return
        keys = [[frame.name for frame in model.keyframes].index(name) for model in self._models]
        times = [float(raw.key_time[key]) for raw, key in zip((one, two), keys, strict=True)]
        if times[0] != times[1]:
            values = (("time", times[0], times[1]),)
            edits: tuple[Edit, ...] = (("key_time", (keys[1],), times[0]),)
            yield ModelDifference("time of the start", "run", "", values, "s", edits)
        owner = [np.repeat(np.arange(raw.nactuator), raw.actuator_ctrlnum) for raw in (one, two)]
        commands, states = [], []
        for a, b in self._matched.actuators:
            commands.append((a, b))
            here, there = int(owner[0][a]), int(owner[1][b])
            number = int(one.actuator_actnum[here])
            if number == two.actuator_actnum[there]:
                start = int(one.actuator_actadr[here]), int(two.actuator_actadr[there])
                states += [(start[0] + k, start[1] + k) for k in range(number)]
        led = [
            (int(one.body_mocapid[pair.one]), int(two.body_mocapid[pair.two]))
            for pair in self._matched.solids
            if one.body_mocapid[pair.one] >= 0
        ]
        for subject, field, pairs in (
            ("ctrl", "key_ctrl", commands),
            ("activations", "key_act", sorted(set(states))),
            (
                "mocap places",
                "key_mpos",
                [(3 * a + k, 3 * b + k) for a, b in led for k in range(3)],
            ),
            (
                "mocap turns",
                "key_mquat",
                [(4 * a + k, 4 * b + k) for a, b in led for k in range(4)],
            ),
        ):
            ours, theirs = getattr(one, field)[keys[0]], getattr(two, field)[keys[1]]
            off = [(a, b) for a, b in pairs if abs(ours[a] - theirs[b]) > _SAME]
            if off:
                values = (
                    (subject, tuple(ours[a] for a, _ in off), tuple(theirs[b] for _, b in off)),
                )
                edits = tuple((field, (keys[1], b), float(ours[a])) for a, b in off)
                yield ModelDifference(f"{subject} of the start", "run", "", values, "", edits)

    def notes(self) -> tuple[str, ...]:
        """What a function of the user's may stumble over."""
        places = [int(self._models[1].jnt_qposadr[b]) for _, b in self._matched.joints]
        if not self._scenario.own or places == sorted(places):
            return ()
        return (
            "the right has its joints in another order: a function that reads qpos or qvel by "
            "number meets others there (model.joint_id, jnt_qposadr and jnt_dofadr tell which)",
        )

    def _orders(self) -> tuple[str, str]:
        """The actuators that stand elsewhere on the right, in the order of either side."""
        pairs, names = self._matched.actuators, self._models[0].actuator_names
        left, right = (
            [names[a] or f"ctrl[{a}]" for a, _ in sorted(pairs, key=lambda pair: pair[k])]
            for k in (0, 1)
        )
        moved = [(a, b) for a, b in zip(left, right, strict=True) if a != b]
        return ", ".join(a for a, _ in moved), ", ".join(b for _, b in moved)

    def know(self, causes: Sequence[Cause]) -> None:
        """The causes that `curves` can bring to the same, by their names."""
        self._by_name = {cause.name: cause for cause in causes}

    def gaps(self, brought: Iterable[str]) -> dict[str, Deviation]:
        """The gap in each quantity with causes brought to the same; {} if a side did not stand."""
        names = frozenset(brought)
        one, two = self.curves(0, names), self.curves(1, names)
        return self.ruler.gaps(one, two) if one and two else {}

    def ahead(self, wanted: Iterable[frozenset[str]]) -> None:
        """Make the runs now that `gaps` of some sets of causes will want, several at once."""
        keys = dict.fromkeys(
            (side, self._acting(side, brought)) for brought in wanted for side in (0, 1)
        )
        new = [key for key in keys if key not in self._runs and key not in self._ahead]
        jobs = self._forks_for(len(new))
        if jobs == 1:
            return
        work = [partial(self._outcome_or_error, *key) for key in new]
        outcomes = in_forks(work, jobs, self._ran, self._took)
        for key, outcome in zip(new, outcomes, strict=True):
            if not isinstance(outcome, Exception):
                self._ahead[key] = outcome or _Outcome(None, _LOST)

    def _forks_for(self, number: int) -> int:
        """How many forks make runs; none by default for a function, which may use any threads."""
        jobs = 1 if self._jobs is None and self._scenario.own else self._jobs
        return forks_for(number, self._took, jobs)

    def _outcome_or_error(self, side: int, brought: frozenset[str]) -> _Outcome | Exception:
        """An error is raised where the run is asked for, which may never be."""
        try:
            return self._outcome(side, brought)
        except Exception as error:
            return RuntimeError(str(error))

    def curves(self, side: int, brought: frozenset[str]) -> Curves | None:
        """A run of one side; None, with a reason in `ended`, if it cannot be or did not stand."""
        key = side, self._acting(side, brought)
        if key not in self._runs:
            if key not in self._ahead:
                self._ahead[key] = self._outcome(*key)
                self._ran()
            self._runs[key] = self._ahead.pop(key)
            self.count += self._runs[key].ran
        found = self._runs[key]
        if found.curves is None:
            self.ended = found.reason or self.ended
        return found.curves

    def _outcome(self, side: int, brought: frozenset[str]) -> _Outcome:
        ran = False
        try:
            model = self.model(side, brought)
            ran = True
            trace = self._trace(side, model, brought)
            reason = trace.header.ended or "it left every bound"
            return _Outcome(self._curves(side, model, trace), reason)
        except (DivergedError, EngineError, ModelError, UnsupportedError) as error:
            return _Outcome(None, str(error), ran)

    def model(self, side: int, brought: Iterable[str]) -> Model:
        """A side's Model with causes brought to the same."""
        return self.brought(self._models[side], brought, side)

    def brought(self, model: Model, brought: Iterable[str], side: int = 1) -> Model:
        """A Model of a side's file with causes brought to the same."""
        those = sorted(brought)
        edits = [edit for name in those for edit in self._by_name[name].edits(side)]
        return built(model, tuple(edits))

    def _acting(self, side: int, brought: frozenset[str]) -> frozenset[str]:
        """The causes that change this side."""
        return frozenset(
            name
            for name in brought
            if self._by_name[name].edits(side) or (side == 1 and self._is_of_the_run(name))
        )

    def _is_of_the_run(self, name: str) -> bool:
        return any(each.kind == "run" for each in self._by_name[name].differences)

    def _trace(self, side: int, model: Model, brought: frozenset[str]) -> Trace:
        return self._rerun(side, model, brought).record(derive=False)

    def _rerun(self, side: int, model: Model, brought: frozenset[str]) -> Rerun:
        start = self._starts[side]
        qpos, qvel = start.qpos, start.qvel
        if START in brought:
            first = self._starts[0]
            qpos = self._matched.qpos(first.qpos, qpos)
            qvel = self._matched.qvel(first.qvel, qvel)
        return Rerun(
            model,
            lambda model: self._controller(side, model, brought),
            self.seconds,
            keyframe=self._keyframes[side],
            qpos=qpos,
            qvel=qvel,
        )

    def _controller(self, side: int, model: Model, brought: frozenset[str]) -> Controller:
        """A function of the user's answers each side; what an experiment commands is the left's.

        It is that of the left as it comes, whatever is edited.
        """
        own = self._scenario.own
        told = self._scenario.controller(model if own else self._models[0], self.seed)
        if side == 0:
            return told
        start = self._starts[1].ctrl
        if not own or ORDER in brought:
            told = retold(told, self._matched, start)
        # Without a keyframe of its own it starts with the commands of the left, too.
        return told if self._keyframes[0] == self._keyframes[1] else beginning_with(start, told)

    def files_apart(self, one: Model, two: Model, brought: frozenset[str]) -> dict[str, Deviation]:
        """The gap between the file of the left and that of the right on one engine.

        Args:
            one: The left's file on the engine of the right.
            two: The right's file on it, with causes brought to the same.
            brought: The causes.

        Returns:
            In each quantity; {} if one of them did not stand.
        """
        found = []
        for side, model in enumerate((one, two)):
            found.append(self._counted(side, model, brought if side else frozenset()))
        return self.ruler.gaps(found[0], found[1]) if found[0] and found[1] else {}

    def _counted(self, side: int, model: Model, brought: frozenset[str]) -> Curves | None:
        """A run that is not kept."""
        trace = self._trace(side, model, brought)
        self.count += 1
        self._ran()
        return self._curves(side, model, trace)

    def repeats(self) -> bool:
        """Whether the left moves the same when it is run again, so that a gap can have causes."""
        again = self._counted(0, self._models[0], frozenset())
        first = self._runs[0, frozenset()].curves
        assert first is not None  # it has gaps
        return again is not None and all(
            np.array_equal(values, again[name]) for name, values in first.items()
        )

    def floor(self, uncertain: Uncertainty) -> dict[str, Deviation]:
        """The chaos floor of each quantity: a gap that is no larger says nothing."""
        first = self._runs[0, frozenset()].curves
        assert first is not None  # it has gaps
        rerun = self._rerun(0, self._models[0], frozenset())

        def run(k: int) -> tuple[Curves | None]:
            trace = perturbed_run(rerun, k, seed=self.seed, uncertain=uncertain, derive=False)
            return (self.ruler.curves(trace),)

        runs = [partial(run, k) for k in range(RUNS)]
        jobs = self._forks_for(RUNS)
        found = (
            in_forks(runs, jobs, lambda: None, self._took)
            if jobs > 1
            else [call() for call in runs]
        )
        if None in found:
            raise EngineError(f"a run for the chaos floor could not be made: {_LOST}")
        return self.ruler.floor(first, [each[0] for each in found if each])

    def _curves(self, side: int, model: Model, trace: Trace) -> Curves | None:
        return self.ruler.curves(trace, self._posed(model), side)

    def _posed(self, model: Model) -> Model:
        """A Model of the same bodies by which poses are computed, on the engine that is fastest."""
        if model.backend == DEFAULT:
            return model
        first = self._models[0]
        base = first if first.backend == DEFAULT else load(model.path)
        return base.with_compiled(model.compiled)


def _apart(one: Array, two: Array) -> float:
    return float(np.abs(np.asarray(one) - np.asarray(two)).max(initial=0.0))
