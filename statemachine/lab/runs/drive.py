"""The loop of every run: how long it is, who commands it, who looks on."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ...errors import BadInputError, DivergedError
from ...interface import Data, Model, make_data, step

Progress = Callable[[float], None]  # told the fraction that is done
Controller = Callable[[Model, Data], Any]  # (model, data) -> ctrl (nu,), or None to leave it


def no_progress(_fraction: float) -> None:
    """Show nothing: a Progress for those who want none."""


def progress_of_stage(progress: Progress, start: float, share: float) -> Progress:
    """Return the Progress of a stage that is a share of the whole, from `start` on."""
    return lambda fraction: progress(start + share * fraction)


_TIMED_STEPS = 10  # steps
# A run that would take hours is a slip of the keyboard.
_MAX_STEPS = 10_000_000


def wall_time_per_second(model: Model) -> float:
    """Estimate the wall time of a simulated second [s] from the first steps."""
    with make_data(model) as data:
        began = time.perf_counter()
        try:
            step(model, data, _TIMED_STEPS)
        except DivergedError:
            return 0.0
        return (time.perf_counter() - began) / (_TIMED_STEPS * model.timestep)


def number_of_steps(model: Model, seconds: float) -> int:
    """Return the number of timesteps in a time, at least one."""
    steps = max(1.0, seconds / model.timestep)
    if not np.isfinite(seconds) or seconds <= 0:
        raise BadInputError(f"seconds must be above 0; got {seconds}")
    engine_steps = steps * model.substeps
    if engine_steps > _MAX_STEPS:
        raise BadInputError(
            f"{seconds:g} s are {engine_steps:.3g} steps of the engine, and a run has at most "
            f"{_MAX_STEPS:,}"
        )
    return round(steps)


def check_length(model: Model, seconds: float) -> None:
    """Raise BadInputError for a run that is shorter than a timestep."""
    if 0 < seconds < model.timestep:
        raise BadInputError(
            f"a timestep of {model.timestep:g} s is longer than the run of {seconds:g} s; "
            "both are in seconds"
        )


def drive(
    model: Model,
    data: Data,
    controller: Controller | None,
    steps: int,
    *,
    once_more: bool = False,
) -> Iterator[float]:
    """Run a Data under the commands of a controller, and stop at each moment for who looks on.

    Args:
        model: The Model of the Data.
        data: Advanced in place.
        controller: Called before each step as f(model, data), for ctrl (nu,) or None to leave it;
            None where nobody writes ctrl.
        steps: Number of timesteps.
        once_more: Whether the controller is asked after the last step, too.

    Yields:
        The time [s] of each moment, the start and the end included: the controller has written,
        and derived arrays are of the state in which the step before began.

    Raises:
        BadInputError: The controller gave what is not ctrl.
        DivergedError: The engine diverged in a step.
    """
    ctrl = data.ctrl
    plain, shape, real = np.ndarray, ctrl.shape, ctrl.dtype
    for k in range(steps + once_more):
        now = data.time
        if controller is not None:
            wanted = controller(model, data)
            if wanted is not None:
                # The fast way for what is an array already; the other one checks.
                if wanted.__class__ is plain and wanted.dtype is real and wanted.shape == shape:
                    ctrl[:] = wanted
                else:
                    _write_ctrl(data, wanted, now)
        yield now
        if k < steps:
            step(model, data)
    if not once_more:
        yield data.time


def _write_ctrl(data: Data, wanted: Any, time: float) -> None:
    try:
        data.ctrl = wanted
    except BadInputError as error:
        raise BadInputError(f"what the controller gave at {time:.3f} s: {error}") from None
