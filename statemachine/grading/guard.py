"""What a student's code may not do: processes, the network; and what it reads, which is told."""

from __future__ import annotations

import faulthandler
import json
import os
import site
import sys
import sysconfig
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import one_line
from ..models import models_dir

# What no exercise needs, by the name of the audit event, and in words.
_REFUSED = {
    "os.fork": "it starts another process",
    "os.forkpty": "it starts another process",
    "os.posix_spawn": "it starts another process",
    "os.spawn": "it starts another process",
    "os.startfile": "it starts another process",
    "os.system": "it starts another program",
    "os.exec": "it starts another program",
    "subprocess.Popen": "it starts another program",
    "os.kill": "it sends a signal to a process",
    "os.killpg": "it sends a signal to processes",
    "socket.connect": "it wants to use the network",
    "socket.bind": "it wants to use the network",
    "socket.sendto": "it wants to use the network",
    "socket.getaddrinfo": "it wants to use the network",
}
_READS = ("open", "os.link", "os.rename")  # with the name of a file first
_SYSTEM: tuple[str, ...] = ()
if sys.platform != "win32":
    _SYSTEM = ("/usr", "/etc", "/proc", "/sys", "/dev", "/lib", "/System", "/Library")


class Guard:
    """Refuses processes and the network, and tells of files that are not the student's."""

    def __init__(self, file: Path, own: Path, here: Path, tell: Callable[[str, str], None]) -> None:
        """Begin.

        Args:
            file: The student's; its lines are named.
            own: The folder of all files that belong to it.
            here: The folder in which this process may read and write.
            tell: Gets "forbidden" and what was refused; or "reads" and the name of a file that
                is neither here, nor own, nor Python's or the package's; or of one that would
                be own and is not there. Each once.
        """
        places = (
            own, here, Path(__file__).parents[1], models_dir(), sys.base_prefix, *_SYSTEM,
            *sysconfig.get_paths().values(), *site.getsitepackages(), site.getusersitepackages(),
            os.environ.get("SYSTEMROOT", own),
        )  # fmt: skip
        self._open = tuple(os.path.realpath(place) + os.sep for place in places)
        self._file, self._own, self._tell = file, os.path.realpath(own) + os.sep, tell
        self._reported: set[tuple[str, str]] = set()
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in _REFUSED:
            where = _line_in(sys._getframe(), self._file)
            if where is not None:
                text = f"{where}{_REFUSED[event]} ({event}), which no exercise needs"
                self._once("forbidden", text)
            raise PermissionError(f"{_REFUSED[event]}: not here")
        if event in _READS:
            self._look_at(arguments[0])
        elif event == "import" and arguments[0] not in sys.stdlib_module_names:
            self._look_at(f"{self._own}{arguments[0]}.py")

    def _look_at(self, name: Any) -> None:
        with suppress(TypeError, ValueError):  # the number of an open file; no name at all
            path = os.path.realpath(os.fsdecode(name))
            inside = path + os.sep
            missing = inside.startswith(self._own) and "__pycache__" not in path
            if os.path.exists(path) != missing and (missing or not inside.startswith(self._open)):
                self._once("reads", path)

    def _once(self, kind: str, text: str) -> None:
        if (kind, text) not in self._reported:
            self._reported.add((kind, text))
            self._tell(kind, text)


def _line_in(frame: Any, path: Path) -> str | None:
    """'line 12: ', the innermost line of the student's file; nothing if there is none.

    None where a package wants it, which does without: of matplotlib, a program that lists fonts.
    """
    while frame is not None:
        if frame.f_code.co_filename == str(path):
            return f"line {frame.f_lineno}: "
        if "site-packages" in frame.f_code.co_filename:
            return None
        frame = frame.f_back
    return ""


# The process in which one function of a student's file runs, alone.
#
# It records what came of the function on each world, as data, into a file: line by line, so that
# a process that ends early leaves behind how far it got, and with a number that is not to be
# guessed, so that what the student's code prints does not pass for a line. Whoever digs the
# number out can write what he likes: it is judged elsewhere, as what anybody might have written.

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
        say("refused", kind=type(error).__name__, text=one_line(error))
        return
    from ..processes.sandbox import limit_cpu
    from .calls import FaultError, answers_of_file

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
