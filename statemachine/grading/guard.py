"""What a student's code may not do: start processes, or use the network."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

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


class Guard:
    """Refuses processes and the network, and remembers what was refused."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.refused: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, _arguments: tuple[Any, ...]) -> None:
        if event in _REFUSED:
            where = _line_in(sys._getframe(), self._file)
            self.refused.append(f"{where}{_REFUSED[event]} ({event}), which no exercise needs")
            raise PermissionError(f"{_REFUSED[event]}: not here")


def _line_in(frame: Any, path: Path) -> str:
    """'line 12: ', the innermost line of the student's file; nothing if there is none."""
    while frame is not None:
        if frame.f_code.co_filename == str(path):
            return f"line {frame.f_lineno}: "
        frame = frame.f_back
    return ""
