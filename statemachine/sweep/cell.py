"""One cell of a sweep: a point of the design, a seed and a backend, run to a row."""

from __future__ import annotations

import time
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from ..compare.perturbed import nudged_controller, nudged_start
from ..errors import TimedOutError
from ..interface import Array, Data, Model, forward, make_data, reset
from ..interface.records import usual_site
from ..measures import ContactNames
from ..runs.drive import check_length, drive, steps_in
from ..runs.energy import energies
from ..runs.scenarios import Scenario
from .request import PreparedSweep, SweepCell
from .settings import drawn_start, start_at

_LOOKED = 64  # steps after which the clock is looked at


def run_cell(
    ready: PreparedSweep,
    cell: SweepCell,
    model: Model,
    options: Mapping[str, Any],
    doing: Scenario,
    row: dict[str, Any],
) -> None:
    """Run a cell and fill its row; what is known until it fails is in the row as well.

    Args:
        ready: The sweep.
        cell: What to run.
        model: With the options of the cell.
        options: These.
        doing: What to do on it.
        row: Filled in place, with what `rows.FIGURES` lists.

    Raises:
        StateMachineError: The run fails: it diverges, takes too long, has bad input.
    """
    sweep = ready.sweep
    deadline = time.monotonic() + sweep.timeout
    check_length(model, doing.seconds)
    total = steps_in(model, doing.seconds)
    controller = doing.controller(model, cell.seed)
    moments = np.round(np.arange(1, sweep.moments + 1) * total / sweep.moments).astype(int)
    keep = set(moments[moments > 0].tolist())
    rows: list[Array] = []
    fastest = np.zeros(model.nv)
    row["sample_time"] = []
    with make_data(model) as data:
        reset(model, data, doing.keyframe)
        starts = start_at(model, ready.settings(cell, "state"))
        for values, start in zip((data.qpos, data.qvel), starts, strict=True):
            values[list(start)] = list(start.values())
        data.qpos = drawn_start(model, data.qpos, ready.spread, cell.seed)
        if cell.nudge:
            draw = np.random.default_rng([cell.nudge, cell.seed])
            data.qpos, data.qvel = nudged_start(model, data.qpos, data.qvel, draw)
            controller = nudged_controller(controller, draw)
        qpos, qvel = data.qpos.copy(), data.qvel.copy()

        try:
            for k, (began, _) in enumerate(pairwise(drive(model, data, controller, total)), 1):
                row["steps"] = k
                np.maximum(fastest, np.abs(data.qvel), out=fastest)
                if "touch" not in row and len(contacts := data.contacts):
                    # As derived arrays are: of the state in which the step began.
                    row["first_touch"] = began
                    names = ContactNames.of(model)
                    pairs = {names.pair(*geoms) for geoms in contacts.geom.tolist()}
                    row["touch"] = ", ".join(sorted(pairs))
                if k in keep:
                    rows.append(data.qpos.copy())
                    row["sample_time"].append(float(data.time))
                if not k % _LOOKED and time.monotonic() > deadline:
                    raise timed_out(sweep.timeout)
        finally:
            row["max_qvel"] = float(np.nan_to_num(fastest).max(initial=0.0))
            row["qpos"], row["qvel"] = data.qpos.tolist(), data.qvel.tolist()
            row["time"] = float(data.time)
            row["sample_qpos"] = [each.tolist() for each in rows]
        ended = np.array([qpos, data.qpos]), np.array([qvel, data.qvel])
        row["sample_tip"] = tips = _tips(model, data, rows)
        row["tip"] = tips[-1] if tips else None
    both, _ = energies(model, sweep.defaults, *ended, options.get("gravity"))
    start, end = (float(each) if np.isfinite(each) else None for each in both.sum(axis=1))
    row["energy_start"], row["energy"] = start, end


def timed_out(seconds: float) -> TimedOutError:
    """The error of a cell that takes too long."""
    return TimedOutError(f"not at its end after {seconds:g} s on the clock")


def _tips(model: Model, data: Data, rows: list[Array]) -> list[list[float]] | None:
    """The fingertip (3,) [m] in world axes at some positions; the run is over, so `data` serves."""
    site = usual_site(model.site_names)
    if site is None:
        return None
    tips = []
    reset(model, data)
    for qpos in rows:
        data.qpos = qpos
        forward(model, data)
        tips.append(data.site_xpos[site].tolist())
    return tips
