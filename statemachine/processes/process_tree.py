"""A process and all that it started: how long they computed, when they end, how they are ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

TOKEN = "STATEMACHINE_SANDBOX"  # environment variable by which what a command started is known
PATIENCE = 2.0  # seconds to end what a command left behind


def cpu_of(process: subprocess.Popen[bytes]) -> float:
    """Return how long a process and those that it started have computed so far [s]."""
    import psutil

    total = 0.0
    with suppress(psutil.Error):
        first = psutil.Process(process.pid)
        for running in (first, *first.children(recursive=True)):
            with suppress(psutil.Error):
                times = running.cpu_times()
                total += times.user + times.system
    return total


def wait(
    process: subprocess.Popen[bytes],
    deadline: float,
    enough: Callable[[], str],
    stop: threading.Event,
) -> str:
    """Wait, and return the reason for the end: "code", "clock" (or `stop`), or that of `enough`."""
    pause = 0.001
    while True:
        ended = _has_ended(process)
        if word := enough():
            return word
        remaining = deadline - time.monotonic()
        if ended or remaining <= 0 or stop.wait(min(pause, remaining)):
            return "code" if ended else "clock"
        pause = min(pause * 2, 0.02)


def _has_ended(process: subprocess.Popen[bytes]) -> bool:
    """Tell whether the process has ended. On POSIX it is not reaped yet then.

    So that its number, and that of its group, is nobody else's when the group is killed.
    """
    if sys.platform == "win32" or not hasattr(os, "waitid"):
        return process.poll() is not None
    options = os.WEXITED | os.WNOHANG | os.WNOWAIT
    return os.waitid(os.P_PID, process.pid, options) is not None


def reap(process: subprocess.Popen[bytes]) -> float:
    """Wait for a process that was ended; how long it had computed [s]."""
    if sys.platform == "win32" or process.returncode is not None:
        process.wait()
        return 0.0
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


def end_all(process: subprocess.Popen[bytes], token: str) -> None:
    """Kill the command and all that it started."""
    if sys.platform == "win32":
        process.kill()
        return
    deadline = time.monotonic() + PATIENCE
    first = True
    while True:
        pids = [int(entry.name) for entry in relatives(process.pid, token)]
        if process.returncode is None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
        for pid in pids:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        if time.monotonic() > deadline or not (pids or first):
            return
        first = False  # what was being forked meanwhile shows in the next round
        time.sleep(0.002)


def relatives(leader: int, token: str) -> set[Path]:
    """Return the living processes of the session, or that carry the token, in /proc; without it,
    none.
    """
    mark = f"{TOKEN}={token}".encode()
    living = set[Path]()
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it ended meanwhile, or is another user's
            # After the name in brackets, which may hold anything.
            stat = (entry / "stat").read_bytes().rpartition(b")")[2].split()
            state, session = stat[0], int(stat[3])
            if state not in b"ZX" and (
                session == leader or mark in (entry / "environ").read_bytes()
            ):
                living.add(entry)
    return living
