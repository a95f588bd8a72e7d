"""An engine that runs in a Python of its own, and the pipes to its process; see `_child_server`."""

from __future__ import annotations

import json
import os
import threading
from typing import Any, NamedTuple

import numpy as np

from ..interface import Array
from ..processes.pipes import PipedChild
from . import _child_server

_FILE = _child_server.__file__


class ServedEngine(NamedTuple):
    """An engine in a Python of its own.

    Attributes:
        name: Of the backend.
        python: Its interpreter, which has NumPy and the engine.
        child: The file that knows the engine, as `_child_server` says.
        title: What messages call it.
    """

    name: str
    python: str
    child: str
    title: str


class LostError(Exception):
    """The process of an engine has ended."""


class Server:
    """The process of an engine, which holds the models and worlds that this process has there."""

    _all: dict[tuple[int, ServedEngine], Server] = {}  # noqa: RUF012
    _lock = threading.RLock()

    def __init__(self, engine: ServedEngine) -> None:
        command = [engine.python, "-I", "-u", _FILE, engine.child]
        self._turn, self.lives = threading.RLock(), True
        self.forgotten: list[int] = []  # models and worlds that it is to forget at the next call
        self._process = PipedChild(command, {**os.environ, "MUJOCO_GL": "disable"})
        self.pid = self._process.pid

    @classmethod
    def of(cls, engine: ServedEngine) -> Server:
        """The one of an engine; started where there is none, or none that lives."""
        with cls._lock:
            key = os.getpid(), engine
            if key not in cls._all or not cls._all[key].lives:
                cls._all[key] = cls(engine)
            return cls._all[key]

    def ask(
        self, verb: str, *content: Array, **job: Any
    ) -> tuple[dict[str, Any], dict[str, Array]]:
        """Let it do something; its answer, and arrays by name.

        Raises:
            LostError: It has ended.
            ValueError: It raised an error, with its text.
        """
        blob = b"".join(array.tobytes() for array in content)
        sizes = _child_server.SIZES
        try:
            with self._turn:
                free, self.forgotten = self.forgotten, []
                head = json.dumps({"verb": verb, "free": free, **job}).encode()
                self._process.to.write(sizes.pack(len(head), len(blob)) + head + blob)
                self._process.to.flush()
                _child_server.await_message(self._process.out)
                size, rest = sizes.unpack(self._process.out.read(sizes.size))
                answer = json.loads(self._process.out.read(size))
                values = np.frombuffer(self._process.out.read(rest))
        except (OSError, ValueError, _child_server.struct.error) as error:
            self.lives, ended = False, self._process.how_it_ended()
            raise LostError(f"its process is gone: {ended or error}") from error
        except BaseException:  # Ctrl-C: what it still says would be taken for another answer
            self.lives = False
            self._process.kill()
            raise
        if "error" in answer:
            raise ValueError(answer["error"])
        arrays, start = dict[str, Array](), 0
        for name, shape in answer["arrays"]:
            stop = start + int(np.prod(shape))
            arrays[name], start = values[start:stop].reshape(shape).copy(), stop
        return answer, arrays
