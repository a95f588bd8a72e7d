"""The answers of `statemachine compare`: computed, written where that is asked for, shown."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import EndedEarlyError
from ..common import INTERRUPTED, print_error, show
from ..long_work import LongWorkReporter
from .options import check_options
from .recordings import names_recording, run_recording
from .requests import explain_request_of, request_of
from .stopping import end_line_of_terminal, stop_is_said

if TYPE_CHECKING:
    from ...engines.pictures import Renderer
    from ...lab.questions.requests.causes import ExplainRequest
    from ...lab.questions.requests.converge import ConvergeRequest
    from ...lab.questions.requests.engines import EnginesRequest
    from ...lab.questions.requests.gap import CompareRequest, CompareResult
    from ...lab.questions.requests.models import ModelsRequest
    from ...lab.questions.requests.one_step import OneStepRequest
    from ...lab.questions.requests.versions import VersionsRequest
    from ...lab.questions.run_files import RunFiles

    Question = (
        CompareRequest
        | EnginesRequest
        | ExplainRequest
        | OneStepRequest
        | ConvergeRequest
        | VersionsRequest
        | ModelsRequest
    )


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ...lab.questions.requests.causes import ExplainRequest
    from ...lab.questions.requests.converge import ConvergeRequest
    from ...lab.questions.requests.engines import EnginesRequest
    from ...lab.questions.requests.models import ModelsRequest
    from ...lab.questions.requests.one_step import OneStepRequest
    from ...lab.questions.requests.versions import VersionsRequest

    if names_recording(options):
        return run_recording(options)
    check_options(options)
    match request_of(options):
        case ModelsRequest() as request:
            return _run_models(options, request)
        case OneStepRequest() as request:
            return _run_one_step(options, request)
        case ConvergeRequest() as request:
            return _run_converge(options, request)
        case EnginesRequest() as request:
            return _run_engines(options, request)
        case VersionsRequest() as request:
            return _run_versions(options, request)
        case ExplainRequest() as request:
            return _run_explain(options, request)
        case request:
            return _run_compare(options, request)


def _run_models(options: argparse.Namespace, request: ModelsRequest) -> int:
    """Compare two files."""
    from ...lab.questions.requests.models import answer

    with stop_is_said():
        result = answer(request, LongWorkReporter())
    return show(result.page(options.details), result, options.json)


def _run_one_step(options: argparse.Namespace, request: OneStepRequest) -> int:
    """Compare one step of both sides."""
    from ...lab.questions import one_step
    from ...lab.questions.requests.one_step import answer

    with stop_is_said():
        result = answer(request, LongWorkReporter())
    return show(one_step.page(result, options.details), result, options.json)


def _run_converge(options: argparse.Namespace, request: ConvergeRequest) -> int:
    """Run both sides with ever finer steps."""
    from ...lab.questions import convergence
    from ...lab.questions.requests.converge import answer

    with stop_is_said():
        result = answer(request, LongWorkReporter())
    return show(convergence.page(result, options.details), result, options.json)


def _run_engines(options: argparse.Namespace, request: EnginesRequest) -> int:
    """Compare each two of three sides or more, and look which one is odd."""
    from ...lab.questions import engines
    from ...lab.questions.requests.engines import answer

    with stop_is_said():
        result = answer(request, LongWorkReporter())
    return show(engines.page(result, options.details), result, options.json)


def _run_versions(options: argparse.Namespace, request: VersionsRequest) -> int:
    """Compare each release with the next one."""
    from ...lab.questions import versions
    from ...lab.questions.requests.versions import answer
    from ...lab.questions.run_files import write_tests
    from ...show.charts import write_pictures

    _files_of(options).check(LongWorkReporter())
    with stop_is_said():
        result = answer(request, LongWorkReporter())
    if options.junit is not None:
        write_tests(options.junit, result.comparisons)
    page = versions.page(result, options.details)
    if options.plot is not None:
        write_pictures(page.blocks, options.plot)
    return show(page, result, options.json)


def _run_explain(options: argparse.Namespace, request: ExplainRequest) -> int:
    """Explain the gap; of runs that end early, say what there is until then, and no cause.

    Where a Ctrl-C ends it, what is known by then is shown.
    """
    from ...lab.questions.requests.causes import answer
    from ...lab.questions.requests.gap import CompareRequest
    from ...lab.why import InterruptedExplanation
    from ...lab.why import page as why

    interrupted = False
    try:
        with stop_is_said():
            result = answer(request, LongWorkReporter())
    except InterruptedExplanation as stop:
        result, interrupted = stop.result, True
    except EndedEarlyError:
        until_then = CompareRequest(request.run, uncertainty=request.uncertainty)
        return _run_compare(options, until_then)
    code = show(why.page(result, options.details), result, options.json)
    return INTERRUPTED if interrupted else code


def _run_compare(options: argparse.Namespace, request: CompareRequest) -> int:
    """Compare both runs, write what is asked for, and show."""
    from ...lab.questions import compare_report, comparison
    from ...lab.questions.page_command import page_command
    from ...lab.questions.requests.gap import answer
    from ...lab.questions.run_files import ShownModels, find_renderer, write_page, write_tests
    from ...lab.why import InterruptedExplanation
    from ...lab.why import page as why

    reporter = LongWorkReporter()
    files = _files_of(options)
    files.check(reporter)
    renderer = None if files.film is None else find_renderer(reporter)
    asked = None
    if files.html is not None and not options.no_why:
        asked = explain_request_of(options, request.run)
    with stop_is_said():
        result = answer(request, reporter)
    page = comparison.page(result, options.details)
    shown = result.figures()
    if files.html is not None:
        made_by = page_command(request, asked, files.html, options.why)
        try:
            if options.why:
                parts = compare_report.report_parts(result, asked, made_by, reporter)
                report_page = compare_report.report_page(result, parts)
                if parts.explanation is not None:
                    shown, page = parts.explanation, why.page(parts.explanation, options.details)
                elif parts.why_not:
                    print_error(parts.why_not, 0)
            else:
                report_page = compare_report.whole_page(result, asked, made_by, reporter)
        except InterruptedExplanation as stop:
            end_line_of_terminal()
            print_error(f"stopped: {files.html} was not written", 0)
            show(why.page(stop.result, options.details), stop.result, options.json)
            return INTERRUPTED
        line = write_page(files.html, result.run.traces, ShownModels.of(request.run), report_page)
        print(line, file=sys.stderr)
    if files.junit is not None:
        write_tests(files.junit, [result.comparison])
    if options.json:
        for line in (*result.run.unmatched, *result.run.notes):
            print_error(line, 0)
    code = show(page, shown, options.json)
    _write_pictures(files, result, renderer)
    return code


def _files_of(options: argparse.Namespace) -> RunFiles:
    """Return the files that are to be written."""
    from ...lab.questions.run_files import RunFiles

    html = None if options.html is None else Path(options.html)
    return RunFiles(html=html, junit=options.junit, plot=options.plot, film=options.film)


def _write_pictures(files: RunFiles, result: CompareResult, renderer: Renderer | None) -> None:
    """Write the figure and the film that are asked for."""
    from ...lab.questions.run_files import ShownModels, write_figure, write_film

    reporter, traces = LongWorkReporter(), result.run.traces
    if files.plot is not None:
        write_figure(files.plot, traces, result.comparison, result.floor, reporter)
    if files.film is not None and renderer is not None:
        shown = ShownModels.of(result.request.run)
        write_film(files.film, traces, shown, renderer, result.comparison, reporter)
