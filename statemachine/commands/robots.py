"""`statemachine robots`: any folder of models, and what each does on every engine."""

from __future__ import annotations

import argparse

from ._common import SAYS_NO, TRUST, add_table, file_name, json_of, resumable, seed_of, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Examine every MJCF and URDF in a folder and below it, each in a process of its own: does "
        "it load, is it the bits of the engine without us, how far apart are two engines under "
        "the same random commands, without contacts and with them, is a State restored, what does "
        "the witness say, which experiments run, what does a step cost. Of one model: all that "
        "was found."
    )
    parser.epilog = (
        "Exit code 1: a model could not be examined to its end (it crashed, or took too long), or "
        "what was found contradicts: other bits than the engine's, a restore that parts, a gap "
        "without contacts that neither a warning nor the timestep accounts for, an explosion, a "
        "witness that places a frame elsewhere. A refusal is a fact, and no fault."
    )
    add_table(
        parser,
        ("paths", "DIR|FILE", "folders of models, or models", {"nargs": "+"}),
        (
            "--out",
            "TABLE",
            "write the table there after each model, .csv or .json; typed again, it examines "
            "only models that are new or changed",
            {"type": file_name},
        ),
        ("--quick", "", "leave out the experiments and the costs"),
        ("--seconds", "S", "that a model may take (60)", {"default": 60.0}),
        ("--jobs", "N", "how many models at once (default: one for each processor)"),
        seed_of("what is drawn"),
        TRUST,
        json_of("table"),
    )


def run(options: argparse.Namespace) -> int:
    """Examine, and show."""
    from ..report import robots as words
    from ..report.terminal import progress
    from ..robots import examine_all, find
    from ..robots.records import SUFFIXES
    from ..runs.whole import check_place

    if options.out is not None:
        check_place(options.out, SUFFIXES, "a table")
    models = find(options.paths)
    with resumable(options.out, "examined"), progress(f"{len(models)} models") as bar:
        survey = examine_all(
            models,
            quick=options.quick,
            seconds=options.seconds,
            jobs=options.jobs,
            seed=options.seed,
            table=options.out,
            progress=bar,
        )
    show(words.page(survey), survey, options.json)
    return SAYS_NO if survey.wrong else 0
