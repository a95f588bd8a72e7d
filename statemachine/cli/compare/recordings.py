"""`statemachine compare lerobot:DIR#3 MODEL`: a recording of a real arm against its model."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import BadInputError
from ...installed import DEFAULT
from ...measures.text import command
from ..common import INTERRUPTED, PROGRAM, is_given, print_error, show
from ..long_work import LongWorkReporter
from .options import refuse_options
from .requests import pairs_of
from .stopping import stop_is_said

if TYPE_CHECKING:
    from ...lab.identification.results import (
        IdentificationResult,
        RecordingRequest,
        RecordingResult,
    )

# What goes with a recording; the other options are of runs that are made on both sides.
OPTIONS_OF_RECORDINGS = frozenset(
    {"what", "calibration", "why", "html", "write", "json", "details", "seconds", "seed", "map"}
    | {"menagerie", "trust_binary", "help", "help_all", "run"}
)
_NOT_OF_RECORDINGS = "{} does not go with a recording of an arm"
_EXAMPLE = f"{PROGRAM} compare lerobot:DIR#3 so101"


def names_recording(options: argparse.Namespace) -> bool:
    """Tell whether a recording of a real arm is among the words."""
    from ...lab.recordings.arm_recording import is_arm_recording

    return any(map(is_arm_recording, options.what))


def recording_request_of(options: argparse.Namespace) -> RecordingRequest:
    """Return what is asked of a recording.

    Raises:
        BadInputError: What is typed is of something else, or there is not one model.
        StateMachineError: There is no such model.
    """
    from ...lab.identification.results import RecordingRequest

    others = [name for name in vars(options) if name not in OPTIONS_OF_RECORDINGS]
    refuse_options(options, others, _NOT_OF_RECORDINGS)
    if options.models is not None:  # without a word of its own, too
        raise BadInputError(_NOT_OF_RECORDINGS.format("--models"))
    if is_given(options, "write") and not options.why:
        raise BadInputError("--write goes with --why: it writes the figures that are fitted")
    return RecordingRequest(
        recording=options.what[0],
        model=_model_of(options),
        calibration=options.calibration,
        names=pairs_of(options.map, "--map"),
        seconds=options.seconds,
        seed=options.seed,
        menagerie=options.menagerie,
        write=options.write,
    )


def _model_of(options: argparse.Namespace) -> str:
    """Return the model that a recording is compared with.

    Raises:
        BadInputError: There is not one, or it is to run otherwise than as its file has it.
        StateMachineError: There is no such model.
    """
    from ...lab.compare.typed_sides import parse_sides
    from ...lab.recordings.arm_recording import is_arm_recording

    recording, *words = options.what
    if not is_arm_recording(recording):
        raise BadInputError(f"the recording of an arm stands first: {_EXAMPLE}")
    if not words:
        raise BadInputError(
            f"a recording is compared with its arm: {command([PROGRAM, 'compare', recording])} "
            "so101"
        )
    if any(map(is_arm_recording, words)):
        raise BadInputError("a recording of an arm is compared with a model, not with another one")
    side, *more = parse_sides(words, options.menagerie)
    if more:
        raise BadInputError(
            f"a recording of an arm is compared with one model; got {len(more) + 1}"
        )
    if side.options:
        name = next(iter(side.options))
        raise BadInputError(
            f"{name}= does not go with a recording of an arm: the model runs as its file has it"
        )
    if side.engine != DEFAULT or side.defaults != "model":
        raise BadInputError(
            f"a recording of an arm is fitted on the worlds of {DEFAULT}, and compared there; type "
            f"{side.model} instead of {side.model}@{side.chosen_backend()}"
        )
    return side.model


def run_recording(options: argparse.Namespace) -> int:
    """Compare a recording with its model, or fit that, and show."""
    from ...lab.identification.arm_report import check_page, write_arm_page
    from ...lab.identification.results import InterruptedIdentification

    request, reporter = recording_request_of(options), LongWorkReporter()
    page_file = None if options.html is None else Path(options.html)
    if page_file is not None:
        check_page(page_file, reporter)
    try:
        with stop_is_said():
            result = _result_of(request, options.why, reporter)
    except InterruptedIdentification as stop:
        for file in (page_file, request.write):
            if file is not None:
                print_error(f"stopped: {file} was not written", 0)
        show(stop.result.page(options.details), stop.result, options.json)
        return INTERRUPTED
    try:
        if page_file is not None:
            print(write_arm_page(page_file, result), file=sys.stderr)
    finally:  # a disk that is full takes nothing from what took a minute
        code = show(result.page(options.details), result, options.json)
    return code


def _result_of(
    request: RecordingRequest, why: bool, reporter: LongWorkReporter
) -> RecordingResult | IdentificationResult:
    """Compute what is asked."""
    if why:
        from ...lab.identification import question

        return question.answer(request, reporter)
    from ...lab.identification import recorded_gap

    return recorded_gap.answer(request, reporter)
