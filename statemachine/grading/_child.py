"""The process in which one function of a student's file runs, alone.

It records what came of the function on each world, as data, into a file: line by line, so that
a process that ends early leaves behind how far it got, and with a number that is not to be
guessed, so that what the student's code prints does not pass for a line. Whoever digs the
number out can write what he likes: it is judged elsewhere, as what anybody might have written.
"""

from __future__ import annotations

import faulthandler
import json
import os
import sys
from pathlib import Path
from typing import Any

_LONGEST = 8_000_000  # characters of a line
_TOO_MUCH = {"text": "it returns more than can be looked at", "written": True}


def main(job_file: str) -> None:
    """Call one function, as the job file says, and end the process."""
    job = json.loads(Path(job_file).read_text(encoding="utf-8"))
    os.unlink(job_file)
    path = Path(job["file"])

    def say(stage: str, **facts: Any) -> None:
        """Add a line to the file."""
        line = json.dumps({"nonce": job["nonce"], "stage": stage, **facts})
        if len(line) > _LONGEST:
            line = json.dumps({"nonce": job["nonce"], "stage": "fault", **_TOO_MUCH})
        with open(job["answers"], "a", encoding="utf-8") as file:
            file.write(line + "\n")

    sys.argv = [str(path)]
    try:
        # The worlds to call it on; nothing of what is right there.
        from .judges import judge_of
        from .worlds import Scenes

        folder = Path.cwd() / "worlds"
        folder.mkdir()
        worlds = judge_of(job["function"]).worlds(Scenes(job["backend"], folder))
    except Exception as error:
        say("refused", kind=type(error).__name__, text=" ".join(str(error).split()))
        return
    from ..processes.sandbox import limit_cpu
    from .calls import FaultError, answers_of_file
    from .guard import Guard

    # Both work where Python's own threads do not get their turn, and tell the line.
    trace = open(job["trace"], "w", encoding="utf-8")  # noqa: SIM115  (till the end)
    faulthandler.enable(trace)
    # What `Guard` tells is told at once: it stays, whatever the student's code does next.
    Guard(
        path, Path(job["own"]), Path(job["answers"]).parent, lambda kind, text: say(kind, text=text)
    )
    sys.path.insert(0, str(path.parent))  # as when the file is run; engines are loaded by now
    say("running")
    limit_cpu(job["cpu"], trace)
    for answer in answers_of_file(path, job["function"], worlds):
        if isinstance(answer, FaultError):
            say("fault", text=str(answer), written=answer.written)
        else:
            say("answer", answer=answer)
    # Threads that the student's code left, and what it registered for the end, have no say.
    os._exit(0)
