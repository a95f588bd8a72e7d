"""Pages of the closer looks: finer timesteps, one step at a time, release after release."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from ...measures.text import (
    NONE,
    command,
    figure,
    grouped,
    listed,
    milliseconds,
    quantity,
    sentence,
    short_time,
    significant,
)
from ...show import report_template as template
from ...show.blocks import Bars, Block, Code, Headline, Items, Page, Table
from ...show.report_template import if_true, slots_of
from ..compare import Comparison, Request
from ..compare.convergence import FINER, Convergence, GapLimit, LimitVerdict
from ..compare.one_step import OneStep, Spike, StageGap
from ..compare.stages import FORCES
from ..compare.stillness import nothing_moved
from .finding import leading, moment, name_of

LEADS = {
    "rounding": "There is no gap beyond rounding, whatever the timestep",
    "vanishes": "The gap vanishes with the timestep: it is discretisation",
    "unclear": "It is unclear whether the gap vanishes with the timestep: that of {name} is "
    "{coarse}, and {fine} with the finest steps, in no steady order (so {unclear} of {total} "
    "quantities)",
    "stays": "The gap does not vanish with the timestep: that of {name} is {coarse}, and {fine} "
    "with the finest steps",
    "in part": "The gap vanishes with the timestep in part only: that of {name} is {coarse}, and "
    "{fine} with the finest steps",
}
NO_GAP = "Before the first touch, at {touch}, there is no gap."
DISCRETISATION = "Before the first touch, at {touch}, there is nothing but discretisation."

ByVerdict = Mapping[LimitVerdict, Sequence[GapLimit]]
_FINER = ("at h", *(f"h/{finer}" for finer in FINER[1:]))


def convergence(result: Convergence, experiment: str) -> Page:
    """Return the page of what vanishes with the timestep, and what does not.

    Args:
        result: What was found.
        experiment: What was run.
    """
    by_verdict = grouped((limit.verdict, limit) for limit in result.whole)
    return template.page(
        "lab/questions/convergence",
        _of_the_limit(result, by_verdict),
        experiment=experiment,
        **slots_of(
            _runs_of(result),
            _limit_tables_of(result),
            _counts_of(result, by_verdict),
            _rounding_of(result),
            _advice_of(result),
        ),
    )


@dataclass(frozen=True)
class _Runs:
    """What the page says of the runs.

    Attributes:
        left: What the left side is called.
        right: What the right side is called.
        until: The last moment that is compared [s].
        steps: The engines' steps as given, each once.
        here: How long a command holds on the left; None where it holds as long on both sides.
        there: How long a command holds on the right.
        late: The longer of these [s].
    """

    left: str
    right: str
    until: float
    steps: str
    here: str | None
    there: str
    late: str


def _runs_of(result: Convergence) -> _Runs:
    left, right = result.labels
    here, there = (milliseconds(period, 3) for period in result.periods)
    steps = dict.fromkeys(milliseconds(step, 3) for step in result.steps)
    return _Runs(
        left=left,
        right=right,
        until=result.until,
        steps=" and ".join(steps),
        here=None if here == there else here,
        there=there,
        late=significant(max(result.periods)),
    )


@dataclass(frozen=True)
class _LimitTables:
    """The tables of the gaps.

    Attributes:
        before: Until the first touch; None where there is nothing to be seen in it.
        whole: Over the whole run.
    """

    before: Table | None
    whole: Table


def _limit_tables_of(result: Convergence) -> _LimitTables:
    before = None
    only_rounding = all(limit.verdict == "rounding" for limit in result.before)
    if result.touch is not None and not only_rounding:  # else one line says so
        title = f"The gap with finer steps, before the first touch at {short_time(result.touch)}"
        before = _limits(result.before, title)
    return _LimitTables(
        before, _limits(result.whole, "The gap with finer steps, over the whole run")
    )


def _limits(limits: Sequence[GapLimit], title: str) -> Table:
    """Return a row for each gap beyond rounding: with the first steps and the finest three."""
    levels = len(limits[0].gaps)
    columns: dict[str, Callable[[GapLimit], str]] = {
        "quantity": lambda limit: name_of(limit.name),
        "the gap is": lambda limit: limit.verdict,
    }
    for level in sorted({0, *range(levels - 3, levels)}):
        columns[_FINER[level]] = _gap_at(level)
    columns["at 0"] = lambda limit: quantity(limit.limit, limit.unit)
    return Table.of(
        [limit for limit in limits if limit.verdict != "rounding"],
        columns,
        title,
        words={"the gap is"},
        emphasis=lambda limit: limit.verdict in ("stays", "in part"),
    )


def _gap_at(level: int) -> Callable[[GapLimit], str]:
    """Return what fills a column: the gap in the runs with some of the steps."""
    return lambda limit: quantity(limit.gaps[level], limit.unit)


@dataclass(frozen=True)
class _Counts:
    """How many gaps do what, and how far the sides move with finer steps.

    Attributes:
        total: How many quantities there are.
        counts: How many gaps have each verdict.
        name: The quantity that is farthest apart with the steps as given, of the first's unit.
        left_moved: How far the left side is in it from its own run with the finest steps.
        right_moved: How far the right side is.
    """

    total: int
    counts: str
    name: str
    left_moved: str
    right_moved: str


def _counts_of(result: Convergence, by_verdict: ByVerdict) -> _Counts:
    alike = [limit for limit in result.whole if limit.unit == result.whole[0].unit]
    farthest = max(alike, key=lambda limit: limit.gaps[0])
    left_moved, right_moved = (quantity(moved, farthest.unit) for moved in farthest.moved)
    return _Counts(
        total=len(result.whole),
        counts=", ".join(f"{verdict} {len(limits)}" for verdict, limits in by_verdict.items()),
        name=name_of(farthest.name),
        left_moved=left_moved,
        right_moved=right_moved,
    )


@dataclass(frozen=True)
class _Rounding:
    """Of the gaps that are rounding.

    Attributes:
        rounding: How many there are; None for none.
        most: The largest of each unit.
    """

    rounding: int | None
    most: str


def _rounding_of(result: Convergence) -> _Rounding:
    gaps = [(max(limit.gaps), limit.unit) for limit in result.whole if limit.verdict == "rounding"]
    if not gaps:
        return _Rounding(None, "")
    largest = {unit: quantity(gap, unit) for gap, unit in sorted(gaps)}
    return _Rounding(len(gaps), listed(list(largest.values())))


@dataclass(frozen=True)
class _Advice:
    """What the page adds under a condition.

    Attributes:
        touch: "" where two engines touch something.
        quarter: A timestep that may tell what is unclear [s]; None where nothing is, or where
            something touches.
    """

    touch: str | None
    quarter: str | None


def _advice_of(result: Convergence) -> _Advice:
    touches = result.touch is not None
    quarter = None
    if result.unclear and not touches:
        quarter = significant(min(result.steps) / 4)
    return _Advice(if_true(touches and len(result.engines) > 1), quarter)


def _of_the_limit(result: Convergence, by_verdict: ByVerdict) -> Headline:
    """Return the headline: whether the gap vanishes with the timestep."""
    if result.is_still:
        return Headline(nothing_moved(result.motion), holds=False)
    if result.vanishes:
        return Headline(LEADS["vanishes" if by_verdict.keys() - {"rounding"} else "rounding"])
    gap = _leading(by_verdict)
    coarse, fine = quantity(gap.gaps[0], gap.unit), quantity(gap.gaps[-1], gap.unit)
    lead = LEADS[gap.verdict].format(
        name=name_of(gap.name),
        coarse=coarse,
        fine=fine,
        unclear=len(by_verdict.get("unclear", [])),
        total=len(result.whole),
    )
    return Headline(lead, end=_before_the_touch(result), holds=False)


def _leading(by_verdict: ByVerdict) -> GapLimit:
    """Return the gap that the headline is of.

    It is one that stays, or one that is unclear, whichever are more often; of those with the
    unit of the first the largest.
    """
    unclear = by_verdict.get("unclear", [])
    stay = [*by_verdict.get("stays", []), *by_verdict.get("in part", [])]
    if len(stay) > len(unclear):
        alike = [limit for limit in stay if limit.unit == stay[0].unit]
        return max(alike, key=lambda limit: limit.gaps[-1])
    candidates = unclear if unclear else list(chain(*by_verdict.values()))
    alike = [limit for limit in candidates if limit.unit == candidates[0].unit]
    return max(alike, key=lambda limit: limit.gaps[0])


def _before_the_touch(result: Convergence) -> str:
    """Say of a gap that stays that there is none until something touches; "" if there is one."""
    verdicts = {limit.verdict for limit in result.before}
    if result.touch is None or not verdicts or not verdicts <= {"rounding", "discretisation"}:
        return ""
    text = NO_GAP if verdicts == {"rounding"} else DISCRETISATION
    return text.format(touch=short_time(result.touch))


def one_step(result: OneStep, labels: tuple[str, str], experiment: str) -> Page:
    """Return the page of what each stage of a step gives on both sides: what differs first.

    Args:
        result: What was found.
        labels: What the sides are called.
        experiment: What was run.
    """
    left, right = labels
    return template.page(
        "lab/questions/one_step",
        experiment=experiment,
        left=left,
        right=right,
        **slots_of(
            _moments_of(result),
            _null_of(result),
            _step_tables_of(result),
            _verdict_of(result),
            _first_stage_of(result),
            _others_of(result),
        ),
    )


@dataclass(frozen=True)
class _Moments:
    """From which moments a step was taken.

    Attributes:
        moments: How many.
        every: Steps from one to the next.
        until: The last of them [s].
        primed: What of the step before the right side was given.
        relative: The tolerance, relative to the scale of a stage.
        weight: Of the robot, whose share is no difference either.
        size: Of the robot.
    """

    moments: int
    every: int
    until: float
    primed: str
    relative: str
    weight: str
    size: str


def _moments_of(result: OneStep) -> _Moments:
    return _Moments(
        moments=result.moments,
        every=result.every,
        until=result.until,
        primed=result.primed if result.primed else "nothing",
        relative=figure(result.relative),
        weight=quantity(result.robot.weight, "N"),
        size=quantity(result.robot.size, "m"),
    )


@dataclass(frozen=True)
class _Null:
    """How far the left side, put back to its own states, gets from its own run.

    Attributes:
        null: At most.
        stage: In which stage.
    """

    null: str
    stage: str


def _null_of(result: OneStep) -> _Null:
    compared = [gap for gap in result.stages if gap.told and gap.unit]
    most = max(compared, key=_null_tolerances)
    return _Null(quantity(most.null, most.unit), most.stage)


def _null_tolerances(gap: StageGap) -> float:
    """Return how many tolerances the null of a stage is; a tolerance of zero is next to nothing."""
    return gap.null / (gap.tolerance if gap.tolerance else 1e-300)


@dataclass(frozen=True)
class _StepTables:
    """What stands alone on the page.

    Attributes:
        stages: A row for each stage.
        spikes: A row for each moment that stands out.
        notes: What a reader must know.
    """

    stages: Table
    spikes: Table
    notes: Items


def _step_tables_of(result: OneStep) -> _StepTables:
    notes = [f"{gap.stage} is not compared: {gap.reason}." for gap in result.stages if not gap.told]
    notes += [sentence(line) for line in result.notes]
    return _StepTables(_stages_table(result), _spikes_table(result.spikes), Items(notes))


_STAGE_HEADS = (
    "stage",
    "differs",
    "first",
    "largest",
    "at, s",
    "where",
    "from, s",
    "null",
    "tolerance",
)


def _stages_table(result: OneStep) -> Table:
    rows = [(gap.stage, *_stage_cells(gap)) for gap in result.stages]
    first = frozenset(k for k, gap in enumerate(result.stages) if gap is result.first)
    return Table(
        _STAGE_HEADS,
        rows,
        "The stages of a step, in their order",
        words=frozenset({0, 5}),
        emphasis=first,
        wide=frozenset({4, 7, 8}),
    )


def _stage_cells(gap: StageGap) -> tuple[str, ...]:
    """Return the cells of a stage behind its name."""
    if not gap.told or not gap.unit:
        reason = gap.reason if gap.reason else NONE
        return NONE, NONE, NONE, NONE, reason, NONE, NONE, NONE
    largest, at, where = "0", NONE, NONE
    if gap.beyond:
        largest, where = quantity(gap.worst, gap.unit), gap.where
        if gap.at is not None:
            at = moment(gap.at)
    elif gap.worst:
        largest = "≈ 0"
    null = quantity(gap.null, gap.unit)
    tolerance = quantity(max(gap.tolerance, gap.floor), gap.unit)
    return (
        str(gap.beyond),
        str(gap.leads),
        largest,
        at,
        where,
        moment(gap.first),
        null,
        tolerance,
    )


def _spikes_table(spikes: Sequence[Spike]) -> Table:
    rows = []
    for spike in spikes:
        size = quantity(spike.size, spike.unit)
        rows.append((moment(spike.at), size, spike.joint, spike.stage, spike.where))
    return Table(
        ("at, s", "velocity update apart", "joint", "first stage", "where"),
        rows,
        "The moments that stand out",
        words=frozenset({0, 2, 3, 4}),
    )


@dataclass(frozen=True)
class _StepVerdict:
    """Whether both sides take the same step.

    Attributes:
        same: True where they do; else None.
        exact: "" where every figure is the same to the last bit.
        differs: False where they do not; else None.
    """

    same: bool | None
    exact: str | None
    differs: bool | None


def _verdict_of(result: OneStep) -> _StepVerdict:
    if result.first is not None:
        return _StepVerdict(same=None, exact=None, differs=False)
    exact = all(gap.worst == 0 for gap in result.stages)
    return _StepVerdict(same=True, exact=if_true(exact), differs=None)


@dataclass(frozen=True)
class _FirstStage:
    """The first stage that differs; None of all where none does.

    Attributes:
        first: Its name.
        since: The first moment at which it differs [s].
        beyond: At how many moments it differs.
        where: The joint, body or pair to look at.
    """

    first: str | None = None
    since: str | None = None
    beyond: int | None = None
    where: str | None = None


def _first_stage_of(result: OneStep) -> _FirstStage:
    gap = result.first
    if gap is None:
        return _FirstStage()
    return _FirstStage(gap.stage, moment(gap.first), gap.beyond, gap.where)


@dataclass(frozen=True)
class _OtherStages:
    """What else differs; None for nothing.

    Attributes:
        others: Stages that have a cause of their own at some moments, with the number of these.
        forces: The largest difference of a force in each unit.
    """

    others: str | None
    forces: str | None


def _others_of(result: OneStep) -> _OtherStages:
    differing = [gap for gap in result.stages if gap.beyond]
    others = [
        f"{gap.stage} ({gap.leads})" for gap in differing if gap.leads and gap != result.first
    ]
    forces: dict[str, str] = {}  # the largest of each unit
    for gap in sorted(differing, key=lambda gap: gap.worst):
        if gap.stage in FORCES:
            size, at = quantity(gap.worst, gap.unit), moment(gap.at)
            forces[gap.unit] = f"{gap.stage}, {size} at {at} s, {gap.where}"
    return _OtherStages(
        others=listed(others) if others else None,
        forces="; ".join(forces.values()) if forces else None,
    )


@dataclass(frozen=True)
class _NextRelease:
    """A release of MuJoCo and the next one, compared.

    Attributes:
        release: The version.
        next: That of the next one.
        backends: What to type for both.
        comparison: Of the two.
    """

    release: str
    next: str
    backends: tuple[str, str]
    comparison: Comparison

    @classmethod
    def of(cls, comparison: Comparison) -> _NextRelease:
        """Return what a comparison is of."""
        left, right = comparison.left.trace.header, comparison.right.trace.header
        return cls(
            release=left.provenance.versions[left.backend],
            next=right.provenance.versions[right.backend],
            backends=(left.backend, right.backend),
            comparison=comparison,
        )

    @property
    def tolerances(self) -> float:
        """How many tolerances the leading gap is."""
        worst = leading(self.comparison)
        return worst.max / worst.tolerance if worst.tolerance else 0.0

    def cells(self) -> tuple[str, ...]:
        """Return the row of the two."""
        worst = leading(self.comparison)
        outcome = self.comparison.outcome
        verdict = outcome if outcome in ("agrees", "nothing moved") else "DIFFERS"
        if not worst.max:
            return (self.release, self.next, "nothing differs", NONE, NONE, NONE, verdict)
        largest, tolerance = (quantity(v, worst.unit) for v in (worst.max, worst.tolerance))
        return (
            self.release,
            self.next,
            name_of(worst.name),
            largest,
            short_time(worst.at),
            tolerance,
            verdict,
        )


def versions(comparisons: Sequence[Comparison], request: Request) -> Page:
    """Return the page of releases, each compared with the next, and commands that ask why.

    Args:
        comparisons: Of each release with the next.
        request: What was run.
    """
    pairs = [_NextRelease.of(comparison) for comparison in comparisons]
    slots = slots_of(_releases_of(pairs), _changes_of(pairs, request))
    return template.page("lab/questions/versions", experiment=Path(request.what[0]).name, **slots)


@dataclass(frozen=True)
class _Releases:
    """What is compared, and how far apart it is.

    Attributes:
        first: The first release.
        last: The last one.
        until: The last moment that is compared [s].
        steps: A row for each release and the next.
        bars: How far each release is from the next.
        read: What a release reads in the file that the next does not, or the other way round.
    """

    first: str
    last: str
    until: float
    steps: Table
    bars: Bars
    read: Items


def _releases_of(pairs: Sequence[_NextRelease]) -> _Releases:
    return _Releases(
        first=pairs[0].release,
        last=pairs[-1].next,
        until=max(pair.comparison.until for pair in pairs),
        steps=_releases_table(pairs),
        bars=_releases_bars(pairs),
        read=Items(_notes_of(pairs)),
    )


def _notes_of(pairs: Sequence[_NextRelease]) -> list[str]:
    """Return what is noted of each release and the next, as sentences."""
    return [sentence(note) for pair in pairs for note in pair.comparison.notes]


def _releases_table(pairs: Sequence[_NextRelease]) -> Table:
    return Table(
        ("release", "next", "quantity", "largest", "at", "tolerance", "verdict"),
        [pair.cells() for pair in pairs],
        "From release to release",
        words=frozenset({0, 1, 2, 6}),
    )


def _releases_bars(pairs: Sequence[_NextRelease]) -> Bars:
    return Bars(
        "How far a release is from the next",
        "largest gap [tolerances]",
        [f"{pair.release} to {pair.next}" for pair in pairs],
        {"farthest beyond its tolerance": [pair.tolerances for pair in pairs]},
    )


@dataclass(frozen=True)
class _Changes:
    """Between which releases the motion changes.

    Attributes:
        why: Commands that ask why it does.
        same: True where it does nowhere; else None.
        differs: False where it does; else None.
        pairs: Between which; None for none.
        still: False where nothing moves on some of them, and the rest agrees; else None.
        nothing: What is said of that; "" else.
    """

    why: list[Block]
    same: bool | None = None
    differs: bool | None = None
    pairs: str | None = None
    still: bool | None = None
    nothing: str = ""


def _changes_of(pairs: Sequence[_NextRelease], request: Request) -> _Changes:
    what = request.what[0]
    model = request.model if request.model else request.scenario().model
    changed = [pair for pair in pairs if pair.comparison.outcome in ("differs", "ended")]
    still = [pair for pair in pairs if pair.comparison.outcome == "nothing moved"]
    if not changed and still:
        return _Changes([], still=False, nothing=nothing_moved(still[0].comparison.motion))
    if not changed:
        return _Changes([], same=True)
    why: list[Block] = []
    for pair in changed:
        sides = [f"{model}@{backend}" for backend in pair.backends]
        why.append(Code([command(["statemachine", "compare", what, *sides, "--why"])]))
    releases = [f"MuJoCo {pair.release} and {pair.next}" for pair in changed]
    return _Changes(why, differs=False, pairs=listed(releases))
