"""What the servos of a robot exert in a run, and how much of what they can."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...errors import UnsupportedError
from ...interface import Array, Data, Ints, Model
from ...measures import largest
from ...measures.text import NO_NUMBER, fixed
from ...show.blocks import Table
from ...show.engine_tables import where
from ...show.labels import TableLabels

_ALL = 1e-9  # of its limit; a servo that is so near exerts all that it can


@dataclass(frozen=True)
class Torques:
    """What the k servos of a robot exert in the n steps of a run.

    Attributes:
        joints: (k,) names of the joints that they drive.
        slides: (k,) which of these are slides; forces on a slide are in N.
        exerted: (n, k) in each step [N·m; of a slide, N].
        limit: (k,) what each can exert at most [N·m; of a slide, N]; infinity without a limit.
    """

    joints: tuple[str, ...]
    slides: tuple[bool, ...]
    exerted: Array = field(metadata={"json": False})
    limit: Array

    @property
    def most(self) -> Array:
        """Return the largest in the run (k,) [N·m; of a slide, N]."""
        return np.abs(self.exerted).max(axis=0)

    @property
    def last(self) -> Array:
        """Return that in the last step (k,) [N·m; of a slide, N]."""
        return self.exerted[-1]

    @property
    def steps_at_limit(self) -> int:
        """Return in how many steps a servo exerted all that it can."""
        at_limit = np.abs(self.exerted) >= self.limit * (1 - _ALL)
        return int(at_limit.any(axis=1).sum())

    @property
    def common_limit(self) -> float | None:
        """Return what each can exert at most [N·m]; None where they differ, or have no limit."""
        limit = float(self.limit[0])
        is_common = bool((self.limit == limit).all()) and not any(self.slides)
        return limit if is_common and 0 < limit < np.inf else None


def exerted_by(data: Data, dofs: Ints) -> Array | None:
    """Read what the actuators exert on some degrees of freedom (k,); None where it is not told."""
    try:
        return data.qfrc_actuator[dofs].copy()
    except UnsupportedError:
        return None


def torques_of(
    model: Model,
    servos: Ints,
    joints: tuple[str, ...],
    slides: tuple[bool, ...],
    rows: Sequence[Array | None],
) -> Torques | None:
    """Return what some servos exert in a run; None where the backend does not tell it.

    Args:
        model: Of the run.
        servos: (k,) their numbers.
        joints: (k,) names of the joints that they drive.
        slides: (k,) which of these are slides.
        rows: (n) of (k,) what they exert in each step.
    """
    told = [row for row in rows if row is not None]
    if not told:
        return None
    limits = np.abs(model.actuator_forcerange[servos] * model.actuator_gear[servos, None])
    return Torques(joints, slides, np.array(told), limits.max(axis=1))


@dataclass(frozen=True)
class Strain:
    """What servos with the same limit exert, beside that limit.

    Attributes:
        limit: What each can exert at most [N·m].
        most: The most that one exerts in the run [N·m].
        steps_at_limit: In how many steps a servo exerts all that it can.
        last_joint: Joint of the servo that exerts most in the last step.
        last: What it exerts then [N·m].
    """

    limit: float
    most: float
    steps_at_limit: int
    last_joint: str
    last: float

    @property
    def most_part(self) -> float:
        """Return the most as a part of the limit."""
        return self.most / self.limit

    @property
    def last_part(self) -> float:
        """Return what is exerted in the last step as a part of the limit."""
        return self.last / self.limit


def strain_of(torques: Torques | None) -> Strain | None:
    """Return what servos exert beside their limit; None where they have no common one."""
    limit = None if torques is None else torques.common_limit
    if torques is None or limit is None:
        return None
    last, joint = largest(np.abs(torques.last))
    return Strain(
        limit=limit,
        most=float(torques.most.max()),
        steps_at_limit=torques.steps_at_limit,
        last_joint=torques.joints[joint],
        last=last,
    )


def torque_table(results: Mapping[str, Torques | None], say: TableLabels) -> Table:
    """Show the most that each servo exerted in the run, and what it exerts at the end.

    Where the first backend does not tell it, the table has no rows.

    Args:
        results: By backend.
        say: The words of the lesson.
    """
    first = next(iter(results.values()))
    if first is None:
        return Table((), ())
    most, last = say("most"), say("last")
    headers = ["joint"]
    for name in results:
        prefix = where(results, name)
        headers += [f"{prefix}{most}", f"{prefix}{last}"]
    rows: list[tuple[str, ...]] = []
    for k, joint in enumerate(first.joints):
        row = [joint]
        for torques in results.values():
            row += [NO_NUMBER, NO_NUMBER] if torques is None else _cells(torques, k)
        rows.append(tuple(row))
    return Table(headers, rows)


def _cells(torques: Torques, joint: int) -> list[str]:
    """Write the most that the servo of a joint exerted, and what it exerts at the end."""
    unit = "N" if torques.slides[joint] else "N·m"
    last = fixed(float(torques.last[joint]), 2)
    return [f"{torques.most[joint]:.2f} {unit}", f"{last} {unit}"]
