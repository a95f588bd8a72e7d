"""Limits of computing time, which does not pass while the machine is busy with others."""

from __future__ import annotations

import faulthandler
import math
import signal
import subprocess
import sys
import time
from contextlib import suppress
from typing import IO

# Where a process cannot limit itself, it is watched from outside.
WATCHED = sys.platform == "win32"


def limit_cpu(seconds: float, trace: IO[str]) -> None:
    """End this process after so much more computing; that, or `sandbox.run`, has its line told.

    Where it cannot, the line is noted each second, and `sandbox.run` ends the process.

    Args:
        seconds: Of computing, on all processors together.
        trace: Where the fault handler writes; it works while Python itself is not reached.
    """
    if sys.platform == "win32":
        faulthandler.dump_traceback_later(1.0, repeat=True, file=trace)
        return
    import resource

    faulthandler.register(signal.SIGPROF, file=trace, chain=True)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    last = math.ceil(time.process_time() + seconds) + 1  # where the signal was refused
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CPU, (last, last))


def ended_by_cpu(number: int | None, cpu: float, most: float) -> bool:
    """Whether a signal that ended a process was one of a limit of `most` seconds."""
    if sys.platform == "win32" or number is None:
        return False
    limits = (signal.SIGPROF, signal.SIGXCPU)
    return number in limits or (number == signal.SIGKILL and cpu >= most)


def cpu_of(process: subprocess.Popen[bytes]) -> float:
    """How long a process and those that it started have computed so far [s]."""
    import psutil

    total = 0.0
    with suppress(psutil.Error):
        first = psutil.Process(process.pid)
        for each in (first, *first.children(recursive=True)):
            with suppress(psutil.Error):
                times = each.cpu_times()
                total += times.user + times.system
    return total
