"""Files of a comparison: a page, a figure, a film, a report for CI; which one, the suffix says."""

from __future__ import annotations

from pathlib import Path

from ...errors import BadInputError
from ...models import AnyPath
from ...show.charts import write_pictures
from ..identification.arm_report import check_page, write_arm_page
from ..identification.results import IdentificationResult, RecordingResult
from ..questions import plot
from ..questions.compare_report import whole_page
from ..questions.page_command import page_command
from ..questions.requests.causes import ExplainRequest
from ..questions.requests.gap import CompareResult
from ..questions.requests.versions import VersionsResult
from ..questions.run_files import (
    RunFiles,
    ShownModels,
    find_renderer,
    write_film,
    write_page,
    write_tests,
)
from ..runs.reporter import QUIET, Reporter

_PAGES, _FIGURES, _FILM, _TESTS = (".html", ".htm"), (".svg", ".png", ".pdf"), ".webp", ".xml"


def write(
    result: CompareResult | VersionsResult | RecordingResult | IdentificationResult,
    file: AnyPath,
    *,
    why: bool = True,
    reporter: Reporter = QUIET,
) -> Path:
    """Write a file of a comparison, and return where it is.

        lab.write(lab.compare("a.xml", "b.xml", what="hold"), "hold.html")

    Args:
        result: Of `compare`; of `versions` for a figure or a report for CI; of `recording` or
            `identify` for a page.
        file: "NAME.html" for a page that stands alone, with both runs in 3D; .svg, .png or .pdf for
            a figure; .webp for a film of both sides; .xml for each quantity as a test of JUnit.
        why: Whether causes are looked for, which a page then says.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: The suffix says none of these, or the file cannot be written.
        MissingEngineError: An extra is missing.
        StateMachineError: A model is not here.
    """
    target = Path(file)
    suffix = target.suffix.lower()
    if isinstance(result, VersionsResult):
        _write_of_versions(result, target, suffix)
    elif isinstance(result, RecordingResult | IdentificationResult):
        check_page(target, reporter)
        write_arm_page(target, result)
    elif suffix in _PAGES:
        _write_page(result, target, why, reporter)
    elif suffix in _FIGURES:
        RunFiles(plot=target).check(reporter)
        plot.write_plot(plot.of_comparison(result.comparison, result.floor), target)
    elif suffix == _FILM:
        RunFiles(film=target).check(reporter)
        shown, renderer = ShownModels.of(result.request.run), find_renderer(reporter)
        write_film(target, result.run.traces, shown, renderer, result.comparison, reporter)
    elif suffix == _TESTS:
        RunFiles(junit=target).check(reporter)
        write_tests(target, [result.comparison])
    else:
        raise _other_suffix(target, (*_PAGES[:1], *_FIGURES, _FILM, _TESTS))
    return target


def _write_of_versions(result: VersionsResult, target: Path, suffix: str) -> None:
    """Write a figure of releases, or a report for CI."""
    if suffix in _FIGURES:
        RunFiles(plot=target).check()
        write_pictures(result.page().blocks, target)
    elif suffix == _TESTS:
        RunFiles(junit=target).check()
        write_tests(target, result.comparisons)
    else:
        raise _other_suffix(target, (*_FIGURES, _TESTS))


def _write_page(result: CompareResult, target: Path, why: bool, reporter: Reporter) -> None:
    """Write a page that stands alone."""
    RunFiles(html=target).check(reporter)
    run = result.request.run
    asked = ExplainRequest(run, uncertainty=result.request.uncertainty) if why else None
    made_by = page_command(result.request, asked, target)
    page = whole_page(result, asked, made_by, reporter)
    write_page(target, result.run.traces, ShownModels.of(run), page)


def _other_suffix(target: Path, suffixes: tuple[str, ...]) -> BadInputError:
    return BadInputError(f"a file of it ends in {', '.join(suffixes)}; got {target.name!r}")
