"""The question what works on this machine."""

from __future__ import annotations

from dataclasses import dataclass

from . import doctor


@dataclass(frozen=True)
class DoctorRequest:
    """Question what works on this machine; it is asked in one way only."""


def answer(_request: DoctorRequest) -> doctor.Diagnosis:
    """Look at Python, the engines, rendering, the viewer, the import name and the extras."""
    return doctor.examine()
