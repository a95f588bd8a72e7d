"""Runs that can be made again: of a scenario, or of a trace's start and commands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..errors import TraceError, refuse
from ..interface import MOCAP, Array, Data, Model, make_data, reset
from ..interface.records import Defaults
from .drive import Controller, Progress, check_length, silent
from .recorder import record
from .scenarios import Scenario
from .trace import Trace


class SideStart(NamedTuple):
    """Where a run starts: qpos (nq,), qvel (nv,), ctrl (nu,)."""

    qpos: Array
    qvel: Array
    ctrl: Array


def start_of(model: Model, keyframe: int | str | None) -> SideStart:
    """Where a Model starts: in a keyframe, or in its default state if that is None."""
    with make_data(model) as data:
        reset(model, data, keyframe)
        return SideStart(data.qpos.copy(), data.qvel.copy(), data.ctrl.copy())


@dataclass(frozen=True, eq=False)
class Rerun:
    """How a side is run, so that it can be run again. The fields are arguments of `record`.

    Attributes:
        model: With all its options.
        controller: Makes a fresh controller of a Model; it may give None for none.
        seconds: Simulated time.
        keyframe: Where it starts; qpos, qvel: written over that.
        defaults, options: For the header of the trace.
        experiment, says, seed: Likewise.
        writes_state: Whether the controller may write more than ctrl.
    """

    model: Model
    controller: Callable[[Model], Controller | None]
    seconds: float
    keyframe: int | str | None = None
    qpos: Array | None = None
    qvel: Array | None = None
    defaults: Defaults = "model"
    options: dict[str, Any] = field(default_factory=dict)
    experiment: str = ""
    says: str = ""
    seed: int | None = None
    writes_state: bool = True

    def record(self, **arguments: Any) -> Trace:
        """The run; `arguments` are further ones of `record`, which win."""
        return record(**{**vars(self), "controller": self.controller(self.model), **arguments})

    def start(self) -> tuple[Array, Array]:
        """Positions (nq,) and velocities (nv,) that it starts with."""
        qpos, qvel, _ = start_of(self.model, self.keyframe)
        return (
            qpos if self.qpos is None else np.array(self.qpos),
            qvel if self.qvel is None else np.array(self.qvel),
        )


def rerun_of(
    scenario: Scenario,
    model: Model,
    *,
    seconds: float | None = None,
    seed: int = 0,
    defaults: Defaults = "model",
    options: dict[str, Any] | None = None,
) -> Rerun:
    """How a scenario is run on a Model; arguments are those of `record_scenario`."""
    scenario = scenario.on(model)
    chosen = {**scenario.options, **(options or {})}
    return Rerun(
        model.replace(**chosen) if chosen else model,
        lambda replaced: scenario.controller(replaced, seed),
        scenario.seconds if seconds is None else seconds,
        keyframe=scenario.keyframe,
        defaults=defaults,
        options=chosen,
        experiment=scenario.name,
        says=scenario.says,
        seed=seed if scenario.seeded else None,
        writes_state=scenario.own,  # ours write nothing but ctrl
    )


def replayed(
    trace: Trace,
    model: Model,
    defaults: Defaults = "model",
    options: dict[str, Any] | None = None,
) -> Rerun:
    """The start and the commands of a trace on a Model of its layout."""
    return Rerun(
        model,
        lambda _model: commands_of(trace),
        float(trace.time[-1] - trace.time[0]),
        qpos=trace.qpos[0],
        qvel=trace.qvel[0],
        defaults=defaults,
        options=options or {},
        experiment=trace.header.experiment,
        says=trace.header.says,
        seed=trace.header.provenance.seed,
        writes_state=False,
    )


def record_scenario(
    scenario: Scenario,
    model: Model,
    *,
    seconds: float | None = None,
    seed: int = 0,
    command: str = "",
    defaults: Defaults = "model",
    options: dict[str, Any] | None = None,
    progress: Progress = silent,
) -> Trace:
    """Record a scenario on a model, which is given as loaded.

    Args:
        scenario: What to do, as it is on that model; its options are put into it.
        model: Of any backend.
        seconds: Simulated time; None for the scenario's own.
        seed: Of what the scenario draws.
        command: What makes this trace again.
        defaults: What `load` was given.
        options: Further options for `Model.replace`, which win over the scenario's.
        progress: Told the fraction that is done.

    Raises:
        UnsupportedError: The backend lacks one of the options.
        UnknownNameError: The model lacks the keyframe.
        BadInputError: The scenario makes no sense on the model, or a timestep is longer than
            the run.
    """
    rerun = rerun_of(
        scenario, model, seconds=seconds, seed=seed, defaults=defaults, options=options
    )
    check_length(rerun.model, rerun.seconds)
    return rerun.record(command=command, progress=progress)


def play(
    trace: Trace,
    model: Model,
    *,
    command: str = "",
    defaults: Defaults = "model",
    options: dict[str, Any] | None = None,
    progress: Progress = silent,
) -> Trace:
    """The ctrl of a trace, from the state it starts in, on another model or engine.

    Where the timesteps differ, a command holds until the time of the next one.

    Raises:
        TraceError: The model has other joints or actuators, in name or in order.
    """
    header = trace.header
    refuse(
        *(
            (
                tuple(ours) != tuple(theirs),
                f"the trace has other {what} than {model.path.name}: "
                f"{', '.join(theirs)} and {', '.join(ours)}",
            )
            for what, ours, theirs in (
                ("joints", model.joint_names, header.joints),
                ("actuators", model.actuator_names, header.actuators),
            )
        ),
        (
            (header.nq, header.nv) != (model.nq, model.nv),
            "the trace's joints are of other kinds than the model's",
        ),
        (
            header.nmocap != model.nmocap,
            f"the trace has {header.nmocap} mocap bodies, and the model {model.nmocap}",
        ),
        error=TraceError,
    )
    rerun = replayed(trace, model, defaults, options)
    return rerun.record(command=command, progress=progress)


def commands_of(trace: Trace) -> Controller:
    """A controller that gives the ctrl of a trace; a command holds until the time of the next.

    So it does with the poses of mocap bodies, which it writes.
    """
    led = [name for name in MOCAP if name in trace]
    commands, start = trace.ctrl, float(trace.time[0])
    # A hair early, so that a sum of timesteps does not miss the row that it means.
    times = trace.time - start - 1e-6 * trace.timestep
    began: list[float] = []

    def controller(time: float, data: Data) -> Array:
        if not began:
            began.append(time)
        row = int(np.searchsorted(times, time - began[0], side="right")) - 1
        row = max(0, min(row, len(commands) - 1))
        for name in led:
            getattr(data, name)[:] = trace[name][row]
        return commands[row]

    return controller


def beginning_with(first: Callable[[Data], Array], controller: Controller) -> Controller:
    """A controller that begins with some ctrl (nu,), where it gives none of its own."""
    begun = False

    def beginning(time: float, data: Data) -> Any:
        nonlocal begun
        ctrl = controller(time, data)
        if ctrl is None and not begun:
            ctrl = first(data)
        begun = True
        return ctrl

    return beginning
