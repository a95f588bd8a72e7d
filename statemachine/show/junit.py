"""Tests in JUnit's XML, for CI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree


@dataclass(frozen=True)
class TestSuite:
    """Tests that belong together.

    Attributes:
        name: Of the suite.
        tests: By name the message of each test that failed; "" for one that passed.
    """

    name: str
    tests: Mapping[str, str]


def junit_text(suites: Sequence[TestSuite]) -> str:
    """Return the text of a file of JUnit's XML."""
    root = ElementTree.Element("testsuites")
    for suite in suites:
        failures = sum(message != "" for message in suite.tests.values())
        about = {"name": suite.name, "tests": str(len(suite.tests)), "failures": str(failures)}
        element = ElementTree.SubElement(root, "testsuite", about)
        for name, message in suite.tests.items():
            case = ElementTree.SubElement(element, "testcase", classname=suite.name, name=name)
            if message:
                ElementTree.SubElement(case, "failure", message=message)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
