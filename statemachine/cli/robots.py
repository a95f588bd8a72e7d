"""`statemachine robots`: any folder of models, and what each does on every engine."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..typed_numbers import typed_float, typed_int
from .common import (
    SAYS_NO,
    add_json,
    add_seed,
    add_trust,
    file_name,
    show,
)
from .long_work import LongWorkReporter
from .resuming import resumable

if TYPE_CHECKING:
    from ..lab.robots.request import RobotsRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Examine every MJCF and URDF in a folder and below it, each in a process of its own: does "
        "it load, is it the bits of the engine without us, how far apart are two engines under "
        "the same random commands, without contacts and with them, is a State restored, what does "
        "the witness say, which experiments run, what does a step cost. Of one model: all that "
        "was found."
    )
    parser.epilog = (
        "Exit code 1: a model could not be examined to its end (it crashed, or took too long), or "
        "what was found contradicts: other bits than the engine's, a restore that parts, a gap "
        "without contacts that neither a warning nor the timestep accounts for, an explosion, a "
        "witness that places a frame elsewhere. A refusal is a fact, and no fault."
    )
    parser.add_argument("paths", nargs="+", metavar="DIR|FILE", help="folders of models, or models")
    parser.add_argument(
        "--out",
        type=file_name,
        metavar="TABLE",
        help="write the table there after each model, .csv or .json; typed again, it examines "
        "only models that are new or changed",
    )
    parser.add_argument(
        "--quick", action="store_true", help="leave out the experiments and the costs"
    )
    parser.add_argument(
        "--seconds", type=typed_float, default=60.0, metavar="S", help="that a model may take (60)"
    )
    parser.add_argument(
        "--jobs",
        type=typed_int,
        metavar="N",
        help="how many models at once (default: one for each processor)",
    )
    add_seed(parser, "what is drawn")
    add_trust(parser)
    add_json(parser, "table")


def request_of(options: argparse.Namespace) -> RobotsRequest:
    """Return what was asked for.

    Raises:
        BadInputError: A number is out of range, or the table cannot be written.
    """
    from ..lab.robots.request import RobotsRequest

    return RobotsRequest(
        paths=tuple(options.paths),
        table=options.out,
        quick=options.quick,
        seconds=options.seconds,
        jobs=options.jobs,
        seed=options.seed,
    )


def run(options: argparse.Namespace) -> int:
    """Examine, and show."""
    from ..lab.robots.page import page
    from ..lab.robots.request import answer

    request = request_of(options)
    with resumable(request.table, "examined"):
        survey = answer(request, LongWorkReporter())
    show(page(survey), survey, options.json)
    return SAYS_NO if survey.wrong else 0
