"""The page of a comparison of two runs: the verdict, the worst quantities, what to type next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...measures.text import milliseconds, sentence
from ...show.blocks import Block, Page, Table
from ...show.first_screen import first_that_fits
from ...show.templates import PageContent, render_blocks
from ..compare import Comparison
from ..compare.base_frame_page import base_frame_blocks
from ..compare.call_periods_page import call_periods_blocks
from ..compare.known_changes_page import ShownChange, known_changes_blocks
from ..compare.labels import lines_on_unmatched
from ..compare.matched import Matched
from ..compare.series import SETTLED
from ..compare.written_state_page import written_state_blocks
from ..runs.floating import Bases
from .compare_details import details_of
from .compare_verdict import headline_of, sentence_labels
from .compared_names import long_labels, shortened, traces_of
from .finding import VerdictCounts
from .next_command import Purpose, next_command
from .policy_outcomes import policy_outcomes_blocks
from .requests.gap import CompareResult
from .worst import WORST, worst_of

_TITLE = 30  # characters of a name in the title of the table


@dataclass(frozen=True)
class SideCounts:
    """How many things there are to know of how two sides were run.

    Attributes:
        by_place: Joints, sites and actuators that were paired by their place in the robot.
        unmatched: Joints, sites and actuators that one side alone has.
        emulated: Features that a backend computes for its engine.
        notes: What else a reader should know, in sentences.
    """

    by_place: int
    unmatched: int
    emulated: int
    notes: int


@dataclass(frozen=True)
class ComparePage(PageContent):
    """What the page of a comparison shows below its verdict.

    Attributes:
        result: How far apart two runs are.
        worst: A row for each of the quantities that are farthest apart.
        rest: The verdicts of those that have no row.
        counts: How many things there are to know of both sides.
        purpose: What the command is for.
        command: What to type next, in lines; "" for nothing.
        details: Everything else, in sections; empty where that is not asked for.
    """

    template = "compare.md.j2"
    result: CompareResult
    worst: Table
    rest: VerdictCounts
    counts: SideCounts
    purpose: Purpose
    command: str
    details: Sequence[Block]

    @property
    def experiment(self) -> str:
        """Return the name of the experiment, function or trace that was compared."""
        experiment = self.result.comparison.left.trace.header.experiment
        return _in_title(Path(experiment).name)

    @property
    def file(self) -> str | None:
        """Return the model file of both sides; None where they have two."""
        traces = traces_of(self.result.comparison)
        left, right = (trace.header.provenance.model_file for trace in traces)
        return _in_title(left) if left == right else None

    @property
    def sides(self) -> tuple[str, str] | None:
        """Return both labels, where the verdict has only "the left" and "the right"; else None."""
        comparison = self.result.comparison
        if sentence_labels(comparison)[0] != "the left":
            return None
        left, right = long_labels(comparison)
        return _in_title(left), _in_title(right)

    @property
    def moments(self) -> int:
        """Return the number of moments that are compared."""
        return self.result.comparison.moments

    @property
    def gap_of_moments(self) -> float | None:
        """Return the time between two compared moments [s]; None where that is about one step."""
        return self.result.comparison.gap_of_moments

    @property
    def steps(self) -> tuple[str, str]:
        """Return the timestep of each side, in milliseconds."""
        left, right = traces_of(self.result.comparison)
        return milliseconds(left.timestep), milliseconds(right.timestep)

    @property
    def bases(self) -> Bases:
        """Return whether the base of each side floats, and what of it was taken over."""
        run = self.result.run
        return self.result.comparison.bases if run.bases is None else run.bases

    @property
    def unmatched_joints(self) -> list[str]:
        """Return a sentence for each side that has joints which the other lacks."""
        run = self.result.run
        if run.matched is None:
            return []
        labels = long_labels(self.result.comparison)
        joints = [{"joint": only.get("joint", ())} for only in run.matched.only_beside_bases]
        return [sentence(line) for line in lines_on_unmatched(joints, labels)]

    @property
    def missing(self) -> list[str]:
        """Return the parts that one side has nothing of."""
        return [missing.part for missing in self.result.finding.missing]

    @property
    def until(self) -> float:
        """Return the last moment that is compared [s]."""
        return self.result.comparison.until

    @property
    def window(self) -> float:
        """Return the time at the end over which the final figures are a mean [s]."""
        return SETTLED * self.until

    @property
    def total(self) -> int:
        """Return the number of quantities."""
        return len(self.result.comparison.agreements)


def page(result: CompareResult, details: bool = False) -> Page:
    """Return the page of a comparison, for a terminal.

    Args:
        result: How far apart two runs are.
        details: Whether everything follows that is known: all quantities, contacts, what rounding
            makes, tolerances and their reasons, what was paired and emulated, a third party.
    """
    if details:
        return _with_rows(result, WORST, details_of(result))
    return first_that_fits(_shorter_pages(result))


def _shorter_pages(result: CompareResult) -> Iterator[Page]:
    """Yield the page with ever fewer rows, then with a shorter command, too."""
    for rows in range(WORST, 0, -1):
        yield _with_rows(result, rows, ())
    yield _with_rows(result, 1, (), is_short=True)


def _with_rows(
    result: CompareResult, rows: int, details: Sequence[Block], is_short: bool = False
) -> Page:
    """Return the page.

    Args:
        result: How far apart two runs are.
        rows: How many of the worst quantities have a row.
        details: What follows.
        is_short: Whether the command leaves the quantity to itself.
    """
    comparison, finding = result.comparison, result.finding
    worst = worst_of(comparison, finding, result.floor, rows)
    table, rest = worst.narrow_table, worst.rest
    if finding.outcome == "nothing moved" or finding.is_same:  # a row could say nothing
        table, rest = replace(table, rows=[]), VerdictCounts(0, 0, 0)
    periods = result.call_periods
    following = next_command(result.request.run, finding, result.instead, periods)
    content = ComparePage(
        result=result,
        worst=table,
        rest=rest,
        counts=side_counts(result),
        purpose=following.purpose,
        command=following.short_text if is_short else following.text,
        details=details,
    )
    headline = headline_of(finding, comparison, result.instead)
    frame = base_frame_blocks(content.bases.frame)
    call_periods_note = call_periods_blocks(periods)
    state = written_state_blocks(comparison.left.trace, comparison.right.trace)
    outcomes = policy_outcomes_blocks(comparison)
    changes = _known_changes(result)
    notes = [*state, *call_periods_note, *frame, *changes]
    blocks = [*outcomes, *notes, *render_blocks(content)]
    return Page(title_of(comparison), origin_of(comparison), blocks, headline)


def _known_changes(result: CompareResult) -> list[Block]:
    """Say what is known to have changed between the releases of two sides, as far as it acts."""
    left, right = (side.run.label for side in (result.comparison.left, result.comparison.right))
    versions = left.rpartition(" ")[2], right.rpartition(" ")[2]
    return known_changes_blocks([ShownChange(*versions, change) for change in result.changes])


def _in_title(name: str) -> str:
    return shortened([name], _TITLE)[0]


def side_counts(result: CompareResult) -> SideCounts:
    """Count what there is to know of how two sides were run."""
    run, comparison = result.run, result.comparison
    by_place, unmatched, remarks = 0, 0, 0
    if run.matched is not None:
        by_place = _paired_by_place(run.matched, result.request.run.names)
        remarks = len(run.matched.notes)
        for only in run.matched.only:
            unmatched += sum(len(names) for names in only.values())
    emulated = 0
    for side in (comparison.left, comparison.right):
        if side.trace.header.defaults == "model":
            emulated += len(side.trace.header.provenance.emulated)
    # Each pair has a remark of its own.
    notes = len(run.notes) + len(comparison.notes) + max(0, remarks - by_place)
    return SideCounts(by_place, unmatched, emulated, notes)


def _paired_by_place(matched: Matched, names: Mapping[str, str]) -> int:
    """Return how many joints, sites and actuators are paired that have two names.

    Args:
        matched: The pairs.
        names: Two names that were said to be one.
    """
    left, right = matched.left, matched.right
    count = 0
    for left_names, right_names, pairs in (
        (left.joint_names, right.joint_names, matched.joints),
        (left.site_names, right.site_names, matched.sites),
        (left.actuator_names, right.actuator_names, matched.actuators),
    ):
        for left_id, right_id in pairs:
            name = left_names[left_id]
            count += names.get(name, name) != right_names[right_id]
    return count


def title_of(comparison: Comparison) -> str:
    """Return what was run, and on which two sides."""
    return f"{comparison.left.trace.header.experiment}: {' and '.join(long_labels(comparison))}"


def origin_of(comparison: Comparison) -> str:
    """Return the files that were run, on what, and with which steps, in one line."""
    files: dict[str, None] = {}
    sides, labels = list[str](), long_labels(comparison)
    for label, trace in zip(labels, traces_of(comparison), strict=True):
        source = trace.header.provenance
        files[f"{source.model_file} ({source.model_sha256[:8]})"] = None
        side = f"{label}, {milliseconds(trace.header.timestep)}"
        if source.seed is not None:
            side += f", seed {source.seed}"
        sides.append(side)
    parts = list(files)
    engine = comparison.left.trace.header.label
    if engine not in labels[0]:
        parts.append(f"both on {engine}")
    return "; ".join([*parts, *sides])
