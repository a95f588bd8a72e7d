"""demo_gravity: untouched ctrl is a command; the same fall with servos on, and off."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from ...interface import Model
from ...records import Array, Ints
from ...verbs import make_data, step
from ..calls import Function, Remark, call
from ..watch import Watch
from ..worlds import ELSEWHERE, Scenes, World
from ._values import LIFT, address, listed, near, numbers, owner, parts

SCENE = "so101/scene"
TOLERANCE = 0.006  # [degrees]: two decimals will do
_MOON = (0.0, 0.0, -1.62)
_SAME = 1e-6  # [degrees]: the same figure, come by another way
_NAMES = ("servos on", "servos off")
_NO_STEP = "no step was taken with the model that you got"


@dataclass(frozen=True)
class Fall:
    """What is right on one world.

    Attributes:
        on, off: (steps + 1, nq) qpos after each step, for a second longer than asked for.
        marks: (seconds + 1,) the steps at which whole seconds are over.
        course: (2, …) what is right on the course's own model, if this is another [degrees].
    """

    on: Array
    off: Array
    marks: Ints
    course: Array | None = None

    def degrees(self, limp: bool, place: int) -> Array:
        """(seconds + 1,) an entry of qpos at whole seconds, as degrees."""
        return np.degrees((self.off if limp else self.on)[self.marks, place])


def worlds(scenes: Scenes) -> list[World]:
    """The course's scene; the Moon's gravity at another timestep; a crate before the arm."""
    course = scenes.ordinary(SCENE)
    moon = course.replace(gravity=_MOON, timestep=0.004)
    fall = _fall(course, 4)
    usual = np.array([fall.degrees(limp, address(course)) for limp in (False, True)])
    return [
        World("", course, (4,), fall),
        World("with the Moon's gravity and 4 ms a step", moon, (3,), _fall(moon, 3, usual)),
        World(ELSEWHERE, crowded := scenes.crowded(SCENE), (2,), _fall(crowded, 2, usual)),
    ]


def _fall(model: Model, seconds: int, course: Array | None = None) -> Fall:
    each = round(1 / model.timestep)
    traces = []
    for variant in (model, model.replace(actuation=False)):
        with make_data(variant) as data:
            trace = [data.qpos.copy()]
            for _ in range((seconds + 1) * each):
                step(variant, data)
                trace.append(data.qpos.copy())
        traces.append(np.array(trace))
    return Fall(traces[0], traces[1], np.arange(seconds + 1) * each, course)


def judge(function: Function, world: World) -> list[Remark]:
    """Both traces in degrees; ctrl untouched; the Model as it was."""
    fall: Fall = world.expected
    before = _settings(world.model)
    try:
        result, watch = call(function, world)
    finally:
        after = _settings(world.model)
    remarks = _left(before, after)
    pair = parts(result, 2, "(on, off), two lists of degrees,")
    count = len(fall.marks)
    given = [
        numbers(each, (count,), f"{name}, one number at each of 0 … {count - 1} s")
        for name, each in zip(_NAMES, pair, strict=True)
    ]
    remarks += _command(watch)
    place = address(world.model)
    right = [fall.degrees(limp, place) for limp in (False, True)]
    if near(given[0], right[1], TOLERANCE) and near(given[1], right[0], TOLERANCE):
        return [*remarks, Remark("the two lists are swapped: (on, off) is the order")]
    for limp, name in enumerate(_NAMES):
        if not near(given[limp], right[limp], TOLERANCE):
            text = _why(given[limp], given[1 - limp], bool(limp), world, watch)
            remarks.append(Remark(f"{name}: {text}"))
    if not watch.runs:
        remarks.append(Remark(_NO_STEP))
    elif not remarks and sum(run.nstep >= fall.marks[-1] for run in watch.runs) < 2:
        steps = ", ".join(str(run.nstep) for run in watch.runs[:4])
        remarks.append(
            Remark(
                f"your runs took {steps} steps; {count - 1} s are {fall.marks[-1]} steps of "
                f"{world.model.timestep:g} s, with the servos on and again with them off"
            )
        )
    if remarks:
        return remarks
    return [
        Remark(
            f"after {count - 1} s {LIFT} is at {right[0][-1]:.3f}° with its servos on and at "
            f"{right[1][-1]:.2f}° with them off; ctrl untouched, the model given back as it was",
            True,
        )
    ]


def _why(given: Array, other: Array, limp: bool, world: World, watch: Watch) -> str:
    """What a wrong list is, as far as it can be told."""
    fall: Fall = world.expected
    model, place = world.model, address(world.model)
    right, wrong = fall.degrees(limp, place), fall.degrees(not limp, place)
    # The farthest, but not the start, where all is zero in any unit.
    k = int(np.argmax(np.nan_to_num(abs(given - right), nan=np.inf)))
    figures = f"you return {given[k]:.4g} at {k} s where {right[k]:.4g} is expected"
    if near(given, np.radians(right), TOLERANCE / 60):
        return f"{figures}: that is radians; np.degrees(…) makes degrees of them"
    if near(given, np.degrees(right), TOLERANCE * 60):
        return f"{figures}: degrees were made of it twice"
    for entry in range(model.nq):
        if given.any() and entry != place and near(given, fall.degrees(limp, entry), _SAME):
            return (
                f"{figures}: that is qpos[{entry}], of {owner(model, entry)!r}; {LIFT} is at "
                "model.jnt_qposadr[model.joint_id(…)]"
            )
    if abs(given[0] - right[0]) > TOLERANCE and abs(given[0] - other[-1]) <= TOLERANCE:
        return (
            f"{figures}: this run goes on where the other one ended, at {given[0]:.3f}°; "
            "a new Data begins at the default state"
        )
    if fall.course is not None and near(given, fall.course[int(limp), : len(given)], TOLERANCE):
        return f"{figures}: that belongs to the course's own scene, not to the model that you got"
    if near(given, wrong, TOLERANCE):
        how = "still on" if limp else "off already"
        return f"{figures}: the servos were {how} in this run"
    return figures + _when(given, limp, world, watch)


def _when(given: Array, limp: bool, world: World, watch: Watch) -> str:
    """Whether the list is right for other moments."""
    fall: Fall = world.expected
    seconds, timestep = len(given) - 1, world.model.timestep
    trace = np.degrees((fall.off if limp else fall.on)[:, address(world.model)])
    for nstep in dict.fromkeys(run.nstep for run in watch.runs):
        each = nstep // seconds
        marks = np.arange(seconds + 1) * each
        if each != fall.marks[1] and marks[-1] < len(trace) and near(given, trace[marks], _SAME):
            return (
                f": you took {each} steps for a second, and at {timestep * 1e3:g} ms a step a "
                f"second has {fall.marks[1]}: round(1 / model.timestep)"
            )
    for late in range(1 - int(fall.marks[1]), int(fall.marks[1]) + 1):
        marks = fall.marks + late
        if late and near(given[1:], trace[marks[1:]], _SAME):
            word = "later" if late > 0 else "earlier"
            return f": that is the arm {abs(late) * timestep:g} s {word} (the first is at 0 s)"
    return "" if watch.runs else f": {_NO_STEP}"


def _command(watch: Watch) -> list[Remark]:
    """Whether ctrl was written."""
    for run in watch.runs:
        if run.ctrl.any() or run.ctrl_changed is not None:
            command = listed(np.array(run.data.ctrl))
            return [Remark(f"ctrl was written ({command}): here it must stay as a new Data has it")]
    return []


def _settings(model: Model) -> dict[str, list[float]]:
    """What of the engine's own model a student can reach: its options, and its arrays' sums."""
    if model.backend != "mujoco":
        return {}
    options = model.raw.opt
    names = ("disableflags", "enableflags", "timestep", "gravity", "integrator")
    found = {f"opt.{name}": np.atleast_1d(getattr(options, name)).tolist() for name in names}
    for name in dir(model.raw):
        value = None if name.startswith("_") else getattr(model.raw, name)
        if isinstance(value, np.ndarray):
            found[name] = [float(zlib.crc32(value.tobytes()))]
    return found


def _left(before: dict[str, list[float]], after: dict[str, list[float]]) -> list[Remark]:
    """Whether the Model was given back as it was."""
    changed = [name for name in before if before[name] != after[name]]
    if "opt.disableflags" in changed:
        return [
            Remark(
                "the model was given back with its servos off (model.raw.opt.disableflags is "
                f"{after['opt.disableflags'][0]:.0f}, it was "
                f"{before['opt.disableflags'][0]:.0f}): switch "
                "the bit back, or use model.replace(actuation=False)"
            )
        ]
    return [
        Remark(f"the model was given back with another model.raw.{name}: a Model never changes")
        for name in changed
    ]
