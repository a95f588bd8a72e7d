"""From a sweep to an answer: where two engines agree, what decides it, what brings them together.

from statemachine.sweep.analysis import sweep_report

found = sweep_report("sweep-damping")
print(found.agreed, "of", len(found.settings), "settings agree")
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from ..compare.tolerances import COUNT
from ..comparison.text import listed
from ..errors import BadInputError, unknown_name
from ..interface import Array
from ..scenarios.runs import Progress, part_of, silent
from .analysis_floor import SweepFloor, floor_of
from .analysis_gaps import QUANTITIES, SweepGaps, gaps_of, median, worst
from .analysis_indices import Sensitivity, sensitivity
from .analysis_map import GapMap, gap_map
from .analysis_runs import CellRunner, ModelFacts, facts_of, runner_of
from .analysis_together import BroughtTogether, Varied, brought_together
from .design import Design
from .factors import Value, Vary
from .folder import design_of, read_manifest
from .rows import read_cells

SettingVerdict = Literal["agrees", "some seeds", "chaos", "differs", "no runs"]
VERDICTS: tuple[SettingVerdict, ...] = ("agrees", "some seeds", "chaos", "differs", "no runs")
FLOOR_CELLS = 64


@dataclass(frozen=True)
class SettingGap:
    """One setting of a sweep.

    Attributes:
        values: Of the parameters.
        median: The gap over the seeds [SI]; None without a run on both sides.
        worst: The largest of the seeds.
        floor: Its chaos floor; None where that is not known.
        verdict: "agrees": within tolerance at every seed; "some seeds": at some of them; "chaos":
            beyond, but inside the chaos floor; "differs"; "no runs".
    """

    values: tuple[Value, ...]
    median: float | None
    worst: float | None
    floor: float | None
    verdict: SettingVerdict

    @property
    def inside_floor(self) -> bool:
        """Whether there is a gap, and it is inside the chaos floor."""
        return self.median is not None and self.floor is not None and self.median <= self.floor


@dataclass(frozen=True)
class QuantityAgreement:
    """The gap of one quantity over all settings.

    Attributes:
        name: Of the quantity; says: in words; unit: SI.
        says: See name.
        unit: See name.
        tolerance: The gap that does not matter; reason: why that much.
        reason: See tolerance.
        counts: How many settings have each verdict.
        median: Of all settings' medians [SI].
        worst: The largest of any seed at any setting.
    """

    name: str
    says: str
    unit: str
    tolerance: float
    reason: str
    counts: Mapping[str, int]
    median: float
    worst: float


@dataclass(frozen=True, eq=False)
class SweepReport:
    """What a sweep says of two engines.

    Attributes:
        what: The experiment; folder: of the dataset.
        folder: See what.
        sides: The engines; versions: of what the dataset was made with.
        versions: See sides.
        parameters: What was varied, in the order of a setting's values.
        seeds: How many starts each setting has.
        quantity: The one that the settings, the map, the indices and the fit are of.
        quantities: Each that the dataset has.
        settings: Every point of the design.
        failed: How many cells failed, by the class of the error; missing: have not run.
        missing: See failed.
        floor: The chaos floor; None where it is not known, and no_floor says why.
        no_floor: See floor.
        map: The gap over one or two parameters; None where nothing is varied.
        sensitivity: None where the gap is the same everywhere, or nothing is varied.
        together: For each parameter that was fitted.
        ran: How many cells were run for this report.
    """

    what: str
    folder: str
    sides: tuple[str, str]
    versions: Mapping[str, str]
    parameters: tuple[str, ...]
    seeds: int
    quantity: QuantityAgreement
    quantities: tuple[QuantityAgreement, ...]
    settings: tuple[SettingGap, ...]
    failed: Mapping[str, int]
    missing: int
    floor: SweepFloor | None
    no_floor: str
    map: GapMap | None
    sensitivity: Sensitivity | None
    together: tuple[BroughtTogether, ...]
    ran: int
    design: Design = field(repr=False, metadata={"json": False})

    @property
    def agreed(self) -> int:
        """In how many settings both sides agree at every seed."""
        return self.quantity.counts.get("agrees", 0)

    @property
    def only_rounding(self) -> bool:
        """Whether every gap is inside the chaos floor, so that nothing has a cause to look for."""
        return _only_rounding(self.settings)


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
) -> SweepReport:
    """What the dataset of a sweep says of two engines.

    Args:
        folder: Of the dataset.
        backends: Two of its engines, the left one first; by default its first two.
        quantity: Of `QUANTITIES`; by default the fingertip's, else the joint angles'.
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
        if name not in labels:
            raise unknown_name("parameter", name, labels)
    facts = facts_of(manifest, design.factors, sides, menagerie)
    seeds = manifest["design"]["seeds"]
    gaps = gaps_of(read_cells(folder), design, sides, seeds, facts.hinges)
    if quantity is not None and quantity not in gaps.quantities:
        raise unknown_name("quantity", quantity, gaps.quantities)
    main = quantity or gaps.quantities[0]
    runner: CellRunner | str = "nothing was to be run"
    if run:
        runner = runner_of(manifest, sides, facts.hinges, menagerie, jobs)
    floor, no_floor = None, runner if isinstance(runner, str) else ""
    if isinstance(runner, CellRunner):
        floor = floor_of(gaps, runner, floor_cells, part_of(progress, 0.0, 0.5))
        no_floor = "" if floor else "no cell was to be run for it"
    widths = {} if floor is None else floor.width
    found = {
        name: _agreement(gaps, name, widths.get(name), facts, tolerances)
        for name in gaps.quantities
    }
    agreement, settings = found[main]
    figures = gaps.gap(main)
    rounding = _only_rounding(settings)
    shares = None if rounding else sensitivity(design, gaps.points, figures)
    together = () if rounding and not fit else _together(
        gaps, shares, agreement, widths.get(main), facts, fit, varied,
        runner if isinstance(runner, CellRunner) else None, part_of(progress, 0.5, 0.5),
    )  # fmt: skip
    return SweepReport(
        what=manifest["request"]["what"],
        folder=str(folder),
        sides=sides,
        versions={name: manifest["versions"].get(name, "") for name in ("statemachine", *sides)},
        parameters=tuple(labels),
        seeds=seeds,
        quantity=agreement,
        quantities=tuple(each for each, _ in found.values()),
        settings=settings,
        failed=gaps.failed,
        missing=gaps.missing,
        floor=floor,
        no_floor=no_floor,
        map=gap_map(gaps, median(figures), widths.get(main), shares),
        sensitivity=shares,
        together=together,
        ran=(floor.cells if floor else 0) + sum(each.cells for each in together),
        design=design,
    )


