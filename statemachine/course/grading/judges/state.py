"""demo_state: which slots of qpos and qvel each joint owns, and the time of a keyframe."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from itertools import pairwise
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from ....interface import Array, JointType, Model, make_data, reset
from ....interface.records import Ints
from ....measures.text import count
from ..inside.answers import Answer, kind
from ..inside.calls import FaultError
from ..inside.worlds import NoArgumentsWorld
from . import WorldJudgement, parts, verified, wrong
from .remarks import OfState

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
        """Return the number of its entries."""
        return self.stop - self.start


Slots = tuple[Slot, Slot]  # of qpos, of qvel


@dataclass(frozen=True)
class Layout:
    """Layout of a model's state, and the time of a keyframe.

    Attributes:
        slots: Those of each joint, by its name.
        time: At keyframe 0 [s].
        qpos: (nq,) at keyframe 0 [rad or m].
    """

    slots: dict[str, Slots]
    time: float
    qpos: Array


def right(world: NoArgumentsWorld) -> Layout:
    """Return the layout that is right on a world."""
    model = world.model
    positions = _slots_of_joints(model.jnt_qposadr, model.nq)
    velocities = _slots_of_joints(model.jnt_dofadr, model.nv)
    slots = dict(zip(model.joint_names, zip(positions, velocities, strict=True), strict=True))
    with make_data(model) as data:
        reset(model, data, keyframe=0)
        return Layout(slots, data.time, data.qpos.copy())


def _slots_of_joints(starts: Ints, total: int) -> list[Slot]:
    """Return the slots of each joint by where they start: they end where the next one's begin.

    Without a table of what a joint has.
    """
    return [Slot(start, stop) for start, stop in pairwise([*starts.tolist(), total])]


def judge(answer: Answer, world: NoArgumentsWorld, right: Layout, course: Layout) -> WorldJudgement:
    """Judge the pair of slices of every joint, and the time."""
    slots, time = parts(answer.result, 2, "(slots, time)")
    if isinstance(time, dict) and isinstance(slots, Real):
        return wrong(OfState.SWAPPED.filled())
    faults = (
        _fault_of_names(slots, right),
        _first_wrong(slots, right, world.model),
        _fault_of_time(time, right, course.time, world.model, answer),
    )
    remarks = [fault for fault in faults if fault]
    if remarks:
        return wrong(*remarks)
    free = [name for name, (qpos, qvel) in right.slots.items() if qpos.size != qvel.size]
    return verified(OfState.PASSED.filled(joints=len(right.slots), free=", ".join(free)))


def _fault_of_names(slots: Any, layout: Layout) -> str:
    """Return which joints are missing or unknown; "" where there are none.

    Raises:
        FaultError: It is no dict.
    """
    if isinstance(slots, (list, tuple)):
        raise FaultError(OfState.LIST.filled(kind=kind(slots)))
    if not isinstance(slots, dict):
        raise FaultError(OfState.NO_DICT.filled(kind=kind(slots)))
    missing = [name for name in layout.slots if name not in slots]
    unknown = [name for name in slots if name not in layout.slots]
    if missing and unknown:
        return OfState.OTHER_KEYS.filled(
            missing=len(missing), joints=len(layout.slots), key=unknown[0]
        )
    if missing:
        return OfState.MISSING.filled(
            missing=len(missing), joints=len(layout.slots), names=", ".join(missing)
        )
    if unknown:
        return OfState.UNKNOWN.filled(name=unknown[0])
    return ""


def _first_wrong(slots: dict[str, Any], layout: Layout, model: Model) -> str:
    """Return the first joint with a wrong slot, and why it may be; "" where there is none."""
    returned = {name: _pair(slots[name], name, model) for name in layout.slots if name in slots}
    if returned and all(pair == layout.slots[name][::-1] for name, pair in returned.items()):
        return OfState.PAIRS_SWAPPED.filled()
    for name, pair in returned.items():
        for which in range(len(_ARRAYS)):
            if pair[which] != layout.slots[name][which]:
                return _figures(name, pair[which], which, layout.slots[name], model)
    return ""


def _figures(name: str, returned: Slot, which: int, expected: Slots, model: Model) -> str:
    """Return what is said of a wrong slot; arguments as of `_why`."""
    return OfState.FIGURES.filled(
        joint=name,
        array=_ARRAYS[which],
        start=returned.start,
        stop=returned.stop,
        begin=expected[which].start,
        end=expected[which].stop,
        why=_why(name, returned, which, expected, model),
    )


def _pair(value: Any, joint: str, model: Model) -> Slots:
    """Return the slots of a joint that were returned.

    Raises:
        FaultError: They are no pair of slices.
    """
    if isinstance(value, slice):
        raise FaultError(OfState.ONE_SLICE.filled(joint=joint))
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise FaultError(OfState.NO_PAIR.filled(joint=joint, kind=kind(value)))
    for part in value:
        if not isinstance(part, slice):
            raise FaultError(_no_slice(part, joint))
    return _slot(value[0], joint, model.nq), _slot(value[1], joint, model.nv)


def _no_slice(value: Any, joint: str) -> str:
    """Return what a part of a pair is that is no slice, and what to write."""
    if isinstance(value, (list, tuple)) and len(value) == 2:
        start, stop = value
        kinds = f"{type(value).__name__}s"
        return OfState.PAIR_OF_PAIRS.filled(joint=joint, kinds=kinds, start=start, stop=stop)
    if isinstance(value, Real):
        return OfState.PAIR_OF_NUMBERS.filled(joint=joint)
    if isinstance(value, np.ndarray):
        return OfState.PAIR_OF_ARRAYS.filled(joint=joint)
    return OfState.PAIR_OF_OTHERS.filled(joint=joint, kind=kind(value))


def _slot(value: slice, joint: str, total: int) -> Slot:
    """Return where a slice of an array of so many numbers begins and ends.

    Raises:
        FaultError: It has a step, or an end that is no whole number.
    """
    if value.step not in (None, 1):
        raise FaultError(OfState.STEPS.filled(joint=joint, slice=value))
    try:
        start = 0 if value.start is None else operator.index(value.start)
        stop = total if value.stop is None else operator.index(value.stop)
    except TypeError:
        raise FaultError(OfState.NOT_WHOLE.filled(joint=joint, slice=value)) from None
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
        return OfState.OTHER_ARRAY.filled(array=_ARRAYS[1 - which], table=table)
    if returned.start == number:
        return OfState.JOINT_NUMBER.filled(number=number, table=table)
    return OfState.ELSEWHERE.filled(table=table)


def _why_of_size(returned: Slot, which: int, expected: Slot, jnt_type: int) -> str:
    """Return why a slot that begins at the right place may end at a wrong one."""
    if jnt_type == int(JointType.FREE):
        if returned.size == 1:
            return OfState.FREE_HAS_MORE.filled()
        if which == 1 and returned.size == 7:
            return OfState.SIX_IN_QVEL.filled()
        if which == 0 and returned.size == 6:
            return OfState.SEVEN_IN_QPOS.filled()
    if returned.stop == expected.stop - 1:
        return OfState.END.filled()
    return OfState.SIZE.filled(size=count(returned.size, "number"), needed=expected.size)


def _fault_of_time(time: Any, right: Layout, course: float, model: Model, answer: Answer) -> str:
    """Return what is wrong with the time at keyframe 0; "" for nothing.

    Args:
        time: That was returned.
        right: What is right.
        course: What is right on the course's own world [s].
        model: What the function got.
        answer: The time is of it.
    """
    if not isinstance(time, Real) or isinstance(time, bool):
        return OfState.TIME_KIND.filled(kind=kind(time))
    if float(time) == right.time:
        return ""
    text = OfState.TIME.filled(expected=right.time, time=float(time))
    why = _why_of_time(float(time), right, course, model, answer)
    return OfState.TIME_WHY.filled(text=text, why=why) if why else text


def _why_of_time(time: float, right: Layout, course: float, model: Model, answer: Answer) -> str:
    """Return why a time [s] may be wrong; "" where nothing tells. Arguments as above."""
    if time == 0:
        at_keyframe = [end for end in answer.ends if np.array_equal(end.qpos, right.qpos)]
        is_zeroed = any(end.time == 0 for end in at_keyframe)
        return OfState.TIME_ZEROED.filled() if is_zeroed else OfState.TIME_NEW.filled()
    for k, keyframe in enumerate(model.keyframes):
        if k and keyframe.time == time:
            return OfState.TIME_OTHER.filled(number=k)
    if time == course:
        return OfState.TIME_COURSE.filled()
    if answer.runs:
        return OfState.TIME_STEPPED.filled()
    return ""
