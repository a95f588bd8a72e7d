"""What the actuators of two compiled models differ in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from ...backends.controls import ctrl_owners
from ...installed import require
from ...interface import JointType
from ...measures.text import grouped
from ..records import (
    DifferingQuantity,
    ElementReference,
    ModelDifference,
    SpecEdit,
)
from ._gains import (
    dynamics,
    gains,
    has_own_state,
    in_units_of,
    is_filter,
    motion_of,
    unit_of_ctrl,
)
from ._quantities import same, word_in
from ._sides import Sides, copies, name_of, zeros

# mjtTrn: what an actuator acts on, and from which site it measures.
_DRIVES = {
    0: ("joint",),
    1: ("joint",),
    2: ("site", "site"),
    3: ("tendon",),
    4: ("site", "site"),
    5: ("body",),
}
# mjtTrn: the attributes of an MjSpec's actuator that refer to what it acts on.
_REFERENCES = {
    0: ("target",),
    1: ("target",),
    3: ("target",),
    4: ("target", "refsite"),
    5: ("target",),
}
_ON_JOINT, _ON_JOINT_IN_PARENT = 0, 1  # mjtTrn
_SCALAR = (JointType.SLIDE, JointType.HINGE)
_SO3 = 6  # mjtTrn: of a ball joint, or of a site in the frame of another
# Where the law of an actuator's own state is another, these are one thing with it.
_OF_A_FILTER = ("dynamics", "range of its activation")
_OF_A_LAW = ("gains", *_OF_A_FILTER, "length range")
_STATE_ARRAYS = ("actuator_dyntype", "actuator_dynprm", "actuator_actearly")
_STILL = (
    *("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm"),
    *("actuator_armature", "actuator_damping"),
)


def drives(sides: Sides) -> Iterator[ModelDifference]:
    """Yield the differences of actuators: gains, ranges, dynamics, and what they drive."""
    left, right = sides.raws
    owners = ctrl_owners(left), ctrl_owners(right)
    places = sides.pairs.actuators
    actuators = sorted({(int(owners[0][a]), int(owners[1][b])) for a, b in places})
    for a, b in actuators:
        yield from _laws(sides, a, b)
        yield from _delay(sides, a, b)
        yield from _transmission(sides, a, b)
    if left.opt.disableactuator or right.opt.disableactuator:
        yield from sides.rows("actuator", actuators, "group")
    for a, b in places:
        actuator = int(owners[0][a])
        name = name_of(left, "actuator", actuator)
        for row in sides.rows("actuator", [(a, b)], "control", name):
            values = tuple(
                replace(value, unit=unit_of_ctrl(left, actuator)) for value in row.values
            )
            yield replace(row, values=values)
    yield from sides.extras("actuator", actuators, lambda raw, k: zeros(_STILL, raw, k))


def _laws(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield the differences of an actuator's force and activation; together, where its own state
    follows another law.
    """
    rows = list(_rows(sides, a, b))
    ours, theirs = _Law.of(sides.left, a), _Law.of(sides.right, b)
    if ours == theirs:
        yield from rows
        return
    filters = all(is_filter(raw, k) or not has_own_state(raw, k) for raw, k in _both(sides, a, b))
    together = _OF_A_FILTER if filters else _OF_A_LAW
    if ours.size != theirs.size:
        together = _OF_A_FILTER
    of_law = [row for row in rows if row.subject in together]
    values = list(dynamics(sides.left, a, sides.right, b))
    known = {value.quantity for value in values}
    for row in of_law:
        values += [value for value in row.values if value.quantity not in known]
    subject = "filter" if filters else "law"
    if ours.size == theirs.size:
        edits = list(copies(_STATE_ARRAYS, sides.left, a, b))
        for row in of_law:
            edits += row.edits
        yield sides.tell(subject, "actuator", a, values, edits)
    elif ours.controls != theirs.controls:
        why = "it takes other numbers of ctrl: give it one kind and one input in both files"
        yield sides.tell(subject, "actuator", a, values, refused=why)
    else:
        difference = sides.tell(subject, "actuator", a, values)
        yield replace(
            difference,
            spec_edits=_given_law(sides.raws, (a, b), to=1),
            spec_edits_one=_given_law(sides.raws, (a, b), to=0),
        )
    yield from (row for row in rows if row not in of_law)


