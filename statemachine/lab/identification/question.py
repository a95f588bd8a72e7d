"""The question --why of a recording: the fit, and the model's file with what came of it."""

from __future__ import annotations

from ..runs.reporter import QUIET, Reporter
from .identify import identify
from .results import IdentificationResult, RecordingRequest
from .written_model import check_written, with_written


def answer(request: RecordingRequest, reporter: Reporter = QUIET) -> IdentificationResult:
    """Return what a recording tells of its model, and write its file with that if it is asked.

    Raises:
        BadInputError: The recording cannot be read, or the file cannot be written.
        StateMachineError: The model cannot be loaded.
        InterruptedIdentification: Ctrl-C once the fit was known; no file was written.
    """
    check_written(request)
    return with_written(identify(request, reporter))
