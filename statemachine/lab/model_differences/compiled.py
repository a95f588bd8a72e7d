"""The differences of two compiled models, as `..why` has them, on the one list of two files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...engines.description.reading import ModelReading
from ...engines.records import ORDER_OF_JOINTS, TURNED, DifferingQuantity, ModelDifference
from ...interface import JointType
from ..compare.matching import Matched
from ..why.causes import OTHER_JOINT, differences_of
from .effects import Effects, Meaning
from .listing import CompiledCause, Listing
from .locating import ElementIds, Locator
from .meanings import Meanings
from .quantities import of_free_joint, split_solref
from .records import Value

# What a geom, and a flex, has of how it touches.
_CONTACT = dict.fromkeys(
    (
        *("friction", "friction dimensions", "softness", "priority", "margin", "filter"),
        *("adhesion", "moving surface", "self-collision"),
    ),
    "contact",
)
# What a difference of an element of each kind is a matter of, by its subject.
_SUBJECTS: dict[str, dict[str, str]] = {
    "body": {
        "mass": "mass",
        "centre of mass": "centre of mass",
        "inertia": "inertia",
        "place": "places",
        "zero": "places",
        "parent": "structure",
        "joints": "structure",
    },
    "joint": {
        "armature": "armature",
        "damping": "damping",
        "dry friction": "dry friction",
        "spring": "spring",
        "axis": "places",
        "anchor": "places",
        "range": "limits",
        "rest of the spring": "spring",
        "force limit": "effort",
        "extra joint": "structure",
    },
    "geom": {
        "shape": "shapes",
        "hull": "shapes",
        "heights": "shapes",
        "extra shape": "shapes",
        "place": "shapes",
        **_CONTACT,
    },
    "flex": {
        "radius": "shapes",
        "rest shape": "shapes",
        "mesh": "shapes",
        "extra flex": "structure",
        **_CONTACT,
    },
    "site": {"place": "tool frame", "owner": "tool frame"},
    "equality": {"extra equality": "structure"},
}
_SUBJECT_OF_KIND = {"actuator": "drive", "option": "settings", "flag": "settings"}
# Of a body that is cut otherwise: what each quantity is a matter of.
_SUBJECT_OF_INERTIAL = {
    "mass": "mass",
    "com": "centre of mass",
    "moments": "inertia",
    TURNED: "inertia",
}
# What a URDF, or what an engine tells, has no word for: by the kind of the element.
_UNSTATED_VALUES = {
    "joint": ("armature", "spring", "rest of the spring", "stop", "softness of dry friction"),
    "geom": _SUBJECTS["geom"].keys() - {"shape", "hull", "heights", "extra shape", "place"},
}
_EQUALITY_OF_JOINTS = 2  # mjtEq
# What says the largest force of a joint.
_EFFORTS = (("joint", "force limit"), ("actuator", "force range"))


class CompiledDifferences:
    """Enters what two compiled models differ in.

    Args:
        listing: Where it is entered.
        readings: Both sides.
        matched: What of one is what of the other.
        effects: What differences mean.
        locator: Where elements stand in the files.
    """

    def __init__(
        self,
        listing: Listing,
        readings: Sequence[ModelReading],
        matched: Matched,
        effects: Effects,
        locator: Locator,
    ) -> None:
        self._listing, self._readings, self._matched = listing, readings, matched
        self._effects, self._locator = effects, locator
        self._meanings = Meanings(readings, effects, locator)

    def enter(self) -> list[str]:
        """Enter all that differs; return what was not compared, in sentences."""
        skipped: list[str] = []
        rows = differences_of(self._matched.left, self._matched.right, self._matched)
        lonely = {row.where for row in rows if row.subject == "extra joint"}
        of_other_kinds = self._enter_kinds(lonely)
        for row in rows:
            if row.kind == "model":
                skipped.append(f"{row.title} are compared as a whole only, and differ")
            if row.subject == "extra joint" and row.where in of_other_kinds:
                continue
            if not (self._goes_with_a_joint(row, lonely) or self._is_unknown(row)):
                self._enter(row)
        self._enter_base()
        return skipped

    def _enter_kinds(self, lonely: set[str]) -> set[str]:
        """Enter joints that are of another kind on the other side; return their names.

        Args:
            lonely: Names of the joints that have no counterpart of their kind.
        """
        names: set[str] = set()
        for left, right in self._effects.joints_of_parts():
            if left.kind == right.kind or left.name not in lonely:
                continue
            names |= {left.name, right.name}
            cause = CompiledCause(f"extra joint of {left.name}", OTHER_JOINT)
            element = self._locator.find("joint", left.name)
            kinds = (left.kind, right.kind)
            self._listing.enter("places", element, "type", kinds, Meaning(1.0), "", cause)
        return names

    def _enter_base(self) -> None:
        """Enter another mass of what is fixed to the world, which moves nothing by it."""
        pair = self._effects.root
        left, right = pair.left.inertial.mass, pair.right.inertial.mass
        if pair.left.joint is None and pair.right.joint is None and left != right:
            # The first link that is not the world, which an engine may have taken it for.
            links = max(pair.left.links, pair.right.links, key=len)
            element = self._locator.find("body", links[min(1, len(links) - 1)][0].name)
            meaning = Meaning(0.0, "stands still", matters=False)
            self._listing.enter("mass", element, "mass", (left, right), meaning, "kg")

    def _goes_with_a_joint(self, row: ModelDifference, lonely: set[str]) -> bool:
        """Tell whether an actuator is there on one side only since its joint is."""
        if row.kind != "actuator" or row.subject != "extra actuator":
            return False
        sides = (self._effects.left, self._effects.right)
        actuators = [side.actuators[row.where] for side in sides if row.where in side.actuators]
        return any(actuator.joint in lonely for actuator in actuators)

    def _is_unknown(self, row: ModelDifference) -> bool:
        """Tell whether a side has no word for an option, and its engine none either."""
        if row.kind not in ("option", "flag"):
            return False
        names = {value.quantity for value in row.values}
        for reading in self._readings:
            if reading.settings is not None and not names <= reading.settings:
                return True
        return False

    def _enter(self, row: ModelDifference) -> None:
        """Enter the quantities of one difference."""
        element = self._locator.find(row.kind, row.where)
        if row.subject.startswith("extra ") and row.values:
            side = 0 if row.values[0].right is None else 1
            element = self._locator.find_alone(side, row.kind, row.where)
        ids = self._locator.ids(row.kind, row.where)
        if (row.kind, row.subject) in _EFFORTS and self._is_same_effort(row):
            return
        for value in self._quantities(row, ids):
            quantity = value.quantity
            if row.subject.startswith(ORDER_OF_JOINTS):
                element, quantity = self._locator.find("joint", value.quantity), "order"
            subject = self._subject(row, value.quantity)
            values = self._said(row, ids, value)
            if values[0] == values[1]:
                continue
            self._listing.enter(
                subject,
                element,
                quantity,
                values,
                self._meanings.of(row, ids, value, values),
                value.unit,
                CompiledCause(row.title, row.refused),
            )

    def _subject(self, row: ModelDifference, quantity: str) -> str:
        """Return the subject of a quantity."""
        is_weight = row.kind == "body" and row.subject in ("mass", "centre of mass", "inertia")
        if is_weight and quantity in _SUBJECT_OF_INERTIAL:
            return _SUBJECT_OF_INERTIAL[quantity]
        if row.subject.startswith(ORDER_OF_JOINTS):
            return "structure"
        if row.kind in _SUBJECT_OF_KIND:
            return _SUBJECT_OF_KIND[row.kind]
        return _SUBJECTS.get(row.kind, {}).get(row.subject, "further")

    def _quantities(self, row: ModelDifference, ids: ElementIds) -> Iterator[DifferingQuantity]:
        """Yield the quantities of a difference, those of a servo by its gains."""
        if row.kind == "actuator" and row.subject == "extra actuator":
            yield from self._of_extra_actuator(row)
            return
        if row.kind == "joint" and row.subject == "extra joint":
            yield self._extra_joint(row)
            return
        if row.kind == "equality" and row.subject == "extra equality":
            yield self._extra_equality(row)
            return
        if row.kind == "body" and row.subject == "parent":
            yield DifferingQuantity("parent", *self._parents(ids))
            return
        is_free = row.kind == "joint" and self._is_free(ids)
        for value in split_solref(row.values):
            yield of_free_joint(value) if is_free else value
        if not row.values:
            yield DifferingQuantity(row.subject, "as it is", "another")

    def _is_free(self, ids: ElementIds) -> bool:
        """Tell whether a joint of the left is a free one."""
        return ids.left >= 0 and self._matched.left.jnt_type[ids.left] == JointType.FREE

    def _of_extra_actuator(self, row: ModelDifference) -> Iterator[DifferingQuantity]:
        """Yield what an actuator is that only one side has, and its gains."""
        sides = (self._effects.left, self._effects.right)
        actuators = [side.actuators.get(row.where) for side in sides]
        kinds = [actuator.kind if actuator else "nothing" for actuator in actuators]
        yield DifferingQuantity("actuator", kinds[0], kinds[1])
        there = next(actuator for actuator in actuators if actuator is not None)
        loads = self._effects.loads(there.joint)
        for name, unit in (("kp", "N·m/rad"), ("kv", "N·m·s")):
            value = getattr(there, name)
            if value is not None:
                unit_of_joint = loads[0].unit(unit) if loads and there.gear == 1 else ""
                values = (value, "nothing") if actuators[0] else ("nothing", value)
                yield DifferingQuantity(name, *values, unit_of_joint)

    def _extra_joint(self, row: ModelDifference) -> DifferingQuantity:
        """Return what a joint is that only one side has."""
        loads = self._effects.loads(row.where)
        kind = loads[0].joint.kind if loads else "joint"
        is_left = row.values[0].left is not None
        values = (kind, "nothing") if is_left else ("nothing", kind)
        return DifferingQuantity("joint", *values)

    def _extra_equality(self, row: ModelDifference) -> DifferingQuantity:
        """Return what an equality keeps that only one side has."""
        side = 0 if row.values[0].right is None else 1
        model = (self._matched.left, self._matched.right)[side]
        raw = model.compiled
        number = self._locator.number(side, "equality", row.where)
        words = str(row.values[0].right if side else row.values[0].left)
        if number >= 0 and int(raw.eq_type[number]) == _EQUALITY_OF_JOINTS:
            first = self._locator.name(side, "joint", int(raw.eq_obj1id[number]))
            second = self._locator.name(side, "joint", int(raw.eq_obj2id[number]))
            offset, factor = raw.eq_data[number, :2].tolist()
            words = f"{first} is {offset:g}"
            if second:
                words = f"{first} is {factor:g} {second} {offset:+g}"
            if raw.eq_data[number, 2:5].any():
                words += " + …"
        values = (words, "nothing") if side == 0 else ("nothing", words)
        return DifferingQuantity("equality", *values)

    def _parents(self, ids: ElementIds) -> tuple[str, str]:
        """Return the names of the bodies that carry a body on each side."""
        names: list[str] = []
        for side, number in ((0, ids.left), (1, ids.right)):
            model = (self._matched.left, self._matched.right)[side]
            parent = int(model.compiled.body_parentid[number])
            names.append(self._locator.name(side, "body", parent))
        return names[0], names[1]

    def _said(
        self, row: ModelDifference, ids: ElementIds, value: DifferingQuantity
    ) -> tuple[Value, Value]:
        """Return both values; None of a side that has no word for it, or does not say it."""
        values: list[Value] = []
        for side, entry in ((0, value.left), (1, value.right)):
            is_said = self._says(side, row, ids, entry)
            nothing = "none" if value.quantity.endswith("range") else "nothing"
            values.append(_listed_value(entry, nothing) if is_said else None)
        return values[0], values[1]

    def _says(self, side: int, row: ModelDifference, ids: ElementIds, entry: Value) -> bool:
        """Tell whether a side says a quantity of its compiled model."""
        reading = self._readings[side]
        declared = reading.declared
        if declared is None:
            return True
        if row.kind in ("option", "flag"):
            return reading.settings is not None
        if row.kind == "actuator":
            return False
        if row.subject in _UNSTATED_VALUES.get(row.kind, ()):
            is_friction = row.kind == "geom" and row.subject == "friction"
            return is_friction and self._declares_friction(side, ids)
        if row.kind == "joint":
            name = self._locator.name(side, "joint", ids.left if side == 0 else ids.right)
            joint = declared.joints.get(name)
            if joint is not None and row.subject in ("damping", "dry friction", "force limit"):
                stated = {
                    "damping": joint.damping,
                    "dry friction": joint.friction,
                    "force limit": joint.effort,
                }
                return stated[row.subject] is not None
        return True

    def _declares_friction(self, side: int, ids: ElementIds) -> bool:
        """Tell whether a URDF, or an engine, says the friction of a geom."""
        reading, number = self._readings[side], ids.left if side == 0 else ids.right
        if reading.format == "engine" or reading.declared is None or number < 0:
            return True
        body = int(reading.model.compiled.geom_bodyid[number])
        return self._locator.name(side, "body", body) in reading.declared.frictions

    def _is_same_effort(self, row: ModelDifference) -> bool:
        """Tell whether a limit of a joint is that of its one actuator on the other side."""
        joint = row.where
        if row.kind == "actuator":
            actuator = self._effects.left.actuators.get(row.where)
            joint = "" if actuator is None else actuator.joint
        loads = self._effects.loads(joint)
        efforts = [load.joint.effort for load in loads]
        if len(efforts) != 2 or efforts[0] is None or efforts[1] is None:
            return False
        counts: list[int] = []
        for side, load in zip((self._effects.left, self._effects.right), loads, strict=True):
            on_joint = [actuator.joint == load.joint.name for actuator in side.actuators.values()]
            counts.append(sum(on_joint))
        return max(counts) <= 1 and bool(np.isclose(efforts[0], efforts[1], rtol=1e-9, atol=0))


def _listed_value(value: Value, nothing: str) -> Value:
    """Return a value of a compiled model as one of the list; `nothing` of what is not there."""
    if value is None:
        return nothing
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return float(value)
    return value
