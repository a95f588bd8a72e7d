"""The command that asks something of a recording of a real arm, to be typed again."""

from __future__ import annotations

import os
from pathlib import Path

from ...program import NAME
from ..compare.typed_command import TypedCommand
from ..compare.what import without_folders
from ..recordings.arm_recording import PREFIX
from .results import RecordingRequest

_SOME_FOLDER = "DIR"


def typed_question(request: RecordingRequest, *further: str, folders: bool = True) -> str:
    """Return the command that asks a question, in lines.

    Args:
        request: What was asked.
        *further: Options that follow, such as "--why".
        folders: Whether paths have their folders; on a page that is handed on they have none.
    """
    words = (NAME, "compare", *_words_of(request, folders))
    return TypedCommand(words).lines(*further)


def recording_name(recording: str) -> str:
    """Return a recording as it is typed, without the folder that its data set lies in."""
    # A folder of the data set ends in its name, an episode behind it included.
    return f"{PREFIX}{Path(recording.removeprefix(PREFIX)).name}"


def _words_of(request: RecordingRequest, folders: bool) -> list[str]:
    """Return recording, model and options as they are typed."""
    recording, model = request.recording, os.fspath(request.model)
    if not folders:
        recording, model = recording_name(recording), without_folders(model)
    words = [recording, model]
    if request.calibration is not None:
        file = Path(request.calibration)
        words += ["--calibration", str(file) if folders else file.name]
    for name, other in request.names.items():
        words += ["--map", f"{name}={other}"]
    if request.seconds is not None:
        words += ["--seconds", f"{request.seconds:g}"]
    if request.seed:
        words += ["--seed", str(request.seed)]
    if request.menagerie is not None:
        words += ["--menagerie", str(request.menagerie) if folders else _SOME_FOLDER]
    return words
