"""A case of the battery: what is run, what is measured of it, and what the closed form says.

A case is a record. To add one, write it into the file of its group, and list it in that file's
`CASES`. Its truth is never taken from an engine: a test computes it a second way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from ...errors import BadInputError
from ...release_names import engine_of
from .run import Run

Group = Literal["motion", "joints", "contact"]
Integrator = Literal["Euler", "implicit", "implicitfast", "RK4", "discrete", "own"]
Cause = Literal[
    "none",
    "discretisation",
    "contact model",
    "computed by our backend",
    "engine's own",
    "single precision",
]
# From the best to the worst.
Verdict = Literal[
    "exact",
    "exact discrete form",
    "converges",
    "bounded",
    "wrong",
    "diverges",
    "refused",
    "failed",
]

Discrete = Mapping[Integrator, Callable[[float], float]]  # of the timestep [s]

GRAVITY = 9.81  # [m/s²]
TIMESTEPS = (0.005, 0.002, 0.001, 0.0005)  # [s]
FEW_TIMESTEPS = (0.005, 0.002, 0.001)  # [s] of an error that does not depend on the timestep
ROUNDING = 1e-9  # the largest error that counts as exact, unless a case says another
SLACK = 1.25  # what another make of processor or another compiler may add to an error
# What a step may change a number by, relative to its size, that is stored in single precision: one
# unit in the last place. A rounding is half of that; speed and place are both rounded.
SINGLE = 2.0**-23
_ROUNDING = (
    "A step rounds numbers by at most 1.2e-7 of the largest, in single precision; the error is "
    "within what that makes of all steps."
)
EVERY = "*"  # every engine or integrator that no other key names


@dataclass(frozen=True)
class Expectation:
    """What a case is known to give with an engine and an integrator.

    Attributes:
        verdict: How the engine does.
        within: Largest size of the error at the case's longest timestep [unit of its error].
        order: With which power of the timestep the error vanishes; None where it does not, or
            where rounding or chaos hides it.
        cause: What the error comes from.
        note: More of the cause, in a sentence; "" where there is nothing to add.
        rounded: Of an engine of which only the rounding of single precision is seen: the size of
            the largest number that is rounded [unit of the error]. An error is then at most
            `SINGLE` times that for each step, at every timestep, and `within` is not used. None of
            other records.
    """

    verdict: Verdict
    within: float
    order: float | None
    cause: Cause
    note: str = ""
    rounded: float | None = None

    def bound(self, steps: int) -> float:
        """Return the largest size of an error that rounding makes in a run [unit of the error].

        Args:
            steps: Number of steps of the run.
        """
        return math.inf if self.rounded is None else self.rounded * SINGLE * steps


def exact(within: float = ROUNDING) -> Expectation:
    """Return the expectation of the closed form itself, at every timestep."""
    return Expectation("exact", within, None, "none")


def exact_steps(within: float, order: float | None = 1.0) -> Expectation:
    """Return the expectation of the exact discrete form: what is left is the timestep's alone."""
    return Expectation("exact discrete form", within * SLACK, order, "discretisation")


def converges(
    order: float, within: float, cause: Cause = "discretisation", note: str = ""
) -> Expectation:
    """Return the expectation of an error that vanishes with a power of the timestep."""
    return Expectation("converges", within * SLACK, order, cause, note)


def bounded(within: float, cause: Cause, note: str = "") -> Expectation:
    """Return the expectation of a small error that does not vanish with the timestep."""
    return Expectation("bounded", within * SLACK, None, cause, note)


def rounded(size: float = 1.0) -> Expectation:
    """Return the expectation of an engine of which only the rounding of single precision is seen.

    Args:
        size: Of the largest number that is rounded [unit of the error].
    """
    return Expectation("bounded", math.inf, None, "single precision", _ROUNDING, size)


def wrong(within: float, cause: Cause, order: float | None = None, note: str = "") -> Expectation:
    """Return the expectation of an engine that is known to be wrong, and by how much."""
    return Expectation("wrong", within * SLACK, order, cause, note)


# Of an engine as it comes, whose motors hold each joint still that nothing drives.
NO_MOTION = wrong(math.inf, "engine's own")


def diverges(cause: Cause) -> Expectation:
    """Return the expectation of a run that stops being finite."""
    return Expectation("diverges", math.inf, None, cause)


