"""`statemachine audit`: what exactly the state is, and what leaves it alone, found by trying."""

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
    add_table(
        parser,
        BACKEND,
        model_of(default="so101/scene_box"),
        *menagerie(),
        json_of(),
        ("--steps", "N", "of each future (60)", {"default": 60}),
        seed_of("the commands"),
    )


def run(options: argparse.Namespace) -> int:
    """Try, and show."""
    from ..probes import audit
    from ..report import audit as report

    results = on_each_backend(
        options,
        "audit",
        options.model,
        lambda model, _backend, bar: audit.run(
            model, steps=options.steps, seed=options.seed, progress=bar
        ),
    )
    return show(report.page(results), results, options.json)
