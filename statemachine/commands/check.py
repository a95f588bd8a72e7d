"""`statemachine check`: exercises judged by what they do."""

from __future__ import annotations

import argparse
from typing import Any

from . import _mutants
from ._common import add_backend, add_json


def add(commands: Any) -> None:
    """The subparser."""
    parser = commands.add_parser(
        "check", help="judge an exercise by what it does", description="Judge an exercise."
    )
    _mutants.add(parser)
    add_backend(parser, everyone=False)
    add_json(parser)
    parser.set_defaults(run=run, parser=parser)


def run(options: argparse.Namespace) -> int:
    """Judge, and show."""
    if options.mutants is None:
        options.parser.error("the following arguments are required: --mutants TESTFILE")
    return _mutants.run(options)
