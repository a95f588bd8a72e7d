"""The tree of a file as MotrixSim describes it (`motrixsim.msd.World`), walked in the file's order.

`mx` is the package: it is imported here, and comes from here.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...errors import EngineError
from ...installed import require
from ...interface import JointType

if TYPE_CHECKING:
    from motrixsim import msd

mx: Any = require("motrix")

TITLE = "MotrixSim"


class _Threads:
    """Whether MotrixSim has threads in this process: they do not come along into a fork."""

    started = False
    lost = False


def check_threads() -> None:
    """Note that MotrixSim starts its threads, if it has none yet: before it is let compute.

    Raises:
        EngineError: It had them before this process was forked: it would wait for them for ever.
    """
    if _Threads.lost:
        raise EngineError(
            f"{TITLE} has run before this process was forked, and its threads did not come along: "
            "start processes by spawn, or load its models only in the forks"
        )
    _Threads.started = True


def _after_fork() -> None:
    _Threads.lost = _Threads.started


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


@dataclass(frozen=True)
class LinkOfWorld:
    """A link of a world, where a walk through its tree finds it.

    Attributes:
        link: The link.
        free: Its free joint, where it is the root of a tree that floats; else None.
        mocap: Whether it is a body that is led.
    """

    link: msd.Link
    free: msd.FreeJoint | None
    mocap: bool


def links_of(world: msd.World) -> Iterator[LinkOfWorld]:
    """Yield all links of a world, parents before children, in the order of the file."""
    for body in world.hierarchy.bodies:
        waiting = [LinkOfWorld(body.link, body.free, body.mocap)]
        while waiting:
            found = waiting.pop()
            yield found
            children = [LinkOfWorld(child, None, False) for child in found.link.children]
            waiting += reversed(children)


def geoms_of(world: msd.World) -> list[msd.Geometry]:
    """Return all geoms of a world: its own, then those of the links, in their order."""
    geoms = list(world.hierarchy.geoms)
    for found in links_of(world):
        geoms += found.link.geoms
    return geoms


def free_joints_of(world: msd.World) -> Iterator[tuple[msd.FreeJoint, int]]:
    """Yield the free joints of a world, each with where its six degrees of freedom begin."""
    for free, _, start in _joints_of(world):
        if free is not None:
            yield free, start


def joints_of(world: msd.World) -> Iterator[tuple[msd.Joint, int]]:
    """Yield the other joints of a world, each with where its degrees of freedom begin in qvel."""
    for _, joint, start in _joints_of(world):
        if joint is not None:
            yield joint, start


def _joints_of(world: msd.World) -> Iterator[tuple[msd.FreeJoint | None, msd.Joint | None, int]]:
    start = 0
    for each in links_of(world):
        if each.free is not None:
            yield each.free, None, start
            start += JointType.FREE.nv
            continue
        for joint in each.link.joints:
            yield None, joint, start
            start += JointType.BALL.nv if joint.type_ == mx.msd.JointType.Ball else 1
