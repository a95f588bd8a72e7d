"""A robot as Pinocchio has it, with the names and the order of the file that it comes from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

OWN_READING, SAME_READING = "own reading", "same reading"
SIZES = {"free": (7, 6), "ball": (4, 3), "hinge": (1, 1), "slide": (1, 1), "unbounded": (1, 1)}


class Segment(NamedTuple):
    """One joint.

    Attributes:
        kind: "free", "ball", "hinge", "slide", or "unbounded": a hinge that Pinocchio
            keeps as cosine and sine.
        idx_q, idx_v: Where it starts in Pinocchio's vectors.
        ref: What qpos says where the file draws the joint [rad or m].
    """

    kind: str
    idx_q: int
    idx_v: int
    ref: float = 0.0

    @property
    def nq(self) -> int:
        """Its length in qpos, in MuJoCo's layout."""
        return SIZES[self.kind][0]

    @property
    def nv(self) -> int:
        """Its length in qvel."""
        return SIZES[self.kind][1]


@dataclass(frozen=True)
class WitnessModel:
    """A robot as Pinocchio has it.

    Attributes:
        model: Pinocchio's.
        joints: Of each joint its name, "" if it has none, and where it is; in MuJoCo's
            order, or of a URDF in Pinocchio's.
        bodies, sites: Ids of Pinocchio's frames, by name; those without a name are called
            "body 7" and "site 3", by their places in MuJoCo's order. 0 is the world.
        grade: `OWN_READING` or `SAME_READING`.
        prepared: What was done to the file's text before Pinocchio read it.
    """

    model: Any
    joints: tuple[tuple[str, Segment], ...]
    bodies: dict[str, int]
    sites: dict[str, int]
    grade: str
    prepared: tuple[str, ...] = ()


def labels(kind: str, names: Iterable[str]) -> list[str]:
    """What bodies or sites are called: their names, or "body 7" and "site 3" without one."""
    given = list(names)
    found = []
    for number, name in enumerate(given):
        own = name or f"{kind} {number}"
        while not name and own in given:  # somebody else's name
            own = f"unnamed {own}"
        found.append(own)
    return found
