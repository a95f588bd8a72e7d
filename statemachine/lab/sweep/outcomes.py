"""What comes of a run, looked at in every step: where the base gets, whether it fell, tracking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...interface import Array, Data, JointType, Model
from ...interface.sites import usual_site
from ...rotations import matrix_from_quat
from ..runs.robot import is_servo, trees_of_actuators

_LOWEST = 1 / 3  # of its height at the start: a base below it has fallen


def base_joint(model: Model) -> int | None:
    """Return the number of the free joint of a robot's base; None where it is fixed.

    A free body that carries none of what actuators drive, as a box in a scene, is no base.
    """
    robot = trees_of_actuators(model)
    for joint in range(model.njnt):
        if model.jnt_type[joint] == JointType.FREE and int(model.jnt_bodyid[joint]) in robot:
            return joint
    return None


def unavailable_columns(models: Sequence[Model]) -> tuple[str, ...]:
    """Return the columns of the dataset that no run on any of some models has."""
    columns: list[str] = []
    if all(base_joint(model) is None for model in models):
        columns += ["base", "distance", "fell"]
    if not any(bool(is_servo(model).any()) for model in models):
        columns.append("tracking_error")
    if all(usual_site(model.site_names, model.moving_sites) is None for model in models):
        columns += ["tip", "sample_tip"]
    return tuple(columns)


class Outcomes:
    """The outcomes of a run so far; `look` is called after every step."""

    def __init__(self, model: Model, qpos: Array) -> None:
        """Begin with the state in which the run starts.

        Args:
            model: What is run.
            qpos: (nq,) of the start.
        """
        joint = base_joint(model)
        self._address = None if joint is None else int(model.jnt_qposadr[joint])
        self._start = np.zeros(7)
        self._up = np.zeros(3)
        if self._address is not None:
            self._start = qpos[self._address : self._address + 7].copy()
            # The direction of the base's own axes that points up where the run starts.
            self._up = matrix_from_quat(self._start[3:])[2].copy()
        servos = np.flatnonzero(is_servo(model))
        joints = model.actuator_jntid[servos]
        self._servos, self._positions = servos, model.jnt_qposadr[joints]
        self._gears = model.actuator_gear[servos]
        self._squares, self._looks = 0.0, 0
        self._is_fallen = False

    def look(self, data: Data) -> None:
        """Look at the state after a step."""
        qpos = data.qpos
        if self._address is not None and not self._is_fallen:
            pose = qpos[self._address : self._address + 7]
            self._is_fallen = self._lies(pose)
        if len(self._servos):
            # Of a servo ctrl is the target of its joint times the gear.
            apart = data.ctrl[self._servos] / self._gears - qpos[self._positions]
            self._squares += float(apart @ apart) / len(apart)
            self._looks += 1

    def _lies(self, pose: Array) -> bool:
        """Tell whether a base at a pose (7,) has fallen: it is too low, or turned over."""
        if pose[2] < _LOWEST * self._start[2]:
            return True
        up = matrix_from_quat(pose[3:])[2]
        return bool(up @ self._up < 0)

    def columns(self, qpos: Array) -> dict[str, float | list[float] | None]:
        """Return the columns of the dataset for a run that ends at `qpos` (nq,)."""
        return {
            "base": self.base(qpos),
            "distance": self.distance(qpos),
            "fell": self.fell,
            "tracking_error": self.tracking_error,
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
        here = qpos[self._address : self._address + 2]
        return float(np.linalg.norm(here - self._start[:2]))

    @property
    def fell(self) -> float | None:
        """1 where the base fell, else 0; None of a fixed base.

        It fell where it was below a third of its height at the start after any step, or the
        direction that pointed up at the start pointed down.
        """
        if self._address is None:
            return None
        return 1.0 if self._is_fallen else 0.0

    @property
    def tracking_error(self) -> float | None:
        """Root mean square, over steps and servos, of the gap of joint and target [rad or m].

        None without position servos.
        """
        if not self._looks:
            return None
        return float(np.sqrt(self._squares / self._looks))
