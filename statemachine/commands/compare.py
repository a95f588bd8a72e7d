"""`statemachine compare`: where two engines part, by how much, and why."""

from __future__ import annotations

import argparse
from typing import Any

from ..errors import BadInputError, EndedEarlyError
from ..installed import PAIR
from . import _compare_floor, _compare_html, _compare_models
from . import _compare_pictures as pictures
from ._common import PROGRAM, add_json, add_menagerie, complain, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Run an experiment on two engines, or open recorded traces, and compare: each\n"
        "quantity with its tolerance and a verdict. One trace: its ctrl is played on\n"
        "the other engine."
    )
    parser.epilog = (
        f"experiments:\n{experiments()}\n\n"
        "Exit code 1: something differs, or a run ends before its time; with --why: something\n"
        "stays unexplained."
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "what",
        nargs="*",
        metavar="EXPERIMENT|TRACE",
        help="an experiment, or one or two files .npz or .parquet",
    )
    parser.add_argument(
        "--backends",
        nargs=2,
        default=None,
        metavar=("A", "B"),
        help="the engines (default mujoco pybullet)",
    )
    add_defaults(parser)
    add_run(parser)
    parser.add_argument(
        "--tolerance",
        action="append",
        default=[],
        metavar="KIND=VALUE",
        help="another tolerance, such as joint=0.5deg, tip=2mm, energy=0.1J",
    )
    parser.add_argument(
        "--why", action="store_true", help="which difference explains how much of the gap"
    )
    parser.add_argument(
        "--quantity", default=None, metavar="NAME", help="of --why: what the gap is measured in"
    )
    _compare_floor.add_options(parser)
    _compare_html.add_options(parser)
    pictures.add(parser)
    _compare_models.add_options(parser)
    add_json(parser)
    parser.set_defaults(run=run)


# As `scenarios.SCENARIOS`, which needs NumPy; a test compares them.
EXPERIMENTS = {
    "hold": "go to one pose; a finger meets the floor",
    "gravity": "servos off: the arm falls onto the floor",
    "droop": "nobody writes ctrl: the servos hold the arm",
    "fall": "servos off, nothing can touch",
    "box": "the jaws hold a box while the arm swings",
    "waves": "every joint follows waves that a seed draws",
}


def experiments() -> str:
    """A line for each experiment."""
    return "\n".join(f"  {name:<9} {says}" for name, says in EXPERIMENTS.items())


def add_defaults(parser: argparse.ArgumentParser) -> None:
    """The option --defaults."""
    parser.add_argument(
        "--defaults",
        default="model",
        choices=("model", "engine"),
        help="engine: each engine as its own users meet it (default model)",
    )


def add_run(parser: argparse.ArgumentParser) -> None:
    """Options that change what is run."""
    parser.add_argument(
        "--model", default=None, metavar="NAME|FILE", help="instead of the experiment's own"
    )
    add_menagerie(parser)
    parser.add_argument("--seconds", type=float, default=None, metavar="S", help="simulated time")
    parser.add_argument(
        "--timestep", type=float, default=None, metavar="S", help="of each step [s]"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of what is drawn (0)")


def request_of(options: argparse.Namespace) -> Any:
    """What was asked for, as a Request."""
    from ..compare import Request

    one, two = options.backends or PAIR
    return Request(
        what=tuple(options.what),
        backends=(one, two),
        defaults=options.defaults,
        model=options.model,
        menagerie=options.menagerie,
        seconds=options.seconds,
        seed=options.seed,
        options={} if options.timestep is None else {"timestep": options.timestep},
    )


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    _compare_html.check(options)
    _compare_floor.check(options)
    pictures.complete(options)
    if options.models:
        if options.why or options.quantity:
            raise BadInputError(
                "--models compares files: --why and --quantity are of an experiment"
            )
        return _compare_models.run(options)
    _compare_models.refuse_alone(options)
    if not options.what:
        raise BadInputError(
            f"compare what? An experiment ({', '.join(EXPERIMENTS)}) or traces: "
            f"{PROGRAM} compare hold"
        )
    if options.quantity and not (options.why or options.html):
        raise BadInputError("--quantity belongs to --why")
    if options.why and not options.html:
        return _run_why(options)
    return _run_compare(options)


def _run_why(options: argparse.Namespace) -> int:
    from ._compare_why import run as run_why

    if options.tolerance:
        raise BadInputError("--why takes no --tolerance: it explains the gap, whatever its size")
    if options.plot or options.film:
        raise BadInputError("--why runs many times: --plot and --film go without it")
    try:
        return run_why(request_of(options), options.quantity, options.json)
    except EndedEarlyError as error:  # what there is until then, and no cause
        return _run_compare(options, f"No cause is named: {error}.")


def _run_compare(options: argparse.Namespace, why_not: str = "") -> int:
    from ..compare import compare, sides_of, touches, witness
    from ..comparison import parse_tolerances
    from ..report import compare as report
    from ..report.progress import progress

    tolerances = parse_tolerances(options.tolerance)
    request = request_of(options)
    if request.is_traces and len(request.what) == 2 and options.backends:
        raise BadInputError("--backends is of a run, and two traces are runs that were made")
    wanted = pictures.checked(options)
    with progress("compare") as told:
        (one, two), said = sides_of(request, told)
    found = compare(one, two, tolerances=tolerances)
    if options.json:
        for line in said:
            complain(line, 0)
    asked = witness(one, two)
    floor = _compare_floor.floor_of(options, request, found, (one, two))
    if options.html:
        _compare_html.write(options, request, found, (one, two), said, asked, floor)
    why_not = "" if found.ended else why_not  # which the page says itself
    page = report.page(found, one, two, said=said, witness=asked, floor=floor, why_not=why_not)
    result = {
        "comparison": found,
        "witness": asked,
        "touches": touches(one, two),
        "floor": floor,
    }
    code = show(page, result, options.json)
    pictures.write(wanted, options, one, two, found, floor)
    return code
