"""`statemachine fingertip`: an engine's fingertip against an independent witness."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..installed import DEFAULT
from ..typed_numbers import typed_int
from .common import (
    EACH_BACKEND,
    add_backend,
    add_json,
    add_menagerie,
    add_model,
    add_seed,
    show,
)
from .long_work import LongWorkReporter

if TYPE_CHECKING:
    from ..lab.validate.fingertip_request import FingertipRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = "Compare poses of sites or bodies on an engine with Pinocchio's."
    add_backend(parser, EACH_BACKEND)
    add_model(parser, default="so101")
    add_menagerie(parser)
    add_json(parser)
    parser.add_argument("--poses", type=typed_int, default=200, metavar="N", help="how many (200)")
    add_seed(parser, "the poses")
    parser.add_argument(
        "--site",
        metavar="NAME",
        help="the site or body (gripperframe if there is one, else every body at an end)",
    )
    parser.add_argument(
        "--witness", metavar="FILE", help="what Pinocchio reads (default: the model)"
    )
    parser.add_argument("--witness-frame", metavar="NAME", help="the frame's name there")


def request_of(options: argparse.Namespace) -> FingertipRequest:
    """Return what was asked for.

    Raises:
        BadInputError: A number is out of range.
        UnknownNameError: There is no such backend.
    """
    from ..lab.validate.fingertip_request import FingertipRequest

    return FingertipRequest(
        model=options.model,
        backends=tuple(options.backend or [DEFAULT]),
        menagerie=options.menagerie,
        poses=options.poses,
        seed=options.seed,
        site=options.site,
        witness=options.witness,
        witness_frame=options.witness_frame,
    )


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ..lab.validate.certificate import page
    from ..lab.validate.fingertip_request import answer

    results = answer(request_of(options), LongWorkReporter())
    return show(page(results), results, options.json)
