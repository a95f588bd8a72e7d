"""Exercises judged by what they do: `statemachine check`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...errors import BadInputError
from ...models import check_is_file

# A student's predictions, as `statemachine lesson --record FILE` keeps them.

KIND = "statemachine predictions"


def answers_in(file: Path) -> dict[str, dict[str, Any]]:
    """Return the first answer to each question, by "lesson: question".

    Raises:
        BadInputError: The file is no such record.
    """
    check_is_file(file)
    try:
        record = json.loads(file.read_text(encoding="utf-8"))
        if record["kind"] != KIND:
            raise ValueError("another kind of file")
        answers = {
            f"{answer['lesson']}: {answer['question']}": answer for answer in record["answers"]
        }
        if not all(isinstance(answer["right"], bool) for answer in answers.values()):
            raise ValueError("an answer is neither right nor wrong")
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise BadInputError(
            f"{file.name} exists, and is not a record of predictions ({error}): name another file"
        ) from None
    return answers


def score(file: Path) -> str:
    """Return how many predictions were right: "3 of 5"."""
    try:
        answers = answers_in(file).values()
    except BadInputError:
        return f"{file.name} is not a record of predictions"
    return f"{sum(answer['right'] for answer in answers)} of {len(answers)}"
