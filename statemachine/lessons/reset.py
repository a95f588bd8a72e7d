"""Reset and keyframes: back to a known state, and what that state is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..interface import INPUTS, Data, JointType, Model, forward, make_data, reset, step
from ..measures.text import count, millimetres
from ..page import Figures, Table
from ..runs.drive import Progress
from ..runs.header import provenance
from ..runs.robot import body_pairs, carried_by, moved_by_actuators
from ._readings import read_derived, read_stored
from .session import CodeRun, Options
from .template import Results, differences, emulated

_STEPS = 100  # before the reset, and after it
_WATCHED = 600  # steps under the keyframe's own ctrl


def code(model: Model, options: Options, load: str) -> str:
    """Change everything, reset, and reset to the first keyframe, if there is one."""
    to_keyframe = """\
sm.reset(model, data, keyframe=0)
print(model.keyframes[0].name, data.time, data.qpos[1:3].round(3))
"""
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
data.qvel += 0.1
data.ctrl += 0.1
sm.step(model, data, {_STEPS})
sm.reset(model, data)
print(data.time, data.qpos[1:3])
{to_keyframe if model.keyframes else ""}"""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Look at the Data after each line; go on with it from each keyframe, and after a reset.

    Returns:
        restored: Inputs and time that are, after a reset, bit for bit those of a fresh
            Data, although all of them had been changed.
        empty: Whether every derived array is zero then, until `forward`.
        same_future: Whether the next `steps` are bit for bit those of a fresh Data.
        steps, simulated: Before the reset; the latter in simulated time [s].
        scenes: The keyframes; see `_scene`.
    """
    model = play.model
    lines = {  # what is stored and derived after each
        source: (read_stored(play.names["data"]), read_derived(play.names["data"]))
        for source in play.lines()
        if "data" in play.names
    }
    start, blank = lines["data = sm.make_data(model)"]
    changed, _ = lines[f"sm.step(model, data, {_STEPS})"]
    again, derived = lines["sm.reset(model, data)"]
    _, data = play.worlds[0]
    scenes = []
    for key in range(len(model.keyframes)):
        reset(model, data, keyframe=key)
        scenes.append(_scene(model, data, key))
        progress((key + 1) / len(model.keyframes))
    reset(model, data)
    with make_data(model) as fresh:
        step(model, data, _STEPS)
        step(model, fresh, _STEPS)
        same = read_stored(data) == read_stored(fresh)
    return Figures(
        restored=tuple(  # an array without entries could not be changed
            name
            for name, bits in start.items()
            if again[name] == bits and (changed[name] != bits or not bits)
        ),
        empty=derived == blank and not any(map(any, blank.values())),
        same_future=same,
        steps=_STEPS,
        simulated=_STEPS * model.timestep,
        scenes=tuple(scenes),
        provenance=provenance(model),
    )


def _scene(model: Model, data: Data, key: int) -> Figures:
    """What a Data that was just reset to a keyframe shows, and what becomes of it.

    Returns:
        name, time: Of the keyframe [s].
        exact: Inputs and time that the reset took over bit for bit.
        body: The free body that it is about; None without one.
        contacts: How many contacts each pair of bodies has at the keyframe.
        on_robot, on_world: How many of the body's are with the robot, with the world.
        nstep: Steps taken then, under the keyframe's ctrl.
        robot_steps: In how many of them the robot touched the body; world_steps: the world did.
        held: Whether the robot alone holds the body, from the first step to the last.
        rise: How much the body's origin rose in them [m].
    """
    frame, now = model.keyframes[key], read_stored(data)
    wanted = {name: getattr(frame, name).tobytes() for name in INPUTS}
    wanted["time"] = np.array(frame.time).tobytes()
    free = np.flatnonzero(model.jnt_type == int(JointType.FREE))
    body = int(model.jnt_bodyid[free[0]]) if len(free) else None
    height = model.jnt_qposadr[free[:1]] + 2
    start = data.qpos[height].sum()  # 0 without a free body
    forward(model, data)
    contacts, (on_robot, on_world) = body_pairs(model, data.contacts), _touches(model, data, body)
    robot_steps = world_steps = 0
    for _ in range(_WATCHED):
        step(model, data)
        robot, world = _touches(model, data, body)
        robot_steps += robot > 0
        world_steps += world > 0
    return Figures(
        name=frame.name,
        time=frame.time,
        exact=tuple(name for name in wanted if now[name] == wanted[name]),
        body=None if body is None else model.body_names[body],
        contacts=dict(contacts),
        on_robot=on_robot,
        on_world=on_world,
        nstep=_WATCHED,
        robot_steps=robot_steps,
        world_steps=world_steps,
        held=on_world == world_steps == 0 < on_robot and robot_steps == _WATCHED,
        rise=float(data.qpos[height].sum() - start),
    )


def _touches(model: Model, data: Data, body: int | None) -> tuple[int, int]:
    """How many contacts a body has with the robot, and with what does not move."""
    robot, moving = moved_by_actuators(model), carried_by(model, set(model.jnt_bodyid.tolist()))
    pairs = [set(pair) for pair in model.geom_bodyid[data.contacts.geom].tolist()]
    others = [pair - {body} for pair in pairs if body in pair]
    return sum(bool(pair & robot) for pair in others), sum(not pair <= moving for pair in others)


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    frame = result.scenes[0] if result.scenes else None
    public = result.provenance.model_file.startswith("robotstudio_so101")
    return {
        "simulated": f"{result.simulated:g} s",
        "steps": count(result.steps, "step"),
        "asks": frame is not None and frame.time != 0,
        "right": 2 if frame and "time" in frame.exact else 0,
        "frame": frame and frame.name,
        "frame_time": f"{frame.time:g} s" if frame else "",
        "same": len(result.restored) == 4 and result.same_future,
        "emulated": emulated(result, "zeros when fresh"),
        "body": frame and frame.body,
        "held": ", ".join(scene.name for scene in result.scenes if scene.held),
        "public": public and frame is not None and frame.on_robot == 0,
    }


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """What each keyframe shows, and what becomes of it."""
    return {
        "keyframes": [
            _keyframe(k, {name: result.scenes[k] for name, result in results.items()})
            for k in range(len(first.scenes))
        ],
        "differences": differences(
            results,
            {
                f"rise of the {scene.body}, {scene.name}": lambda left, right, k=k: (
                    " instead of ".join(millimetres(r.scenes[k].rise, 3) for r in (right, left))
                )
                for k, scene in enumerate(first.scenes)
                if scene.body
            },
        ),
    }


def _keyframe(number: int, scenes: Mapping[str, Figures]) -> Table:
    columns, first = list(scenes.values()), next(iter(scenes.values()))
    pairs = dict.fromkeys(pair for scene in columns for pair in scene.contacts)
    rows = [
        (pair, *(count(scene.contacts.get(pair, 0), "contact") for scene in columns))
        for pair in pairs
    ]
    if first.body:
        after = f"of the next {first.nstep} steps, those in which"
        rows += [
            (f"{after} the robot touches the {first.body}", *(str(s.robot_steps) for s in columns)),
            (f"{after} a fixed body touches it", *(str(s.world_steps) for s in columns)),
            ("how far it rises in all of them", *(millimetres(s.rise) for s in columns)),
        ]
    return Table(
        ("what touches", *scenes),
        rows or [("nothing", *("" for _ in scenes))],
        title=f"Keyframe {number} ({first.name!r}, time {first.time:g} s), after forward",
    )
