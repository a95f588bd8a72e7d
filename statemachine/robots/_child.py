"""The process that examines one model: `python -m statemachine.robots._child JOB ANSWER`."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path

from ..runs.whole import replace_text
from .examine import examine
from .records import ExaminedModel


def main(job: str, answer: str) -> None:
    """Examine, and keep what is known in the file `answer`, whole at any moment."""
    asked = json.loads(Path(job).read_text(encoding="utf-8"))

    def tell(row: ExaminedModel, part: str) -> None:
        replace_text(Path(answer), json.dumps({"part": part, "row": asdict(row)}))

    row = ExaminedModel(asked["file"], asked["sha256"], asked["made_with"])
    tell(examine(Path(asked["path"]), row, asked["quick"], asked["seed"], tell), "")


if __name__ == "__main__":
    main(*sys.argv[1:])
