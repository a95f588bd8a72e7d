"""The viewer: its command in a process of its own, and its server."""

from __future__ import annotations

import os
import random
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from statemachine.view import server as serving
from statemachine.view.server import Door

from .requirements import ROOT

VIEW = [sys.executable, "-u", "-m", "statemachine", "view"]


def free_pair() -> int:
    """Return a port that is free with the next one too; another for each test at the same time."""
    for port in random.SystemRandom().sample(range(18080, 32000), 100):
        with socket.socket() as one, socket.socket() as two:
            try:
                one.bind(("127.0.0.1", port))
                two.bind(("127.0.0.1", port + 1))
            except OSError:
                continue
            return port
    raise AssertionError("no two free ports")


class Viewer:
    """The command in a process of its own."""

    def __init__(self, folder: Path, *arguments: str, **environment: str) -> None:
        self._said = open(folder / "stderr", "w+")  # noqa: SIM115
        self.process = subprocess.Popen(
            [*VIEW, *arguments],
            stdout=subprocess.PIPE,
            stderr=self._said,
            text=True,
            cwd=ROOT,
            env={**os.environ, **environment},
        )

    def line(self) -> str:
        """Return the next line that it printed."""
        return self.process.stdout.readline()

    def end(self) -> str:
        """Return the rest of what it printed; it ended well, and complained of nothing."""
        rest = self.process.stdout.read()
        code = self.process.wait(timeout=300)
        self._said.seek(0)
        assert (code, self._said.read()) == (0, "")
        return rest

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.process.kill()
        self.process.wait()
        self._said.close()


@contextmanager
def served(door: Door | None = None) -> Iterator[Any]:
    """Start a server of viser's behind a door."""
    port = serving.free_port("127.0.0.1", 0)
    server = serving.serve("127.0.0.1", port, "t", door or Door("127.0.0.1"))
    try:
        yield server
    finally:
        serving.stop(server)
