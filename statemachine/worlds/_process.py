"""One process that holds worlds, as the process that started it sees it."""

from __future__ import annotations

import os
import pickle
import select
import time
from contextlib import suppress
from typing import Any

from ..errors import EngineError
from ..processes import fresh_python
from ..processes.pipes import PipedChild
from ._shared import ANSWER, ANSWER_MOST, COMMAND, VERBS, SharedBlock

_ENDING = 0.3  # seconds in which one that closed its pipes has ended


class WorldsProcess(PipedChild):
    """A process of worlds, and the pipes to it.

    Attributes:
        worlds: Numbers of the worlds that it holds.
    """

    def __init__(self, number: int, worlds: range, block: SharedBlock, answers: int) -> None:
        """Start it.

        Args:
            number: Its number among those of these worlds.
            worlds: Numbers of the worlds that it is to hold.
            block: The memory that it shares with this process.
            answers: Where in that the answers of all processes are.
        """
        self.worlds = worlds
        self._block, self._place = block, answers + number * ANSWER_MOST
        command, environment = fresh_python(
            f"{__package__}._worker", block.handle, str(block.size), str(number)
        )
        super().__init__(command, environment, **block.inherited)

    def send(
        self, number: int, verb: str, argument: int = 0, size: int = 0, of_ids: bool = False
    ) -> None:
        """Tell it something; one that has ended does not hear it."""
        command = COMMAND.pack(number, VERBS.index(verb), argument, size, of_ids)
        with suppress(OSError):
            os.write(self.to.fileno(), command)

    def receive(self, number: int, deadline: float | None = None) -> dict[str, Any]:
        """Wait for the answer to a command.

        Raises:
            EOFError: The process ends without one.
            TimeoutError: The deadline (of `time.monotonic`) is over, where that can be known.
        """
        while True:
            if deadline is not None and hasattr(select, "poll"):
                poll = select.poll()
                poll.register(self.out.fileno(), select.POLLIN)
                if not poll.poll(max(0.0, 1000 * (deadline - time.monotonic()))):
                    raise TimeoutError
            frame = os.read(self.out.fileno(), ANSWER.size)
            if len(frame) < ANSWER.size:
                raise EOFError
            answered, size = ANSWER.unpack(frame)
            if answered == number:
                place = self._place
                return pickle.loads(self._block.memory[place : place + size]) if size else {}


def end_all(processes: list[WorldsProcess], owner: int) -> None:
    """End processes; in a fork of the process that owns them, nothing is done."""
    if os.getpid() != owner:
        return
    for process in processes:
        process.leave()
    for process in processes:
        process.close()


def lost_worlds(processes: list[WorldsProcess]) -> EngineError:
    """The error that tells which worlds are lost with those of the processes that have ended."""
    time.sleep(_ENDING)
    hows = {process: how for process in processes if (how := process.how_it_ended(0.0))}
    worlds = tuple(sorted(world for process in hows for world in process.worlds))
    numbers = ", ".join(map(str, worlds[:8])) + (", …" if len(worlds) > 8 else "")
    named = f"world {numbers} is" if len(worlds) == 1 else f"{len(worlds)} worlds ({numbers}) are"
    return EngineError(
        f"{named} lost with the process that held them: {', '.join(dict.fromkeys(hows.values()))}. "
        "These Worlds are closed: make others with make_worlds",
        worlds=worlds,
    )
