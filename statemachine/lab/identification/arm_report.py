"""The page of a recording of an arm that stands alone: both arms in 3-D, curves, what it tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...measures import ENCODER_COUNT
from ...show.blocks import Block, Page
from ...show.templates import PageContent, render_blocks
from ..compare import Comparison, compare
from ..questions.events import events_of
from ..questions.run_files import RunFiles, ShownModels, write_page
from ..questions.stage.both_runs import BothRuns
from ..questions.stage.quantity_chart import charts_of
from ..recordings import Trace
from ..runs.reporter import QUIET, Reporter
from .ghosts import traces_of
from .results import IdentificationResult, RecordingResult
from .typed_question import recording_name, typed_question

_SPOKEN = 2  # charts that are spoken as the slider moves
_PEAK = 4.0  # times the floor: the largest of some thousand errors with that root mean square


@dataclass(frozen=True)
class ArmReport(PageContent):
    """What a page of a recording shows that stands alone, below its verdict.

    Attributes:
        runs: Both arms in 3-D.
        answer: What the recording tells.
        curves: A chart for each quantity.
        tolerance: How far apart a joint may be that was fitted [rad]; None where none was.
        command: What makes the page again.
    """

    template = "arm_report.md.j2"
    runs: BothRuns
    answer: Sequence[Block]
    curves: Sequence[Block]
    tolerance: float | None
    command: str


def check_page(file: Path, reporter: Reporter = QUIET) -> None:
    """Check that a page can be written, before anything runs; raises as `RunFiles.check` does."""
    RunFiles(html=file).check(reporter)


def write_arm_page(file: Path, result: RecordingResult | IdentificationResult) -> str:
    """Write the page of a recording, and return what was written, in a line.

    Args:
        file: Where to write it.
        result: What the recording tells.
    """
    traces = traces_of(result)
    comparison = compared_arms(result, *traces)
    shown = ShownModels([result.request.model] * 2, result.request.menagerie)
    return write_page(file, traces, shown, report_page(result, comparison, file))


def compared_arms(
    result: RecordingResult | IdentificationResult, measured: Trace, simulated: Trace
) -> Comparison:
    """Compare an arm as it was measured with its model.

    A fitted model differs where it is farther off than measuring alone takes it; the model as it is
    where it is off by a count of an encoder.

    Args:
        result: What the recording tells.
        measured: The arm as it was measured.
        simulated: The arm as it is simulated.
    """
    comparison = compare(measured, simulated)
    if not isinstance(result, IdentificationResult):
        return comparison
    larger = _tolerance(result) / ENCODER_COUNT
    tolerances = {each.kind: larger * each.tolerance for each in comparison.agreements}
    return compare(measured, simulated, tolerances=tolerances)


def _tolerance(result: IdentificationResult) -> float:
    """Return how far apart a joint that was fitted may be [rad]: a count of an encoder at least."""
    return max(ENCODER_COUNT, _PEAK * result.floor)


def report_page(
    result: RecordingResult | IdentificationResult, comparison: Comparison, file: Path
) -> Page:
    """Return the page of a recording that stands alone.

    Args:
        result: What the recording tells.
        comparison: Of the arm as it was measured and as it is simulated.
        file: Where it is written.
    """
    charts = charts_of(comparison)
    worst = comparison.worst
    lead = tuple(range(min(_SPOKEN, len(charts))))
    if worst is not None:
        lead = tuple(k for k, chart in enumerate(charts) if chart.curve.name == worst.name) or lead
    runs = BothRuns(
        recording_name(result.request.recording),
        comparison=comparison,
        start=0.0 if worst is None else worst.at,
        events=tuple(events_of(comparison)),
        charts=charts,
        lead=lead,
    )
    page = result.page(details=True)
    words = ("--why",) if isinstance(result, IdentificationResult) else ()
    command = typed_question(result.request, *words, "--html", file.name, folders=False)
    tolerance = _tolerance(result) if isinstance(result, IdentificationResult) else None
    blocks = render_blocks(ArmReport(runs, page.blocks, charts, tolerance, command))
    return Page(page.title, page.origin, blocks, page.headline)
