"""Comparisons as tests in JUnit's XML, for CI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from ...measures.text import quantity
from ..compare import Comparison
from ..compare.stillness import nothing_moved

if TYPE_CHECKING:
    pass

FAILED = "{largest} apart at {at:g} s; the tolerance is {tolerance}, {reason}"
ENDED = "ended early: {why}"


def junit(comparisons: Sequence[Comparison]) -> str:
    """Return the text of the file: a suite for each comparison."""
    root = ElementTree.Element("testsuites")
    for comparison in comparisons:
        left, right = comparison.left, comparison.right
        experiment = left.trace.header.experiment
        _add_suite(root, f"{experiment}: {left.label}, {right.label}", comparison)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add_suite(root: ElementTree.Element, name: str, comparison: Comparison) -> None:
    """Add a comparison as a suite: a test for each quantity, and one for a run that ended early."""
    failures = _failures(comparison)
    tests = dict.fromkeys([*(agreement.name for agreement in comparison.agreements), *failures])
    about = {"name": name, "tests": str(len(tests)), "failures": str(len(failures))}
    suite = ElementTree.SubElement(root, "testsuite", about)
    for test in tests:
        case = ElementTree.SubElement(suite, "testcase", classname=name, name=test)
        if test in failures:
            ElementTree.SubElement(case, "failure", message=failures[test])


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
