"""Reset and keyframes: back to a known state, and what that state is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...interface import INPUTS, Data, JointType, Model, forward, make_data, reset, step
from ...lab.runs.drive import Progress
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.readings import read_derived, read_stored
from ...lab.runs.robot import actuated_bodies, carried_by, contact_counts
from .session import CodeRun, Options

_STEPS = 100  # before the reset, and after it
_WATCHED = 600  # steps under the keyframe's own ctrl

# Lines of the code after which the Data is looked at.
_MADE = "data = sm.make_data(model)"
_STEPPED = f"sm.step(model, data, {_STEPS})"
_RESET = "sm.reset(model, data)"


def code(model: Model, options: Options, load: str) -> str:
    """Write code that changes everything, resets, and resets to the first keyframe, if any."""
    to_keyframe = """\
sm.reset(model, data, keyframe=0)
print(model.keyframes[0].name, data.time, data.qpos[1:3].round(3))
"""
    return f"""\
import statemachine as sm

model = {load}
{_MADE}
data.qvel += 0.1
data.ctrl += 0.1
{_STEPPED}
{_RESET}
print(data.time, data.qpos[1:3])
{to_keyframe if model.keyframes else ""}"""


@dataclass(frozen=True)
class KeyframeScene:
    """Scene of a keyframe right after a reset to it, and what becomes of it.

    Attributes:
        name: Of the keyframe.
        time: Of the keyframe [s].
        exact: Inputs and time that the reset took over bit for bit.
        body: The free body that it is about; None without one.
        contacts: Number of contacts of each pair of bodies at the keyframe.
        on_robot: Number of contacts of the body with the robot at the keyframe.
        on_world: Number of contacts of the body with what does not move at the keyframe.
        nstep: Steps taken then, under the keyframe's ctrl.
        robot_steps: In how many of them the robot touched the body.
        world_steps: In how many of them what does not move touched it.
        rise: How much the body's origin rose in these steps [m].
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
        """Tell whether the robot alone holds the body, from the first step to the last."""
        touches_world = self.on_world > 0 or self.world_steps > 0
        return not touches_world and self.on_robot > 0 and self.robot_steps == self.nstep


@dataclass(frozen=True)
class ResetResult:
    """What a reset restores, and what each keyframe is.

    Attributes:
        restored: Inputs and time that are, after a reset, bit for bit those of a fresh
            Data, although all of them had been changed.
        empty: Whether every derived array is zero then, until `forward`.
        same_future: Whether the next `steps` are bit for bit those of a fresh Data.
        steps: Steps before the reset, and after it.
        simulated: Simulated time of these steps [s].
        further: Whether what goes further was asked for.
        scenes: The scene of each keyframe; where what goes further was not asked for, of the first.
        provenance: What it was computed with.
    """

    restored: tuple[str, ...]
    empty: bool
    same_future: bool
    steps: int
    simulated: float
    further: bool
    scenes: tuple[KeyframeScene, ...]
    provenance: Provenance


def run(play: CodeRun, options: Options, progress: Progress) -> ResetResult:
    """Look at the Data after each line; go on with it from each keyframe, and after a reset."""
    model = play.model
    stored: dict[str, dict[str, bytes]] = {}  # by the line after which it is stored
    derived: dict[str, dict[str, bytes]] = {}
    for source in play.lines():
        if "data" in play.names:
            stored[source] = read_stored(play.names["data"])
            derived[source] = read_derived(play.names["data"])
    _, data = play.worlds[0]
    scenes = []
    shown = len(model.keyframes) if options["further"] else min(1, len(model.keyframes))
    for key in range(shown):
        reset(model, data, keyframe=key)
        scenes.append(_scene(model, data, key))
        progress((key + 1) / shown)
    restored = _restored(stored[_MADE], stored[_STEPPED], stored[_RESET])
    is_empty = derived[_RESET] == derived[_MADE] and _is_zero(derived[_MADE])
    return ResetResult(
        restored=restored,
        empty=is_empty,
        same_future=_has_future_of_fresh(model, data),
        steps=_STEPS,
        simulated=_STEPS * model.timestep,
        further=options["further"],
        scenes=tuple(scenes),
        provenance=provenance(model),
    )


