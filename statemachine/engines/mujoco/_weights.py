"""What the rigid parts of two compiled models weigh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...description.records import Inertial
from ...interface import Array
from ...rotations import HERE, Placement
from ..records import BodyPair, Edit, ModelDifference
from ._figures import plain, same
from ._solid import NEAR, SolidPairs, apart, name_of, quat_of


class Weights(SolidPairs):
    """Masses, centres of mass and inertias."""

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        for pair in self._pairs.solids:
            if pair.one and pair.two and self._one.body_mocapid[pair.one] < 0:
                yield from self._inertial(pair)  # what no force moves has no weight

    def _inertial(self, pair: BodyPair) -> Iterator[ModelDifference]:
        """Body by body where the part is made alike; else as one solid."""
        ours, theirs = (
            solids.massive(head)
            for solids, head in zip(self._solids, (pair.one, pair.two), strict=True)
        )
        whole = self._weighed(self._solids[0].inertial(pair.one), pair.align)
        alike = self._alike(whole, self._solids[1].inertial(pair.two))
        if all(alike.values()) or not (ours or theirs):
            return
        if len(theirs) == 1:
            yield from self._weights(pair, theirs[0], whole, alike, ours)
        elif self._made_alike(pair, ours, theirs):
            for a, b in zip(ours, theirs, strict=True):
                one, two = self._solids[0].inertial_of(a), self._solids[1].inertial_of(b)
                yield from self._weights(replace(pair, one=a), b, one, self._alike(one, two), [a])
        else:
            edits, why = self._lumped(pair, whole, theirs)
            mass = self._solids[1].inertial(pair.two).mass
            name = name_of(self._one, "body", pair.one)
            values = (("mass", whole.mass, mass), ("bodies", len(ours), len(theirs)))
            yield ModelDifference("mass", "body", name, values, "kg", edits, (), why)

    def _made_alike(self, pair: BodyPair, ours: list[int], theirs: list[int]) -> bool:
        """Whether the bodies of a part are the same ones in the same places."""
        if pair.align is not HERE or len(ours) != len(theirs):
            return False
        for a, b in zip(ours, theirs, strict=True):
            far, turn = apart(self._solids[0].place(a), self._solids[1].place(b))
            if far > NEAR or turn > NEAR or self._one.body(a).name != self._two.body(b).name:
                return False
        return True

    @staticmethod
    def _weighed(inertial: Inertial, align: Placement) -> Inertial:
        """An inertia in the frame of the other's part."""
        tensor = align.mat @ inertial.tensor @ align.mat.T
        return Inertial(inertial.mass, align.of(inertial.com), tensor)

    @staticmethod
    def _alike(one: Inertial, two: Inertial) -> dict[str, bool]:
        size = max(np.abs(one.tensor).max(), np.abs(two.tensor).max())
        return {
            "mass": same(one.mass, two.mass),
            "centre of mass": float(np.linalg.norm(one.com - two.com)) <= NEAR,
            "inertia": bool(np.abs(one.tensor - two.tensor).max() <= 1e-9 * size),
        }

    def _weights(
        self,
        pair: BodyPair,
        target: int,
        there: Inertial,
        alike: dict[str, bool],
        bodies: list[int],
    ) -> Iterator[ModelDifference]:
        """What the one body is to weigh that has the mass of a part."""
        theirs = self._solids[1].inertial_of(target)
        name = name_of(self._one, "body", pair.one)
        told = {
            "mass": (("mass", there.mass, theirs.mass), "kg"),
            "centre of mass": (("com", plain(there.com), plain(theirs.com)), "m"),
            "inertia": (("moments", _moments(there.tensor), _moments(theirs.tensor)), "kg m²"),
        }
        raw_copy = pair.align is HERE and bodies == [pair.one]
        for subject, equal in alike.items():
            if equal:
                continue
            values, unit = told[subject]
            if subject == "mass" or self._stays_simple(pair, target):
                edits = self._weight(subject, pair, target, there, raw_copy)
                yield ModelDifference(subject, "body", name, (values,), unit, edits)
                continue
            back = self._back(subject, pair)
            why = "" if back else "its mass matrix is stored as a diagonal"
            yield ModelDifference(subject, "body", name, (values,), unit, (), back, why)

    def _weight(
        self, subject: str, pair: BodyPair, target: int, there: Inertial, raw_copy: bool
    ) -> tuple[Edit, ...]:
        one, body = self._one, (target,)
        if subject == "mass":
            return (("body_mass", body, there.mass),)
        inner = self._solids[1].place(target).inverse
        if subject == "centre of mass":
            com = one.body_ipos[pair.one].copy() if raw_copy else inner.of(there.com)
            return (("body_ipos", body, com),)
        if raw_copy:
            moments, quat = one.body_inertia[pair.one].copy(), one.body_iquat[pair.one].copy()
        else:
            moments, quat = _principal(inner.mat @ there.tensor @ inner.mat.T)
        return ("body_inertia", body, moments), ("body_iquat", body, quat)

    def _lumped(
        self, pair: BodyPair, there: Inertial, bodies: list[int]
    ) -> tuple[tuple[Edit, ...], str]:
        """All of a part's inertia in its first body, none in those fixed to it."""
        if self._two.body_simple[pair.two]:
            return (), "its mass matrix is stored as a diagonal"
        moments, quat = _principal(there.tensor)
        edits: list[Edit] = []
        for body in bodies:
            if body != pair.two:
                edits += [("body_mass", (body,), 0.0), ("body_inertia", (body,), np.zeros(3))]
        at = (pair.two,)
        edits += [("body_mass", at, there.mass), ("body_ipos", at, there.com)]
        return (*edits, ("body_inertia", at, moments), ("body_iquat", at, quat)), ""

    def _stays_simple(self, pair: BodyPair, target: int) -> bool:
        """Whether the second's mass matrix has a place for what the first has.

        The engine stores that of a body which turns about its centre of mass as a diagonal.
        """
        simple = bool(self._two.body_simple[target])
        return not simple or bool(self._one.body_simple[pair.one])

    def _back(self, subject: str, pair: BodyPair) -> tuple[Edit, ...]:
        """Edits of the first model instead, where it is the one that can be changed."""
        one, two = self._one, self._two
        if one.body_simple[pair.one] or pair.align is not HERE:
            return ()
        if subject == "centre of mass":
            return (("body_ipos", (pair.one,), two.body_ipos[pair.two].copy()),)
        return (
            ("body_inertia", (pair.one,), two.body_inertia[pair.two].copy()),
            ("body_iquat", (pair.one,), two.body_iquat[pair.two].copy()),
        )


def _moments(tensor: Array) -> tuple[float, ...]:
    return tuple(np.linalg.eigvalsh(tensor)[::-1].tolist())


def _principal(tensor: Array) -> tuple[Array, Array]:
    """Moments (3,) of inertia, and the quaternion of their axes."""
    moments, axes = np.linalg.eigh(tensor)
    moments, axes = moments[::-1], axes[:, ::-1]
    if np.linalg.det(axes) < 0:
        axes = axes * [1.0, 1.0, -1.0]
    return moments, quat_of(axes)
