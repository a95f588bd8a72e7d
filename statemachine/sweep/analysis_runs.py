"""What the report of a sweep runs: perturbed starts, a side at the model's own value, a check."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..backends import load
from ..errors import StateMachineError
from ..interface import Ints, JointType, Model, forward, make_data, reset
from ..processes import checked_jobs
from ..runs.controllers import is_function
from ..runs.drive import Progress, silent
from .analysis_gaps import SweepRuns, runs_of
from .apart import apart
from .cell import CellRules, SweepCell
from .factors import UNITS, Value, Vary
from .prepare import prepared
from .request import REQUEST, PreparedSweep, Sweep
from .settings import options_at

Setting = tuple[tuple[Value, ...], int]  # values of the factors, and a seed


@dataclass(frozen=True)
class CellRunner:
    """Runs cells of a sweep that its dataset has not.

    Attributes:
        ready: The sweep, as its folder tells it.
        hinges: Which numbers of qpos are angles; None for all.
        jobs: How many processes.
    """

    ready: PreparedSweep
    hinges: tuple[int, ...] | None
    jobs: int

    def run(
        self,
        backends: Sequence[str],
        settings: Sequence[Setting],
        *,
        nudges: Sequence[int] = (),
        own: Vary | None = None,
        progress: Progress = silent,
    ) -> SweepRuns:
        """Runs (n,) at settings.

        Args:
            backends: The engine of each.
            settings: Values and seed of each.
            nudges: For each what a change of its start and commands by rounding is drawn from.
            own: A factor that is as the model has it, whatever the settings say.
            progress: Told the fraction that is done.
        """
        rules = self.ready.rules
        if own is not None:
            rules, settings = _without(rules, own, settings)
        cells = [
            SweepCell(f"{k}", "", values, seed, backends[k], nudges[k] if nudges else 0)
            for k, (values, seed) in enumerate(settings)
        ]
        rows = _run(rules, cells, self.jobs, progress)
        return runs_of([rows[cell.id] for cell in cells], self.hinges)


def _without(
    rules: CellRules, own: Vary, settings: Sequence[Setting]
) -> tuple[CellRules, list[Setting]]:
    """Rules and settings without a factor."""
    place = [vary.label for vary in rules.factors].index(own.label)
    factors = tuple(vary for vary in rules.factors if vary.label != own.label)
    rest = [(values[:place] + values[place + 1 :], seed) for values, seed in settings]
    return replace(rules, factors=factors), rest


def _run(
    rules: CellRules, cells: Sequence[SweepCell], jobs: int, progress: Progress
) -> Mapping[str, Mapping[str, Any]]:
    """The row of each cell, by its id."""
    found: dict[str, Mapping[str, Any]] = {}
    size = max(1, len(cells) // (4 * jobs))
    batches: Iterable[Sequence[SweepCell]] = (
        cells[k : k + size] for k in range(0, len(cells), size)
    )
    for rows in apart(rules, batches, min(jobs, max(1, len(cells)))):
        found.update((row["cell"], row) for row in rows)
        progress(len(found) / len(cells))
    return found


def runner_of(
    manifest: Mapping[str, Any],
    sides: tuple[str, str],
    hinges: tuple[int, ...] | None,
    menagerie: str | None = None,
    jobs: int | None = None,
) -> CellRunner | str:
    """What runs more cells of a sweep, or why nothing can: files or versions are others here."""
    design, request = manifest["design"], manifest["request"]
    what = request["what"]
    if is_function(what) and not Path(what.rpartition(":")[0]).is_file():
        return f"{what.rpartition(':')[0]} is not in this folder"
    try:
        ready = prepared(
            Sweep(
                what,
                vary=design["vary"],
                backends=sides,
                seeds=design["seeds"],
                samples=design["samples"],
                indices=design["indices"],
                design_seed=design["design_seed"],
                menagerie=menagerie,
                **{name: request[name] for name in REQUEST if request.get(name) is not None},
            )
        )
    except StateMachineError as error:
        return str(error)
    now = ready.manifest()
    if (now["files"], now["function"]) != (manifest["files"], manifest["function"]):
        return "the model or the function is another one than that of the sweep"
    others = [name for name in sides if now["versions"].get(name) != manifest["versions"].get(name)]
    if others:
        return f"{' and '.join(others)} here is of another version than that of the sweep"
    return CellRunner(ready, hinges, checked_jobs(jobs))


@dataclass(frozen=True)
class ModelFacts:
    """What a report has to know of a sweep's model.

    Attributes:
        hinges: Which numbers of qpos are angles; None for all of them.
        foot: (3,) where the first jointed body has its origin [m].
        own: Value of each option that is varied, as the model has it; None where its parts have
            several.
        units: What each factor is in; "" where it has no unit, or joints of several.
    """

    hinges: tuple[int, ...] | None = None
    foot: tuple[float, ...] = (0.0, 0.0, 0.0)
    own: Mapping[str, float | None] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)


def facts_of(
    manifest: Mapping[str, Any],
    factors: Sequence[Vary],
    backends: Sequence[str],
    menagerie: str | None = None,
) -> ModelFacts:
    """What the model of a sweep is like; nothing where it cannot be loaded, or is varied."""
    files = list(manifest["files"])
    if len(files) != 1:
        return ModelFacts()
    for backend in backends:
        try:
            model = load(files[0], backend=backend, menagerie=menagerie)
        except StateMachineError:
            continue
        kinds = zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True)
        hinges = tuple(place for kind, place in kinds if kind == JointType.HINGE)
        return ModelFacts(
            hinges or None,
            _foot(model),
            {v.label: own_value(v, model) for v in factors},
            {v.label: _unit(v, model) for v in factors},
        )
    return ModelFacts()


def _foot(model: Model) -> tuple[float, ...]:
    with make_data(model) as data:
        reset(model, data)
        forward(model, data)
        return tuple(data.xpos[min(1, model.nbody - 1)].tolist())


def _unit(vary: Vary, model: Model) -> str:
    """What the numbers of a factor are in."""
    if vary.times or vary.kind == "parameter":
        return ""
    hinge, slide = UNITS.get(vary.name, ("", ""))
    kinds = set(model.jnt_type.tolist())
    if vary.place in model.joint_names:
        kinds = {int(model.jnt_type[model.joint_id(vary.place)])}
    if hinge == slide or kinds == {JointType.HINGE}:
        return hinge
    return slide if kinds == {JointType.SLIDE} else ""


def own_value(vary: Vary, model: Model) -> float | None:
    """The value of an option that a model has itself; None if its parts have several."""
    if vary.kind != "option" or not vary.numeric:
        return None
    if vary.times:
        return 1.0
    try:
        if vary.place:
            marked = options_at(model, [(vary, float("nan"))])[vary.name]
            once = options_at(model, [(replace(vary, place="", times=True), 1.0)])[vary.name]
            values = np.atleast_1d(once)[np.isnan(np.atleast_1d(marked))]
        else:
            values = np.atleast_1d(options_at(model, [(replace(vary, times=True), 1.0)])[vary.name])
    except (StateMachineError, KeyError, TypeError, ValueError):
        return None
    return float(values[0]) if len(values) and not np.ptp(values) else None


def evenly(count: int, most: int) -> Ints:
    """At most so many of `count` numbers from 0, evenly spread."""
    found: Ints = np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
    return found
