"""What comes of a run, looked at in every step: where the base gets, whether it fell, tracking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...interface import Array, Data, Ints, JointType, Model
from ...interface.sites import usual_site
from ...rotations import matrix_from_quat
from ..runs.floating import free_joint_of_robot
from ..runs.robot import is_servo

# Columns of the dataset, and the joints whose servos each is of.
_TRACKING_COLUMNS = {"tracking_error": JointType.HINGE, "slide_tracking_error": JointType.SLIDE}
_FALLEN_HEIGHT = 1 / 3  # of its height at the start: a base below it has fallen


def unavailable_columns(models: Sequence[Model]) -> tuple[str, ...]:
    """Return the columns of the dataset that no run on any of some models has."""
    columns: list[str] = []
    if all(free_joint_of_robot(model) is None for model in models):
        columns += ["base", "distance", "fell"]
    for name, kind in _TRACKING_COLUMNS.items():
        if not any(len(_servos_of(model, kind)) for model in models):
            columns.append(name)
    if all(usual_site(model.site_names, model.moving_sites) is None for model in models):
        columns += ["tip", "sample_tip"]
    return tuple(columns)


def _servos_of(model: Model, kind: JointType) -> Ints:
    """Return the numbers (n,) of the position servos on joints of a kind."""
    joints = np.append(model.jnt_type, -1)[model.actuator_jntid]  # -1: it drives no joint
    return np.flatnonzero(is_servo(model) & (joints == kind))


class _Tracking:
    """The gap of joints of a kind and the targets of their servos, over the steps of a run."""

    def __init__(self, model: Model, kind: JointType) -> None:
        self.servos = _servos_of(model, kind)
        self._places = model.jnt_qposadr[model.actuator_jntid[self.servos]]
        self._gears = model.actuator_gear[self.servos]
        self._squares, self._steps = 0.0, 0

    def look(self, data: Data) -> None:
        """Look at the state after a step."""
        # Of a servo ctrl is the target of its joint times the gear.
        errors = data.ctrl[self.servos] / self._gears - data.qpos[self._places]
        self._squares += float(errors @ errors) / len(errors)
        self._steps += 1

    @property
    def error(self) -> float | None:
        """Return the root mean square over steps and servos [rad or m]; None without either."""
        if not self._steps:
            return None
        return float(np.sqrt(self._squares / self._steps))


class Outcomes:
    """The outcomes of a run so far; `look` is called after every step."""

    def __init__(self, model: Model, qpos: Array) -> None:
        """Begin with the state in which the run starts.

        Args:
            model: What is run.
            qpos: (nq,) of the start.
        """
        joint = free_joint_of_robot(model)
        self._address = None if joint is None else int(model.jnt_qposadr[joint])
        self._start = np.zeros(7)
        self._up = np.zeros(3)
        if self._address is not None:
            self._start = qpos[self._address : self._address + 7].copy()
            # The direction of the base's own axes that points up where the run starts.
            self._up = matrix_from_quat(self._start[3:])[2].copy()
        self._tracking = {name: _Tracking(model, kind) for name, kind in _TRACKING_COLUMNS.items()}
        self._acting = [each for each in self._tracking.values() if len(each.servos)]
        self._is_fallen = False

    def look(self, data: Data) -> None:
        """Look at the state after a step."""
        qpos = data.qpos
        if self._address is not None and not self._is_fallen:
            pose = qpos[self._address : self._address + 7]
            self._is_fallen = self._lies(pose)
        for tracking in self._acting:
            tracking.look(data)

    def _lies(self, pose: Array) -> bool:
        """Tell whether a base at a pose (7,) has fallen: it is too low, or turned over."""
        height = self._start[2]  # below the origin there is no third of it
        if height > 0 and pose[2] < _FALLEN_HEIGHT * height:
            return True
        up = matrix_from_quat(pose[3:])[2]
        return bool(up @ self._up < 0)

    def columns(self, qpos: Array) -> dict[str, float | list[float] | None]:
        """Return the columns of the dataset for a run that ends at `qpos` (nq,)."""
        return {
            "base": self.base(qpos),
            "distance": self.distance(qpos),
            "fell": self.fell,
            **{name: tracking.error for name, tracking in self._tracking.items()},
        }

    def base(self, qpos: Array) -> list[float] | None:
        """Return the position (3,) [m] of the base at `qpos` in the world; None of a fixed one."""
        if self._address is None:
            return None
        return qpos[self._address : self._address + 3].tolist()

    def distance(self, qpos: Array) -> float | None:
        """Return how far, level, the base at `qpos` is from its start [m]; None of a fixed one."""
        if self._address is None:
            return None
        position = qpos[self._address : self._address + 2]
        return float(np.linalg.norm(position - self._start[:2]))

    @property
    def fell(self) -> float | None:
        """Return 1 where the base fell, else 0; None of a fixed base.

        It fell where it was below a third of its height at the start after any step, or the
        direction that pointed up at the start pointed down.
        """
        if self._address is None:
            return None
        return 1.0 if self._is_fallen else 0.0
