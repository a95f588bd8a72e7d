"""The loop over a session, a clock and a page: the one thread that touches the simulation."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from ..errors import StateMachineError
from .session import Frame, Session

RATE = 40.0  # frames in a second of the clock
_MOST_LAG = 0.25  # seconds behind the clock that may still be caught up
_WINDOW = 1.0  # seconds over which the speed is measured
# A hair more than a whole number of steps may come out a hair less.
_HAIR = 1e-6  # of a step

Command = Callable[[], object]  # a call of a session's method, with its arguments


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
        """Return what was asked for since the last time, in order."""
        ...

    def show(self, frame: Frame, pace: Tempo, note: str) -> None:
        """Show a moment, how fast time goes, and what was wrong with the last command."""


class _Mark(NamedTuple):
    """A moment of the clock [s], and how many steps had been taken then."""

    time: float
    steps: int


class Live:
    """Loop that lets a session follow the clock, and shows it."""

    def __init__(
        self,
        session: Session,
        front: Front,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
        rate: float = RATE,
    ) -> None:
        """Put them together.

        Args:
            session: What is shown.
            front: Where.
            clock: Gives the seconds of the clock.
            sleep: Waits for so many of them.
            rate: Frames in a second.
        """
        self._session = session
        self._front = front
        self._clock = clock
        self._sleep = sleep
        self._span = 1 / rate
        self._note = ""
        self._late = 0.0  # until when it counts as late
        self._restart()

    def run(self, seconds: float | None = None, stop: Sequence[object] = ()) -> None:
        """Turn until interrupted, until `stop` has an entry, or for some seconds of the clock."""
        end = None if seconds is None else self._clock() + seconds
        while not stop and (end is None or self._clock() < end):
            self.turn()

    def turn(self) -> None:
        """Do what was asked, take the steps that are due, show, and wait for the next frame."""
        session, began = self._session, self._clock()
        for command in self._front.commands():
            self._obey(command)
        if session.running:
            self._catch_up(began + self._span)
        now = self._clock()
        reached = self._reached(now) if session.running else None
        tempo = Tempo(session.speed, reached, now < self._late)
        self._front.show(session.frame(), tempo, self._note)
        left = began + self._span - self._clock()
        if left > 0:
            self._sleep(left)

    def _obey(self, command: Command) -> None:
        session = self._session
        self._note = ""
        before = session.running, session.steps, session.speed
        try:
            command()
        except StateMachineError as error:
            self._note = str(error)
        if before != (session.running, session.steps, session.speed):
            self._restart()

    def _restart(self) -> None:
        """Count from now on; what passed while time stood, or before it jumped, is not owed."""
        self._start = self._clock()
        self._taken = 0
        self._marks = deque([_Mark(self._start, 0)])

    def _catch_up(self, deadline: float) -> None:
        """Take what is due, as far as there is time for it before the next frame."""
        session, now = self._session, self._clock()
        span = session.timestep / session.speed  # of a step, by the clock
        while (
            session.running
            and now < deadline
            and now - self._start >= (self._taken + 1 - _HAIR) * span
        ):
            session.advance()
            self._taken += 1
            now = self._clock()
        lag = now - self._start - self._taken * span
        if lag > _MOST_LAG:
            # No engine can be hurried: the rest is let go, or it would lag ever more.
            self._start += lag
            self._late = now + 1
        self._marks.append(_Mark(now, self._taken))
        while len(self._marks) > 2 and self._marks[1].time <= now - _WINDOW:
            self._marks.popleft()

    def _reached(self, now: float) -> float | None:
        """Return simulated seconds in a second of the clock, of late; None before it is known."""
        mark = self._marks[0]
        if now - mark.time < _WINDOW / 4:
            return None
        return (self._taken - mark.steps) * self._session.timestep / (now - mark.time)
