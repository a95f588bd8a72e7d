"""The options of `statemachine compare`, and what they need of each other."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence

from ...errors import BadInputError
from ...typed_numbers import typed_float
from ..common import (
    PROGRAM,
    SIDES,
    add_backend,
    add_jobs,
    add_json,
    add_menagerie,
    add_policy,
    add_seconds,
    add_seed,
    add_timestep,
    file_name,
    flag_of,
    is_given,
)
from ..experiments import experiments
from ..help_all import shorten_help

PARTS = ("actuators", "floor")  # of a file, that another side can have, too


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Run something on two sides, or open recorded traces, and compare: each quantity\n"
        "with its tolerance and a verdict. An experiment alone, or with one FILE, runs on\n"
        "MuJoCo and PyBullet; the commands of one trace are played on the other of them.\n"
        "Of three sides or more, the one that is odd is named.\n\n"
        "A side is FILE, FILE@ENGINE or FILE@ENGINE:engine (as the engine's own users\n"
        "meet it), and options behind it, such as timestep=0.002 contacts=off:\n"
        f"  {PROGRAM} compare hold A.xml\n"
        f"  {PROGRAM} compare hold A.xml@mujoco B.urdf@pybullet\n"
        f"  {PROGRAM} compare hold A.xml --backend all\n"
        f"  {PROGRAM} compare hold so101 timestep=0.002 so101 timestep=0.001\n"
        f"  {PROGRAM} compare walk.py:policy A.xml B.xml --every 5 --keyframe home\n"
        f"  {PROGRAM} compare walk.onnx A.xml A.xml@pybullet --contract C.yaml\n"
        f"  {PROGRAM} compare run.npz A.xml B.xml\n"
        f"  {PROGRAM} compare lerobot:synthetic so101 --why"
    )
    parser.epilog = (
        f"experiments:\n{experiments()}\n\n"
        "Exit code 1: something differs, or a run ends before its time; with --why, but\n"
        "without --html: something stays unexplained, or is only a weak hint. Of a\n"
        "recorded arm: the model is no nearer to it than its commands are; with --why: the\n"
        "fitted model stays above the floor of resolution and unmeasured time."
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "what",
        nargs="*",
        metavar="WHAT",
        help="what is run: an experiment, FILE.py:FUNCTION, POLICY.onnx or a recorded TRACE; then "
        "nothing, a model for all engines, two sides or more, or a second trace; or a recording of "
        "a real arm, lerobot:DIR#EPISODE, and its model",
    )
    add_backend(
        parser,
        "the left's engine, once more the right's, and more where one of several may be odd: "
        "mujoco, pybullet, pybullet:engine (as its own users meet it), a release, mujoco==3.3.7, "
        "or all that are installed (default mujoco and pybullet)",
    )
    add_menagerie(parser)
    add_seconds(parser)
    add_timestep(parser)
    add_seed(parser, "what is drawn")
    parser.add_argument(
        "--tolerance",
        action="append",
        default=[],
        metavar="KIND=VALUE",
        help="another tolerance, such as joint=0.5deg, tip=2mm, energy=0.1J",
    )
    parser.add_argument(
        "--uncertainty",
        action="append",
        default=[],
        metavar="SIZE",
        help="how uncertain the start of your robot is, such as 0.1mm or 0.1deg",
    )
    parser.add_argument(
        "--no-chaos", action="store_true", help="do not look for the chaos floor: faster"
    )
    parser.add_argument(
        "--html",
        metavar="PAGE.html",
        help="write a report that stands alone: both runs in 3D, curves, figures, what causes it",
    )
    parser.add_argument(
        "--no-why", action="store_true", help="with --html: skip the search for causes"
    )
    parser.add_argument(
        "--details",
        action="store_true",
        help="all that is known, and not only the verdict and the worst of it",
    )
    add_json(parser)
    parser.add_argument(
        "--junit",
        type=file_name,
        metavar="FILE",
        help="write each quantity as a test of JUnit, for CI",
    )
    _add_sides(parser.add_argument_group("two sides"))
    _add_why(parser.add_argument_group("why"))
    _add_steps(parser.add_argument_group("is it a difference, and of what?"))
    _add_pictures(parser.add_argument_group("pictures"))
    _add_models(parser.add_argument_group("comparing descriptions of a robot"))
    first = ("what", "backend", "why", "html", "converge", "seconds", "tolerance", "one_step")
    shorten_help(parser, first=(*first, "versions", "models", "details", "json"))


def _add_sides(group: argparse._ArgumentGroup) -> None:
    """Add the options of two sides."""
    group.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="LEFT=RIGHT",
        help="a joint, body, site or actuator of the left and its name on the right; of --models, "
        "too",
    )
    group.add_argument(
        "--actuators",
        choices=SIDES,
        metavar="SIDE",
        help="both sides have those of the left, or of the right",
    )
    group.add_argument(
        "--floor",
        choices=SIDES,
        metavar="SIDE",
        help="both have that of the left, or of the right",
    )
    group.add_argument(
        "--every",
        metavar="N|TIME",
        help="for how long what FUNCTION(model, data) returned holds: steps (1), or 5ms",
    )
    group.add_argument("--keyframe", metavar="NAME", help="where it starts, on both sides")
    group.add_argument(
        "--calibration",
        metavar="FILE",
        help="LeRobot's calibration of a recorded arm (default: unit and scale from the numbers)",
    )
    add_policy(group)


def _add_why(group: argparse._ArgumentGroup) -> None:
    """Add the options of the search for causes."""
    group.add_argument(
        "--why", action="store_true", help="which difference explains how much of the gap"
    )
    group.add_argument(
        "--quantity",
        metavar="NAME",
        help="what the gap is measured in, such as joints, one joint or a body",
    )
    group.add_argument(
        "--measure",
        choices=("worst", "end", "rms"),
        help="which figure of the gap is explained (worst)",
    )
    group.add_argument("--finer", action="store_true", help="every difference by its entries")
    group.add_argument(
        "--time-limit",
        type=typed_float,
        metavar="S",
        help="end the search for causes after so many seconds: what is known by then is shown",
    )
    group.add_argument(
        "--write",
        type=file_name,
        metavar="FILE",
        help="write the right's file with the left's values, run it, and tell what stays; with "
        "--models, too; of a recorded arm, the model's file with the fitted values",
    )
    add_jobs(group)


def _add_steps(group: argparse._ArgumentGroup) -> None:
    """Add the questions of what a difference is."""
    group.add_argument(
        "--one-step",
        action="store_true",
        help="one step on each side from each state of the left one: the first stage that differs",
    )
    group.add_argument(
        "--converge",
        action="store_true",
        help="run with timesteps h, h/2 and h/4, and h/8 and h/16 where that leaves it unclear: "
        "what vanishes is discretisation",
    )
    group.add_argument(
        "--versions",
        metavar="V,V,…",
        help="run on releases of MuJoCo, and on the one that is installed: between which it "
        "changes",
    )
    group.add_argument(
        "--bisect",
        action="store_true",
        help="with --versions V: add releases since V until it is known which one changed it",
    )


def _add_pictures(group: argparse._ArgumentGroup) -> None:
    """Add the options of pictures."""
    group.add_argument(
        "--plot", type=file_name, metavar="FILE", help="write a figure: .svg, .png or .pdf"
    )
    group.add_argument(
        "--film", type=file_name, metavar="FILE", help="write a film of both sides: .webp"
    )


def _add_models(group: argparse._ArgumentGroup) -> None:
    """Add the options of comparing two files."""
    group.add_argument(
        "--models",
        nargs="*",
        metavar="NAME|FILE",
        help="two models, URDF or MJCF, before anything moves; FILE@ENGINE:engine, or --backend "
        "twice and one model: what an engine itself makes of it",
    )
    group.add_argument(
        "--frame",
        action="append",
        default=[],
        metavar="LEFT=RIGHT",
        help="a frame of the left and what the right calls it",
    )


# What options need of each other.


def check_options(options: argparse.Namespace) -> None:
    """Check that the options belong to what is asked.

    Raises:
        BadInputError: One does not.
    """
    _need(options, ("measure", "finer", "time_limit", "jobs"), ("why",))
    _need(options, ("quantity",), ("why", "html"))
    _need(options, ("write",), ("why", "models"))
    _exclude(options, "write", ("html",))
    _need(options, ("no_why",), ("html",))
    _exclude(options, "no_why", ("why",))
    _need(options, ("frame",), ("models",))
    refuse_options(options, ("calibration",), "{} goes with a recording of an arm, lerobot:DIR#3")
    _exclude(options, "uncertainty", ("no_chaos",))
    other_answers = ("why", "html", "plot", "film", "models", "uncertainty", "tolerance")
    _exclude(options, "one_step", other_answers)
    _exclude(options, "converge", other_answers)
    _exclude(options, "versions", ("why", "html", "film", "models", "uncertainty", "backend"))
    _exclude(options, "one_step", ("converge",))
    _exclude(options, "junit", ("why", "one_step", "converge", "models"))
    _need(options, ("bisect",), ("versions",))
    _exclude(options, "versions", ("one_step", "converge"))
    of_a_run = (
        *("why", "quantity", "html", "plot", "film", "seconds", "timestep", "tolerance"),
        *("uncertainty", "every", "keyframe", "contract", "command", *PARTS),
    )
    if options.why and options.html is None:
        _check_why_alone(options)
    if is_given(options, "models"):
        refuse_options(options, of_a_run, "{} is of a run, and --models runs nothing")


def _check_why_alone(options: argparse.Namespace) -> None:
    """Check what goes with --why where no page is written.

    Raises:
        BadInputError: Something does not.
    """
    if options.tolerance:
        raise BadInputError("--why takes no --tolerance: it explains the gap, whatever its size")
    if options.plot is not None or options.film is not None:
        raise BadInputError("--why runs many times: --plot and --film go without it")


def _need(options: argparse.Namespace, names: Iterable[str], others: Sequence[str]) -> None:
    """Check that options are given with one of some others only."""
    if not any(is_given(options, other) for other in others):
        refuse_options(options, names, f"{{}} goes with {_either(others)}")


def _exclude(options: argparse.Namespace, name: str, others: Iterable[str]) -> None:
    """Check that an option is given with none of some others."""
    both = [other for other in others if is_given(options, other)]
    if both:
        refuse_options(options, (name,), f"{{}} goes without {_either(both)}")


def refuse_options(options: argparse.Namespace, names: Iterable[str], text: str) -> None:
    """Raise BadInputError for the first of these options that is given; {} is its flag."""
    for name in names:
        if is_given(options, name):
            raise BadInputError(text.format(flag_of(name)))


def _either(names: Iterable[str]) -> str:
    return " or ".join(flag_of(name) for name in names)
