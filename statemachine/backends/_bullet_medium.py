"""What acts on each body of a tree by itself: the medium around it, and what carries its weight.

The medium is MuJoCo's model of boxes of the bodies' inertia [manual, chapter Computation, section
Fluid forces]; PyBullet knows none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from ..interface import Array
from ..rotations import matrix_from_quat
from . import _dense as dense
from ._bullet_world import Tree, World
from .compiled import gravity


class Medium:
    """Drag and compensation of gravity of one tree.

    Attributes:
        bodies: Those on which something acts.
    """

    def __init__(
        self, raw: mujoco.MjModel, world: World, tree: Tree, off: Mapping[str, bool]
    ) -> None:
        self._raw, self._world, self._tree = raw, world, tree
        wet = bool(raw.opt.density or raw.opt.viscosity)
        self._lift = -gravity(raw) * (raw.body_mass * raw.body_gravcomp)[:, None]
        passive = not (off["damper"] and off["spring"])  # as MuJoCo, which then skips all of it
        self.bodies = [
            body
            for body in tree.links
            if passive and raw.body_mass[body] and (wet or self._lift[body].any())
        ]
        self._wet = wet
        i, j, k = raw.body_inertia.T
        mass = np.maximum(raw.body_mass, mujoco.mjMINVAL)
        sides = [np.maximum(two, mujoco.mjMINVAL) for two in (j + k - i, i + k - j, i + j - k)]
        a, b, c = boxes = np.sqrt(6.0 * np.array(sides) / mass)
        width, density = boxes.mean(axis=0), float(raw.opt.density)
        spin = [a * (b**4 + c**4), b * (a**4 + c**4), c * (a**4 + b**4)]
        move = [b * c, a * c, a * b]
        # By body, of moving and turning along each axis of its inertia.
        viscous = float(raw.opt.viscosity) * math.pi * np.array([3 * width] * 3 + [width**3] * 3)
        self._linear = viscous.T.copy()
        self._square = density * np.concatenate([np.array(move) / 2, np.array(spin) / 64]).T

    def forces(self, q: Sequence[float], speed: Array) -> tuple[Array, Array]:
        """The generalised force (n,), and how it opposes each velocity more (n, n)."""
        raw, n = self._raw, len(speed)
        force, slope = np.zeros(n), np.zeros((n, n))
        places, quats = self._world.body_poses(self._tree, self.bodies)
        for body, place, turn in zip(self.bodies, places, matrix_from_quat(quats), strict=True):
            centre = place + dense.times(turn, raw.body_ipos[body])
            jacobian = self._world.jacobian(self._tree, q, body, (place, turn), centre)
            force += dense.times(jacobian[:3].T.copy(), self._lift[body])
            if not self._wet:
                continue
            own = dense.product(turn, matrix_from_quat(raw.body_iquat[body])).T.copy()
            local = np.vstack([dense.product(own, jacobian[:3]), dense.product(own, jacobian[3:])])
            rate = dense.times(local, speed)
            rate[:3] -= dense.times(own, raw.opt.wind)
            linear, square = self._linear[body], self._square[body]
            across = local.T.copy()
            force -= dense.times(across, (linear + square * abs(rate)) * rate)
            slope += dense.product(across * (linear + 2 * square * abs(rate)), local)
        return force, slope
