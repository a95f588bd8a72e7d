"""`statemachine engines`: releases of an engine, each in an environment of its own."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from .common import PROGRAM, add_json, show

if TYPE_CHECKING:
    from ..lab.installation.engines import AddReleasesRequest, ReleasesRequest, RemoveReleaseRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options, and a parser for each verb."""
    parser.description = (
        "Other releases of MuJoCo, each in an environment of its own. Where an engine is "
        f"named, so can be a release: {PROGRAM} compare hold so101@mujoco==3.3.7 so101"
    )
    add_json(parser)
    verbs = parser.add_subparsers(metavar="verb")

    listing = verbs.add_parser("list", help="those that are here, and their size")
    add_json(listing, default=argparse.SUPPRESS)  # a default would undo the one before the verb

    adding = verbs.add_parser("add", help="install a release")
    adding.add_argument("names", metavar="NAME", nargs="+", help="as mujoco==3.3.7")
    adding.add_argument(
        "--python",
        default=sys.executable,
        metavar="EXE",
        help="the Python that it is to run on (default: this one)",
    )
    adding.set_defaults(run=run_add)

    removing = verbs.add_parser("remove", help="remove a release, and free its space")
    removing.add_argument("name", metavar="NAME", help="as mujoco==3.3.7")
    removing.set_defaults(run=run_remove)


def request_of(_options: argparse.Namespace) -> ReleasesRequest:
    """Return what was asked for, without a verb or with `list`."""
    from ..lab.installation.engines import ReleasesRequest

    return ReleasesRequest()


def request_to_add(options: argparse.Namespace) -> AddReleasesRequest:
    """Return what was asked for with `add`."""
    from ..lab.installation.engines import AddReleasesRequest

    return AddReleasesRequest(names=tuple(options.names), python=options.python)


def request_to_remove(options: argparse.Namespace) -> RemoveReleaseRequest:
    """Return what was asked for with `remove`."""
    from ..lab.installation.engines import RemoveReleaseRequest

    return RemoveReleaseRequest(options.name)


def run(options: argparse.Namespace) -> int:
    """Show what is here."""
    from ..lab.installation.engines import answer, page

    result = answer(request_of(options))
    return show(page(result), result, options.json)


def run_add(options: argparse.Namespace) -> int:
    """Install releases."""
    from ..lab.installation.engines import answer_add, size_of

    for release in answer_add(request_to_add(options), print):
        print(f"{release.name} is here: {size_of(release)}")
    return 0


def run_remove(options: argparse.Namespace) -> int:
    """Remove one."""
    from ..lab.installation.engines import answer_remove

    answer_remove(request_to_remove(options))
    print(f"{options.name} is removed")
    return 0
