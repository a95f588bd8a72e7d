"""One cell of a sweep: a point of the design, a seed and a backend, run to a row."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from ..compare.perturbed import Uncertainty, nudged_controller, nudged_start
from ..errors import TimedOutError
from ..interface import Array, Data, Model, forward, make_data, reset
from ..interface.records import usual_site
from ..measures import ContactNames
from ..runs.controllers import function_scenario, is_function
from ..runs.drive import check_length, drive, steps_in
from ..runs.energy import energies
from ..runs.scenarios import Scenario, scenario
from .factors import Value, Vary
from .settings import drawn_start, start_at

_LOOKED = 64  # steps after which the clock is looked at
DONE, FAILED = "done", "failed"


@dataclass(frozen=True)
class SweepCell:
    """What is run once.

    Attributes:
        id: A digest of point, seed and backend.
        point: The digest of the values.
        values: One for each factor of the sweep.
        seed: What is drawn from; 0 draws no start.
        backend: The engine.
        nudge: What a change of start and commands by rounding is drawn from; 0 for none.
    """

    id: str
    point: str
    values: tuple[Value, ...]
    seed: int
    backend: str
    nudge: int = 0


@dataclass(frozen=True)
class CellRules:
    """What all cells of a sweep have in common; it goes to every worker.

    Attributes:
        what: The experiment, or FILE.py:FUNCTION with the whole path.
        factors: What is varied, in the order of a cell's values.
        model: The model where it is not varied.
        files: The digest of each model's file, by the name that a cell gives.
        places: What `load` is given for each of these names.
        function: The digest of the user's file; "" for an experiment of ours.
        parameters: What the user's function takes by keyword.
        defaults: What `load` is given; menagerie too.
        menagerie: See defaults.
        seconds: Instead of the experiment's own time [s].
        every: Steps for which what the function returns holds.
        keyframe: Where it starts; None for the experiment's own.
        spread: How far from there a seed puts the start.
        moments: How many moments of the run are kept.
        timeout: What a cell may take on the clock [s].
    """

    what: str
    factors: tuple[Vary, ...]
    model: str
    files: Mapping[str, str]
    places: Mapping[str, str]
    function: str = ""
    parameters: tuple[str, ...] = ()
    defaults: Literal["model", "engine"] = "model"
    menagerie: str | None = None
    seconds: float | None = None
    every: int = 1
    keyframe: str | None = None
    spread: Uncertainty = field(default_factory=Uncertainty)
    moments: int = 20
    timeout: float = 600.0

    def settings(self, cell: SweepCell, kind: str) -> list[tuple[Vary, Value]]:
        """The factors of a kind and their values in a cell."""
        pairs = zip(self.factors, cell.values, strict=True)
        return [(vary, value) for vary, value in pairs if vary.kind == kind]

    def model_of(self, cell: SweepCell) -> str:
        """The name of a cell's model."""
        return next((str(value) for _, value in self.settings(cell, "model")), self.model)

    def scenario_of(self, cell: SweepCell) -> Scenario:
        """What a cell does.

        Raises:
            BadInputError: The user's file fails.
        """
        return self.scenario(
            {vary.name: v for vary, v in self.settings(cell, "parameter")}, cell.seed
        )

    def scenario(self, parameters: Mapping[str, Any], seed: int = 0) -> Scenario:
        """What is done with some values of the function's parameters."""
        if not is_function(self.what):
            return scenario(self.what)
        seeded = {"seed": seed} if "seed" in self.parameters else {}
        return function_scenario(self.what, self.every, self.keyframe, {**seeded, **parameters})


