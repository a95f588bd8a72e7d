"""How far apart two sides are in each stage of a step, as records."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...measures import RobotScale
from ...show.blocks import only_on_pages


@dataclass(frozen=True)
class StageGap:
    """How far apart two sides are in one stage of a step, over all moments.

    Attributes:
        stage: Its name.
        is_available: Whether both engines tell it.
        reason: Why it cannot be compared; "" where it can.
        unit: Of the figures; "" where there are none.
        scale: Its usual size on the two sides [unit]: the median of its largest entry over the
            moments at which that is at least a thousandth of what it ever is.
        tolerance: What does not count of the scale [unit].
        floor: What does not count whatever the scale is, of the element that differs most [unit].
        null: How far the left side, put back to its own states, gets from its own run [unit].
        worst: The largest difference [unit].
        at: When that is [s from the start]; None where there is no difference.
        where: The joint, body or pair to look at then.
        beyond: At how many moments it is beyond the tolerance, the floor and the null.
        first: The first of them [s]; None if there is none.
        first_count: At how many of them no earlier stage is, so that it has a cause of its own.
    """

    stage: str
    is_available: bool
    reason: str = ""
    unit: str = ""
    scale: float = 0.0
    tolerance: float = 0.0
    floor: float = 0.0
    null: float = 0.0
    worst: float = 0.0
    at: float | None = None
    where: str = ""
    beyond: int = 0
    first: float | None = None
    first_count: int = 0

    @property
    @only_on_pages
    def limit(self) -> float:
        """Return what does not count of the element that differs most [unit]."""
        return max(self.tolerance, self.floor)

    @property
    @only_on_pages
    def of_usual(self) -> float | None:
        """Return the largest difference as a part of the usual size; None where that is zero."""
        return self.worst / self.scale if self.scale else None


@dataclass(frozen=True)
class Spike:
    """A moment at which the accelerations of a step differ far more than they usually do.

    Attributes:
        at: When [s from the start]; each moment once.
        size: The difference of the accelerations [unit].
        unit: "rad/s²" or "m/s²".
        joint: Whose acceleration differs.
        stage: The first stage beyond its tolerance there.
        where: Its joint, body or pair.
        weight: The difference, relative to the usual acceleration.
    """

    at: float
    size: float
    unit: str
    joint: str
    stage: str
    where: str
    weight: float = field(metadata={"json": False})


@dataclass(frozen=True)
class OneStep:
    """One step of two sides, from each recorded state of the left one.

    Attributes:
        moments: From how many states.
        every: Each so many-th row of the run.
        until: The time of the last of them [s].
        relative: The tolerance, relative to the scale of a stage.
        robot: How heavy and how large the robot is, for what does not count whatever a scale is.
        stages: In the order in which a step computes them.
        first: The first of them that differs at any moment; None if none does.
        spikes: The moments that stand out, the largest first.
        primed: What of the step before the right side was given; "" for nothing.
        notes: What a reader must know.
    """

    moments: int
    every: int
    until: float
    relative: float
    robot: RobotScale
    stages: tuple[StageGap, ...]
    first: StageGap | None
    spikes: tuple[Spike, ...]
    primed: str
    notes: tuple[str, ...]

    @property
    @only_on_pages
    def differing(self) -> tuple[StageGap, ...]:
        """Return the stages that differ at any moment, in the order of a step."""
        return tuple(gap for gap in self.stages if gap.beyond)

    @property
    @only_on_pages
    def is_exact(self) -> bool:
        """Tell whether every figure is the same to the last bit."""
        return all(gap.worst == 0 for gap in self.stages)
