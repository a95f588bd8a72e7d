"""`statemachine compare --models LEFT RIGHT`: two files of a robot, before anything moves."""

from __future__ import annotations

import argparse

from ..errors import BadInputError
from ._common import PROGRAM, REPEATED, Row, pairs_of, show

OPTIONS: tuple[Row, ...] = (
    (
        "--models",
        "NAME|FILE",
        "two models, URDF or MJCF, before anything moves; FILE@ENGINE, or --backends and one "
        "model: what an engine makes of it",
        {"nargs": "+"},
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
    if options.what:
        raise BadInputError(f"--models compares descriptions; {options.what[0]} is a run")
    for name in (
        "model",
        "seconds",
        "timestep",
        "tolerance",
        "plot",
        "film",
        "every",
        "keyframe",
    ):
        if getattr(options, name) not in (None, []):
            raise BadInputError(f"--{name} is of a run, and --models runs nothing")
    if options.backends:
        if any(engine for _, engine in given):
            raise BadInputError("--backends and FILE@ENGINE say the same: give one of them")
        for engine in options.backends:
            backend_engine(engine)
        if len(given) == 1:
            given *= 2
        given = [
            (model, engine) for (model, _), engine in zip(given, options.backends, strict=False)
        ]
    if len(given) != 2 or len(options.models) > 2:
        hint = "two models, or one and --backends A B"
        typed = options.models[0].replace(",", " ").split()
        if len(options.models) == 1 and len(typed) == 2:
            hint = f"two words: {PROGRAM} compare --models {' '.join(typed)}"
        raise BadInputError(f"--models wants {hint}; got {len(options.models)}")
    digits = 6 if options.digits is None else options.digits
    if not 1 <= digits <= 17:
        raise BadInputError(f"--digits wants a number from 1 to 17; got {digits}")
    if options.seed < 0:
        raise BadInputError(f"--seed must not be negative; got {options.seed}")
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


def refuse_alone(options: argparse.Namespace) -> None:
    """Raise BadInputError for an option of --models without it."""
    for name in ("frame", "all"):
        if getattr(options, name):
            raise BadInputError(f"--{name} goes with --models")
    if options.digits is not None:
        raise BadInputError("--digits goes with --models")
