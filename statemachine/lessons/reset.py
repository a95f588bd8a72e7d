"""Reset and keyframes: back to a known state, and what that state is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..interface import INPUTS, Data, JointType, Model, forward, make_data, reset, step
from ..measures.text import count, millimetres
from ..page import Page, Question, Table, Text, Verdict
from ..runs.drive import Progress
from ..runs.provenance import Provenance, provenance
from ..runs.robot import body_pairs, carried_by, moved_by_actuators
from ._robot import read_derived, read_stored
from ._words import differences, emulation, page_of, sentence, typed, where
from .records import Session
from .session import CodeRun

_STEPS = 100  # before the reset, and after it
_WATCHED = 600  # steps under the keyframe's own ctrl


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """Change everything, reset, and reset to a keyframe."""
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
data.qvel += 0.1
data.ctrl += 0.1
sm.step(model, data, {_STEPS})
sm.reset(model, data)
print(data.time, data.qpos[:3])
for frame in model.keyframes[:1]:
    sm.reset(model, data, keyframe=0)
    print(frame.name, data.time, data.qpos[:3].round(3) + 0.0)
"""


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

    @property
    def simulated(self) -> float:
        """Time that was simulated before the reset [s]."""
        return self.steps * self.provenance.timestep


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Reset:
    """Look at the Data after each line; go on with it from each keyframe, and after a reset."""
    model = play.model
    lines: dict[str, tuple[dict[str, bytes], dict[str, bytes]]] = {}  # stored, derived; after each

    def look(source: str, names: Mapping[str, Any]) -> None:
        if "data" in names:
            lines[source] = read_stored(names["data"]), read_derived(names["data"])

    play(line=look)
    start, blank = lines["data = sm.make_data(model)"]
    changed, _ = lines[f"sm.step(model, data, {_STEPS})"]
    again, derived = lines["sm.reset(model, data)"]
    _, data = play.worlds[0]
    scenes = []
    for key in range(len(model.keyframes)):
        if key > 0:  # the code went to the first
            reset(model, data, keyframe=key)
        scenes.append(_scene(model, data, key))
        progress((key + 1) / len(model.keyframes))
    if scenes:
        reset(model, data)
    with make_data(model) as fresh:
        step(model, data, _STEPS)
        step(model, fresh, _STEPS)
        same = read_stored(data) == read_stored(fresh)
    return Reset(
        restored=tuple(  # an array without entries could not be changed
            name
            for name, bits in start.items()
            if again[name] == bits and (changed[name] != bits or not bits)
        ),
        empty=derived == blank and not any(map(any, blank.values())),
        same_future=same,
        steps=_STEPS,
        scenes=tuple(scenes),
        provenance=provenance(model),
    )


def _scene(model: Model, data: Data, key: int) -> KeyframeScene:
    """What a Data that was just reset to a keyframe shows, and what becomes of it."""
    frame = model.keyframes[key]
    free = np.flatnonzero(model.jnt_type == int(JointType.FREE))
    body = int(model.jnt_bodyid[free[0]]) if len(free) else None
    height = int(model.jnt_qposadr[free[0]]) + 2 if len(free) else None
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


def page(results: Mapping[str, Reset], session: Session) -> Page:
    """What a reset takes back, and what the keyframes show."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text(
            f"Velocity and command are changed, and {first.simulated:g} s is simulated. Then the "
            "Data is reset: first to the default state, then to one that the model file names."
        ),
        *typed(session, _question(first)),
        Text(
            "reset puts a Data back to the model's default state: positions, velocities, "
            "command and time. With keyframe=… it goes to a state that the model file names. "
            "reset computes nothing that is derived: call forward for that."
        ),
    ]
    for name, result in results.items():
        prefix, steps = where(results, name), count(result.steps, "step")
        blocks += [
            Verdict(
                f"{prefix}after {steps} and a reset, qpos, qvel, ctrl and time have the same bits "
                f"as in a new Data. The next {steps} end in the same bits, too",
                len(result.restored) == 4 and result.same_future,
            ),
            Verdict(f"{prefix}every derived array is zero after a reset", result.empty),
        ]
    blocks += emulation(results, "zeros when fresh")
    if not first.scenes:
        blocks.append(Text("This model's file names no keyframe: try --model so101/scene_box."))
    for number, scene in enumerate(first.scenes):
        scenes = {name: result.scenes[number] for name, result in results.items()}
        blocks.append(_contacts(number, scene, scenes))
        blocks += [_finding(results, name, number, first.provenance.model_file) for name in results]
    blocks += differences(
        results,
        [
            (f"rise of the {scene.body}, {scene.name}", partial(_rise, k))
            for k, scene in enumerate(first.scenes)
            if scene.body
        ],
    )
    return page_of("Back to a known state", results, blocks)


def _question(first: Reset) -> Question | None:
    if not first.scenes:
        return None
    frame = first.scenes[0]
    if frame.time == 0:
        return None
    return Question(
        f"what is data.time after the reset to keyframe 0 ({frame.name!r})?",
        (
            "0 s: a reset begins anew",
            f"{first.simulated:g} s: as before",
            f"{frame.time:g} s: what the file says",
        ),
        2 if "time" in frame.exact else 0,
        "Time is a number of the state, and a keyframe has one of its own.",
    )


def _contacts(number: int, first: KeyframeScene, scenes: Mapping[str, KeyframeScene]) -> Table:
    pairs = dict.fromkeys(pair for scene in scenes.values() for pair in scene.contacts)
    rows = [
        (pair, *(count(scene.contacts.get(pair, 0), "contact") for scene in scenes.values()))
        for pair in pairs
    ]
    return Table(
        ("what touches", *scenes),
        rows or [("nothing", *("" for _ in scenes))],
        title=f"Keyframe {number} ({first.name!r}, time {first.time:g} s), after forward",
    )


def _finding(results: Mapping[str, Reset], name: str, number: int, file: str) -> Text | Verdict:
    """What a keyframe is, by what touches what, then and in the steps that follow."""
    scene = results[name].scenes[number]
    if scene.body is None:
        return sentence(results, name, "there is no free body in this scene.")
    moved = f"it {'rises' if scene.rise > 0 else 'sinks'} by {millimetres(abs(scene.rise))}"
    steps = f"in {scene.robot_steps} of the next {scene.nstep} steps"
    if scene.held:
        return Verdict(
            f"{where(results, name)}the {scene.body} is held: it touches the robot and nothing "
            f"else, right after the reset and {steps}. Meanwhile {moved}",
            True,
        )
    if scene.on_robot == 0 and scene.on_world:
        text = (
            f"the {scene.body} is not held: it has {count(scene.on_world, 'contact')} with what "
            f"does not move, and none with the robot. The robot touches it {steps}. Meanwhile "
            f"{moved}"
        )
        if number == 0 and file.startswith("robotstudio_so101"):
            text += ". A lesson that calls this a grasp with the box lifted is mistaken"
        return sentence(results, name, f"{text}.")
    return sentence(
        results,
        name,
        f"the {scene.body} has {count(scene.on_robot, 'contact')} with the robot and "
        f"{scene.on_world} with what does not move; the robot touches it {steps}, and {moved}.",
    )


def _rise(number: int, one: Reset, two: Reset) -> str:
    rises = [millimetres(each.scenes[number].rise, 3) for each in (two, one)]
    return " instead of ".join(rises)
