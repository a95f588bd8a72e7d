"""`statemachine audit`: what exactly the state is, and what leaves it alone, found by trying."""

from __future__ import annotations

import argparse

from ._common import add_backend, add_json, add_menagerie, add_model, on_each_backend, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Save a run, go on, restore it, go on again, and compare every byte: on the "
        "engine itself, by its own functions, and through this interface. And whether forward, "
        "several steps in one call, threads and other processes change anything."
    )
    parser.epilog = (
        "Exit code 1 means that a promise is broken: that two restores "
        "of a State agree (and, where a backend says so, go on as the run itself), that step(n) "
        "is n steps, that forward and reading perturb nothing, that reset is a fresh start, that "
        "another Data, threads and processes change nothing. What an engine itself forgets is a "
        "fact, not a fault: it is shown, and the exit code is 0."
    )
    add_backend(parser)
    add_model(parser, "so101/scene_box")
    add_menagerie(parser)
    add_json(parser)
    parser.add_argument("--steps", type=int, default=60, metavar="N", help="of each future (60)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the commands (0)")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Try, and show."""
    from ..probes import audit
    from ..report import audit as report

    results = on_each_backend(
        options,
        "audit",
        options.model,
        lambda model, _backend, told: audit.run(
            model, steps=options.steps, seed=options.seed, progress=told
        ),
    )
    return show(report.page(results), results, options.json)
