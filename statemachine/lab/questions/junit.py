"""Comparisons as tests in JUnit's XML, for CI."""

from __future__ import annotations

from collections.abc import Sequence

from ...measures.text import quantity
from ...show.junit import TestSuite, junit_text
from ..compare import Comparison
from ..compare.stillness import nothing_moved

FAILED = "{largest} apart at {at:g} s; the tolerance is {tolerance}, {reason}"
ENDED = "ended early: {why}"


def junit(comparisons: Sequence[Comparison]) -> str:
    """Return the text of the file: a suite for each comparison."""
    return junit_text([_suite(comparison) for comparison in comparisons])


def _suite(comparison: Comparison) -> TestSuite:
    """Return a comparison as a suite: a test a quantity, and one for a run that ended early."""
    left, right = comparison.left, comparison.right
    experiment = left.trace.header.experiment
    passed = {agreement.name: "" for agreement in comparison.agreements}
    return TestSuite(f"{experiment}: {left.label}, {right.label}", passed | _failures(comparison))


def _failures(comparison: Comparison) -> dict[str, str]:
    """Return the message of each test that fails."""
    failures = {}
    for agreement in comparison.agreements:
        if agreement.verdict != "agrees":
            failures[agreement.name] = FAILED.format(
                largest=quantity(agreement.max, agreement.unit),
                at=agreement.at,
                tolerance=quantity(agreement.tolerance, agreement.unit),
                reason=agreement.reason,
            )
    if comparison.outcome == "nothing moved":
        failures["motion"] = nothing_moved(comparison.motion)
    for side in (comparison.left, comparison.right):
        ended = side.trace.header.ended
        if ended:
            failures[f"end of {side.label}"] = ENDED.format(why=ended)
    return failures
