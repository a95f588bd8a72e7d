"""The quick part of the tests fails where a warning of ours comes that no test expects."""

from __future__ import annotations

from pathlib import Path

import pytest

from .support.files import written
from .support.processes import of_python

WARNS = """
import warnings
import pytest
from statemachine.errors import EngineWarning

{mark}
def test_it():
    warnings.warn("shapes are inside each other", {category}, stacklevel=1)
"""
EXPECTED = '@pytest.mark.filterwarnings("ignore:shapes")'


@pytest.mark.parametrize(
    ("category", "mark", "part", "code"),
    [
        ("EngineWarning", "", "not slow", 1),
        pytest.param("EngineWarning", EXPECTED, "not slow", 0, marks=pytest.mark.slow),
        pytest.param("EngineWarning", "", "", 0, marks=pytest.mark.slow),
        pytest.param("DeprecationWarning", "", "not slow", 0, marks=pytest.mark.slow),
    ],
)
def test_a_warning_that_nobody_expects(
    tmp_path: Path, category: str, mark: str, part: str, code: int
) -> None:
    file = written(tmp_path / "test_it.py", WARNS.format(category=category, mark=mark))
    words = ("-m", "pytest", "-p", "tests.conftest", "-p", "no:cacheprovider", "-c", "/dev/null")
    done = of_python(*words, "-m", part, file, folder=tmp_path, code=code)
    assert ("test_it.py::test_it" in done.stdout.partition("it came in:")[2]) is bool(code)
