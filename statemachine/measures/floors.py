"""What two figures of a robot may differ by and still be the same: floors that are absolute.

A tolerance that is a share of the quantity itself says nothing where that quantity is rounding: of
8e-34 N·m a millionth is less still. So nothing is called a difference that is below a share of the
robot's own weight and size. There are two shares.

Of a run, of the forces of its contacts and of its energy, it is 2^-23, a ten-millionth: what a
number in single precision keeps, in which many simulators hold their state. A force of that share
of its weight moves a robot by 2 µm in 2 s, whatever the weight is; 0.1 g more on an arm of 6 N
weighs a thousand times as much.

Of one step from one state, where nothing has had the time to add up, it is a billionth: of g for an
acceleration, of the robot's size for a place. In 2 s such an acceleration makes 20 nm. A force has
the floor of the acceleration, times the inertia that it acts on, so that a light wrist has a lower
one than the shoulder. It is far above what double precision makes of a step (1e-16, times some
thousands), and below what a solver leaves of a contact (MuJoCo's stops at 1e-8). Where a side
computes in single precision it is a millionth: a step leaves no more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..interface import Array, Model

RUN_FORCE_SHARE = 2.0**-23  # of a weight, in a run: the precision of a float32
STEP_SHARE = 1e-9  # of g, of a size, of an inertia, of a radian
GRAVITY = 9.81  # m/s², whatever that of the model is: a robot in orbit is as heavy to move
# What the arithmetic of an engine makes of a run's positions: two arms that are built alike are
# 1e-9° to 5e-10 m apart after some seconds. Less than this is no gap to be explained.
RUN_FLOORS = {"rad": 1e-8, "m": 1e-9, "s": 1e-9, "m/s": 1e-9}
_UNKNOWN_SIZE = 1.0  # m; of one point that moves
# J, N; of a robot whose weight is not known, as of a recorded run whose file is not here
_ENERGY_FLOOR, _FORCE_FLOOR = 1e-9, 1e-6


@dataclass(frozen=True)
class RobotScale:
    """How heavy and how large a robot is, and the floors that follow.

    Attributes:
        mass: Of all that can move [kg].
        size: The diagonal of the box around it [m], above zero.
        step_share: The share that is the floor of one step.
    """

    mass: float
    size: float
    step_share: float = STEP_SHARE

    @classmethod
    def of(cls, model: Model, positions: Array) -> RobotScale:
        """Return the scale of a Model.

        Args:
            model: Whose masses they are.
            positions: (n, 3) where what moves is at one moment, its bodies and sites [m]. Of one
                point alone the shapes count, where the Model was compiled.
        """
        moving = moving_bodies(model)
        mass = float(model.body_mass[sorted(moving)].sum())
        size = 0.0
        if len(positions):
            size = float(np.linalg.norm(np.ptp(positions, axis=0)))
        if model.compiled is not None and moving:
            geoms = np.isin(model.geom_bodyid, sorted(moving))
            size = max(size, 2 * float(model.compiled.geom_rbound[geoms].max(initial=0.0)))
        step_share = max(STEP_SHARE, model.capabilities.rounding)
        return cls(mass, size if size > 0 else _UNKNOWN_SIZE, step_share)

    def smaller(self, other: RobotScale) -> RobotScale:
        """Return the scale of two robots that are compared.

        Floors are those of the smaller one, and of the less precise one.
        """
        step_share = max(self.step_share, other.step_share)
        return RobotScale(min(self.mass, other.mass), min(self.size, other.size), step_share)

    @property
    def weight(self) -> float:
        """Return its weight [N]."""
        return self.mass * GRAVITY

    @property
    def force(self) -> float:
        """Return the floor of a contact's force [N]; that of a joint's force is lower."""
        return RUN_FORCE_SHARE * self.weight

    @property
    def energy(self) -> float:
        """Return the floor of an energy change [J]: what lifts the robot by a share of its size."""
        return RUN_FORCE_SHARE * self.weight * self.size

    @property
    def acceleration(self) -> float:
        """Return the floor of the acceleration of what slides, in one step [m/s²].

        The floor of a force on it is that, times the inertia of its degree of freedom.
        """
        return self.step_share * GRAVITY

    @property
    def angular_acceleration(self) -> float:
        """Return the floor of the acceleration of what turns, in one step [rad/s²].

        It is that of a pendulum as long as the robot. The floor of a torque is that, times the
        inertia of its degree of freedom.
        """
        return self.step_share * GRAVITY / self.size

    @property
    def length(self) -> float:
        """Return the floor of a place, or of a depth, in one step [m]."""
        return self.step_share * self.size

    @property
    def angle(self) -> float:
        """Return the floor of a rotation, in one step [rad]."""
        return self.step_share


def force_floor(robot: RobotScale | None) -> float:
    """Return the floor of a contact's force [N], of a robot whose weight may be unknown."""
    return _FORCE_FLOOR if robot is None else robot.force


def energy_floor(robot: RobotScale | None) -> float:
    """Return the floor of a change of energy [J], of a robot whose weight may be unknown."""
    return _ENERGY_FLOOR if robot is None else robot.energy


def moving_bodies(model: Model) -> frozenset[int]:
    """Return the ids of the bodies that a joint moves, by itself or with what carries them."""
    moving = set(model.jnt_bodyid.tolist())
    for body in range(1, model.nbody):  # parents come before children
        if int(model.body_parentid[body]) in moving:
            moving.add(body)
    return frozenset(moving)


def robot_points(model: Model, xpos: Array, site_xpos: Array) -> Array:
    """Return where what moves is (n, 3) [m]: the origins of its bodies, and its sites.

    The body that carries the first joint counts, too: it is the robot's foot.

    Args:
        model: Whose bodies and sites they are.
        xpos: (nbody, 3) of all bodies.
        site_xpos: (nsite, 3) of all sites.
    """
    moving = moving_bodies(model)
    feet = {int(model.body_parentid[body]) for body in moving} - {0}
    bodies = sorted(moving | feet)
    sites = np.isin(model.site_bodyid, bodies)
    return np.concatenate([xpos[bodies].reshape(-1, 3), site_xpos[sites].reshape(-1, 3)])
