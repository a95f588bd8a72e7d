"""Reset, and what a keyframe holds: is that box on the floor, or in the jaws?"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from ..interface import INPUTS, Data, JointType, Model, forward, make_data, reset, step
from ..lessons._bytes import read_derived, read_stored
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.robot import body_pairs, carried_by, moved_by_actuators
from ..scenarios.runs import Progress, silent

_WATCHED = 600  # steps under the keyframe's own ctrl


@dataclass(frozen=True)
class KeyframeScene:
    """What a keyframe shows, and what becomes of it under its own ctrl.

    Attributes:
        name, time: Of the keyframe [s].
        exact: Inputs and time that the reset took over bit for bit.
        body: The free body that it is about; None without one.
        contacts: How many contacts each pair of bodies has at the keyframe.
        on_robot, on_world: How many of the body's are with the robot, with the world.
        nstep: Steps taken then, under the keyframe's ctrl.
        both: In how many of them the robot touched the body; world: the world did.
        rise: How much the body's origin rose in them [m].
    """

    name: str
    time: float
    exact: tuple[str, ...]
    body: str | None
    contacts: dict[str, int]
    on_robot: int
    on_world: int
    nstep: int
    robot_steps: int
    world_steps: int
    rise: float

    @property
    def held(self) -> bool:
        """Whether the robot alone holds the body, from the first step to the last."""
        return (
            self.on_robot > 0
            and self.on_world == 0
            and self.robot_steps == self.nstep
            and self.world_steps == 0
        )


@dataclass(frozen=True)
class Reset:
    """What a reset takes back.

    Attributes:
        restored: Inputs and time that are, after a reset, bit for bit those of a fresh
            Data, although all of them had been changed.
        empty: Whether every derived array is zero then, until `forward`.
        same_future: Whether the next `steps` are bit for bit those of a fresh Data.
        scenes: The keyframes.
    """

    restored: tuple[str, ...]
    empty: bool
    same_future: bool
    steps: int
    scenes: tuple[KeyframeScene, ...]
    provenance: Provenance


def run(model: Model, steps: int = 100, progress: Progress = silent) -> Reset:
    """Change everything, reset, compare; then look at each keyframe.

    Args:
        model: Any model; one with keyframes shows more.
        steps: How many before and after the reset.
        progress: Told the fraction that is done.
    """
    with make_data(model) as data, make_data(model) as fresh:
        start = read_stored(fresh)
        blank = read_derived(fresh)
        data.qvel += 0.1
        data.ctrl += 0.1
        step(model, data, steps)
        changed = read_stored(data)
        reset(model, data)
        again = read_stored(data)
        restored = tuple(  # an array without entries could not be changed
            name
            for name, bits in start.items()
            if again[name] == bits and (changed[name] != bits or not bits)
        )
        empty = read_derived(data) == blank and not any(map(any, blank.values()))
        step(model, data, steps)
        step(model, fresh, steps)
        same = read_stored(data) == read_stored(fresh)
    scenes = []
    for key in range(len(model.keyframes)):
        scenes.append(_scene(model, key))
        progress((key + 1) / len(model.keyframes))
    return Reset(
        restored=restored,
        empty=empty,
        same_future=same,
        steps=steps,
        scenes=tuple(scenes),
        provenance=provenance(model),
    )


def _scene(model: Model, key: int) -> KeyframeScene:
    frame = model.keyframes[key]
    free = np.flatnonzero(model.jnt_type == int(JointType.FREE))
    body = int(model.jnt_bodyid[free[0]]) if len(free) else None
    height = int(model.jnt_qposadr[free[0]]) + 2 if len(free) else None
    with make_data(model) as data:
        reset(model, data, keyframe=key)
        wanted = {name: getattr(frame, name).tobytes() for name in INPUTS}
        wanted["time"] = np.array(frame.time).tobytes()
        now = read_stored(data)
        began = 0.0 if height is None else float(data.qpos[height])
        forward(model, data)
        contacts = body_pairs(model, data.contacts)
        on_robot, on_world = _who(model, data, body)
        steps: Counter[str] = Counter()
        for _ in range(_WATCHED):
            step(model, data)
            robot, world = _who(model, data, body)
            steps["robot"] += robot > 0
            steps["world"] += world > 0
        ended = 0.0 if height is None else float(data.qpos[height])
    return KeyframeScene(
        name=frame.name,
        time=frame.time,
        exact=tuple(name for name in wanted if now[name] == wanted[name]),
        body=None if body is None else model.body_names[body],
        contacts=dict(contacts),
        on_robot=on_robot,
        on_world=on_world,
        nstep=_WATCHED,
        robot_steps=steps["robot"],
        world_steps=steps["world"],
        rise=ended - began,
    )


def _who(model: Model, data: Data, body: int | None) -> tuple[int, int]:
    """How many contacts a body has with the robot, and with what does not move."""
    if body is None:
        return 0, 0
    robot = moved_by_actuators(model)
    static = frozenset(range(model.nbody)) - carried_by(model, set(model.jnt_bodyid.tolist()))
    on_robot = on_world = 0
    for pair in data.contacts.geom.tolist():
        bodies = {int(model.geom_bodyid[geom]) for geom in pair}
        if body in bodies:
            on_robot += bool(bodies & robot)
            on_world += bool(bodies & static)
    return on_robot, on_world
