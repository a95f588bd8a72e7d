"""`statemachine` alone: the four commands to begin with."""

from __future__ import annotations

import argparse
from importlib import resources

from ..course.lessons import PATH
from ..program import as_called


def overview(_options: argparse.Namespace) -> int:
    """Say what there is to begin with."""
    text = resources.files("statemachine.cli").joinpath("overview.md").read_text("utf-8")
    print(as_called(text.format(count=len(PATH))), end="")
    return 0
