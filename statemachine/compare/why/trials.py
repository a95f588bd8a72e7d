"""Runs of two sides with some of their differences brought to the same, each made once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ...backends import load
from ...engines.parts import ModelDifference
from ...errors import BadInputError, DivergedError, EngineError, ModelError, UnsupportedError
from ...installed import DEFAULT
from ...interface import Array, Data, Model, make_data, reset
from ...scenarios import SCENARIOS, Controller, Scenario
from ...traces import Trace, record
from ..matching import Matched
from .causes import Cause, built
from .gap import Curves, Deviation, Ruler

Measure = Literal["worst", "end", "rms"]
START, COMMANDS, ORDER = "start", "commands", "order of ctrl"
_SAME = 1e-12
_ASKED = 64  # moments at which commands are compared


@dataclass(frozen=True, eq=False)
class SideStart:
    """Where a side starts: keyframe, qpos (nq,), qvel (nv,), ctrl (nu,)."""

    keyframe: str | None
    qpos: Array
    qvel: Array
    ctrl: Array


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
    ) -> None:
        self._models, self._matched = (one, two), matched
        self.seconds, self.seed, self._ran = seconds, seed, ran
        self._scenarios = scenario, _elsewhere(scenario, two)
        # Of a function of the user's each side gets its own answer; what an experiment commands
        # depends on the time alone.
        self.feedback = scenario.name not in SCENARIOS
        self._starts = tuple(
            _start(m, s) for m, s in zip(self._models, self._scenarios, strict=True)
        )
        self.count, self.ended = 0, ""
        self._runs: dict[tuple[int, frozenset[str]], Curves | None] = {}
        self._reasons: dict[tuple[int, frozenset[str]], str] = {}
        self._by_name: dict[str, Cause] = {}
        traces = [self._trace(k, self._models[k], frozenset()) for k in (0, 1)]
        self.traces: tuple[Trace, Trace] = traces[0], traces[1]
        self.ruler = Ruler(one, traces[0], traces[1], matched)
        for k, trace in enumerate(traces):
            self._runs[k, frozenset()] = self._curves(k, self._models[k], trace)
            self.ended = self.ended or trace.header.ended

    def of_the_run(self) -> tuple[ModelDifference, ...]:
        """What of the run itself differs: where it starts, and what is commanded."""
        found, (one, two) = [], self._starts
        wanted = self._matched.qpos(one.qpos, two.qpos)
        speeds = self._matched.qvel(one.qvel, two.qvel)
        off = max(_apart(wanted, two.qpos), _apart(speeds, two.qvel))
        if off > _SAME:
            values = (("farthest coordinate", 0.0, off),)
            found.append(ModelDifference(START, "run", "", values))
        if self.feedback:
            places = [b for _, b in self._matched.actuators]
            if places != sorted(places):
                names = [self._names(k) for k in (0, 1)]
                values = (("order", names[0], names[1]),)
                found.append(ModelDifference(ORDER, "run", "", values))
        else:
            commands = self._commands_apart()
            if commands > _SAME:
                values = (("farthest command", 0.0, commands),)
                found.append(ModelDifference(COMMANDS, "run", "", values))
        return tuple(found)

    def _names(self, side: int) -> str:
        model = self._models[side]
        return ", ".join(name or str(k) for k, name in enumerate(model.actuator_names))

    def know(self, causes: Sequence[Cause]) -> None:
        """The causes that `curves` can bring to the same, by their names."""
        self._by_name = {cause.name: cause for cause in causes}

    def gaps(self, brought: Iterable[str]) -> dict[str, Deviation]:
        """The gap in each quantity with causes brought to the same; {} if a side did not stand."""
        names = frozenset(brought)
        one, two = self.curves(0, names), self.curves(1, names)
        return self.ruler.gaps(one, two) if one and two else {}

    def curves(self, side: int, brought: frozenset[str]) -> Curves | None:
        """A run of one side; None, with a reason in `ended`, if it cannot be or did not stand."""
        key = side, self._acting(side, brought)
        if key not in self._runs:
            try:
                model = self.model(side, key[1])
                trace = self._trace(side, model, key[1])
                self._runs[key] = self._curves(side, model, trace)
                self._reasons[key] = trace.header.ended or "it left every bound"
            except (DivergedError, EngineError, ModelError, UnsupportedError) as error:
                self._runs[key], self._reasons[key] = None, str(error)
        if self._runs[key] is None:
            self.ended = self._reasons.get(key, self.ended)
        return self._runs[key]

    def model(self, side: int, brought: Iterable[str]) -> Model:
        """A side's Model with causes brought to the same."""
        those = sorted(brought)
        edits = [edit for name in those for edit in self._by_name[name].edits(side)]
        return built(self._models[side], tuple(edits))

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
        self.count += 1
        self._ran()
        start = self._starts[side]
        qpos, qvel = start.qpos, start.qvel
        if START in brought:
            first = self._starts[0]
            qpos = self._matched.qpos(first.qpos, qpos)
            qvel = self._matched.qvel(first.qvel, qvel)
        controller = self._controller(side, model, brought)
        return record(
            model,
            controller,
            self.seconds,
            keyframe=start.keyframe,
            qpos=qpos,
            qvel=qvel,
            derive=False,
        )

    def _controller(self, side: int, model: Model, brought: frozenset[str]) -> Controller:
        # An experiment's commands are those of the side as it comes, whatever is edited.
        own = self._scenarios[side].controller(
            model if self.feedback else self._models[side], self.seed
        )
        if COMMANDS in brought:
            return self._lefts(self._scenarios[0].controller(self._models[0], self.seed))
        if ORDER in brought:
            return self._ordered(own)
        return own

    def _lefts(self, own: Controller) -> Controller:
        """The commands of the first side, to the second."""
        one, two = self._starts

        def controller(time: float, data: Data) -> Array:
            wanted = own(time, data)
            full = one.ctrl if wanted is None else np.asarray(wanted, dtype=np.float64)
            return self._matched.ctrl(full, two.ctrl)

        return controller

    def _ordered(self, own: Controller) -> Controller:
        """What a function writes in the order of the first side, by the names of the second."""
        start = self._starts[1].ctrl

        def controller(time: float, data: Data) -> Any:
            wanted = own(time, data)
            if wanted is None:
                return None
            return self._matched.ctrl(np.asarray(wanted, dtype=np.float64), start)

        return controller

    def _commands_apart(self) -> float:
        """The largest difference between what the two sides are commanded, at some moments."""
        own = [
            scenario.controller(model, self.seed)
            for scenario, model in zip(self._scenarios, self._models, strict=True)
        ]
        first, most = self._lefts(own[0]), 0.0
        with make_data(self._models[1]) as data:
            for time in np.linspace(0.0, self.seconds, _ASKED):
                wanted = own[1](float(time), data)
                theirs = self._starts[1].ctrl if wanted is None else np.asarray(wanted)
                most = max(most, _apart(first(float(time), data), theirs))
        return most

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


def _elsewhere(scenario: Scenario, two: Model) -> Scenario:
    """A scenario as it is on the second Model; where it makes no sense there, as on the first."""
    known = SCENARIOS.get(scenario.name)
    if known is None:
        return scenario
    try:
        return known.on(two)
    except BadInputError:
        return scenario


def _start(model: Model, scenario: Scenario) -> SideStart:
    key = scenario.keyframe
    if key is not None and key not in [frame.name for frame in model.keyframes]:
        key = None
    with make_data(model) as data:
        reset(model, data, key)
        return SideStart(key, data.qpos.copy(), data.qvel.copy(), data.ctrl.copy())
