"""demo_state: which slots of qpos and qvel each joint owns, and the time of a keyframe."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from itertools import pairwise
from numbers import Real
from typing import Any, NamedTuple

from ....interface import JointType, Model, make_data, reset
from ....interface.records import Ints
from ....measures.text import count
from ..inside.answers import Answer, kind
from ..inside.calls import FaultError
from ..inside.worlds import NoArgumentsWorld
from . import WorldJudgement, parts, verified, wrong

_ARRAYS = ("qpos", "qvel")


class Slot(NamedTuple):
    """Slots of an array that a joint owns.

    Attributes:
        start: The first.
        stop: One after the last.
    """

    start: int
    stop: int

    @property
    def size(self) -> int:
        """How many there are."""
        return self.stop - self.start


Slots = tuple[Slot, Slot]  # of qpos, of qvel


@dataclass(frozen=True)
class Layout:
    """Layout of a model's state, and the time of a keyframe.

    Attributes:
        slots: Those of each joint, by its name.
        time: At keyframe 0 [s].
    """

    slots: dict[str, Slots]
    time: float


def right(world: NoArgumentsWorld) -> Layout:
    """Return the layout that is right on a world."""
    model = world.model
    positions = _owned(model.jnt_qposadr, model.nq)
    velocities = _owned(model.jnt_dofadr, model.nv)
    slots = dict(zip(model.joint_names, zip(positions, velocities, strict=True), strict=True))
    with make_data(model) as data:
        reset(model, data, keyframe=0)
        return Layout(slots, data.time)


def _owned(starts: Ints, total: int) -> list[Slot]:
    """Return the slots of each joint by where they start: they end where the next one's begin.

    Without a table of what a joint has.
    """
    return [Slot(start, stop) for start, stop in pairwise([*starts.tolist(), total])]


def judge(answer: Answer, world: NoArgumentsWorld, right: Layout, course: Layout) -> WorldJudgement:
    """Judge the pair of slices of every joint, and the time."""
    slots, time = parts(answer.result, 2, "(slots, time)")
    faults = (
        _fault_of_names(slots, right),
        _first_wrong(slots, right, world.model),
        _fault_of_time(time, right.time, course.time, world.model, answer),
    )
    remarks = [fault for fault in faults if fault]
    if remarks:
        return wrong(*remarks)
    free = [name for name, (qpos, qvel) in right.slots.items() if qpos.size != qvel.size]
    return verified(f"all {len(right.slots)} joints, {', '.join(free)} with 7 and 6 numbers")


def _fault_of_names(slots: Any, layout: Layout) -> str:
    """Return which joints are missing or unknown; "" where there are none.

    Raises:
        FaultError: It is no dict.
    """
    if not isinstance(slots, dict):
        raise FaultError(
            "slots: a dict {joint: (slice of qpos, slice of qvel)} is asked for; "
            f"got {kind(slots)}"
        )
    missing = [name for name in layout.slots if name not in slots]
    if missing:
        return (
            f"slots: {len(missing)} of {len(layout.slots)} joints are missing: "
            f"{', '.join(missing)}; the keys are model.joint_names"
        )
    for name in slots:
        if name not in layout.slots:
            return f"slots: no joint is called {name!r}; see model.joint_names"
    return ""


def _first_wrong(slots: dict[str, Any], layout: Layout, model: Model) -> str:
    """Return the first joint with a wrong slot, and why it may be; "" where there is none."""
    for name, expected in layout.slots.items():
        if name not in slots:
            continue
        pair = parts(slots[name], 2, f"{name}: (slice of qpos, slice of qvel)")
        returned = (_slot(pair[0], name, model.nq), _slot(pair[1], name, model.nv))
        for which, array in enumerate(_ARRAYS):
            if returned[which] != expected[which]:
                start, stop = returned[which]
                return (
                    f"{name}: you return {array}[{start}:{stop}] where "
                    f"{array}[{expected[which].start}:{expected[which].stop}] is expected: "
                    f"{_why(name, returned[which], which, expected, model)}"
                )
    return ""


def _slot(value: Any, name: str, total: int) -> Slot:
    """Return where a slice of an array of so many numbers begins and ends."""
    if not isinstance(value, slice) or value.step not in (None, 1):
        raise FaultError(f"{name}: a pair of slices is asked for; got {kind(value)}")
    try:
        start = 0 if value.start is None else operator.index(value.start)
        stop = total if value.stop is None else operator.index(value.stop)
    except TypeError:
        raise FaultError(f"{name}: a slice wants two whole numbers; got {value}") from None
    return Slot(start + total if start < 0 else start, stop + total if stop < 0 else stop)


def _why(name: str, returned: Slot, which: int, expected: Slots, model: Model) -> str:
    """Return why a slot may be wrong.

    Args:
        name: Of the joint.
        returned: The wrong slot.
        which: Of qpos (0), or of qvel (1).
        expected: The right ones.
        model: What the function got.
    """
    number = model.joint_id(name)
    table = ("model.jnt_qposadr", "model.jnt_dofadr")[which]
    if returned.start == expected[which].start:
        return _why_of_size(returned, which, expected[which], int(model.jnt_type[number]))
    if returned.start == expected[1 - which].start:
        return f"that is where it begins in {_ARRAYS[1 - which]}; see {table}"
    if returned.start == number:
        return (
            f"it begins at the joint's number, {number}; a joint before it owns several numbers: "
            f"see {table}"
        )
    return f"it begins elsewhere: see {table}, no arithmetic"


def _why_of_size(returned: Slot, which: int, expected: Slot, jnt_type: int) -> str:
    """Return why a slot that begins at the right place may end at a wrong one."""
    if jnt_type == int(JointType.FREE):
        if returned.size == 1:
            return "a free joint owns more than one number: three and a quaternion, in qvel six"
        if which == 1 and returned.size == 7:
            return "a quaternion has four numbers, a turning speed three: six in qvel, not seven"
        if which == 0 and returned.size == 6:
            return "a place has three numbers and a quaternion four: seven in qpos, not six"
    if returned.stop == expected.stop - 1:
        return "a slice ends one after the last number"
    size = count(returned.size, "number")
    return f"it begins at the right place and has {size}, not {expected.size}"


def _fault_of_time(time: Any, right: float, course: float, model: Model, answer: Answer) -> str:
    """Return what is wrong with the time at keyframe 0; "" for nothing.

    Args:
        time: That was returned.
        right: What is right [s].
        course: What is right on the course's own world [s].
        model: What the function got.
        answer: The time is of it.
    """
    if not isinstance(time, Real) or isinstance(time, bool):
        return f"time: a number of seconds is asked for; got {kind(time)}"
    if float(time) == right:
        return ""
    text = f"time after the reset to keyframe 0 should be {right:g} s, you return {float(time):g}"
    if time == 0:
        return f"{text}: that is a new Data, or a reset without keyframe=0"
    for k, keyframe in enumerate(model.keyframes):
        if k and keyframe.time == time:
            return f"{text}: that is keyframe {k}"
    if time == course:
        return f"{text}: that is the course's own scene; ask the model that you got"
    if answer.runs:
        return f"{text}: read it right after the reset, before any step"
    return text
