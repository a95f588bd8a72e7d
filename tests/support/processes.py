"""Commands and code in processes of their own."""

from __future__ import annotations

import contextlib
import io
import mmap
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from statemachine.cli import main

from .requirements import ROOT

_ESTIMATE = re.compile(r"^.*: about [\d.e+]+ (?:s|min) more\n", re.MULTILINE)


# As of a shell in which this environment is activated: commands are printed as it finds them.
_PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])


def without_estimates(stderr: str) -> str:
    """Return standard error without the line that says how long a slow command may take.

    A command prints that line where it takes longer than 20 s, which on a busy machine any may.
    """
    return _ESTIMATE.sub("", stderr)


def of_python(
    *words: object,
    folder: Path = ROOT,
    code: int | None = None,
    typed: str | None = None,
    **environment: str,
) -> subprocess.CompletedProcess[str]:
    """Run Python with such words in a process of its own, which has this checkout.

    `code` is the exit code that it must have, if that is all that is asked of it, and `typed` what
    it reads on its standard input. Its standard
    error is without the line that depends on speed (`without_estimates`).
    """
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        input=typed,
        capture_output=True,
        text=True,
        timeout=600,  # of a busy machine
        cwd=folder,
        env={**os.environ, "PATH": _PATH, "PYTHONPATH": str(ROOT), **environment},
        check=False,
    )
    done.stderr = without_estimates(done.stderr)
    assert code in (None, done.returncode), done.stdout + done.stderr
    return done


def run_main(*words: object) -> subprocess.CompletedProcess[str]:
    """Run a command in this process, as the fixture `here` does, where its test's scope is wider.

    Returns:
        Its exit code, and what it printed.
    """
    texts = [str(word) for word in words]
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(texts)
    printed: list[str] = []
    for stream in (out, err):
        stream.seek(0)
        printed.append(stream.read())
    return subprocess.CompletedProcess(texts, code, printed[0], without_estimates(printed[1]))


def in_its_own_python(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run code in a folder by a Python of its own, which has this checkout."""
    # Of a fork beside threads, from 3.12.
    return of_python("-W", "ignore:This process:DeprecationWarning", "-c", code, folder=folder)


def runs_in_silence(code: str, folder: Path, printed: str = "") -> None:
    """Assert that code ends well in a Python of its own, and prints nothing but this."""
    done = in_its_own_python(code, folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, printed, "")


Cli = Callable[..., "subprocess.CompletedProcess[str]"]


def one_line(done: subprocess.CompletedProcess[str], says: str, code: int = 2) -> None:
    """Assert that a command was refused, in one line that says why."""
    assert (done.returncode, done.stdout) == (code, ""), done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("statemachine")
    assert says in line


def lives(pid: int) -> bool:
    """Return whether a process has not ended; zombies have."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def soon(so: Callable[[], object], seconds: float = 300.0) -> bool:
    """Return whether something is so within some seconds.

    Nobody waits longer than it takes, and a busy machine may take long.
    """
    until = time.monotonic() + seconds
    while time.monotonic() < until and not so():
        time.sleep(0.05)
    return bool(so())


def files_below(folder: Path, pattern: str) -> list[Path]:
    """Return the files that match, of a folder that others change meanwhile.

    `Path.glob` of Python 3.11 raises where a folder goes while it is read.
    """
    try:
        return list(folder.glob(pattern))
    except FileNotFoundError:
        return []


def processes_with(part: object) -> list[int]:
    """Return the processes in whose command line something stands."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if str(part).encode() in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
    return found


def memory_of(pid: int | str = "self") -> float:
    """Return the resident memory of a process [MB]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * mmap.PAGESIZE / 1e6
