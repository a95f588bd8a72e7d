"""Runs that can be made again: of a scenario, or of a trace's start and commands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...errors import TraceError
from ...interface import MOCAP, Array, Data, Model, make_data, reset
from ...interface.options import OptionValue
from ...interface.records import Defaults
from ..runs.drive import Controller, Progress, check_length, no_progress
from ..runs.scenarios import Scenario
from .header import Header
from .recorder import DerivedFrom, RunMetadata, RunStart, record
from .trace import Trace


class SideStart(NamedTuple):
    """The start of a run.

    Attributes:
        qpos: (nq,) positions [rad or m].
        qvel: (nv,) velocities [rad/s or m/s].
        ctrl: (nu,) command [unit of the actuator].
    """

    qpos: Array
    qvel: Array
    ctrl: Array


def start_of(model: Model, keyframe: int | str | None) -> SideStart:
    """Return where a Model starts: in a keyframe, or in its default state if that is None."""
    with make_data(model) as data:
        reset(model, data, keyframe)
        return SideStart(data.qpos.copy(), data.qvel.copy(), data.ctrl.copy())


def start_of_scenario(scenario: Scenario, model: Model) -> SideStart | None:
    """Return the start of a scenario on a Model; None where a keyframe or the default state is."""
    qpos = scenario.qpos_at_start(model)
    return None if qpos is None else start_of(model, None)._replace(qpos=qpos)


@dataclass(frozen=True, eq=False)
class Rerun:
    """The run of a side, so that it can be run again.

    Attributes:
        model: With all its options.
        controller: Makes a fresh controller of a Model; it may give None for none.
        seconds: Simulated time.
        keyframe: Where it starts; None for the default state.
        qpos: (nq,) positions that are written over that start [rad or m]; None for its own.
        qvel: (nv,) velocities that are written over it [rad/s or m/s]; None for its own.
        defaults: What `load` was given; this and all that follows stand in the header of the trace.
        options: What `Model.replace` was given.
        experiment: Name of what is done.
        description: What happens, in a sentence.
        seed: What the controller was drawn from; None for nothing.
        writes_state: Whether the controller may write more than ctrl.
    """

    model: Model
    controller: Callable[[Model], Controller | None]
    seconds: float
    keyframe: int | str | None = None
    qpos: Array | None = None
    qvel: Array | None = None
    defaults: Defaults = "model"
    options: dict[str, OptionValue] = field(default_factory=dict)
    experiment: str = ""
    description: str = ""
    seed: int | None = None
    writes_state: bool = True

    def record(
        self,
        *,
        controller: Controller | None = None,
        qpos: Array | None = None,
        qvel: Array | None = None,
        command: str = "",
        derived: DerivedFrom = "repetition",
        progress: Progress = no_progress,
    ) -> Trace:
        """Record the run.

        Args:
            controller: Instead of a fresh one.
            qpos: (nq,) where it starts, instead of its own [rad or m].
            qvel: (nv,) its velocities there, instead of its own [rad/s or m/s].
            command: What makes the trace again.
            derived: From what the columns are that the engine derives, as of `recorder.record`.
            progress: Told the fraction that is done.
        """
        start = RunStart(
            keyframe=self.keyframe,
            qpos=self.qpos if qpos is None else qpos,
            qvel=self.qvel if qvel is None else qvel,
        )
        metadata = RunMetadata(
            experiment=self.experiment,
            description=self.description,
            command=command,
            defaults=self.defaults,
            options=self.options,
            seed=self.seed,
        )
        return record(
            self.model,
            self.controller(self.model) if controller is None else controller,
            self.seconds,
            start=start,
            metadata=metadata,
            derived=derived,
            writes_state=self.writes_state,
            progress=progress,
        )

    def start(self) -> tuple[Array, Array]:
        """Return positions (nq,) [rad or m] and velocities (nv,) [rad/s or m/s] at its start."""
        qpos, qvel, _ = start_of(self.model, self.keyframe)
        if self.qpos is not None:
            qpos = np.array(self.qpos)
        if self.qvel is not None:
            qvel = np.array(self.qvel)
        return qpos, qvel


def rerun_of(
    scenario: Scenario,
    model: Model,
    *,
    seconds: float | None = None,
    seed: int = 0,
    defaults: Defaults = "model",
    options: dict[str, OptionValue] | None = None,
) -> Rerun:
    """Return how a scenario is run on a Model; arguments are those of `record_scenario`."""
    scenario = scenario.on(model)
    chosen = dict(scenario.options)
    if options is not None:
        chosen |= options
    return Rerun(
        model=model.replace(**chosen) if chosen else model,
        controller=lambda replaced: scenario.controller(replaced, seed),
        seconds=scenario.seconds if seconds is None else seconds,
        keyframe=scenario.keyframe,
        qpos=scenario.qpos_at_start(model),
        defaults=defaults,
        options=chosen,
        experiment=scenario.name,
        description=scenario.description,
        seed=seed if scenario.seeded else None,
        writes_state=scenario.is_user_function,  # ours write nothing but ctrl
    )


def rerun_of_trace(
    trace: Trace,
    model: Model,
    defaults: Defaults = "model",
    options: dict[str, OptionValue] | None = None,
) -> Rerun:
    """Return the start and the commands of a trace on a Model of its layout."""
    header = trace.header
    return Rerun(
        model=model,
        controller=lambda _model: controller_of_trace(trace),
        seconds=float(trace.time[-1] - trace.time[0]),
        qpos=trace.qpos[0],
        qvel=trace.qvel[0],
        defaults=defaults,
        options={} if options is None else options,
        experiment=header.experiment,
        description=header.description,
        seed=header.provenance.seed,
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
    options: dict[str, OptionValue] | None = None,
    progress: Progress = no_progress,
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
    options: dict[str, OptionValue] | None = None,
    progress: Progress = no_progress,
) -> Trace:
    """Play the ctrl of a trace, from the state it starts in, on another model or engine.

    Where the timesteps differ, a command holds until the time of the next one.

    Raises:
        TraceError: The model has other joints or actuators, in name or in order.
    """
    _check_layout(trace.header, model)
    rerun = rerun_of_trace(trace, model, defaults, options)
    return rerun.record(command=command, progress=progress)


def _check_layout(header: Header, model: Model) -> None:
    """Check that a Model has the joints, actuators and mocap bodies of a trace.

    Raises:
        TraceError: It has others.
    """
    for what, ours, theirs in (
        ("joints", model.joint_names, header.joints),
        ("actuators", model.actuator_names, header.actuators),
    ):
        if tuple(ours) != tuple(theirs):
            raise TraceError(
                f"the trace has other {what} than {model.path.name}: "
                f"{', '.join(theirs)} and {', '.join(ours)}"
            )
    if (header.nq, header.nv) != (model.nq, model.nv):
        raise TraceError("the trace's joints are of other kinds than the model's")
    if header.nmocap != model.nmocap:
        raise TraceError(
            f"the trace has {header.nmocap} mocap bodies, and the model {model.nmocap}"
        )


def controller_of_trace(trace: Trace) -> Controller:
    """Return a controller that gives the ctrl of a trace.

    A command holds until the time of the next. It also writes the poses of mocap bodies.
    """
    mocap = [name for name in MOCAP if name in trace]
    commands, start = trace.ctrl, float(trace.time[0])
    # A little early, so that a sum of timesteps does not miss the row that it means.
    times = trace.time - start - 1e-6 * trace.timestep
    began: float | None = None

    def controller(_model: Model, data: Data) -> Array:
        nonlocal began
        if began is None:
            began = data.time
        row = int(np.searchsorted(times, data.time - began, side="right")) - 1
        row = max(0, min(row, len(commands) - 1))
        for name in mocap:
            getattr(data, name)[:] = trace[name][row]
        return commands[row]

    return controller


def with_first_ctrl(first: Callable[[Data], Array], controller: Controller) -> Controller:
    """Return a controller that begins with another ctrl where it gives none of its own.

    Args:
        first: Gives that ctrl (nu,) [unit of the actuator] of a Data in its start.
        controller: Whose ctrl it gives from then on.
    """
    begun = False

    def beginning(model: Model, data: Data) -> Any:
        nonlocal begun
        ctrl = controller(model, data)
        if ctrl is None and not begun:
            ctrl = first(data)
        begun = True
        return ctrl

    return beginning
