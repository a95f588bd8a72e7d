"""How far the model of an arm is from a recording of it, and what of the model that tells."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...errors import BadInputError
from ...models import AnyPath
from ..identification import question, recorded_gap
from ..identification.results import (
    FEWEST_STARTS,
    IdentificationResult,
    RecordingRequest,
    RecordingResult,
)
from ..runs.reporter import QUIET, Reporter
from .arguments import check_alone


def recording(
    source: RecordingRequest | str,
    model: AnyPath | None = None,
    *,
    calibration: AnyPath | None = None,
    names: Mapping[str, str] | None = None,
    seconds: float | None = None,
    menagerie: AnyPath | None = None,
    reporter: Reporter = QUIET,
) -> RecordingResult:
    """Play the commands of a recorded arm into its model, and return how far that is from it.

        lab.recording("lerobot:pushes#3", "so101").gap.model

    Args:
        source: "lerobot:DIR#EPISODE", a data set of LeRobot; without "#EPISODE" its first
            episode. Or a RecordingRequest, which says all that is asked.
        model: A name or a file of the arm.
        calibration: LeRobot's calibration file; None to take unit and scale from the numbers.
        names: Joints of the recording by the names that they have in the model.
        seconds: How much of the episode is taken at most [s]; None for 20 s.
        menagerie: A menagerie folder to look the model's name up in.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: The recording cannot be read, or its numbers can mean several things.
        MissingEngineError: The extra `recordings` is not installed.
        StateMachineError: The model cannot be loaded.
    """
    return recorded_gap.answer(_request_of(recording, locals()), reporter)


def identify(
    source: RecordingRequest | str,
    model: AnyPath | None = None,
    *,
    calibration: AnyPath | None = None,
    names: Mapping[str, str] | None = None,
    seconds: float | None = None,
    starts: int = FEWEST_STARTS,
    seed: int = 0,
    menagerie: AnyPath | None = None,
    write: AnyPath | None = None,
    reporter: Reporter = QUIET,
) -> IdentificationResult:
    """Return what a recording of an arm tells of each parameter of its model.

        result = lab.identify("lerobot:pushes#3", "so101")
        table = pandas.DataFrame(result.to_dict())

    Args:
        source: As of `recording`.
        model: As of `recording`.
        calibration: As of `recording`.
        names: As of `recording`.
        seconds: As of `recording`.
        starts: How many starts the fit has, from 8 to 64.
        seed: Of the starts.
        menagerie: As of `recording`.
        write: Where the model's file is written with the figures that the recording determines;
            None for nowhere.
        reporter: Told how it gets on; by default no one, and notes are warnings.

    Raises:
        BadInputError: The recording cannot be read, its numbers can mean several things, or the
            file cannot be written.
        MissingEngineError: The extra `recordings` is not installed.
        StateMachineError: The model cannot be loaded.
    """
    return question.answer(_request_of(identify, locals()), reporter)


def _request_of(function: Callable[..., object], arguments: Mapping[str, Any]) -> RecordingRequest:
    """Return what a function was asked: the Request that it was given, or that of its arguments.

    Args:
        function: `recording` or `identify`.
        arguments: What it was called with, by name, as `locals()` has them.

    Raises:
        BadInputError: A Request and more are given, or no model is named.
    """
    source = arguments["source"]
    if isinstance(source, RecordingRequest):
        check_alone(function, arguments)
        return source
    asked = {name: arguments[name] for name in arguments if name not in ("source", "reporter")}
    if asked["model"] is None:
        raise BadInputError("a recording is compared with its arm: name a model, such as so101")
    if asked["names"] is None:
        asked["names"] = {}
    return RecordingRequest(source, **asked)
