"""`statemachine policy`: a walking policy on each engine, and what of its contract is wrong."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..installed import DEFAULT
from ..typed_numbers import typed_float
from .common import (
    CONTRACT_BACKENDS,
    add_backend,
    add_json,
    add_menagerie,
    number_list,
    show,
)
from .long_work import LongWorkReporter

if TYPE_CHECKING:
    from ..lab.policy.request import PolicyRequest

_SECONDS = 10.0


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Run a walking policy on engines, straight on and turning, as its contract says: which "
        "speeds it reaches, whether it falls, and which servos are at their limits."
    )
    parser.epilog = (
        "Exit code 1: it falls on an engine, or a speed is off by more than 20 % of what is asked, "
        "0.05 m/s and 0.1 rad/s at least."
    )
    parser.add_argument("policy", metavar="POLICY.onnx", help="the network")
    parser.add_argument("model", metavar="NAME|FILE", help="the robot, on its ground")
    parser.add_argument(
        "--contract",
        required=True,
        metavar="FILE",
        help="what the policy expects: gaitkeeper/contract/v3, or Unitree's deploy.yaml",
    )
    add_backend(parser, CONTRACT_BACKENDS)
    parser.add_argument(
        "--command",
        action="append",
        type=number_list,
        metavar="VX,VY,WZ",
        help="speeds that are asked for [m/s, m/s, rad/s]; may be repeated, a run each (default: "
        "straight on, and turning, as fast as the contract allows)",
    )
    parser.add_argument(
        "--seconds",
        type=typed_float,
        default=_SECONDS,
        metavar="S",
        help=f"length of each run ({_SECONDS:g})",
    )
    parser.add_argument("--keyframe", metavar="NAME", help="where it starts (home)")
    asked = parser.add_mutually_exclusive_group()
    asked.add_argument(
        "--faults",
        action="store_true",
        help="try named changes of the contract, and say which makes it walk",
    )
    asked.add_argument(
        "--against",
        metavar="FILE",
        help="another contract: what both make of the same states, and what comes of each",
    )
    parser.add_argument(
        "--details", action="store_true", help="all changes; way, height and power of each run"
    )
    add_menagerie(parser)
    add_json(parser)


def request_of(options: argparse.Namespace) -> PolicyRequest:
    """Return what was asked for.

    Raises:
        BadInputError: A command is no three numbers, or the time is out of range.
        UnknownNameError: There is no such backend.
    """
    from ..lab.policy.command import Command, speeds_of
    from ..lab.policy.request import PolicyRequest

    return PolicyRequest(
        policy=options.policy,
        contract=options.contract,
        model=options.model,
        backends=tuple(options.backend or [DEFAULT]),
        commands=tuple(Command(*speeds_of(numbers)) for numbers in options.command or ()),
        seconds=options.seconds,
        keyframe=options.keyframe,
        menagerie=options.menagerie,
    )


def run(options: argparse.Namespace) -> int:
    """Run it, and show."""
    request = request_of(options)
    if options.faults:
        return _show_faults(request, options)
    if options.against is not None:
        return _show_contracts(request, options)
    from ..lab.policy.page import page
    from ..lab.policy.request import answer

    result = answer(request, LongWorkReporter())
    return show(page(result, options.details), result, options.json)


def _show_faults(request: PolicyRequest, options: argparse.Namespace) -> int:
    """Try changes of the contract, and show."""
    from ..lab.policy.diagnosis import diagnose
    from ..lab.policy.diagnosis_page import page

    result = diagnose(request, LongWorkReporter())
    return show(page(result, options.details), result, options.json)


def _show_contracts(request: PolicyRequest, options: argparse.Namespace) -> int:
    """Compare two contracts, and show."""
    from ..lab.policy.contracts_page import page
    from ..lab.policy.two_contracts import compare_contracts

    result = compare_contracts(request, options.against, LongWorkReporter())
    return show(page(result), result, options.json)
