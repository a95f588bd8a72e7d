"""What everybody has of the course's own code, as digests of shingles: no text can be read from it.

python -m tools.course_code       write course_code.json anew, from exercises/ and teaching/
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources

FILE = "course_code.json"


@dataclass(frozen=True)
class CourseCode:
    """Digests of the shingles of the course's own files; see `likeness`.

    Attributes:
        handed_out: Of the student's file as it is handed out.
        solution: Of the course's own solution, without what is handed out.
    """

    handed_out: frozenset[str]
    solution: frozenset[str]


@cache
def course_code() -> CourseCode:
    """Return the digests of the course's own files."""
    text = resources.files(__package__ or "").joinpath(FILE).read_text("utf-8")
    digests = json.loads(text)
    return CourseCode(
        frozenset(digests["handed_out"].split()), frozenset(digests["solution"].split())
    )
