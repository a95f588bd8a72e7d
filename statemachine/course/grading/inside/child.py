"""The process in which one function of a student's file runs, alone.

It records what came of the function on each world, as data, into a file: line by line, so that
a process that ends early leaves behind how far it got, and with a number that is not to be
guessed, so that what the student's code prints does not pass for a line. Whoever digs the
number out can write what he likes: it is judged elsewhere, as what anybody might have written.
"""

from __future__ import annotations

import faulthandler
import importlib
import json
import os
import sys
from pathlib import Path
from typing import Any

from ....errors import one_line
from .guard import Guard
from .worlds import FUNCTIONS, Scenes, worlds_of

_LONGEST = 8_000_000  # characters of a line
_TOO_MUCH = {"text": "it returns more than can be looked at", "written": True}


def prepare(backend: str) -> None:
    """Import all that `main` imports before it runs a student's code; that is compiled then."""
    for function in FUNCTIONS:
        worlds_of(function, Scenes(backend, Path.cwd()))
    importlib.import_module(".calls", __package__)
    importlib.import_module("....processes.sandbox", __package__)


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
        folder = Path.cwd() / "worlds"
        folder.mkdir()
        worlds = worlds_of(job["function"], Scenes(job["backend"], folder))
    except Exception as error:
        say("refused", kind=type(error).__name__, text=one_line(error))
        return
    from ....processes.sandbox import limit_cpu
    from .calls import FaultError, answers_of_file

    sys.pycache_prefix = None  # what the student's code imports has its bytecode beside it
    for name in job["only_for_imports"]:
        del os.environ[name]
    # Both work where Python's own threads do not get their turn, and tell the line.
    trace = open(job["trace"], "w", encoding="utf-8")  # noqa: SIM115  (till the end)
    faulthandler.enable(trace)
    # What `Guard` tells is told at once: it stays, whatever the student's code does next.
    Guard(
        path,
        Path(job["student_folder"]),
        Path(job["answers"]).parent,
        lambda kind, text: say(kind, text=text),
        is_only_guard=job["alone"],
    )
    _forget_the_judge()
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


def _forget_the_judge() -> None:
    """Leave nothing of `course` to be had by its name: an import of it is then heard."""
    parent = sys.modules[__name__.partition(".")[0]]
    for name in [name for name in sys.modules if name.startswith(f"{parent.__name__}.course")]:
        del sys.modules[name]
    vars(parent).pop("course", None)
