"""What the report of a sweep runs beside its dataset, and what it asks of the model."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..backends import load
from ..compare.perturbed import ROUNDING
from ..errors import StateMachineError, refuse
from ..interface import Ints, Model, forward, make_data, reset, usual_site
from ..measures import JointPlaces
from ..page import Figures
from ..processes import checked_jobs
from ..runs.controllers import function_file, is_function
from ..runs.drive import Progress, silent
from . import run_apart
from .analysis_data import Runs, SweepData, gap_between, read_runs
from .design import Value, Vary
from .prepare import prepared
from .request import DESIGN, REQUEST, PreparedSweep, Sweep, SweepCell, own_value
from .rows import require_parquet, schema_of

NUDGES = 2  # perturbed runs of each side at a setting, for the chaos floor
# A backend, the values of the factors and a seed; a value that is None is the model's own.
AskedCell = tuple[str, tuple[Value | None, ...], int]


@dataclass(frozen=True)
class CellRunner:
    """Runs cells of a sweep that its dataset has not.

    Attributes:
        ready: The sweep, as its folder tells it.
        hinges: Which numbers of qpos are angles; None for all.
        jobs: How many processes.
        kind: The type of the runs of the dataset.
    """

    ready: PreparedSweep
    hinges: tuple[int, ...] | None
    jobs: int
    kind: Any

    def run(
        self,
        asked: Sequence[AskedCell],
        nudges: Sequence[int] = (),
        progress: Progress = silent,
    ) -> Runs:
        """Runs (n,) of cells.

        Args:
            asked: The cells.
            nudges: For each what a change of its start and commands by rounding is drawn from.
            progress: Told the fraction that is done.
        """
        nudges = nudges or [0] * len(asked)
        cells = [
            SweepCell(f"{k}", "", values, seed, backend, nudges[k])
            for k, (backend, values, seed) in enumerate(asked)
        ]
        size = max(1, len(cells) // (4 * self.jobs))
        batches = [cells[k : k + size] for k in range(0, len(cells), size)]
        rows: dict[str, dict[str, Any]] = {}
        for done in run_apart(self.ready, batches, min(self.jobs, len(batches))):
            rows.update((row["cell"], row) for row in done)
            progress(len(rows) / len(cells))
        table = require_parquet()[0].Table.from_pylist(
            [rows[cell.id] for cell in cells], schema_of((), {})
        )
        return read_runs(table, self.ready.sweep.moments, self.hinges, self.kind)


def runner_of(
    manifest: Mapping[str, Any],
    data: SweepData,
    hinges: tuple[int, ...] | None,
    menagerie: str | None = None,
    jobs: int | None = None,
) -> CellRunner:
    """What runs more cells of a sweep.

    Raises:
        StateMachineError: Nothing can: files or versions are others here.
    """
    design, request = manifest["design"], manifest["request"]
    what = request["what"]
    file = function_file(what)
    refuse((is_function(what) and not file.is_file(), f"{file} is not in this folder"))
    given = {name: request[name] for name in REQUEST} | {name: design[name] for name in DESIGN}
    ready = prepared(Sweep(what, backends=data.sides, menagerie=menagerie, **given))
    others = [n for n in data.sides if ready.versions.get(n) != manifest["versions"].get(n)]
    refuse(
        (
            (ready.files, ready.function) != (manifest["files"], request["function"]),
            "the model or the function is another one than that of the sweep",
        ),
        (others, f"{' and '.join(others)} here is of another version than that of the sweep"),
    )
    return CellRunner(ready, hinges, checked_jobs(jobs), data.runs.dtype)


def floor_of(
    data: SweepData, runner: CellRunner, most: int, progress: Progress = silent
) -> Figures | None:
    """The chaos floor, from cells of both sides, perturbed as `compare` does it.

    Args:
        data: Of the sweep.
        runner: Runs its cells.
        most: How many cells may be run.
        progress: Told the fraction that is done.

    Returns:
        backends: The sides that were run again.
        settings: At how many settings; the others have that of the one nearest to them.
        cells: How many runs it is made of.
        seconds: What they took.
        rounding: What starts and commands were changed by, relative.
        _width: (p) of each quantity [SI]; infinite where a perturbed run failed.
    """
    began = time.monotonic()
    done = np.isfinite(data.runs["time"][0])
    seed = int(done.any(axis=0).argmax())
    known = np.flatnonzero(done[:, seed])
    in_a_setting = NUDGES * len(data.sides)
    if not len(known) or most < in_a_setting:
        return None
    chosen = known[evenly(len(known), most // in_a_setting)]
    again = np.repeat(chosen, NUDGES)
    cells = [(side, data.points[k].values, seed) for side in data.sides for k in again]
    nudges = [1 + n for _ in data.sides for _ in chosen for n in range(NUDGES)]
    runs = runner.run(cells, nudges, progress).reshape(len(data.sides), len(again))
    nearest = _nearest(data, chosen)
    width = {}
    for name in data.gaps:
        gaps = gap_between(name, data.runs[:, again, seed], runs)
        gaps = np.where(np.isnan(gaps), np.inf, gaps)  # one of them failed
        by_setting = gaps.reshape(len(data.sides), len(chosen), NUDGES)
        width[name] = by_setting.max(axis=(0, 2))[nearest]
    return Figures(
        backends=data.sides,
        settings=len(chosen),
        cells=len(cells),
        seconds=time.monotonic() - began,
        rounding=ROUNDING,
        _width=width,
    )


def _nearest(data: SweepData, chosen: Ints) -> Ints:
    """(p) which of the chosen settings is nearest to each, every parameter as wide as any."""
    places = np.zeros((len(data.points), len(data.design.factors)))
    for k, vary in enumerate(data.design.factors):
        values = data.values(vary.label)
        # What is not a number counts by its place in the list.
        values = np.array(values if vary.numeric else [*map(vary.values.index, values)])
        places[:, k] = (values - values.min()) / (np.ptp(values) or 1.0)
    return np.array([((places[chosen] - place) ** 2).sum(axis=1).argmin() for place in places])


@dataclass(frozen=True)
class ModelFacts:
    """What a report has to know of a sweep's model.

    Attributes:
        hinges: Which numbers of qpos are angles; None for all of them.
        site: The name of its usual site; "tip" where that is not known.
        foot: (3,) where the first jointed body has its origin [m].
        own: Value of each option that is varied, as the model has it; None where its parts have
            several.
        units: What each factor is in; "" where it has no unit, or joints of several.
    """

    hinges: tuple[int, ...] | None = None
    site: str = "tip"
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
        sites = model.site_names or ("tip",)
        hinges = tuple(JointPlaces.of(model.jnt_type, model.jnt_qposadr).hinges.tolist())
        with make_data(model) as data:
            reset(model, data)
            forward(model, data)
            foot = tuple(data.xpos[min(1, model.nbody - 1)].tolist())
        return ModelFacts(
            hinges or None,
            sites[usual_site(sites) or 0],
            foot,
            {v.label: own_value(v, model) for v in factors},
            {v.label: v.unit_on(_joints(model, v)) for v in factors},
        )
    return ModelFacts()


def _joints(model: Model, vary: Vary) -> set[int]:
    """The types of the joints that a factor is of."""
    if vary.place and vary.place in model.joint_names:  # some joints have no name
        return {int(model.jnt_type[model.joint_id(vary.place)])}
    return set(model.jnt_type.tolist())


def evenly(count: int, most: int) -> Ints:
    """At most so many of `count` numbers from 0, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
