"""Six numbers in: a command, the way there, and what is in the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import BadInputError, DivergedError, UnsupportedError
from ..interface import Array, Data, Ints, JointType, Model, forward, make_data, reset, step
from ..measures.text import NONE
from ..page import Page, Table, Text
from ..runs.commands import hold_ctrl, is_servo, start_keyframe
from ..runs.drive import Progress, steps_in
from ..runs.provenance import provenance
from ..runs.robot import ARM, command, moved_by_actuators, touching
from ._hold import Hold, apart_freely, apart_until, at, at_end, gap, question, row, traces
from ._robot import Coordinate, coordinate, start_line
from ._words import differences, page_of, spans, typed, where
from .records import Session
from .session import CodeRun

_TIMES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)
_PRINTED = (0.1, 0.2, 0.3, 0.4)  # s; and at the end
_SHOWN = 12  # numbers of qpos that fit in a line
_NUMBERS = {1: "One number", 6: "Six numbers"}


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """One command, and where the robot is then."""
    target = _target(model, options).tolist()
    loop, nstep = spans(model, _PRINTED, options["seconds"])
    shown = "data.qpos" if model.nq <= _SHOWN else f"data.qpos[:{_SHOWN}]"
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
{start_line(model, "model")}data.ctrl[:] = {target}
{loop}
    sm.step(model, data, {nstep})
    print(round(data.time, 3), {shown}.round(3))
"""


def _target(model: Model, options: Mapping[str, Any]) -> Array:
    """The command (nu,), each number in the unit of its actuator."""
    usual = hold_ctrl(model)  # or says that there are no actuators
    return usual if options["target"] is None else command(model, options["target"], "target")


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Hold:
    """Watch the way to the command; then the same with nothing to touch."""
    model = play.model
    driven = _driven(model)
    names = list(driven)
    addresses = np.array([(at.place, at.dof) for at, _ in driven.values()], dtype=np.int64)
    total = steps_in(model, options["seconds"])
    robot = moved_by_actuators(model)
    times: list[float] = []
    poses: list[Array] = []
    touches: list[tuple[float, tuple[str, ...]]] = []  # when, and what touches what

    def note(_model: Model, data: Data) -> None:
        times.append(data.time)
        poses.append(data.qpos[addresses[:, 0]])

    def look(_model: Model, data: Data) -> None:
        # The contacts of a step are those of the state that it started from.
        if found := touching(model, data.contacts, robot):
            touches.append((times[-1], found))
        if len(times) % 100 == 0:
            progress(len(times) / total)

    play(before=note, after=look)
    _, data = play.worlds[0]
    note(model, data)
    forward(model, data)
    at_end = touching(model, data.contacts, robot)
    last = [(data.time, at_end)] if at_end else []
    first, touched = [*touches, *last, (None, ())][0]
    ctrl = data.ctrl.copy()
    servos = [servo for _, servo in driven.values()]
    return Hold(
        target=_goals(model, ctrl, servos),
        goal=_goals(model, np.clip(ctrl, *model.actuator_ctrlrange.T), servos),
        time=np.array(times),
        qpos=np.array(poses),
        first_contact=first,
        touched=touched,
        contact_steps=len(touches),
        touching=at_end,
        speed=data.qvel[addresses[:, 1]].copy(),
        without_contacts=None if first is None else _freely(model, ctrl, total, addresses),
        joints=tuple(names),
        slides=tuple(at.slide for at, _ in driven.values()),
        servo=bool(is_servo(model).all()),
        actuators=model.nu,
        keyframe=start_keyframe(model),
        provenance=provenance(model),
    )


def _driven(model: Model) -> dict[str, tuple[Coordinate, int | None]]:
    """The joints to look at by name, each with the number of the servo on it."""
    servos = is_servo(model)
    found: dict[str, tuple[Coordinate, int | None]] = {}
    for i, joint in enumerate(model.actuator_jntid.tolist()):
        name = model.joint_names[joint] if joint >= 0 else ""
        if name and (servos[i] or name not in found):
            found[name] = coordinate(model, name), i if servos[i] else None
    if not found:  # they act through tendons, at sites or on bodies
        kinds = zip(model.joint_names, model.jnt_type.tolist(), strict=True)
        names = [name for name, kind in kinds if name and kind != int(JointType.BALL)]
        found = {name: (coordinate(model, name), None) for name in names}
    if not found:
        raise BadInputError(f"{model.path.name} names no joint that could be looked at")
    return found


