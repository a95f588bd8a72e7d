"""A Data in a state, and where it goes from there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from statemachine.interface import Data, Model, forward, make_data, reset, step
from statemachine.measures.quantities import derived_arrays


@contextmanager
def opened(
    model: Model,
    keyframe: int | str | None = None,
    *,
    nstep: int = 0,
    derived: bool = False,
    **inputs: Any,
) -> Iterator[tuple[Model, Data]]:
    """Yield a Model and a Data of it, in a keyframe or the default state, or some steps later.

    The inputs, `qpos`, `qvel` or `ctrl`, are written before those steps. `derived` says whether
    what follows from the state is computed then.
    """
    with make_data(model) as data:
        if keyframe is not None:
            reset(model, data, keyframe)
        for name, value in inputs.items():
            getattr(data, name)[:] = value
        if nstep:
            step(model, data, nstep)
        if derived:
            forward(model, data)
        yield model, data


@contextmanager
def started(model: Model) -> Iterator[Data]:
    """Yield a Data in keyframe 0."""
    with opened(model, 0) as (_, data):
        yield data


def after(model: Model, nstep: int, keyframe: int | str | None = None, **inputs: Any) -> np.ndarray:
    """Return qpos (nq,) after some steps from the default state or a keyframe, with such inputs."""
    with opened(model, keyframe, nstep=nstep, **inputs) as (_, data):
        return data.qpos.copy()


def path(model: Model, nstep: int, keyframe: int | str | None = None, **inputs: Any) -> np.ndarray:
    """Return qpos (nstep + 1, nq) before and after every step, with such inputs at first."""
    with opened(model, keyframe, **inputs) as (_, data):
        rows = [data.qpos.copy()]
        for _ in range(nstep):
            step(model, data)
            rows.append(data.qpos.copy())
    return np.array(rows)


def bits(data: Data) -> list[bytes]:
    """Return the bits of everything that a Data has."""
    return [
        np.array(part).tobytes()
        for value in derived_arrays(data).values()
        for part in ([value] if isinstance(value, np.ndarray) else vars(value).values())
    ]
