"""What of one Model is what of another, and what of the left is moved to the right by that."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...backends.controls import ctrl_owners
from ...engines.records import Counterparts, Pairs
from ...interface import Array, JointType, Model, State
from ..recordings import SideStart
from ..runs.floating import free_joint_of_base

Only = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class RenamedPair:
    """Two elements that go by other names, and are taken for one by what they share.

    Attributes:
        kind: "joint", "site" or "actuator".
        left, right: Their names.
        shared: What they share, in words.
        suggestion: What to type where they are two.
    """

    kind: str
    left: str
    right: str
    shared: str
    suggestion: str

    @property
    def note(self) -> str:
        """Return both names as a sentence without its end."""
        return (
            f"{self.kind} {self.left!r} on the left is taken for {self.right!r} on the right: "
            f"{self.shared} ({self.suggestion} says otherwise)"
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Matched(Counterparts):
    """What of one Model is what of another.

    Attributes:
        left: The left Model.
        right: The right one.
        bodies: Pairs of ids.
        only: For each Model what it alone has: names, by "joint", "site" and "actuator".
        renamed: What was taken for one although the names differ, and nobody said so.
        other_notes: What a reader should know beside that, in sentences.
    """

    left: Model
    right: Model
    bodies: Pairs
    only: tuple[Only, Only]
    renamed: tuple[RenamedPair, ...]
    other_notes: tuple[str, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what a reader should know of the pairs, in sentences."""
        return (*(pair.note for pair in self.renamed), *self.other_notes)

    @property
    def reordered(self) -> bool:
        """Tell whether an index into ctrl means another actuator on the right."""
        places = [right_id for _, right_id in self.actuators]
        return places != sorted(places)

    @property
    def only_beside_bases(self) -> tuple[Only, Only]:
        """Return what each Model alone has, but for the free joint of the base of its robot."""
        left, right = (
            _without_base(model, only)
            for model, only in zip((self.left, self.right), self.only, strict=True)
        )
        return left, right

    @property
    def joints_elsewhere(self) -> bool:
        """Tell whether an index into qpos or qvel means another joint on the right."""
        left, right = self.left, self.right
        return any(
            left.jnt_qposadr[left_id] != right.jnt_qposadr[right_id]
            or left.jnt_dofadr[left_id] != right.jnt_dofadr[right_id]
            for left_id, right_id in self.joints
        )

    @property
    def mocap_elsewhere(self) -> bool:
        """Tell whether an index into mocap_pos means another mocap body on the right."""
        left_places, right_places = self.places["mocap_pos"]
        return left_places != right_places

    def start(self, left: SideStart, right: SideStart) -> SideStart:
        """Return the start of the left in the right's layout; the rest is that of `right`."""
        return SideStart(
            qpos=self.to_right("qpos", left.qpos, right.qpos),
            qvel=self.to_right("qvel", left.qvel, right.qvel),
            ctrl=self.to_right("ctrl", left.ctrl, right.ctrl),
        )

    def state(self, left: State, right: State) -> State:
        """Return `right`, a State of the right Model, with the values of a State of the left.

        Copied are the time, and of the arrays in `places` those that both have.
        """
        arrays = {
            name: self.to_right(name, left[name], right[name])
            for name in self.places
            if name in dict(left.layout) and name in dict(right.layout)
        }
        return right.with_parts(time=left["time"], **arrays)

    def to_right(self, part: str, values: Array, right_start: Array) -> Array:
        """Return an array of the left in the right's layout, (k,) or (n, k).

        Args:
            part: Its name in `places`.
            values: (m,) or (n, m) of the left.
            right_start: (k,) of the right, for what has no counterpart.
        """
        return _with_counterparts(values, right_start, *self.places[part])

    @cached_property
    def places(self) -> Mapping[str, list[list[int]]]:
        """Return the indices of the counterparts on the left and on the right, by array of a State.

        Activations are matched for actuators that have as many of them on both sides.
        """
        left, right = self.left.compiled, self.right.compiled
        activations: Iterable[tuple[int, int]] = ()
        if left is not None and right is not None:
            activations = _activations(self.actuators, left, right)
        mocap_bodies = list(self._mocap_bodies())
        return {
            "qpos": self._spans("jnt_qposadr", "nq"),
            "qvel": self._spans("jnt_dofadr", "nv"),
            "ctrl": _ends(self.actuators),
            "act": _ends(activations),
            "mocap_pos": _ends(_entries(mocap_bodies, 3)),
            "mocap_quat": _ends(_entries(mocap_bodies, 4)),
        }

    def _mocap_bodies(self) -> Iterator[tuple[int, int]]:
        """Yield the numbers of mocap bodies, as `body_mocapid` has them, that are counterparts."""
        for pair in self.solids:
            left_id = int(self.left.compiled.body_mocapid[pair.left])
            right_id = int(self.right.compiled.body_mocapid[pair.right])
            if left_id >= 0 and right_id >= 0:
                yield left_id, right_id

    def _spans(self, start: str, end: str) -> list[list[int]]:
        """Return the indices of the common joints in qpos or qvel, of the left and of the right."""
        places: list[list[int]] = [[], []]
        for side, model in enumerate((self.left, self.right)):
            starts = [*getattr(model, start).tolist(), getattr(model, end)]
            for pair in self.joints:
                places[side] += range(starts[pair[side]], starts[pair[side] + 1])
        return places


def joint_name(model: Model, joint: int) -> str:
    """Return the name of a joint; a free joint without one is that of its body."""
    name = model.joint_names[joint]
    if name or model.jnt_type[joint] != JointType.FREE:
        return name or f"number {joint}"
    body = int(model.jnt_bodyid[joint])
    return f"free joint of {model.body_names[body] or f'body {body}'}"


def _without_base(model: Model, only: Only) -> Only:
    """Return what a Model alone has without the free joint of the base of its robot."""
    joint = free_joint_of_base(model)
    if joint is None:
        return only
    base = joint_name(model, joint)
    others = tuple(name for name in only.get("joint", ()) if name != base)
    return {**only, "joint": others}


def _entries(bodies: Iterable[tuple[int, int]], size: int) -> Iterator[tuple[int, int]]:
    """Yield the places of so many numbers of each body, which stand one after the other."""
    for left_id, right_id in bodies:
        for k in range(size):
            yield size * left_id + k, size * right_id + k


def _ends(pairs: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Return the left ends of some pairs, and the right ones."""
    both = list(pairs)
    return [[left_id for left_id, _ in both], [right_id for _, right_id in both]]


def _activations(actuators: Pairs, left: Any, right: Any) -> list[tuple[int, int]]:
    """Return the pairs of places in act."""
    owner = ctrl_owners(left), ctrl_owners(right)
    pairs: set[tuple[int, int]] = set()
    for left_id, right_id in actuators:
        left_owner, right_owner = int(owner[0][left_id]), int(owner[1][right_id])
        number = int(left.actuator_actnum[left_owner])
        if number == right.actuator_actnum[right_owner]:
            start = int(left.actuator_actadr[left_owner]), int(right.actuator_actadr[right_owner])
            pairs |= {(start[0] + k, start[1] + k) for k in range(number)}
    return sorted(pairs)


def _with_counterparts(
    values: Array, right_start: Array, left_places: Sequence[int], right_places: Sequence[int]
) -> Array:
    """Return values (k,) or (n, k) of the left at their places in a start (m,) of the right."""
    shape = (*np.shape(values)[:-1], len(right_start))
    rows = np.array(np.broadcast_to(right_start, shape))
    rows[..., right_places] = values[..., left_places]
    return rows
