"""The process in which one function of a student's file runs, alone.

It answers into a file, line by line and with a number that only its parent knows, so that
nothing that the student's code prints can pass for an answer, and a process that ends early
leaves behind how far it got.
"""

from __future__ import annotations

import faulthandler
import json
import os
import sys
import time
from pathlib import Path
from typing import Any


class _Answers:
    """The private channel."""

    def __init__(self, path: str, nonce: str) -> None:
        self._path = path
        self._nonce = nonce

    def say(self, stage: str, **facts: Any) -> None:
        """Add a line."""
        with open(self._path, "a", encoding="utf-8") as file:
            file.write(json.dumps({"nonce": self._nonce, "stage": stage, **facts}) + "\n")


def main(job_file: str) -> None:
    """Examine one function, as the job file says, and end the process."""
    with open(job_file, encoding="utf-8") as file:
        job = json.load(file)
    os.unlink(job_file)
    answers = _Answers(job["answers"], job["nonce"])
    path = Path(job["file"])
    sys.argv = [str(path)]
    try:
        judge, worlds, rights = _prepare(job["function"], job["backend"])
    except Exception as error:
        answers.say("refused", kind=type(error).__name__, text=" ".join(str(error).split()))
        return
    from .examine import examine
    from .guard import Guard
    from .limits import limit_cpu

    # Both work where Python's own threads do not get their turn, and tell the line.
    trace = open(job["trace"], "w", encoding="utf-8")  # noqa: SIM115  (till the end)
    faulthandler.enable(trace)
    guard = Guard(path)
    sys.path.insert(0, str(path.parent))  # as when the file is run; engines are loaded by now
    answers.say("running", cpu=time.process_time())
    limit_cpu(job["cpu"], job["wall"], trace)
    verdict = examine(path, job["function"], judge, worlds, rights)
    remarks = [(text, False) for text in dict.fromkeys(guard.refused)]
    if not remarks:
        remarks = [(remark.text, remark.holds) for remark in verdict.remarks]
    answers.say("judged", written=verdict.written, remarks=remarks)
    # Threads that the student's code left, and what it registered for the end, have no say.
    os._exit(0)


def _prepare(function: str, backend: str) -> tuple[Any, Any, Any]:
    """The judge and its worlds, with all that is right worked out."""
    from .judges import judge_of
    from .worlds import Scenes

    judge = judge_of(function)
    folder = Path.cwd() / "worlds"
    folder.mkdir()
    worlds = judge.worlds(Scenes(backend, folder))
    return judge, worlds, judge.right(worlds)
