"""The loop over a session, a clock and a page: the one thread that touches the simulation."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..errors import StateMachineError
from .frames import Command, Play, ResetTo, Seek, SetSpeed, Snapshot, Step
from .pace import Pacer
from .recording import TraceSession
from .session import LiveSession

RATE = 40.0  # frames in a second of the clock
_MOST_LAG = 0.25  # seconds behind the clock that may still be caught up


Show = LiveSession | TraceSession  # what can be shown


@dataclass(frozen=True)
class Tempo:
    """How fast it goes.

    Attributes:
        asked: Simulated seconds that are wanted in a second of the clock.
        reached: Those that there were, of late; None if time stands or has just begun.
        late: Whether steps had to be left out of the count: it cannot go as fast.
    """

    asked: float
    reached: float | None
    late: bool


class Front(Protocol):
    """A page, seen from the loop; all of it is called from the loop's thread."""

    def commands(self) -> Sequence[Command]:
        """What was asked for since the last time, in order."""
        ...

    def show(self, frame: Snapshot, pace: Tempo, note: str) -> None:
        """A moment, how fast time goes, and what was wrong with the last command."""


class Live:
    """Lets a session follow the clock, and shows it."""

    def __init__(
        self,
        session: Show,
        front: Front,
        speed: float = 1.0,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
        rate: float = RATE,
    ) -> None:
        """Put them together.

        Args:
            session: What is shown.
            front: Where.
            speed: Simulated seconds in a second of the clock.
            clock: Gives the seconds of the clock.
            sleep: Waits for so many of them.
            rate: Frames in a second.
        """
        self._session, self._front = session, front
        self._clock, self._sleep, self._span = clock, sleep, 1 / rate
        self._pacer = Pacer(session.timestep, speed, clock())
        self._note = ""
        self._late = 0.0  # until when it counts as late

    def run(self, seconds: float | None = None, stop: Sequence[object] = ()) -> None:
        """Turn until interrupted, until `stop` has an entry, or for some seconds of the clock."""
        end = None if seconds is None else self._clock() + seconds
        while not stop and (end is None or self._clock() < end):
            self.turn()

    def turn(self) -> None:
        """Do what was asked, take the steps that are due, show, and wait for the next frame."""
        began = self._clock()
        for command in self._front.commands():
            self._obey(command)
        if self._session.running:
            self._catch_up(began + self._span)
        now = self._clock()
        running = self._session.running
        pace = Tempo(
            self._pacer.speed, self._pacer.factor(now) if running else None, now < self._late
        )
        self._front.show(self._session.frame(), pace, self._note)
        left = began + self._span - self._clock()
        if left > 0:
            self._sleep(left)

    def _obey(self, command: Command) -> None:
        self._note = ""
        try:
            if isinstance(command, SetSpeed):
                self._pacer.set_speed(command.factor, self._clock())
            else:
                self._session.apply(command)
        except StateMachineError as error:
            self._note = str(error)
        # What passed while it stood, or before it jumped, is not owed.
        if isinstance(command, Play | Step | ResetTo | Seek):
            self._pacer.restart(self._clock())

    def _catch_up(self, deadline: float) -> None:
        """Take what is due, as far as there is time for it before the next frame."""
        now = self._clock()
        while self._session.running and self._pacer.due(now) and now < deadline:
            self._session.advance()
            now = self._clock()
            self._pacer.took(1, now)
        if self._pacer.lag(now) > _MOST_LAG:
            # No engine can be hurried: the rest is let go, or it would lag ever more.
            self._pacer.give_up(now)
            self._late = now + 1
