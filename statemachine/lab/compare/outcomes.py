"""What came of the run of a robot that floats: did it fall, how far did it get, did it track.

Of each side one number, whatever happened on the way. A base has fallen where it is below a third
of its height at the start, or where the direction of its own that pointed up at the start points
down: it has turned over by more than 90°. Of a policy it is told, too, how fast it goes, how far to
one side, and what that takes: whether it fell is too little to know of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...interface import Array, JointType
from ...measures import QUANTITIES, SAME_MOMENT, tolerance_of
from ..recordings import Trace
from ..runs.controllers import is_policy
from ..runs.floating import fallen_moments, free_joint_of_robot
from ..runs.walking import lateral_way, mean_speeds
from .series import base_label

FELL, DISTANCE, TRACKING, SLIDE_TRACKING = (
    "fell",
    "distance travelled",
    "tracking error",
    "tracking error of slides",
)
FORWARD, LATERAL, WORK = "forward speed", "lateral way", "work of the actuators"  # of a policy
OF_POLICY = (FORWARD, LATERAL, WORK)
# The kind of each, which says unit and tolerance.
OUTCOMES: Mapping[str, str] = {
    FELL: "fall",
    FORWARD: "forward speed",
    LATERAL: "lateral way",
    WORK: "work",
    DISTANCE: "distance",
    TRACKING: "tracking",
    SLIDE_TRACKING: "slide tracking",
}


@dataclass(frozen=True)
class RunOutcome:
    """What came of two runs, as one number of each.

    Attributes:
        name: One of `OUTCOMES`.
        kind: Which sort of quantity it is.
        unit: Its SI unit.
        left: Of the left: when it fell [s from the start], None if it did not; the distance [m]
            from start to end, level; the root mean square of the gap of servos and their targets
            [rad or m]; of a policy the mean speed in the axes of its heading [m/s], how far to the
            left of the straight line ahead it ended [m], the work of the actuators [J].
        right: Of the right.
        difference: How far apart they are [unit]; where one side alone fell, from then to the end.
        tolerance: What does not matter [unit].
        reason: Why that much.
        verdict: "differs" beyond the tolerance, and where one side alone fell.
    """

    name: str
    kind: str
    unit: str
    left: float | None
    right: float | None
    difference: float
    tolerance: float
    reason: str
    verdict: Literal["agrees", "differs"]

    @property
    def is_on_one_side(self) -> bool:
        """Tell whether one side fell and the other did not."""
        return (self.left is None) is not (self.right is None)

    @property
    def first(self) -> float:
        """Return the lesser of both values; 0 where neither side has one."""
        return min((value for value in (self.left, self.right) if value is not None), default=0.0)


def outcomes_of(
    left: Trace,
    right: Trace,
    until: float,
    tolerances: Mapping[str, float] | None = None,
) -> tuple[RunOutcome, ...]:
    """Return what came of two runs of a robot that floats; nothing of one that is fixed.

    Args:
        left: A run.
        right: The other, by the names of the left.
        until: What of the runs counts [s from the start].
        tolerances: By kind of quantity [SI], instead of ours.
    """
    if not base_label(left.header, right.header):
        return ()
    left_outcomes, right_outcomes = outcomes_of_run(left, until), outcomes_of_run(right, until)
    return tuple(
        _outcome(name, left_outcomes[name], right_outcomes[name], until, tolerances)
        for name in OUTCOMES
        if name in left_outcomes and name in right_outcomes
    )


def outcomes_of_run(trace: Trace, until: float) -> dict[str, float | None]:
    """Return what came of a run by the names in `OUTCOMES`, as far as it has any.

    Args:
        trace: The run.
        until: What of it counts [s from the start].
    """
    time = trace.time - trace.time[0]
    rows = np.flatnonzero(time <= until + SAME_MOMENT * trace.header.timestep)
    outcomes: dict[str, float | None] = {}
    joint = free_joint_of_robot(trace.header)
    if joint is not None and len(rows):
        first = trace.header.jnt_qposadr[joint]
        poses = trace.qpos[rows, first : first + 7]
        fallen = fallen_moments(poses)
        outcomes[FELL] = float(time[rows[fallen.argmax()]]) if fallen.any() else None
        outcomes[DISTANCE] = float(np.linalg.norm(poses[-1, :2] - poses[0, :2]))
        if is_of_policy(trace):
            outcomes |= _of_walk(poses, float(time[rows[-1]]))
            work = _work(trace, len(rows))
            if work is not None:
                outcomes[WORK] = work
    for name, kind in ((TRACKING, JointType.HINGE), (SLIDE_TRACKING, JointType.SLIDE)):
        error = _tracking_error(trace, len(rows), kind)
        if error is not None:
            outcomes[name] = error
    return outcomes


def is_of_policy(trace: Trace) -> bool:
    """Tell whether a policy commanded a run."""
    return is_policy(trace.header.experiment)


def _of_walk(poses: Array, seconds: float) -> dict[str, float]:
    """Return how fast a base goes ahead, and how far it gets to one side.

    Args:
        poses: (n, 7) of the base, one each step.
        seconds: From the first to the last [s].
    """
    speeds = mean_speeds(poses, seconds)
    outcomes = {} if speeds is None else {FORWARD: speeds.forward}
    return outcomes | {LATERAL: lateral_way(poses)}


def _work(trace: Trace, count: int) -> float | None:
    """Return the work that the actuators of hinges and slides do; what they take back is no loss.

    Args:
        trace: The run.
        count: How many rows of it count.

    Returns:
        The sum over steps and joints of force times speed, where both have one sign [J]; None where
        no forces were recorded.
    """
    header = trace.header
    scalars = JointType.HINGE, JointType.SLIDE
    joints = sorted({joint for joint in header.actuator_jntid if joint >= 0})
    dofs = [header.jnt_dofadr[joint] for joint in joints if header.jnt_type[joint] in scalars]
    if "qfrc_actuator" not in trace or not dofs or count < 2:
        return None
    forces = trace["qfrc_actuator"][: count - 1, dofs]
    powers = np.maximum(forces * trace.qvel[: count - 1, dofs], 0.0)
    work = float(powers.sum() * header.timestep)
    return work if np.isfinite(work) else None


def _tracking_error(trace: Trace, count: int, kind: JointType) -> float | None:
    """Return how far joints are from the targets of their servos at the end of each step.

    Args:
        trace: The run.
        count: How many rows of it count.
        kind: Of the joints.

    Returns:
        The root mean square over steps and servos [rad or m]; None without such servos or steps.
    """
    header = trace.header
    gears = np.array(header.servo_gear)
    servos = [i for i in np.flatnonzero(gears) if header.jnt_type[header.actuator_jntid[i]] == kind]
    if not servos or count < 2:
        return None
    places = [header.jnt_qposadr[header.actuator_jntid[i]] for i in servos]
    targets = trace.ctrl[: count - 1, servos] / gears[servos]
    errors = targets - trace.qpos[1:count, places]
    return float(np.sqrt(np.mean(errors**2)))


def _outcome(
    name: str,
    left: float | None,
    right: float | None,
    until: float,
    tolerances: Mapping[str, float] | None,
) -> RunOutcome:
    """Compare one number of two runs."""
    kind = OUTCOMES[name]
    left_value, right_value = (until if value is None else value for value in (left, right))
    allowed = tolerance_of(
        kind, np.array([left_value]), np.array([right_value]), 0.0, 0.0, tolerances
    )
    difference = abs(left_value - right_value)
    is_one_alone = (left is None) is not (right is None)
    return RunOutcome(
        name=name,
        kind=kind,
        unit=QUANTITIES[kind].unit,
        left=left,
        right=right,
        difference=difference,
        tolerance=allowed.value,
        reason=allowed.reason,
        verdict="agrees" if difference <= allowed.value and not is_one_alone else "differs",
    )
