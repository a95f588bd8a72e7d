"""What can touch what, and with how much friction: MuJoCo's rules in PyBullet's terms.

MuJoCo decides by pairs of geoms, and takes the larger friction or that of the geom with
priority. PyBullet decides by pairs of links, and multiplies what each link has.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import mujoco
import numpy as np

from ..interface import Array
from ._contact_rules import bodies_meet, masks_meet, mixed

PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
NO_CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
_MOST = 10.0  # PyBullet's largest friction of a pair
_CLOSE = 0.01  # a friction is the model's if it is within this part of it


@dataclass(frozen=True)
class Solid:
    """What touches as one: the geoms of a body but for planes, or one plane of the world."""

    body: int
    geoms: tuple[int, ...]
    plane: bool


class Surfaces:
    """The solids of a model.

    Attributes:
        solids: All that can touch; planes first.
        pairs: Of two solids, by their places, whether they meet.
        meeting: The geoms that do, two by two.
        slide, spin, roll: Each solid's friction.
        mixed: Pairs of bodies of whose geoms some meet and some do not.
        differences: Where friction is not the model's, in words.
    """

    def __init__(self, raw: mujoco.MjModel) -> None:
        self._raw = raw
        self.solids = [] if raw.opt.disableflags & NO_CONTACT else _solids(raw)
        several: list[str] = []
        self.pairs: dict[tuple[int, int], bool] = {}
        self.meeting: list[tuple[int, int]] = []
        self.mixed: list[str] = []
        wanted = []  # friction (3,) of each pair that meets
        for (i, one), (j, two) in combinations(enumerate(self.solids), 2):
            meeting = [
                (a, b) for a in one.geoms for b in two.geoms if masks_meet(raw, a, b)
            ] * bodies_meet(raw, one.body, two.body)
            self.pairs[i, j] = bool(meeting)
            self.meeting += meeting
            if meeting and len(meeting) < len(one.geoms) * len(two.geoms):
                self.mixed.append(self._label(i, j))
            if meeting:
                frictions = np.array([_friction(raw, a, b) for a, b in meeting])
                wanted.append((i, j, frictions.max(axis=0)))
                if np.ptp(frictions[:, 0]) > _CLOSE * frictions[:, 0].max():
                    several.append(
                        f"friction of {self._label(i, j)} is {frictions[:, 0].max():.3g} for all "
                        f"their geoms, not {frictions[:, 0].min():.3g} for some"
                    )
        self._solve(wanted)
        self.differences += several

    def _label(self, i: int, j: int) -> str:
        def name(solid: Solid) -> str:
            if solid.plane:
                return self._raw.geom(solid.geoms[0]).name or f"the plane (geom {solid.geoms[0]})"
            return self._raw.body(solid.body).name or f"body {solid.body}"

        return f"{name(self.solids[i])} and {name(self.solids[j])}"

    def _solve(self, wanted: list[tuple[int, int, Array]]) -> None:
        """Frictions of solids from those of pairs, as well as it goes."""
        count = len(self.solids)
        rows, right = [], []
        for i, j, (slide, _, _) in wanted:
            if slide > 0:
                rows.append(np.isin(np.arange(count), (i, j)).astype(np.float64))
                right.append(math.log(slide))
        self.slide = np.zeros(count)
        if rows and np.ptp(right) == 0 and len(rows) == len(wanted):
            self.slide += math.exp(right[0] / 2)  # one friction for all: no need to solve
        elif rows:
            logs = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
            rubs = np.any(rows, axis=0)  # what meets nothing with friction has none
            self.slide = np.where(rubs, [math.exp(x) for x in np.round(logs, 12)], 0.0)
        self.spin, self.roll = (self._turning(wanted, k) for k in (1, 2))
        self.differences = []
        for i, j, (slide, spin, roll) in wanted:
            found = (
                ("friction", slide, min(self.slide[i] * self.slide[j], _MOST)),
                ("spinning friction", spin, self._combined(self.spin, i, j)),
                ("rolling friction", roll, self._combined(self.roll, i, j)),
            )
            self.differences += [
                f"{what} of {self._label(i, j)} is {ours:.3g}, not {theirs:.3g}"
                for what, theirs, ours in found
                if abs(ours - theirs) > _CLOSE * max(theirs, 1e-6)
            ]

    def _combined(self, each: Array, i: int, j: int) -> float:
        """What PyBullet makes of the spinning or rolling friction of two."""
        return float(each[i] * self.slide[j] + each[j] * self.slide[i])

    def _turning(self, wanted: list[tuple[int, int, Array]], which: int) -> Array:
        matrix = np.zeros((len(wanted), len(self.solids)))
        for row, (i, j, _) in enumerate(wanted):
            matrix[row, i], matrix[row, j] = self.slide[j], self.slide[i]
        right = np.array([friction[which] for _, _, friction in wanted])
        if not right.any():
            return np.zeros(len(self.solids))
        found = np.linalg.lstsq(matrix, right, rcond=None)[0]
        return np.maximum(np.round(found, 12), 0.0)


def _solids(raw: mujoco.MjModel) -> list[Solid]:
    touching = [g for g in range(raw.ngeom) if raw.geom_contype[g] or raw.geom_conaffinity[g]]
    planes = [g for g in touching if raw.geom_type[g] == PLANE]
    found = [Solid(0, (g,), True) for g in planes]
    for body in range(raw.nbody):
        geoms = tuple(g for g in touching if raw.geom_bodyid[g] == body and g not in planes)
        if geoms:
            found.append(Solid(body, geoms, False))
    return found


def _friction(raw: mujoco.MjModel, a: int, b: int) -> Array:
    """Sliding, spinning and rolling friction of a pair, zero where its condim leaves it out."""
    condim, friction, _, _ = mixed(raw, a, b)
    return friction * (condim > np.array([1, 3, 4]))


def damping_ratios(raw: mujoco.MjModel, pairs: list[tuple[int, int]]) -> Array:
    """Of contacts of geoms (n, 2), by their solref."""
    first, second = np.array([mixed(raw, a, b)[2] for a, b in pairs]).T
    # Negated, they are stiffness and damping.
    return np.where(first <= 0, -second / (2 * np.sqrt(np.maximum(-first, 1e-15))), second)
