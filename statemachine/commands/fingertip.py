"""`statemachine fingertip`: an engine's fingertip against an independent witness."""

from __future__ import annotations

import argparse

from ._common import add_backend, add_json, add_menagerie, add_model, on_each_backend, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = "Compare poses of sites or bodies on an engine with Pinocchio's."
    add_backend(parser)
    add_model(parser, "so101")
    add_menagerie(parser)
    add_json(parser)
    parser.add_argument("--poses", type=int, default=200, metavar="N", help="how many (200)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the poses (0)")
    parser.add_argument(
        "--site",
        default=None,
        metavar="NAME",
        help="the site or body (gripperframe if there is one, else every body at an end)",
    )
    parser.add_argument(
        "--witness", default=None, metavar="FILE", help="what Pinocchio reads (default: the model)"
    )
    parser.add_argument(
        "--witness-frame", default=None, metavar="NAME", help="the frame's name there"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ..lessons._certificate import page
    from ..lessons.fingertip import certify

    results = on_each_backend(
        options,
        "fingertip",
        options.model,
        lambda model, _backend, report: certify(
            model,
            poses=options.poses,
            seed=options.seed,
            site=options.site,
            witness=options.witness,
            witness_frame=options.witness_frame,
            progress=report,
        ),
    )
    return show(page(results), results, options.json)
