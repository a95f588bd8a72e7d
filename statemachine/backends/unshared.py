"""Elements of one file that one release of MuJoCo reads, and another does not.

An upgrade may change what is read: MuJoCo 4.0 makes an equality constraint of a <mimic>, and 3.3
nothing. Both readings are compiled models of the installed release; elements are compared by what
they are called, and couplings by what they couple.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .compiled.kinds import EqualityKind

if TYPE_CHECKING:
    from .compiled.types import MjModel

# A size of a compiled model, as MuJoCo names it, and the kind of element that it counts.
_KINDS = {
    "nbody": "body",
    "njnt": "joint",
    "ngeom": "geom",
    "nsite": "site",
    "ntendon": "tendon",
    "neq": "equality",
    "nactuator": "actuator",
    "nkey": "key",
}


@dataclass(frozen=True)
class UnsharedElement:
    """An element of a file that one release reads, and another does not.

    Attributes:
        size: What counts elements of its kind, as MuJoCo names it: "neq".
        label: What it is, and of a coupling what it does: "right_j follows left_j".
        reader: The release that reads it, as "MuJoCo 4.0.0".
        other: The one that does not.
        count: How many elements of the kind the reader has.
        other_count: How many the other has.
    """

    size: str
    label: str
    reader: str
    other: str
    count: int
    other_count: int

    def __str__(self) -> str:
        counts = f"{self.size}: {self.count} and {self.other_count}"
        return f"{self.label} in {self.reader}, and not in {self.other} ({counts})"


def unshared_elements(
    left: MjModel,
    right: MjModel,
    left_name: str,
    right_name: str,
    frames: Collection[str] = (),
) -> tuple[UnsharedElement, ...]:
    """Return what only one of two readings of a file has.

    Args:
        left: What one release reads, in terms of the installed one.
        right: What another reads, in the same terms.
        left_name: What the one release is called.
        right_name: What the other is called.
        frames: Sites that are no elements of the file: the frames of fused bodies.
    """
    elements = list[UnsharedElement]()
    sides = ((left, right, left_name, right_name), (right, left, right_name, left_name))
    for size, kind in _KINDS.items():
        for model, other_model, reader, other in sides:
            count, other_count = int(getattr(model, size)), int(getattr(other_model, size))
            only = Counter(_labels(model, kind, count))
            only.subtract(_labels(other_model, kind, other_count))
            for frame in frames if size == "nsite" else ():
                only.pop(_label("site", frame), None)
            for label in only.elements():
                elements.append(UnsharedElement(size, label, reader, other, count, other_count))
    return tuple(elements)


def _labels(model: MjModel, kind: str, count: int) -> list[str]:
    """Return what all elements of a kind are called."""
    if kind == "equality":
        return [_label_of_equality(model, eq) for eq in range(count)]
    names = [getattr(model, kind)(number).name for number in range(count)]
    return [_label(kind, name) for name in names]


def _label(kind: str, name: str) -> str:
    """Return what an element is called."""
    return f"{kind} {name} is there" if name else f"a {kind} without a name"


def _label_of_equality(model: MjModel, eq: int) -> str:
    """Return what an equality constraint couples."""
    ends = [int(end) for end in (model.eq_obj1id[eq], model.eq_obj2id[eq]) if end >= 0]
    kind = EqualityKind(int(model.eq_type[eq]))
    if kind is EqualityKind.JOINT:
        joints = [model.joint(end).name or f"joint number {end}" for end in ends]
        return " follows ".join(joints) if len(joints) > 1 else f"{joints[0]} is held"
    name = model.equality(eq).name
    word = kind.name.lower().replace("_", " ")
    return f"{word} {name} is there" if name else f"a {word} without a name"