def _both(sides: Sides, a: int, b: int) -> tuple[tuple[Any, int], tuple[Any, int]]:
    return (sides.left, a), (sides.right, b)


def _rows(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield the differences of an actuator's gains and parameters, by their names in an MJCF."""
    left, right = sides.raws
    for row in sides.rows("actuator", [(a, b)]):
        if row.subject == "gains":
            values = gains(left, a, right, b)
            if values:  # else the law does not read the parameters that differ
                yield replace(row, values=values)
        elif row.subject == "dynamics":
            values = dynamics(left, a, right, b)
            if values:
                yield replace(row, values=values)
        else:
            yield in_units_of(motion_of(left, a), row)
    yield from _outputs(sides, a, b)


def _outputs(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield the differences of the outputs of an actuator, together as one."""
    left, right = sides.raws
    count = min(int(left.actuator_outnum[a]), int(right.actuator_outnum[b]))
    here, there = int(left.actuator_outadr[a]), int(right.actuator_outadr[b])
    outputs = [(here + k, there + k) for k in range(count)]
    name = name_of(left, "actuator", a)
    has_range = any(
        raw.actuator_gaintype[k] or raw.actuator_biastype[k] for raw, k in _both(sides, a, b)
    )
    rows = sides.rows("actuator", outputs, "output", name)
    for subject, parts in grouped((row.subject, row) for row in rows).items():
        if subject == "length range" and not has_range:
            continue
        edits = tuple(edit for part in parts for edit in part.edits)
        yield in_units_of(motion_of(left, a), replace(parts[0], edits=edits))


@dataclass(frozen=True)
class _Law:
    """How the own state of an actuator moves.

    Attributes:
        kind: By which law: an entry of mjtDyn.
        length: How many numbers the state has.
        controls: How many numbers of ctrl it takes.
        meaning: What these mean; 0 of one, whose meaning follows from the gains.
    """

    kind: int
    length: int
    controls: int
    meaning: int

    @classmethod
    def of(cls, raw: Any, k: int) -> _Law:
        """Read that of an actuator."""
        controls = int(raw.actuator_ctrlnum[k])
        meaning = int(raw.actuator_ctrlspec[k]) if controls > 1 else 0
        return cls(int(raw.actuator_dyntype[k]), int(raw.actuator_actnum[k]), controls, meaning)

    @property
    def size(self) -> tuple[int, int, int]:
        """Return the difference that no edit of a compiled model can equalize."""
        return self.length, self.controls, self.meaning


def _given_law(
    raws: tuple[Any, Any], actuators: tuple[int, int], *, to: int
) -> tuple[SpecEdit, ...]:
    """Return what gives an actuator of one side the law of its counterpart.

    Args:
        raws: Both mjModels.
        actuators: The ids of the actuator in each.
        to: The side that is changed, 0 or 1.
    """
    source, target = raws[1 - to], raws[to]
    k, there = actuators[1 - to], actuators[to]
    states = has_own_state(source, k)
    limited = states and bool(source.actuator_actlimited[k])
    kept = tuple(source.actuator_actrange[k].tolist()) if limited else (0.0, 0.0)
    law, length = int(source.actuator_dyntype[k]), -1  # the length of a usual law is known
    if law == int(require("mujoco").mjtDyn.mjDYN_USER):
        length = int(source.actuator_actnum[k])
    values: dict[str, float | tuple[float, ...]] = {"dyntype": law, "actdim": length}
    values["dynprm"] = tuple(source.actuator_dynprm[k].tolist())
    values["actearly"] = bool(source.actuator_actearly[k])
    values["actlimited"] = int(limited)
    values["actrange"] = kept
    values["activations"] = _activations(source, k, target)
    return tuple(SpecEdit("actuator", there, name, value) for name, value in values.items())


def _activations(source: Any, k: int, target: Any) -> tuple[float, ...]:
    """Return what an actuator has of act in each keyframe of another model, by its name; else 0."""
    start, number = int(source.actuator_actadr[k]), int(source.actuator_actnum[k])
    names = [source.key(key).name for key in range(source.nkey)]
    values: list[float] = []
    for key in range(target.nkey):
        name = target.key(key).name
        if name in names and number:
            values += source.key_act[names.index(name), start : start + number].tolist()
        else:
            values += [0.0] * number
    return tuple(values)


def _delay(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield a difference of delay, which needs a memory of commands: without one it is taken
    from the other.
    """
    left, right = sides.raws
    sizes = left.actuator_history[a], right.actuator_history[b]
    back = bool(sizes[0][0] and not sizes[1][0])
    yield from sides.rows("actuator", [(a, b)], "delay", back=back)
    if not (left.actuator_delay[a] and right.actuator_delay[b]) or same(*sizes):
        return
    values: list[DifferingQuantity] = []
    for name, ours, theirs in zip(("nsample", "interp"), sizes[0], sizes[1], strict=True):
        if ours != theirs:
            values.append(DifferingQuantity(name, int(ours), int(theirs)))
    difference = sides.tell("memory of commands", "actuator", a, values)
    yield replace(
        difference,
        spec_edits=_given_memory(b, sizes[0]),
        spec_edits_one=_given_memory(a, sizes[1]),
    )


def _given_memory(actuator: int, history: Any) -> tuple[SpecEdit, ...]:
    """Return what gives an actuator a memory of so many commands, read so: (2,) as `history`."""
    return (
        SpecEdit("actuator", actuator, "nsample", int(history[0])),
        SpecEdit("actuator", actuator, "interp", int(history[1])),
    )


def _transmission(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield the differences of what an actuator drives, and from which site it measures."""
    ours, theirs = _targets(sides, 0, a), _targets(sides, 1, b)
    if ours[0] == theirs[0]:
        return
    value = DifferingQuantity("drives", ours[1], theirs[1])
    edits = _given_transmission(sides, a, b)
    why = ""
    if not edits:
        why = "what it drives has no counterpart: write the same transmission into both files"
    difference = sides.tell("transmission", "actuator", a, (value,), refused=why)
    yield replace(difference, spec_edits=edits)


def _given_transmission(sides: Sides, a: int, b: int) -> tuple[SpecEdit, ...]:
    """Return what lets the second's actuator drive what the first's does; () if it has no such."""
    kind, targets = int(sides.left.actuator_trntype[a]), _named_targets(sides, 0, a)
    if kind not in _REFERENCES or any(there < 0 for _, there in targets):
        return ()
    edits = [SpecEdit("actuator", b, "trntype", kind)]
    for attribute, (target, there) in zip(_REFERENCES[kind], targets, strict=False):
        edits.append(SpecEdit("actuator", b, attribute, ElementReference(target, there)))
    return tuple(edits)


def _named_targets(sides: Sides, side: int, k: int) -> list[tuple[str, int]]:
    """Return what an actuator refers to: kinds, and ids of the second model."""
    raw = sides.raws[side]
    kinds = _DRIVES.get(int(raw.actuator_trntype[k]), ())
    ids = raw.actuator_trnid[k].tolist()
    return [
        (kind, sides.there(side, kind, number))
        for kind, number in zip(kinds, ids, strict=False)
        if number >= 0
    ]


def _targets(sides: Sides, side: int, k: int) -> tuple[tuple[int, ...], str]:
    """Return what an actuator acts on and from which site it measures: ids of the second model,
    words.
    """
    raw = sides.raws[side]
    kind, ids = int(raw.actuator_trntype[k]), raw.actuator_trnid[k].tolist()
    if kind == _SO3:
        kinds = ("joint",) if ids[1] < 0 else ("site", "site")
    else:
        kinds = _DRIVES.get(kind, ())
    targets = list(zip(kinds, ids, strict=False))
    names = [name_of(raw, target, i) for target, i in targets if i >= 0]
    word = word_in("mjtTrn", kind)
    if kind == _ON_JOINT_IN_PARENT and int(raw.jnt_type[ids[0]]) in _SCALAR:
        kind = _ON_JOINT  # only of a ball or a free joint is the frame of the force another
    ids[: len(targets)] = [sides.there(side, target, i) for target, i in targets]
    return (kind, *ids), f"{word} {', '.join(names)}"
