"""`statemachine fingertip`: an engine's fingertip against an independent witness."""

from __future__ import annotations

import argparse

from ._common import (
    BACKEND,
    add_table,
    json_of,
    menagerie,
    model_of,
    on_each_backend,
    seed_of,
    show,
)


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = "Compare poses of sites or bodies on an engine with Pinocchio's."
    add_table(
        parser,
        BACKEND,
        model_of(default="so101"),
        *menagerie(),
        json_of(),
        ("--poses", "N", "how many (200)", {"default": 200}),
        seed_of("the poses"),
        (
            "--site",
            "NAME",
            "the site or body (gripperframe if there is one, else every body at an end)",
        ),
        ("--witness", "FILE", "what Pinocchio reads (default: the model)"),
        ("--witness-frame", "NAME", "the frame's name there"),
    )


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ..lessons.certificate import page
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