def _only_rounding(settings: Sequence[SettingGap]) -> bool:
    known = [each for each in settings if each.median is not None]
    return bool(known) and all(each.inside_floor for each in known)


def _sides(there: Sequence[str], asked: Sequence[str]) -> tuple[str, str]:
    """The two engines that are compared."""
    for name in asked:
        if name not in there:
            raise unknown_name("backend of this sweep", name, there)
    chosen = list(dict.fromkeys(asked or there[:2]))
    if len(chosen) != 2:
        raise BadInputError(
            "a report is of two engines; "
            + (
                f"this sweep has {listed(list(there))}: name two with --backend"
                if len(there) > 2
                else f"this sweep has {listed(list(there))} alone"
                if len(there) < 2
                else f"got {listed(chosen)} alone"
            )
        )
    return chosen[0], chosen[1]


def _agreement(
    gaps: SweepGaps,
    name: str,
    width: Array | None,
    facts: ModelFacts,
    given: Mapping[str, float] | None,
) -> tuple[QuantityAgreement, tuple[SettingGap, ...]]:
    """The gap of a quantity at every setting, and how many agree."""
    quantity = QUANTITIES[name]
    gap = gaps.gap(name)
    tolerance, reason = _tolerance(gaps, name, facts, given)
    within = np.where(np.isnan(gap), np.nan, gap <= tolerance[:, None])
    centre, most = median(gap), worst(gap)
    settings = []
    for k, point in enumerate(gaps.points):
        known = within[k][~np.isnan(within[k])]
        floor = None if width is None else float(width[k])
        verdict: SettingVerdict
        if not len(known):
            verdict = "no runs"
        elif known.all():
            verdict = "agrees"
        elif floor is not None and centre[k] <= floor:
            verdict = "chaos"
        else:
            verdict = "some seeds" if known.any() else "differs"
        pair = (float(centre[k]), float(most[k])) if len(known) else (None, None)
        settings.append(SettingGap(point.values, *pair, floor, verdict))
    counts = Counter(each.verdict for each in settings)
    return (
        QuantityAgreement(
            name, quantity.says, quantity.unit, float(np.nanmax(tolerance)), reason,
            {verdict: counts[verdict] for verdict in VERDICTS if counts[verdict]},
            float(median(centre)), float(worst(most)),
        ),
        tuple(settings),
    )  # fmt: skip


