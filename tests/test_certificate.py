"""What a certificate says of its gaps, on pages and in JSON."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import statemachine as sm
from statemachine.lab.validate.fingertip import FingertipResult, FrameOffset, certify
from statemachine.show.as_json import plain

from .support.requirements import need_engine


@pytest.fixture(scope="module")
def certificate() -> FingertipResult:
    """Return the certificate of MuJoCo for the arm, of two poses."""
    need_engine("pinocchio")
    return certify(sm.load("so101"), poses=2)


@pytest.mark.parametrize(
    ("gap", "grade", "verdict"),
    [
        ({}, "own reading", "agrees"),
        ({}, "same reading", "same place"),
        ({"position_worst": 1e-9}, "own reading", "disagrees"),
        ({"rotation_worst": 1e-9}, "same reading", "disagrees"),
        ({"rotation_worst": float("nan")}, "own reading", "disagrees"),
        ({"frames": None}, "own reading", "no common body"),
        ({"frames": FrameOffset(1e-3, 0.0)}, "own reading", "different frames"),
        ({"frames": FrameOffset(0.0, 1e-3)}, "same reading", "different frames"),
    ],
)
def test_verdict_of_the_worst_gap(
    certificate: FingertipResult, gap: dict[str, Any], grade: str, verdict: str
) -> None:
    changed = replace(certificate, tips=(replace(certificate.tips[0], **gap),), grade=grade)
    assert changed.verdict == verdict


def test_one_gap_of_many_is_enough_to_disagree(certificate: FingertipResult) -> None:
    tip = certificate.tips[0]
    assert not replace(certificate, tips=(tip, replace(tip, position_worst=1e-9))).agrees


def test_what_is_only_on_pages_is_not_in_json(certificate: FingertipResult) -> None:
    keys = set(plain(certificate))
    assert {"site", "agrees", "tips"} <= keys
    assert not {"verdict", "worst_tip", "has_one_tip", "is_own_reading"} & keys
