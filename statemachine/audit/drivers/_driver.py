"""What is asked of everybody that can be audited: to start, to step, to save, to be looked at."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import DivergedError
from ...interface import Array, Model
from ..findings import Finding, Gap, Layer, Layout, gap, worst
from ..points import Point

_AFTERWARDS = 50  # steps of another past beyond the save point
_OTHERWISE = 0.1  # how far its command is from the point's [rad or m]

ONLY = "only those that matter"  # the candidate of what was found to be needed
Machine = Any  # what a driver steps: an MjData, a client, a Data
Restore = Callable[[Machine], None]
# Entered, it saves a machine and gives what restores one.
Save = Callable[[Machine], AbstractContextManager[Restore]]


@dataclass(frozen=True)
class Way:
    """A way to save and to restore.

    Attributes:
        name: What is kept.
        save: How it is done.
        left_out: What of the whole is not kept, where it is the whole without one thing.
        promised: Whether its future is promised to be that of the run it was taken from.
        agree: Whether two restores are promised to have the same future.
        travels: Whether it can be put into another machine than its own.
    """

    name: str
    save: Save
    left_out: str = ""
    promised: bool = False
    agree: bool = False
    travels: bool = True


@dataclass(frozen=True)
class Look:
    """Something done between two steps that should leave no trace in what follows.

    Attributes:
        name: The call.
        act: Does it; or, where it is done in the place of a step, takes that step.
        promised: Whether that is promised.
        instead: Whether it takes the step.
    """

    name: str
    act: Callable[[Machine], object]
    promised: bool = True
    instead: bool = False


@dataclass(frozen=True)
class Hiding:
    """Ways to save, and changes that show what they forget.

    Attributes:
        ways: Ways to save, by name.
        changes: Changes of what is no position or velocity, by what they change.
        let_pass: Makes everything pass through everything.
        best: All that can be read and written.
    """

    ways: Mapping[str, Save]
    changes: Mapping[str, Callable[[Machine], None]]
    let_pass: Callable[[Machine], None]
    best: Way


@dataclass(frozen=True, eq=False)
class Run:
    """The future of a run that nothing disturbed: what all others are compared with.

    Attributes:
        point: Where it was saved.
        future: (steps + 1, k) positions and velocities, there and after each step.
    """

    point: Point
    future: Array

    @property
    def steps(self) -> int:
        """How many steps it has."""
        return len(self.future) - 1


@dataclass(frozen=True)
class Seen:
    """What a save point is like.

    Attributes:
        point: Its name.
        how: How one gets there.
        time: Simulated time since the start [s].
        contacts: How many contacts there are.
        limits: How many joints are at a limit; None where that is not told.
        speed: The largest velocity [rad/s or m/s].
    """

    point: str
    how: str
    time: float
    contacts: int
    limits: int | None
    speed: float


class Driver(ABC):
    """One of those that are audited: an engine itself, or the interface to it.

    Attributes:
        layer: Which of the two.
        name: What a page calls it.
        legend: What the names of its ways to save mean.
        several: Whether one call takes several steps.
        resets: Whether a machine can be reset.
    """

    layer: Layer
    name: str
    legend: str
    several: bool = True
    resets: bool = True

    def __init__(self, model: Model, seed: int) -> None:
        self.model, self.seed = model, seed
        self._seen: dict[str, Seen] = {}

    @cached_property
    @abstractmethod
    def layout(self) -> Layout:
        """What the numbers are that `read` gives."""

    @abstractmethod
    def fresh(self, point: Point) -> Machine:
        """A new machine, at its default state."""

    @abstractmethod
    def close(self, machine: Machine) -> None:
        """Give back what it holds."""

    @abstractmethod
    def start(self, machine: Machine, point: Point) -> None:
        """Put a machine, new or reset, to the start of a point."""

    @abstractmethod
    def command(self, machine: Machine, ctrl: Array) -> None:
        """Write the command."""

    @abstractmethod
    def advance(self, machine: Machine, nstep: int = 1) -> None:
        """Step."""

    @abstractmethod
    def read(self, machine: Machine) -> Array:
        """Positions and velocities, in one new array."""

    @abstractmethod
    def time(self, machine: Machine) -> float:
        """Simulated time [s]."""

    @abstractmethod
    def _see(self, point: Point) -> Seen:
        """What a save point is like."""

    @abstractmethod
    def ways(self, point: Point) -> tuple[Way, ...]:
        """Candidates for the state, from the smallest to the largest."""

    @abstractmethod
    def looks(self, point: Point) -> tuple[Look, ...]:
        """What should perturb nothing."""

    def see(self, point: Point) -> Seen:
        """What a save point is like, looked at once."""
        if point.name not in self._seen:
            self._seen[point.name] = self._see(point)
        return self._seen[point.name]

    def reset(self, machine: Machine) -> None:
        """Put a machine back to its default state, where `resets`."""
        raise NotImplementedError

    def only(self, fields: tuple[str, ...]) -> Way | None:
        """The candidate of some of the components that are left out one at a time."""
        return None

    def hides(self, point: Point) -> Hiding | None:
        """What decides the future and is in no position or velocity, to be tried directly."""
        return None

    def pools(self) -> Mapping[str, Callable[[Point, int], list[Array]]]:
        """The engine's own ways to run several at once: futures from a point, so many steps."""
        return {}

    def soil(self, machine: Machine, point: Point) -> None:  # noqa: B027  (optional hook)
        """Leave traces of another past beyond its state and command."""

    def lacks(self, point: Point) -> str:
        """Why a save point means nothing here; empty where it does."""
        return ""

    @contextmanager
    def new(self, point: Point) -> Iterator[Machine]:
        """A fresh machine for a while."""
        machine = self.fresh(point)
        try:
            yield machine
        finally:
            self.close(machine)

    @contextmanager
    def at(self, point: Point) -> Iterator[Machine]:
        """A machine at a save point."""
        with self.new(point) as machine:
            self.arrive(machine, point)
            yield machine

    @contextmanager
    def used(self, point: Point) -> Iterator[Machine]:
        """A machine with another past: other commands, pushed, and later."""
        with self.at(point) as machine:
            if point.powered and point.model.nu:
                stir = np.random.default_rng(self.seed + 1).uniform(
                    -_OTHERWISE, _OTHERWISE, point.model.nu
                )
                self.command(machine, point.ctrl + stir)
            self.soil(machine, point)
            for _ in range(_AFTERWARDS):
                self.advance(machine)
            yield machine

    def arrive(self, machine: Machine, point: Point) -> None:
        """From a new or reset machine to the save point."""
        self.start(machine, point)
        self.drive(machine, point, point.run_in)

    def drive(self, machine: Machine, point: Point, steps: int, look: Look | None = None) -> Array:
        """Go on, with a look before each step; (steps + 1, k) of what is read there and after."""
        trace = [self.read(machine)]
        for _ in range(steps):
            if point.swings:
                self.command(machine, point.commanded(self.time(machine)))
            if look:
                look.act(machine)
            if look is None or not look.instead:
                self.advance(machine)
            trace.append(self.read(machine))
        return np.array(trace)

    def run(self, point: Point, steps: int) -> Run:
        """The undisturbed run from a point.

        Raises:
            DivergedError: It does not stay finite.
        """
        with self.at(point) as machine:
            future = self.drive(machine, point, steps)
        if not np.isfinite(future).all():
            raise DivergedError(f"{self.name} diverged")
        return Run(point, future)

    def gap(self, run: Run, *futures: Array) -> Gap:
        """The worst gap of futures to that of a run."""
        return worst([gap(run.future, future, self.layout) for future in futures])

    def found(
        self, experiment: str, run: Run, case: str, into: str, off: Gap, promised: bool = True
    ) -> Finding:
        """A finding about this driver."""
        return Finding(experiment, self.layer, run.point.name, case, into, promised, off)
