"""The runs of an attribution, each made once."""

from __future__ import annotations

from typing import Any

from ...errors import DivergedError, EngineError, UnsupportedError
from ...interface import Data, Model
from ...measures import Deviation
from ...runs import Trace, record
from ...runs.drive import Progress
from ...runs.provenance import provenance
from ...runs.robot import moved_by_actuators, touching
from ...runs.scenarios import Scenario
from ..perturbed import Rerun, Uncertainty, perturbed_runs
from .factors import FACTORS
from .gap import Curves, Ruler
from .results import FirstTouch
from .sides import AdjustableSide, Changes


class Runs:
    """Runs of both sides with changes, each made once."""

    def __init__(
        self,
        sides: list[AdjustableSide],
        scenario: Scenario,
        seconds: float,
        seed: int,
        progress: Progress,
    ) -> None:
        self.one, self.two = sides
        self.names = _names(self.one.label, self.two.label)
        self.seconds, self.count, self.ended = seconds, 0, ""
        self._scenario, self._seed, self._progress = scenario, seed, progress
        self._expected = 4 * len(FACTORS)
        self._curves: dict[Any, Curves | None] = {}
        self._reasons: dict[Any, str] = {}
        self.listed = [
            factor
            for factor in FACTORS.values()
            if factor.name != "inertia" or any(side.fresh for side in sides)
        ]
        models = [side.build({}) for side in sides]
        watches = [_Watch(model) for model in models]
        traces = [self._record(*pair) for pair in zip(models, watches, strict=True)]
        self.provenance = provenance(models[0]), provenance(models[1])
        self.ruler = Ruler(models[0], traces[0], traces[1])
        for place, trace in enumerate(traces):
            self._curves[place, ()] = self.ruler.curves(trace)
            self.ended = self.ended or trace.header.ended
        self.natural = self.ruler.held(watches[0].at_start)
        self.quantity = self.natural
        self._watches = watches

    def _record(self, model: Model, watch: _Watch | None = None) -> Trace:
        self.count += 1
        self._progress(min(0.99, self.count / self._expected))
        scenario = self._scenario
        controller = scenario.controller(model, self._seed)
        if watch is not None:
            controller = watch.around(controller)
        return record(model, controller, self.seconds, keyframe=scenario.keyframe, derive=False)

    def floor(self, uncertain: Uncertainty) -> dict[str, Deviation]:
        """The chaos floor of each quantity: a gap that is no larger says nothing."""
        first, scenario = self._curves[0, ()], self._scenario
        assert first is not None  # it has gaps
        rerun = Rerun(
            self.one.build({}),
            lambda model: scenario.controller(model, self._seed),
            self.seconds,
            scenario.keyframe,
        )
        runs = perturbed_runs(rerun, seed=self._seed, uncertain=uncertain, derive=False)
        return self.ruler.floor(first, map(self.ruler.curves, runs))

    def done(self) -> None:
        """Say that all is done."""
        self._progress(1.0)

    def curves(self, place: int, changes: Changes) -> Curves | None:
        """A run of one side, 0 or 1; None, with a reason in `ended`, if it did not end well."""
        key = (
            place,
            tuple(
                sorted(
                    (name, change.how, str(change.values.get("integrator", "")))
                    for name, change in changes.items()
                )
            ),
        )
        if key not in self._curves:
            side = (self.one, self.two)[place]
            try:
                trace = self._record(side.build(changes))
                self._curves[key] = self.ruler.curves(trace)
                self._reasons[key] = trace.header.ended or "it left every bound"
            except (DivergedError, EngineError, UnsupportedError) as error:
                self._curves[key], self._reasons[key] = None, str(error)
        if self._curves[key] is None and key in self._reasons:
            reason = self._reasons[key].split(". ", maxsplit=1)[0]
            self.ended = f"{self.names[place]} does not stand: {reason}"
        return self._curves[key]

    def gaps(self, one: Changes, two: Changes) -> dict[str, Deviation]:
        """The gap with changes on both sides; nothing if one of them did not end well."""
        first, second = self.curves(0, one), self.curves(1, two)
        return self.ruler.gaps(first, second) if first and second else {}

    def moved(self, changes: Changes) -> float:
        """How far one's own motion is from what it is as it comes."""
        before, after = self._curves[0, ()], self.curves(0, changes)
        assert before is not None and after is not None  # noqa: PT018  (they have gaps)
        return self.ruler.gap(self.quantity, before, after).worst

    def extent(self, changes: Changes) -> float:
        """How far one moves from where it starts."""
        run = self.curves(0, changes)
        assert run  # it has gaps
        start = {name: curve[:1] for name, curve in run.items()}
        return float(self.ruler.distances(self.quantity, run, start).max())

    @property
    def first(self) -> float:
        """The gap as they come."""
        return self.gaps({}, {})[self.quantity].worst

    @property
    def touch(self) -> FirstTouch | None:
        """The first contact; at time 0 if there is one from the start."""
        found = [watch for watch in self._watches if watch.time is not None]
        one, two = self._curves[0, ()], self._curves[1, ()]
        if not found or not (one and two):
            return None
        soonest = min(found, key=lambda watch: watch.time or 0.0)
        assert soonest.time is not None
        # A contact found at a moment acts from that moment on: the moment itself is before it.
        before = self.ruler.time <= soonest.time + 1e-9
        if soonest.time == 0:  # no moment shows the rest alone
            return FirstTouch(0.0, soonest.what, 0.0, 0)
        far = self.ruler.distances(self.quantity, one, two)[before]
        return FirstTouch(soonest.time, soonest.what, float(far.max()), int(before.sum()))


class _Watch:
    """When anything first touches, seen from the controller of a run."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self.time: float | None = None
        self.what = ""
        self.at_start: frozenset[str] = frozenset()

    def around(self, controller: Any) -> Any:
        """The controller, which looks at the contacts before each step."""
        robot = moved_by_actuators(self._model)
        began: list[float] = []
        last = [0.0]

        def watching(time: float, data: Data) -> Any:
            if not began:
                began.append(time)
            elif self.time is None:
                found = touching(self._model, data.contacts)
                if found:  # of the state that the last step began with
                    self.time, self.what = last[0] - began[0], "; ".join(found)
                    if self.time == 0:
                        self.at_start = self._touched(data, robot)
            last[0] = time
            return controller(time, data)

        return watching

    def _touched(self, data: Data, robot: frozenset[int]) -> frozenset[str]:
        """Names of the bodies that the robot touches."""
        pairs = self._model.geom_bodyid[data.contacts.geom].tolist()
        others = [
            two if one in robot else one for one, two in pairs if (one in robot) != (two in robot)
        ]
        return frozenset(self._model.body_names[body] for body in others)


def _names(one: str, two: str) -> tuple[str, str]:
    """The engines, or which is which where they are the same."""
    short = one.split(" ", maxsplit=1)[0], two.split(" ", maxsplit=1)[0]
    return short if short[0] != short[1] else ("the first", "the second")
