"""What every page of a recording shows: how far its arm is from the model, and what was read."""

from __future__ import annotations

from dataclasses import dataclass

from ..recordings.robot_types import is_so_arm
from ..runs.provenance import Provenance
from .results import IdentificationResult, RecordingGap, RecordingResult
from .typed_question import recording_name


@dataclass(frozen=True)
class PageOfRecording:
    """What every page of a recording shows.

    Attributes:
        result: What was computed.
    """

    result: RecordingResult | IdentificationResult

    @property
    def gap(self) -> RecordingGap:
        """Return how far commands and model are from the arm, on what was not fitted."""
        return self.result.gap

    @property
    def provenance(self) -> Provenance:
        """Return what it was computed with."""
        return self.result.provenance

    @property
    def recording(self) -> str:
        """Return the recording, without its folder."""
        return recording_name(self.result.request.recording)

    @property
    def other_robot(self) -> str:
        """Return the robot that the data set is of; "" for an SO-100 or SO-101, and for no word."""
        robot = self.result.recordings.fitted.robot
        return "" if is_so_arm(robot) else robot

    @property
    def model_file(self) -> str:
        """Return the name of the model's file."""
        return self.provenance.model_file.rpartition("/")[2]