def _restored(
    start: Mapping[str, bytes], changed: Mapping[str, bytes], again: Mapping[str, bytes]
) -> tuple[str, ...]:
    """Return the names of what was changed and is as at the start again."""
    restored = []
    for name, content in start.items():
        was_changed = changed[name] != content
        is_empty = not content  # an array without entries could not be changed
        if again[name] == content and (was_changed or is_empty):
            restored.append(name)
    return tuple(restored)


def _is_zero(arrays: Mapping[str, bytes]) -> bool:
    """Tell whether all bytes of some arrays are zero."""
    return not any(any(content) for content in arrays.values())


def _has_future_of_fresh(model: Model, data: Data) -> bool:
    """Reset a Data, and tell whether its next steps are bit for bit those of a fresh one."""
    reset(model, data)
    with make_data(model) as fresh:
        step(model, data, _STEPS)
        step(model, fresh, _STEPS)
        return read_stored(data) == read_stored(fresh)


def _scene(model: Model, data: Data, key: int) -> KeyframeScene:
    """Return what a Data that was just reset to a keyframe shows, and what becomes of it."""
    frame = model.keyframes[key]
    exact = _exact(model, data, key)
    body = _free_body(model)
    start = _height(model, data)
    forward(model, data)
    contacts = contact_counts(model, data.contacts)
    on_robot, on_world = _touches(model, data, body)
    robot_steps = world_steps = 0
    for _ in range(_WATCHED):
        step(model, data)
        robot, world = _touches(model, data, body)
        robot_steps += robot > 0
        world_steps += world > 0
    body_name = None if body is None else model.body_names[body]
    return KeyframeScene(
        name=frame.name,
        time=frame.time,
        exact=exact,
        body=body_name,
        contacts=dict(contacts),
        on_robot=on_robot,
        on_world=on_world,
        nstep=_WATCHED,
        robot_steps=robot_steps,
        world_steps=world_steps,
        rise=_height(model, data) - start,
    )


def _exact(model: Model, data: Data, key: int) -> tuple[str, ...]:
    """Return the names of the inputs, and of time, that are bit for bit those of a keyframe."""
    frame, now = model.keyframes[key], read_stored(data)
    wanted = {name: getattr(frame, name).tobytes() for name in INPUTS}
    wanted["time"] = np.array(frame.time).tobytes()
    return tuple(name for name in wanted if now[name] == wanted[name])


def _free_joint(model: Model) -> int | None:
    """Return the first free joint; None without one."""
    free = np.flatnonzero(model.jnt_type == int(JointType.FREE))
    return int(free[0]) if len(free) else None


def _free_body(model: Model) -> int | None:
    """Return the body of the first free joint; None without one."""
    joint = _free_joint(model)
    return None if joint is None else int(model.jnt_bodyid[joint])


def _height(model: Model, data: Data) -> float:
    """Return the height of the first free joint's body [m]; 0 without one."""
    joint = _free_joint(model)
    return 0.0 if joint is None else float(data.qpos[model.jnt_qposadr[joint] + 2])


def _touches(model: Model, data: Data, body: int | None) -> tuple[int, int]:
    """Return how many contacts a body has with the robot, and how many with what does not move."""
    robot, moving = actuated_bodies(model), carried_by(model, set(model.jnt_bodyid.tolist()))
    pairs = [set(pair) for pair in model.geom_bodyid[data.contacts.geom].tolist()]
    others = [pair - {body} for pair in pairs if body in pair]
    return sum(bool(pair & robot) for pair in others), sum(not pair <= moving for pair in others)