def run_cell(
    rules: CellRules,
    cell: SweepCell,
    model: Model,
    options: Mapping[str, Any],
    doing: Scenario,
    row: dict[str, Any],
) -> None:
    """Run a cell and fill its row; what is known until it fails is in the row as well.

    Args:
        rules: Of the sweep.
        cell: What to run.
        model: With the options of the cell.
        options: These.
        doing: What to do on it.
        row: Filled in place, with what `rows.FIGURES` lists.

    Raises:
        StateMachineError: The run fails: it diverges, takes too long, has bad input.
    """
    deadline = time.monotonic() + rules.timeout
    seconds = doing.seconds if rules.seconds is None else rules.seconds
    check_length(model, seconds)
    total = steps_in(model, seconds)
    controller = doing.controller(model, cell.seed)
    rows: list[Array] = []
    fastest = np.zeros(model.nv)
    with make_data(model) as data:
        _begin(rules, cell, model, data, doing.keyframe)
        if cell.nudge:
            draw = np.random.default_rng([cell.nudge, cell.seed])
            data.qpos, data.qvel = nudged_start(model, data.qpos, data.qvel, draw)
            controller = nudged_controller(controller, draw)
        begun = data.qpos.copy(), data.qvel.copy()
        look = _look(rules, data, total, deadline, row, rows, fastest)
        try:
            error = drive(model, data, controller, total, after=look)
            if error is not None:
                raise error
        finally:
            row["max_qvel"] = float(np.nan_to_num(fastest).max(initial=0.0))
            row["qpos"], row["qvel"] = data.qpos.tolist(), data.qvel.tolist()
            row["time"] = float(data.time)
            row["sample_qpos"] = [each.tolist() for each in rows]
        ended = np.array([begun[0], data.qpos]), np.array([begun[1], data.qvel])
        row["sample_tip"] = tips = _tips(model, data, rows)
        row["tip"] = tips[-1] if tips else None
    told, _ = energies(model, rules.defaults, *ended, options.get("gravity"))
    start, end = (float(each) if np.isfinite(each) else None for each in told.sum(axis=1))
    row["energy_start"], row["energy"] = start, end


def _begin(
    rules: CellRules, cell: SweepCell, model: Model, data: Data, keyframe: str | None
) -> None:
    """Put a Data to where a cell starts: keyframe, what is varied of it, what the seed draws."""
    reset(model, data, keyframe)
    qpos, qvel = start_at(model, rules.settings(cell, "state"))
    for place, value in qpos.items():
        data.qpos[place] = value
    for place, value in qvel.items():
        data.qvel[place] = value
    data.qpos = drawn_start(model, data.qpos, rules.spread, cell.seed)


def _look(
    rules: CellRules,
    data: Data,
    total: int,
    deadline: float,
    row: dict[str, Any],
    rows: list[Array],
    fastest: Array,
) -> Callable[[int, float], None]:
    """What looks on after each step: speeds, the first touch, moments that are kept, the clock."""
    moments = np.round(np.arange(1, rules.moments + 1) * total / rules.moments).astype(int)
    keep = dict.fromkeys(moments[moments > 0].tolist())
    row["sample_time"], qvel = [], data.qvel

    def look(k: int, began: float) -> None:
        row["steps"] = k
        np.maximum(fastest, np.abs(qvel), out=fastest)
        if "touch" not in row and len(contacts := data.contacts):
            # As derived arrays are: of the state in which the step began.
            row["first_touch"] = began
            names = ContactNames.of(data.model)
            pairs = {names.pair(*geoms) for geoms in contacts.geom.tolist()}
            row["touch"] = ", ".join(sorted(pairs))
        if k in keep:
            rows.append(data.qpos.copy())
            row["sample_time"].append(float(data.time))
        if not k % _LOOKED and time.monotonic() > deadline:
            raise timed_out(rules.timeout)

    return look


def timed_out(seconds: float) -> TimedOutError:
    """The error of a cell that takes too long."""
    return TimedOutError(f"not at its end after {seconds:g} s on the clock")


def _tips(model: Model, data: Data, rows: list[Array]) -> list[list[float]] | None:
    """The fingertip (3,) [m] in world axes at some positions; the run is over, so `data` serves."""
    site = usual_site(model.site_names)
    if site is None:
        return None
    found = []
    reset(model, data)
    for qpos in rows:
        data.qpos = qpos
        forward(model, data)
        found.append(data.site_xpos[site].tolist())
    return found