def _tolerance(
    gaps: SweepGaps, name: str, facts: ModelFacts, given: Mapping[str, float] | None
) -> tuple[Array, str]:
    """(p) at each setting, and why that much: those of `compare.tolerances`."""
    kind, points = QUANTITIES[name].kind, len(gaps.points)
    if given and kind in given:
        return np.full(points, given[kind]), "as given"
    count = "one count of a 12-bit encoder, 1/4096 turn"
    if kind == "joint":
        return np.full(points, COUNT), count
    if kind == "tip":
        reach = np.linalg.norm(
            np.concatenate([gaps.left.tip, gaps.right.tip]) - facts.foot, axis=-1
        )
        far = float(np.nanmax(reach))
        return np.full(points, COUNT * far), f"what {count}, moves it, {far:.2f} m from the foot"
    steps = np.concatenate([gaps.left.timestep, gaps.right.timestep], axis=1)
    longest = worst(steps) * (1 + 1e-9)
    return longest, "one timestep: an engine looks at contacts once in a step"


def _together(
    gaps: SweepGaps,
    shares: Sensitivity | None,
    agreement: QuantityAgreement,
    width: Array | None,
    facts: ModelFacts,
    asked: Sequence[str],
    varied: Varied | None,
    runner: CellRunner | None,
    progress: Progress,
) -> tuple[BroughtTogether, ...]:
    """The fit of each parameter that is asked for, else of the one that counts most."""
    chosen = [vary for vary in gaps.design.factors if vary.label in asked]
    if not asked:
        chosen = _candidates(gaps.design, shares)[:1]
    floor = _middle(width)
    found = []
    for k, vary in enumerate(chosen):
        if not vary.numeric:
            raise BadInputError(f"{vary.label} has no numbers that could be fitted")
        how: Varied = varied or ("right" if vary.kind == "option" else "both")
        found.append(
            brought_together(
                gaps, vary, agreement.name, max(agreement.tolerance, floor),
                varied=how, own=facts.own.get(vary.label), runner=runner,
                progress=part_of(progress, k / len(chosen), 1 / len(chosen)),
            )
        )  # fmt: skip
    return tuple(found)


def _middle(width: Array | None) -> float:
    """The median of the floors that are finite."""
    finite = np.array([]) if width is None else width[np.isfinite(width)]
    return float(np.median(finite)) if len(finite) else 0.0


def _candidates(design: Design, shares: Sensitivity | None) -> list[Vary]:
    """The parameters that may be fitted, the most sensitive first.

    Not the timestep, unless it is asked for: it is no property of the robot.
    """
    order = [each.label for each in shares.indices] if shares else []
    fine = [
        vary
        for vary in design.factors
        if vary.numeric
        and vary.name not in ("timestep", "substeps")
        and (vary.bounds is not None or len(vary.values) >= 3)
    ]
    return sorted(fine, key=lambda v: order.index(v.label) if v.label in order else len(order))
