"""`statemachine doctor`: what this machine has, and what to do."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from .common import MISSING, add_json, show

if TYPE_CHECKING:
    from ..lab.installation.doctor_request import DoctorRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    add_json(parser, "findings")


def request_of(_options: argparse.Namespace) -> DoctorRequest:
    """Return what was asked for."""
    from ..lab.installation.doctor_request import DoctorRequest

    return DoctorRequest()


def run(options: argparse.Namespace) -> int:
    """Examine, and show."""
    from ..lab.installation import doctor
    from ..lab.installation.doctor_request import answer

    diagnosis = answer(request_of(options))
    code = show(doctor.page(diagnosis), diagnosis, options.json)
    return 0 if code == 0 else MISSING
