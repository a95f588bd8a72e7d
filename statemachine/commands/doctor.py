"""`statemachine doctor`: what this machine has, and what to do."""

from __future__ import annotations

import argparse

from ._common import MISSING, add_table, json_of, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    add_table(parser, json_of("findings"))


def run(options: argparse.Namespace) -> int:
    """Examine, and show."""
    from ..report import doctor

    diagnosis = doctor.examine()
    return MISSING if show(doctor.page(diagnosis), diagnosis, options.json) else 0
