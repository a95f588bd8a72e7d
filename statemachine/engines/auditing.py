"""What is asked of everybody that can be audited: to start, to step, to save, to be looked at."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Literal

import numpy as np

from ..errors import DivergedError
from ..interface import Array, Model
from ..interface.records import Arrays
from ..measures import JointPlaces
from ..page import Figures
from .measured import FutureGap, gap, worst

Layer = Literal["engine", "interface"]

_AFTERWARDS = 50  # steps of another past beyond the save point
_OTHERWISE = 0.1  # how far its command is from the point's [rad or m]

STIR = 0.3  # how far a command is from that of rest [rad or m], where the range allows it
_RATE = 2.0  # of a command that swings [rad/s]

ONLY = "only those that matter"  # the candidate of what was found to be needed
# What is restored.
ITSELF, FRESH, USED = "the run itself", "a fresh one", "a used one"
ITSELF_AGAIN = "the run itself, again"  # where nothing else can be
Machine = Any  # what a driver steps: an MjData, a client, a Data
Restore = Callable[[Machine], object]
# Entered, it saves a machine and gives what restores one.
Save = Callable[[Machine], AbstractContextManager[Restore]]


def copied(take: Callable[[Machine], Any], give: Callable[[Machine, Any], object]) -> Save:
    """A way to save that is a copy: `take` makes it, `give` puts it into a machine."""

    @contextmanager
    def save(machine: Machine) -> Iterator[Restore]:
        copy = take(machine)
        yield lambda other: give(other, copy)

    return save


@dataclass(frozen=True, eq=False)
class SavePoint:
    """A save point: where a run starts, and how long it runs before it is saved.

    Attributes:
        name: A word.
        how: How one gets there.
        model: The model, or a variant of it.
        qpos, qvel, ctrl: The start; the command stays.
        run_in: Steps before the save.
        powered: Whether the servos are on.
        swings: Whether a controller writes the command before each step, from the time.
        at_limit: Whether joints have arrived at their limits.
    """

    name: str
    how: str
    model: Model
    qpos: Array
    qvel: Array
    ctrl: Array
    run_in: int
    powered: bool = True
    swings: bool = False
    at_limit: bool = False

    def commanded(self, time: float) -> Array:
        """What the controller of a point that swings writes at a time [s]."""
        ctrl = self.ctrl.copy()
        ctrl[0] += STIR * np.sin(_RATE * time)
        return within(self.model, ctrl)


def within(model: Model, ctrl: Array) -> Array:
    """A command (nu,), clipped to the ranges of the actuators."""
    return np.clip(ctrl, *model.actuator_ctrlrange.T)


@dataclass(frozen=True)
class SaveMethod:
    """A way to save and to restore.

    Attributes:
        name: What is kept.
        save: How it is done.
        left_out: What of the whole is not kept, where it is the whole without one thing.
        promised: Whether its future is promised to be that of the run it was taken from.
        agree: Whether two restores are promised to have the same future.
        portable: Whether it can be put into another machine than its own.
    """

    name: str
    save: Save
    left_out: str = ""
    promised: bool = False
    agree: bool = False
    portable: bool = True


@dataclass(frozen=True)
class Disturbance:
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


@dataclass(frozen=True, eq=False)
class ReferenceRun:
    """The future of a run that nothing disturbed: what all others are compared with.

    Attributes:
        point: Where it was saved.
        future: (steps + 1, k) positions and velocities, there and after each step.
    """

    point: SavePoint
    future: Array

    @property
    def steps(self) -> int:
        """How many steps it has."""
        return len(self.future) - 1


class Driver(ABC):
    """One of those that are audited: an engine itself, or the interface to it.

    Attributes:
        layer: Which of the two.
        name: What a page calls it.
        legend: What the names of its ways to save mean.
        several: Whether one call takes several steps.
        resets: Whether a machine can be reset.
        measure: Gives what a save point is like (see `_measure`), looked at once.
    """

    layer: Layer
    name: str
    legend: str
    several: bool = True
    resets: bool = True

    def __init__(self, model: Model, seed: int) -> None:
        self.model, self.seed = model, seed
        self.measure = cache(self._measure)  # of each point once

    # A machine is taken to have qpos, qvel, ctrl and time, as an MjData and a Data have.

    @cached_property
    def coordinates(self) -> JointPlaces:
        """What the numbers are that `read` gives."""
        return JointPlaces.of(self.model.jnt_type, self.model.jnt_qposadr)

    @abstractmethod
    def fresh(self, point: SavePoint) -> Machine:
        """A new machine, at its default state."""

    def close(self, machine: Machine) -> None:
        """Give back what it holds."""
        machine.close()

    def start(self, machine: Machine, point: SavePoint) -> None:
        """Put a machine, new or reset, to the start of a point."""
        machine.qpos[:], machine.qvel[:] = point.qpos, point.qvel
        self.command(machine, point.ctrl)

    def command(self, machine: Machine, ctrl: Array) -> None:
        """Write the command."""
        machine.ctrl[:] = ctrl

    @abstractmethod
    def advance(self, machine: Machine, nstep: int = 1) -> None:
        """Step."""

    def read(self, machine: Machine) -> Array:
        """Positions and velocities, in one new array."""
        return np.concatenate((machine.qpos, machine.qvel))

    @abstractmethod
    def touching(self, machine: Machine) -> tuple[int, int | None]:
        """How many contacts there are now, and joints at a limit; None where that is not told."""

    @abstractmethod
    def save_methods(self, point: SavePoint) -> tuple[SaveMethod, ...]:
        """Candidates for the state, from the smallest to the largest."""

    @abstractmethod
    def disturbances(self, point: SavePoint) -> tuple[Disturbance, ...]:
        """What should perturb nothing."""

    def _measure(self, point: SavePoint) -> Figures:
        """What a save point is like.

        Returns:
            point: Its name.
            how: How one gets there.
            time: Simulated time since the start [s].
            contacts: How many contacts there are.
            limits: How many joints are at a limit; None where that is not told.
            speed: The largest velocity [rad/s or m/s].
        """
        with self.at(point) as machine:
            speeds = self.read(machine)[self.coordinates.width :]
            time, (contacts, limits) = float(machine.time), self.touching(machine)
            return Figures(
                point=point.name,
                how=point.how,
                time=time,
                contacts=contacts,
                limits=limits,
                speed=float(np.abs(speeds).max(initial=0.0)),
            )

    def reset(self, machine: Machine) -> None:
        """Put a machine back to its default state, where `resets`."""
        raise NotImplementedError

    def only(self, fields: tuple[str, ...]) -> SaveMethod | None:
        """The candidate of some of the components that are left out one at a time."""
        return None

    def hidden_state(self, point: SavePoint) -> Figures | None:
        """What decides the future and is in no position or velocity, to be tried directly.

        Returns:
            ways: Ways to save (`Save`), by name.
            changes: Changes of a machine that show what they forget, by what they change.
            let_pass: Makes everything in a machine pass through everything.
            best: The SaveMethod of all that can be read and written.
        """
        return None

    def pools(self) -> Mapping[str, Callable[[SavePoint, int], list[Array]]]:
        """The engine's own ways to run several at once: futures from a point, so many steps."""
        return {}

    def leave_traces(self, machine: Machine, point: SavePoint) -> None:  # noqa: B027  (optional hook)
        """Leave traces of another past beyond its state and command."""

    def lacks(self, point: SavePoint) -> str:
        """Why a save point means nothing here; empty where it does."""
        return ""

    @contextmanager
    def new(self, point: SavePoint) -> Iterator[Machine]:
        """A fresh machine for a while."""
        machine = self.fresh(point)
        try:
            yield machine
        finally:
            self.close(machine)

    @contextmanager
    def at(self, point: SavePoint) -> Iterator[Machine]:
        """A machine at a save point."""
        with self.new(point) as machine:
            self.arrive(machine, point)
            yield machine

    @contextmanager
    def used(self, point: SavePoint) -> Iterator[Machine]:
        """A machine with another past: other commands, pushed, and later."""
        with self.at(point) as machine:
            if point.powered and point.model.nu:
                stir = np.random.default_rng(self.seed + 1).uniform(
                    -_OTHERWISE, _OTHERWISE, point.model.nu
                )
                self.command(machine, point.ctrl + stir)
            self.leave_traces(machine, point)
            self.advance(machine, _AFTERWARDS)
            yield machine

    def arrive(self, machine: Machine, point: SavePoint) -> None:
        """From a new or reset machine to the save point."""
        self.start(machine, point)
        self.drive(machine, point, point.run_in)

    def drive(
        self, machine: Machine, point: SavePoint, steps: int, look: Disturbance | None = None
    ) -> Array:
        """Go on, with a look before each step; (steps + 1, k) of what is read there and after."""
        trace = [self.read(machine)]
        for _ in range(steps):
            if point.swings:
                self.command(machine, point.commanded(machine.time))
            if look:
                look.act(machine)
            if look is None or not look.instead:
                self.advance(machine)
            trace.append(self.read(machine))
        return np.array(trace)

    def futures(self, point: SavePoint, steps: int, way: SaveMethod) -> Arrays:
        """What follows from a restore, by what was restored: as `drive` gives it."""
        futures = {}
        with self.at(point) as machine, way.save(machine) as restore:
            self.drive(machine, point, steps)
            for into in (ITSELF,) if way.portable else (ITSELF, ITSELF_AGAIN):
                restore(machine)
                futures[into] = self.drive(machine, point, steps)
            for into, other in ((FRESH, self.new), (USED, self.used)) if way.portable else ():
                with other(point) as target:
                    restore(target)
                    futures[into] = self.drive(target, point, steps)
        return futures

    def run(self, point: SavePoint, steps: int) -> ReferenceRun:
        """The undisturbed run from a point.

        Raises:
            DivergedError: It does not stay finite.
        """
        with self.new(point) as machine:
            self.arrive(machine, point)
            future = self.drive(machine, point, steps)
        if not np.isfinite(future).all():
            raise DivergedError(f"{self.name} diverged")
        return ReferenceRun(point, future)

    def off(self, first: Array, second: Array) -> float:
        """The largest difference of a position after any step of two futures [rad or m]."""
        differences = (first - second)[1:, : self.coordinates.width]
        return float(np.abs(differences).max(initial=0.0))

    def gap(self, run: ReferenceRun, *futures: Array) -> FutureGap:
        """The worst gap of futures to that of a run."""
        return worst([gap(run.future, future, self.coordinates) for future in futures])
