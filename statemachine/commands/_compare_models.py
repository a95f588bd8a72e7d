"""`statemachine compare --models LEFT RIGHT`: two files of a robot, before anything moves."""

from __future__ import annotations

import argparse

from ._common import PROGRAM, REPEATED, Row, pairs_of, refuse, show

OPTIONS: tuple[Row, ...] = (
    (
        "--models",
        "NAME|FILE",
        "two models, URDF or MJCF, before anything moves; FILE@ENGINE, or --backends and one "
        "model: what an engine makes of it",
        {"nargs": "*"},
    ),
    ("--frame", "LEFT=RIGHT", "a frame of the left and what the right calls it", REPEATED),
    ("--rename", None, argparse.SUPPRESS, REPEATED, {"dest": "map"}),
    ("--digits", "N", "equal means to so many digits (6)"),
    ("--all", "", "a row for every figure that differs"),
)


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ..backends import backend_engine
    from ..compare.models import compare, split
    from ..report import model_diff
    from ..report.progress import progress

    given = [split(text) for text in options.models]
    if options.backends:
        refuse(
            (
                any(engine for _, engine in given),
                "--backends and FILE@ENGINE say the same: give one of them",
            )
        )
        for engine in options.backends:
            backend_engine(engine)
        if len(given) == 1:
            given *= 2
        given = [
            (model, engine) for (model, _), engine in zip(given, options.backends, strict=False)
        ]
    typed = " ".join(options.models or options.what[-2:]).replace(",", " ").split()
    hint = "two models, or one and --backends A B"
    if len(options.models) < 2 and len(typed) == 2:
        hint = f"two words behind it: {PROGRAM} compare --models {' '.join(typed)}"
    digits = 6 if options.digits is None else options.digits
    refuse(
        (
            len(given) != 2 or len(options.models) > 2,
            f"--models wants {hint}; got {len(options.models)}",
        ),
        *((True, f"--models compares descriptions; {word} is a run") for word in options.what),
        (not 1 <= digits <= 17, f"--digits wants a number from 1 to 17; got {digits}"),
        (options.seed < 0, f"--seed must not be negative; got {options.seed}"),
    )
    with progress("compare"):
        result = compare(
            given[0][0],
            given[1][0],
            engines=(given[0][1], given[1][1]),
            frames=pairs_of(options.frame, "--frame"),
            rename=pairs_of(options.map, "--map"),
            digits=digits,
            seed=options.seed,
            menagerie=options.menagerie,
        )
    return show(model_diff.page(result, options.all), result, options.json)
