"""demo_state: which slots of qpos and qvel each joint owns, and the time of a keyframe."""

from __future__ import annotations

import operator
from itertools import pairwise
from numbers import Real
from typing import Any

from ...interface import JointType, Model, make_data, reset
from ...measures.text import count
from ...page import Figures
from ..inside.answers import Answer, kind
from ..inside.calls import FaultError, first_of, reason
from ..inside.worlds import ExerciseWorld
from . import parts

Slot = tuple[int, int]  # from, and up to but not with


def right(world: ExerciseWorld) -> Figures:
    """The layout, slots of qpos and of qvel by joint, and the time at keyframe 0 [s]."""
    model = world.model
    # A joint's slots end where the next one's begin: without a table of what a joint has.
    owned = [
        list(pairwise([*starts.tolist(), total]))
        for starts, total in ((model.jnt_qposadr, model.nq), (model.jnt_dofadr, model.nv))
    ]
    slots = dict(zip(model.joint_names, zip(*owned, strict=True), strict=True))
    with make_data(model) as data:
        reset(model, data, keyframe=0)
        return Figures(slots=slots, time=data.time)


def judge(answer: Answer, world: ExerciseWorld, right: Figures, course: Figures) -> list[str] | str:
    """A pair of slices for every joint, and the time."""
    slots, time = parts(answer.result, 2, "(slots, time)")
    remarks = [*_names(slots, right), *_first_wrong(slots, right, world.model)]
    remarks += _clock(time, right.time, course.time, world.model, bool(answer.runs))
    if remarks:
        return remarks
    frees = [
        name
        for name, (positions, velocities) in right.slots.items()
        if positions[1] - positions[0] != velocities[1] - velocities[0]
    ]
    return f"all {len(right.slots)} joints, {', '.join(frees)} with 7 and 6 numbers"


def _names(slots: Any, layout: Figures) -> list[str]:
    if not isinstance(slots, dict):
        raise FaultError(
            "slots: a dict {joint: (slice of qpos, slice of qvel)} is asked for; "
            f"got {kind(slots)}"
        )
    missing = [name for name in layout.slots if name not in slots]
    unknown = [name for name in slots if name not in layout.slots]
    return first_of(
        (
            missing,
            f"slots: {len(missing)} of {len(layout.slots)} joints are missing: "
            f"{', '.join(missing)}; the keys are model.joint_names",
        ),
        (unknown, f"slots: no joint is called {[*unknown, ''][0]!r}; see model.joint_names"),
    )


def _first_wrong(slots: dict[str, Any], layout: Figures, model: Model) -> list[str]:
    """The first joint with a wrong slot, and why it may be."""
    for name, right in layout.slots.items():
        if name not in slots:
            continue
        pair = parts(slots[name], 2, f"{name}: (slice of qpos, slice of qvel)")
        totals = (model.nq, model.nv)
        given = [_slot(value, name, total) for value, total in zip(pair, totals, strict=True)]
        for which, array in enumerate(("qpos", "qvel")):
            if given[which] != right[which]:
                start, stop = given[which]
                text = (
                    f"{name}: you return {array}[{start}:{stop}] where "
                    f"{array}[{right[which][0]}:{right[which][1]}] is expected"
                )
                return [f"{text}: {_why(name, given, which, layout, model)}"]
    return []


def _slot(value: Any, name: str, total: int) -> Slot:
    """Where a slice of an array of so many numbers begins and ends."""
    if not isinstance(value, slice) or value.step not in (None, 1):
        raise FaultError(f"{name}: a pair of slices is asked for; got {kind(value)}")
    try:
        start = 0 if value.start is None else operator.index(value.start)
        stop = total if value.stop is None else operator.index(value.stop)
    except TypeError:
        raise FaultError(f"{name}: a slice wants two whole numbers; got {value}") from None
    return (start + total if start < 0 else start), (stop + total if stop < 0 else stop)


def _why(name: str, given: list[Slot], which: int, layout: Figures, model: Model) -> str:
    right = layout.slots[name]
    number = model.joint_id(name)
    free = int(model.jnt_type[number]) == int(JointType.FREE)
    (start, stop), (begins, ends) = given[which], right[which]
    table = ("model.jnt_qposadr", "model.jnt_dofadr")[which]
    size, here = stop - start, start == begins
    return reason(
        (
            here and free and size == 1,
            "a free joint owns more than one number: three and a quaternion, in qvel six",
        ),
        (
            here and free and which and size == 7,
            "a quaternion has four numbers, a turning speed three: six in qvel, not seven",
        ),
        (
            here and free and not which and size == 6,
            "a place has three numbers and a quaternion four: seven in qpos, not six",
        ),
        (here and stop == ends - 1, "a slice ends one after the last number"),
        (
            here,
            f"it begins at the right place and has {count(size, 'number')}, not {ends - begins}",
        ),
        (
            start == right[1 - which][0],
            f"that is where it begins in {('qvel', 'qpos')[which]}; see {table}",
        ),
        (
            start == number,
            f"it begins at the joint's number, {number}; a joint before it owns several numbers: "
            f"see {table}",
        ),
        (True, f"it begins elsewhere: see {table}, no arithmetic"),
    )


def _clock(time: Any, right: float, course: float, model: Model, stepped: bool) -> list[str]:
    if not isinstance(time, Real) or isinstance(time, bool):
        return [f"time: a number of seconds is asked for; got {kind(time)}"]
    if float(time) == right:
        return []
    others = [k for k, frame in enumerate(model.keyframes) if k and frame.time == time]
    why = reason(
        (time == 0, ": that is a new Data, or a reset without keyframe=0"),
        (others, f": that is keyframe {[*others, 0][0]}"),
        (
            time == course,
            ": that is the course's own scene; ask the model that you got",
        ),
        (stepped, ": read it right after the reset, before any step"),
    )
    text = f"time after the reset to keyframe 0 should be {right:g} s, you return {float(time):g}"
    return [text + why]