def _goals(model: Model, ctrl: Array, servos: list[int | None]) -> Array:
    """What ctrl says to each joint; NaN where it is no target."""
    return np.array([np.nan if i is None else ctrl[i] / model.actuator_gear[i] for i in servos])


def _freely(model: Model, ctrl: Array, steps: int, addresses: Ints) -> Array | None:
    """Where the actuated joints end if nothing can touch anything."""
    try:
        alone = model.replace(contacts=False)
    except UnsupportedError:
        return None
    with make_data(alone) as data:
        reset(alone, data, start_keyframe(model))
        data.ctrl = ctrl
        try:
            step(alone, data, steps)
        except DivergedError:
            return None
        return data.qpos[addresses[:, 0]].copy()


def page(results: Mapping[str, Hold], session: Session) -> Page:
    """Error over time, pose at the end, what is in the way."""
    first = next(iter(results.values()))
    end = float(first.time[-1])
    times = [t for t in _TIMES if t < end - 1e-6] + [end]
    text = (
        "ctrl is how you command this robot: one number for each actuator, in the order of "
        "model.actuator_names."
    )
    moves = "arm follows" if first.joints == ARM else "joint follows"
    law = "with kp·(ctrl − q) − kv·q̇, within its force limit, and the"
    if first.servo:
        text += (
            f" Each is a position servo: it pushes {law} {moves}. A script, a joystick and a "
            "trained policy all speak to the robot through this array."
        )
    elif first.told():
        text += (
            f" {len(first.told())} of {first.actuators} are position servos: each pushes {law} "
            f"{moves}. To the others a number is no place: a motor takes it as a force, and has "
            "no goal."
        )
    else:
        text += (
            " None of them is a position servo: a number here is no place to go to. A motor takes "
            "it as a force, and has no goal; what keeps a joint where it is would be your "
            "controller."
        )
    if first.keyframe is not None:
        text += f" The run starts at the keyframe {first.keyframe!r}."
    blocks: list[Any] = [
        Text(text),
        *typed(session, question(first)),
    ]
    for k in (k for k in first.told() if first.goal[k] != first.target[k]):
        blocks.append(
            Text(
                f"{first.joints[k]} was asked for {at(first, first.target[k], k)}, beyond its "
                f"range: the servo takes {at(first, first.goal[k], k)} for it."
            )
        )
    told = first.told()
    if told:
        blocks.append(
            Table(
                ("time", *results),
                [row(results, time) for time in times],
                title="The worst joint on the way: how far from its goal",
            )
        )
    begins = len(told) < len(first.joints)  # of what has no goal the start is of interest
    blocks.append(
        Table(
            ("joint", *["start"] * begins, *["goal"] * bool(told), *results),
            [
                (
                    joint,
                    *[at(first, first.qpos[0, k], k)] * begins,
                    *[at(first, first.goal[k], k) if k in told else NONE] * bool(told),
                    *(at(result, result.qpos[-1, k], k) for result in results.values()),
                )
                for k, joint in enumerate(first.joints)
            ],
            title=f"Where it is at {end:g} s",
        )
    )
    for name, result in results.items():
        blocks.append(Text(f"{where(results, name)}{at_end(result)}"))
    blocks += traces(results)
    blocks += differences(
        results,
        [
            ("any joint, until one touches", lambda a, b: apart_until(a, b, False)),
            ("any joint, after that", lambda a, b: apart_until(a, b, True)),
            ("any joint, at the end", lambda a, b: gap(a, np.abs(a.qpos[-1] - b.qpos[-1]))),
            ("at the end, contacts left out", apart_freely),
        ],
    )
    numbers = _NUMBERS.get(first.actuators, f"{first.actuators} numbers")
    return page_of(f"{numbers} in", results, blocks)