def refused() -> Expectation:
    """Return the expectation of a model that the engine, or our backend for it, does not take."""
    return Expectation("refused", math.inf, None, "none")


@dataclass(frozen=True)
class Case:
    """A question whose answer is known.

    Attributes:
        name: What --case takes.
        group: Which file it stands in.
        description: What happens and what is measured, in one sentence.
        mjcf: What stands inside <mujoco>, but for <option>.
        measure: Drives a run, and returns the number that is measured [unit]; infinite if what
            it waits for does not happen.
        truth: Returns the number of the closed form [unit].
        unit: Of that number, SI; "" for a ratio.
        source: Textbook and section, or paper, of the closed form.
        expected: What is known of engines and integrators; the first key that fits counts:
            "mujoco==3.3.7 Euler", "mujoco Euler", "mujoco *", "Euler", "*".
        relative: Whether the error is measured over truth, less 1; otherwise it is the difference.
        tolerance: Largest size of an error that is no fault, though it may not vanish [unit of
            the error].
        rounding: Largest size of an error that counts as exact [unit of the error].
        discrete: By integrator the exact discrete truth [unit], a function of the timestep [s].
        truth_after: Of a truth that depends on the simulated time: returns it for a time [s],
            which is not the case's own where a timestep does not divide that; None of others.
        option: More attributes of <option>, such as 'cone="elliptic"'.
        gravity: (3,) [m/s²].
        timesteps: At which it is run, from the longest to the shortest [s].
        is_chaotic: Whether the end depends on rounding, so that no order is observed.
    """

    name: str
    group: Group
    description: str
    mjcf: str
    measure: Callable[[Run], float]
    truth: Callable[[], float]
    unit: str
    source: str
    expected: Mapping[str, Expectation]
    relative: bool = False
    tolerance: float = 0.02
    rounding: float = ROUNDING
    discrete: Discrete = field(default_factory=dict)
    truth_after: Callable[[float], float] | None = None
    option: str = ""
    gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY)
    timesteps: tuple[float, ...] = TIMESTEPS
    is_chaotic: bool = False

    def __post_init__(self) -> None:
        if list(self.timesteps) != sorted(self.timesteps, reverse=True):
            raise BadInputError(f"the timesteps of {self.name} must become shorter")
        if not self.expected:
            raise BadInputError(f"{self.name} says of no engine what to expect")

    @cached_property
    def true_value(self) -> float:
        """Return the number of the closed form [unit], computed once: some take a quadrature."""
        return self.truth()

    def truth_of(self, time: float) -> float:
        """Return the number of the closed form for a simulated time [s]."""
        return self.true_value if self.truth_after is None else self.truth_after(time)

    @property
    def error_unit(self) -> str:
        """Return the unit of its error; "" for a relative one."""
        return "" if self.relative else self.unit

    def error_of(self, measured: float, truth: float) -> float:
        """Return how far a measured number is from a truth [unit of the error]."""
        if self.relative:
            return measured / truth - 1.0
        return measured - truth

    def model_text(self, timestep: float, integrator: Integrator) -> str:
        """Return the case as MJCF.

        Args:
            timestep: Length of a step [s].
            integrator: The one that the file names; "own" for an engine that reads none.
        """
        named = "Euler" if integrator == "own" else integrator
        gravity = " ".join(repr(entry) for entry in self.gravity)
        return (
            f'<mujoco model="{self.name}">'
            '<compiler angle="radian" autolimits="true"/>'
            f'<option timestep="{timestep!r}" integrator="{named}" gravity="{gravity}" '
            f"{self.option}/>"
            f"{self.mjcf}</mujoco>"
        )

    def expectation(self, backend: str, integrator: Integrator) -> Expectation | None:
        """Return what is known of a backend and an integrator; None if that is nothing.

        Nothing is known of an engine that reads no integrator and has no record of its own. An
        engine as it comes has that of its name where none is of it as it comes.

        Args:
            backend: As it is typed behind --backend.
            integrator: How it steps.
        """
        names = dict.fromkeys((backend, backend.partition(":")[0], engine_of(backend)))
        keys = [f"{name} {way}" for name in names for way in (integrator, EVERY)]
        if integrator != "own":
            keys += [integrator, EVERY]
        for key in keys:
            if key in self.expected:
                return self.expected[key]
        return None
