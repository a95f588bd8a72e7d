"""How far two runs move, and whether there was anything to compare.

Two robots that hang at rest agree, whatever they are made of: an experiment that moves nothing
compares nothing. So what a comparison says holds only where something was excited: a coordinate
left its tolerance on a side, or the energy changed, or a contact pressed. A robot that holds its
place exactly was compared by the forces of its contacts, if it has any, and by nothing if not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...interface import Array, Ints, JointType
from ...measures import QUANTITIES, RUN_FLOORS, RobotScale, distances, largest_or_inf
from ...measures.floors import energy_floor, force_floor
from ...rotations import angle_between, matrix_from_quat
from ..recordings import Trace
from .series import SCALARS, Series, base_label, joint_columns

LeastMotion = Mapping[str, float]
# What two runs have to move by so that a gap that is rounding says that they move alike: 100 times
# what the arithmetic of an engine makes of a run, 1e-6 rad and 1e-7 m.
SEEN: LeastMotion = {
    kind: 100 * RUN_FLOORS[quantity.unit]
    for kind, quantity in QUANTITIES.items()
    if quantity.is_coordinate
}


@dataclass(frozen=True)
class MotionExtent:
    """How far two runs move from where they start: the largest of either side.

    Attributes:
        seconds: The time that was compared [s].
        angle: Of what turns: hinges, balls and free bodies [rad]; None where nothing can turn.
        length: Of what slides or floats [m]; None where nothing can.
        energy: By how much the energy changes [J]; None where that was not compared.
        force: The largest normal force between two bodies [N]; None where none was compared.
        moved: Whether a coordinate leaves what is no motion: its tolerance, or, where a gap is
            explained, a hundred times the rounding of a run.
        loaded: Whether the energy changes, or a contact presses, by more than its floor: then these
            were compared, though nothing moved.
    """

    seconds: float
    angle: float | None
    length: float | None
    energy: float | None
    force: float | None
    moved: bool
    loaded: bool

    @property
    def is_compared(self) -> bool:
        """Tell whether anything was compared that could have differed."""
        return self.moved or self.loaded


def motion_of(
    sides: Sequence[tuple[Trace, Sequence[str]]], least: LeastMotion, seconds: float
) -> MotionExtent:
    """Return how far the coordinates of two runs move.

    Args:
        sides: Each run, and the labels of the joints that count.
        least: By kind of quantity, what is no motion [rad or m].
        seconds: How much of the runs counts, since their start [s].
    """
    largest: dict[str, float] = {}
    for trace, names in sides:
        rows = np.flatnonzero(trace.time - trace.time[0] <= seconds + 1e-9)
        for name in names:
            for kind, extent in _extents(trace, rows, name).items():
                largest[kind] = max(extent, largest.get(kind, 0.0))
    turned = [extent for kind, extent in largest.items() if QUANTITIES[kind].unit == "rad"]
    slid = [extent for kind, extent in largest.items() if QUANTITIES[kind].unit == "m"]
    return MotionExtent(
        seconds=seconds,
        angle=max(turned, default=None),
        length=max(slid, default=None),
        energy=None,
        force=None,
        moved=any(extent > least[kind] for kind, extent in largest.items()),
        loaded=False,
    )


def with_efforts(
    motion: MotionExtent, curves: Sequence[Series], robot: RobotScale | None
) -> MotionExtent:
    """Return a motion, and what energies and contact forces were compared besides.

    Args:
        motion: Of the coordinates.
        curves: What was compared.
        robot: The robot, for the floors of both; None where its weight is not known.
    """
    energy = _largest_of(curves, "energy")
    force = _largest_of(curves, "force")
    changes = energy is not None and energy > energy_floor(robot)
    presses = force is not None and force > force_floor(robot)
    return replace(motion, energy=energy, force=force, loaded=changes or presses)


def least_motions(tolerances: Mapping[str, float] | None) -> LeastMotion:
    """Return what is no motion [rad or m] by kind of coordinate: its tolerance.

    A tolerance that is wider than ours lets more pass as agreement, but moves nothing less.

    Args:
        tolerances: By kind, those that win over ours.
    """
    least: dict[str, float] = {}
    for kind, quantity in QUANTITIES.items():
        if quantity.is_coordinate and quantity.tolerance is not None:
            least[kind] = quantity.tolerance
            if tolerances is not None and kind in tolerances:
                least[kind] = min(tolerances[kind], quantity.tolerance)
    return least


def _extents(trace: Trace, rows: Ints, name: str) -> dict[str, float]:
    """Return how far a joint gets from where it starts, by kind of quantity [rad or m]."""
    joint = joint_columns(trace.header, name)
    positions = trace.qpos[rows, joint.qpos]
    if joint.kind in SCALARS:
        return {SCALARS[joint.kind]: largest_or_inf(np.abs(positions - positions[0]).ravel())}
    kind = "base" if name == base_label(trace.header) else "body"
    extents = {f"{kind} rotation": largest_or_inf(_turned(positions[:, -4:]))}
    if joint.kind is JointType.FREE:
        extents[kind] = largest_or_inf(distances(positions[:, :3], positions[0, :3]))
    return extents


def _turned(quats: Array) -> Array:
    """Return the angles (n,) [rad] from the first of some quaternions (n, 4), of any length."""
    with np.errstate(invalid="ignore"):  # all zero is no rotation
        matrices = matrix_from_quat(quats / np.linalg.norm(quats, axis=1, keepdims=True))
    return angle_between(matrices, np.broadcast_to(matrices[0], matrices.shape))


def _largest_of(curves: Sequence[Series], kind: str) -> float | None:
    """Return the largest value of the curves of a kind, on either side; None without any."""
    values = [
        largest_or_inf(np.abs(side)) for c in curves if c.kind == kind for side in (c.left, c.right)
    ]
    return max(values, default=None)
