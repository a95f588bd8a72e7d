"""From a sweep to an answer: where two engines agree, what decides it, what brings them together.

from statemachine.sweep.analysis import sweep_report

found = sweep_report("sweep-damping")
print(found.agreed, "of", len(found.settings), "settings agree")
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..errors import StateMachineError, check_name, refuse
from ..interface import Array
from ..measures.text import listed
from ..page import Figures
from ..runs.drive import Progress, part_of, silent
from .analysis_data import SweepData, sweep_data
from .analysis_gaps import agreement_of, gap_map, only_rounding
from .analysis_indices import ranked, sensitivity
from .analysis_runs import CellRunner, ModelFacts, facts_of, floor_of, runner_of
from .analysis_together import Varied, brought_together
from .folder import design_of, read_manifest
from .rows import read_cells

FLOOR_CELLS = 64


def sweep_report(
    folder: str | Path,
    *,
    backends: Sequence[str] = (),
    quantity: str | None = None,
    tolerances: Mapping[str, float] | None = None,
    fit: Sequence[str] = (),
    varied: Varied | None = None,
    floor_cells: int = FLOOR_CELLS,
    run: bool = True,
    menagerie: str | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
) -> Figures:
    """What the dataset of a sweep says of two engines.

    Args:
        folder: Of the dataset.
        backends: Two of its engines, the left one first; by default its first two.
        quantity: Of `QUANTITIES`; by default the site's, else the joint angles'.
        tolerances: By kind, instead of ours [SI].
        fit: The parameters to fit; by default the one that the gap is most sensitive to.
        varied: Whether the left side keeps the model's own value of it ("right") or both have the
            same ("both"). By default "right" of an option of the model: that is what one does who
            tunes one simulator to another.
        floor_cells: How many cells may be run for the chaos floor.
        run: Whether anything may be run.
        menagerie: Where the name of a model is looked up.
        jobs: How many processes.
        progress: Told the fraction that is done.

    Returns:
        what: The experiment; folder: of the dataset.
        sides: The engines; versions: of what the dataset was made with.
        parameters: What was varied, in the order of a setting's values; units: of each of them
            that has one.
        seeds: How many starts each setting has.
        quantity: The one that the settings, the map, the indices and the fit are of.
        quantities: Each that the dataset has, see `agreement_of`.
        settings: Every point of the design, see `agreement_of`.
        failed: How many cells failed, by the class of the error; missing: have not run.
        floor: The chaos floor, see `floor_of`; None where it is not known, and no_floor says why.
        map: The gap over one or two parameters, see `gap_map`; None where nothing is varied.
        sensitivity: See there; None where the gap is the same everywhere, or nothing is varied.
        together: For each parameter that was fitted, see `brought_together`.
        ran: How many cells were run for this report.
        agreed: In how many settings both sides agree at every seed.
        scaled: The parameters whose values are times the model's own.
        only_rounding: Whether every gap is inside the chaos floor, so that nothing has a cause to
            look for.

    Raises:
        BadInputError: There is no dataset, or none of two engines.
        UnknownNameError: No such backend, quantity or parameter.
        MissingEngineError: A package is missing.
    """
    manifest = read_manifest(folder)
    design = design_of(manifest)
    sides = _sides(manifest["design"]["backends"], backends)
    labels = [vary.label for vary in design.factors]
    for name in fit:
        check_name("parameter", name, labels)
        numeric = design.factors[labels.index(name)].numeric
        refuse((not numeric, f"{name} has no numbers that could be fitted"))
    facts = facts_of(manifest, design.factors, sides, menagerie)
    seeds, moments = manifest["design"]["seeds"], manifest["request"]["moments"]
    data = sweep_data(read_cells(folder), design, sides, seeds, moments, facts.hinges)
    main = next(iter(data.gaps)) if quantity is None else quantity
    check_name("quantity", main, data.gaps)
    runner, floor, no_floor = None, None, "nothing was to be run"
    if run:
        try:
            runner = runner_of(manifest, data, facts.hinges, menagerie, jobs)
        except StateMachineError as error:
            no_floor = str(error)
        else:
            floor = floor_of(data, runner, floor_cells, part_of(progress, 0.0, 0.5))
            no_floor = "" if floor else "no cell was to be run for it"
    widths = {} if floor is None else floor._width
    agreements = {
        name: agreement_of(data, name, widths.get(name), facts, tolerances) for name in data.gaps
    }
    agreement, settings = agreements[main]
    rounding = only_rounding(settings)
    shares = None if rounding else sensitivity(data, data.gaps[main])
    together = () if rounding and not fit else _together(
        data, shares, agreement, widths.get(main), facts, fit, varied, runner,
        part_of(progress, 0.5, 0.5),
    )  # fmt: skip
    return Figures(
        what=manifest["request"]["what"],
        folder=str(folder),
        sides=sides,
        versions={name: manifest["versions"].get(name, "") for name in ("statemachine", *sides)},
        parameters=tuple(labels),
        units={label: unit for label, unit in facts.units.items() if unit},
        seeds=seeds,
        quantity=agreement,
        quantities=tuple(agreement for agreement, _ in agreements.values()),
        settings=settings,
        failed=data.failed,
        missing=data.missing,
        floor=floor,
        no_floor=no_floor,
        map=gap_map(data, main, widths.get(main), shares),
        sensitivity=shares,
        together=together,
        ran=(floor.cells if floor else 0) + sum(fit.cells for fit in together),
        agreed=agreement.counts.get("agrees", 0),
        scaled=frozenset(vary.label for vary in design.factors if vary.times),
        only_rounding=rounding,
    )


def _sides(there: Sequence[str], asked: Sequence[str]) -> tuple[str, str]:
    """The two engines that are compared."""
    for name in asked:
        check_name("backend of this sweep", name, there)
    chosen = list(dict.fromkeys(asked or there[:2]))
    refuse(
        (
            len(there) > 2 != len(chosen),
            f"a report is of two engines; this sweep has {listed(list(there))}: name two with "
            "--backend",
        ),
        (len(chosen) != 2, f"a report is of two engines; got {listed(chosen)} alone"),
    )
    return chosen[0], chosen[1]


def _together(
    data: SweepData,
    shares: Figures | None,
    agreement: Figures,
    width: Array | None,
    facts: ModelFacts,
    asked: Sequence[str],
    varied: Varied | None,
    runner: CellRunner | None,
    progress: Progress,
) -> tuple[Figures, ...]:
    """The fit of each parameter that is asked for, else of the one that counts most."""
    chosen = [vary for vary in data.design.factors if vary.label in asked]
    if not asked:  # not the timestep, which is not a property of the robot
        chosen = [
            vary
            for vary in ranked(data.design, shares)
            if vary.numeric
            and vary.name not in ("timestep", "substeps")
            and (vary.bounds is not None or len(vary.values) >= 3)
        ][:1]
    floors = [] if width is None else width[np.isfinite(width)]
    good = max(agreement.tolerance, float(np.median(floors)) if len(floors) else 0.0)
    return tuple(
        brought_together(
            data, vary, agreement.name, good,
            varied=varied or ("right" if vary.kind == "option" else "both"),
            own=facts.own.get(vary.label), runner=runner,
            progress=part_of(progress, k / len(chosen), 1 / len(chosen)),
        )
        for k, vary in enumerate(chosen)
    )  # fmt: skip
