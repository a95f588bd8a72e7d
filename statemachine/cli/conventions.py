"""`statemachine conventions`: what each engine takes for granted, asked of the engines."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..errors import BadInputError
from .common import add_backend, add_json, show
from .long_work import LongWorkReporter

if TYPE_CHECKING:
    from ..lab.probes.conventions.request import CallsRequest, ConventionsRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Ask the engines themselves, not our backends: every answer is measured, on a small model "
        "made for the question, so that it is known what should come out. Of a model of yours "
        "`compare` tells."
    )
    parser.add_argument(
        "question",
        nargs="*",
        help="only these, such as quaternion or gravity (default: all; a wrong name lists them)",
    )
    parser.add_argument("--calls", action="store_true", help="which call does what, each run")
    add_backend(parser, "an engine, or all; may be repeated (default all)")
    add_json(parser)


def request_of(options: argparse.Namespace) -> ConventionsRequest | CallsRequest:
    """Return what was asked for.

    Raises:
        BadInputError: A question is given to --calls.
        UnknownNameError: There is no such question.
    """
    from ..lab.probes.conventions.request import CallsRequest, ConventionsRequest

    engines = tuple(options.backend or ["all"])
    if not options.calls:
        return ConventionsRequest(tuple(options.question), engines)
    if options.question:
        raise BadInputError("--calls shows all calls: it takes no question")
    return CallsRequest(engines)


def run(options: argparse.Namespace) -> int:
    """Ask, and show."""
    from ..lab.probes.conventions import page as report
    from ..lab.probes.conventions.request import CallsRequest, answer, answer_calls

    request = request_of(options)
    if isinstance(request, CallsRequest):
        phrases = answer_calls(request, LongWorkReporter())
        return show(report.calls_page(phrases), phrases, options.json)
    result = answer(request, LongWorkReporter())
    return show(report.page(result), result, options.json)
