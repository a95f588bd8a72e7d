"""Write down what everybody has of the course's own code, for the likeness of submissions.

python -m tools.course_code       after a change of exercises/step_loop.py or teaching/solutions
"""

from __future__ import annotations

import json
from pathlib import Path

from statemachine.course.grading import course_code
from statemachine.course.grading.likeness import shingles_of_file, student_code

ROOT = Path(__file__).resolve().parents[1]


def digests() -> course_code.CourseCode:
    """Return the digests of the files as they are now."""
    handed_out = shingles_of_file(ROOT / "exercises" / "step_loop.py")
    solution = student_code([ROOT / "teaching" / "solutions" / "step_loop.py"])
    return course_code.CourseCode(handed_out, solution.without(handed_out).all_shingles)


def main() -> None:
    """Write the file."""
    now = digests()
    content = {
        "handed_out": " ".join(sorted(now.handed_out)),
        "solution": " ".join(sorted(now.solution)),
    }
    place = Path(course_code.__file__).with_name(course_code.FILE)
    place.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
