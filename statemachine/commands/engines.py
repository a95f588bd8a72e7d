"""`statemachine engines`: releases of an engine, each in an environment of its own."""

from __future__ import annotations

import argparse
import sys

from ._common import PROGRAM, add_table, json_of, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Other releases of MuJoCo, each in an environment of its own. Where an engine is "
        f"named, so can be a release: {PROGRAM} compare hold so101@mujoco==3.3.7 so101"
    )
    add_table(parser, json_of())
    verbs = parser.add_subparsers(metavar="verb")
    listing = verbs.add_parser("list", help="those that are here, and their size")
    add_table(listing, (*json_of(), {"default": argparse.SUPPRESS}))  # else it undoes the one above
    adding = verbs.add_parser("add", help="install a release")
    adding.add_argument("names", metavar="NAME", nargs="+", help="as mujoco==3.3.7")
    python = "the Python that it is to run on (default: this one)"
    add_table(adding, ("--python", "EXE", python, {"default": sys.executable}))
    adding.set_defaults(run=run_add)
    removing = verbs.add_parser("remove", help="remove a release, and free its space")
    removing.add_argument("name", metavar="NAME", help="as mujoco==3.3.7")
    removing.set_defaults(run=run_remove)


def run(options: argparse.Namespace) -> int:
    """What is here."""
    from ..releases import releases
    from ..report.engines import page

    here = list(releases())
    return show(page(here), here, options.json)


def run_add(options: argparse.Namespace) -> int:
    """Install one."""
    from ..releases import add as add_release
    from ..releases import releases

    for name in options.names:
        add_release(name, options.python)
    for release in releases():
        if release.name in options.names:
            print(f"{release.name} is here: {release.size / 1e6:.0f} MB")
    return 0


def run_remove(options: argparse.Namespace) -> int:
    """Remove one."""
    from ..releases import remove

    remove(options.name)
    print(f"{options.name} is removed")
    return 0
