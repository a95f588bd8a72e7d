"""What a reader predicted, kept in a file to hand in: `statemachine lesson --record FILE`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from .. import __version__
from ..grading.predictions import KIND, answers_in
from ..page import Question
from ..runs.whole import replace_text
from .quiz import Reader


class RecordedReader(Reader):
    """A reader whose answers are written to a file, after each.

    The first answer to a question counts. A file of an earlier session is gone on with.
    """

    def __init__(self, file: Path, lesson: str = "") -> None:
        """Open a file, or begin one.

        Args:
            file: Where the answers are kept, as JSON.
            lesson: Whose questions are asked first.

        Raises:
            BadInputError: The file is there and is no record of predictions.
        """
        super().__init__(lesson)
        self._file = file
        self._answers = answers_in(file) if file.exists() else {}
        self._write()

    def ask(self, question: Question) -> int | None:
        """Ask, and keep the answer."""
        choice = super().ask(question)
        if choice is not None:
            key = f"{self.lesson}: {question.text}"
            right, predicted = question.right, question.choices[choice]
            first = self._answers.setdefault(
                key,
                {
                    "lesson": self.lesson,
                    "question": question.text,
                    "predicted": predicted,
                    "found": None if right is None else question.choices[right],
                    "right": choice == right,
                },
            )
            self._write()
            if first["predicted"] != predicted:
                print(f"(In {self._file.name} your first answer counts: {first['predicted']}.)")
        return choice

    @property
    def summary(self) -> str:
        """What the file says by now, in a line."""
        right = sum(bool(answer["right"]) for answer in self._answers.values())
        return f"{self._file.name}: {right} of {len(self._answers)} predictions right"

    def _write(self) -> None:
        answers = list(self._answers.values())
        record = {
            "kind": KIND,
            "statemachine": __version__,
            "python": sys.version.split()[0],
            "score": sum(bool(answer["right"]) for answer in answers),
            "of": len(answers),
            "answers": answers,
        }
        text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
        replace_text(self._file, text)
