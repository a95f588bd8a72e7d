"""`statemachine compare`: two descriptions of a robot."""

from __future__ import annotations

import argparse
from typing import Any

from ..errors import BadInputError
from . import _compare_models
from ._common import add_json, add_menagerie


def add(commands: Any) -> None:
    """The subparser."""
    parser = commands.add_parser(
        "compare",
        help="where two descriptions of a robot differ, and by how much",
        description="Compare two descriptions of a robot before anything moves.",
    )
    _compare_models.add_options(parser)
    add_menagerie(parser)
    add_json(parser)
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of random poses (0)")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    if not options.models:
        raise BadInputError("compare wants --models A B")
    return _compare_models.run(options)
