"""Comparisons as tests in JUnit's XML, which CI services read: a test for each quantity."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from ..compare import Comparison
from ..measures.text import quantity

FAILED = "{largest} apart at {at:g} s; the tolerance is {tolerance}, {reason}"
ENDED = "ended early: {why}"


def junit(comparisons: Sequence[Comparison]) -> str:
    """The text of the file: a suite for each comparison."""
    root = ElementTree.Element("testsuites")
    for comparison in comparisons:
        sides = comparison.one, comparison.two
        name = f"{sides[0].trace.header.experiment}: {sides[0].label}, {sides[1].label}"
        failures = {
            agreement.name: FAILED.format(
                largest=quantity(agreement.max, agreement.unit),
                at=agreement.at,
                tolerance=quantity(agreement.tolerance, agreement.unit),
                reason=agreement.reason,
            )
            for agreement in comparison.agreements
            if agreement.verdict != "agrees"
        }
        ended = {side.label: side.trace.header.ended for side in sides if side.trace.header.ended}
        failures |= {f"end of {label}": ENDED.format(why=why) for label, why in ended.items()}
        names = dict.fromkeys(
            [agreement.name for agreement in comparison.agreements] + list(failures)
        )
        about = {"name": name, "tests": str(len(names)), "failures": str(len(failures))}
        suite = ElementTree.SubElement(root, "testsuite", about)
        for test in names:
            case = ElementTree.SubElement(suite, "testcase", classname=name, name=test)
            if test in failures:
                ElementTree.SubElement(case, "failure", message=failures[test])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
