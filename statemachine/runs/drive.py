"""The loop of every run: how long it is, who commands it, who looks on."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import BadInputError, DivergedError
from ..interface import Data, Model, make_data, step

Progress = Callable[[float], None]  # told the fraction that is done
Controller = Callable[[float, Data], Any]  # (time, data) -> ctrl, or None to leave it


def silent(_fraction: float) -> None:
    """The Progress that shows nothing."""


def part_of(progress: Progress, start: float, share: float) -> Progress:
    """The Progress of a run that is a share of the whole."""
    return lambda fraction: progress(start + share * fraction)


_TRIED = 10  # steps
# A run that would take hours is a slip of the keyboard.
_STEPS_MOST = 10_000_000


def cost_of_a_second(model: Model) -> float:
    """Roughly what a simulated second costs by the clock [s], from its first steps."""
    with make_data(model) as data:
        began = time.perf_counter()
        try:
            step(model, data, _TRIED)
        except DivergedError:
            return 0.0
        return (time.perf_counter() - began) / (_TRIED * model.timestep)


def steps_in(model: Model, seconds: float) -> int:
    """Number of timesteps in a time, at least one."""
    if not np.isfinite(seconds) or seconds <= 0:
        raise BadInputError(f"seconds must be above 0; got {seconds}")
    steps = max(1.0, seconds / model.timestep)
    if steps * model.substeps > _STEPS_MOST:
        raise BadInputError(
            f"{seconds:g} s are {steps * model.substeps:.3g} steps of the engine, and a run has "
            f"at most {_STEPS_MOST:,}"
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
    before: Callable[[int, float], object] | None = None,
    after: Callable[[int, float], object] | None = None,
    once_more: bool = False,
) -> DivergedError | None:
    """Run a Data under the commands of a controller.

    Args:
        model: The Model of the Data.
        data: Advanced in place.
        controller: Asked for ctrl (nu,) before each step; None where nobody writes ctrl.
        steps: Number of timesteps.
        before: Called with the number of the step, from 0, and the time [s], when the
            controller has written.
        after: Called with how many steps are over, and the time at which the last one began [s].
        once_more: Whether the controller is asked, and `before` called, after the last step, too.

    Returns:
        The error with which the engine diverged in a step; None if it did not.

    Raises:
        BadInputError: The controller gave what is no ctrl.
    """
    ctrl = data.ctrl
    plain, shape, real = np.ndarray, ctrl.shape, ctrl.dtype
    for k in range(steps + once_more):
        now = data.time
        if controller is not None:
            wanted = controller(now, data)
            if wanted is not None:
                # The fast way for what is an array already; the other one checks.
                if wanted.__class__ is plain and wanted.dtype is real and wanted.shape == shape:
                    ctrl[:] = wanted
                else:
                    _write_ctrl(data, wanted, now)
        if before is not None:
            before(k, now)
        if k == steps:
            break
        try:
            step(model, data)
        except DivergedError as error:  # a controller's own, of another Data, is not meant
            return error
        if after is not None:
            after(k + 1, now)
    return None


def _write_ctrl(data: Data, wanted: Any, time: float) -> None:
    try:
        data.ctrl = wanted
    except BadInputError as error:
        raise BadInputError(f"what the controller gave at {time:.3f} s: {error}") from None
