"""Differences of two compiled models as attributes of the second one's URDF."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ...interface import Array
from ...rotations import matrix_from_quat, rotation
from ..description.file_form import FileForm, NotWrittenError
from ..description.file_numbers import number_text, numbers_text, tidied
from ..description.xml_source import AttributeText, XmlElement, XmlSource
from ..records import Edit, SpecEdit
from ._file_target import FileTarget
from .mjcf_form import option_texts

_WEIGHTS = ("body_mass", "body_ipos", "body_iquat", "body_inertia")
_PLACES = ("body_pos", "body_quat")
_SHAPE = ("geom_size", "geom_type", "geom_pos", "geom_quat")
_DERIVED = ("geom_rbound", "geom_aabb", "geom_fluid")
_LOCKED = 1e-9  # cosine of the pitch: nearer to zero roll and yaw are not known apart
_INERTIA = {
    "ixx": (0, 0),
    "iyy": (1, 1),
    "izz": (2, 2),
    "ixy": (0, 1),
    "ixz": (0, 2),
    "iyz": (1, 2),
}
_AXES = np.eye(3)


class UrdfForm(FileForm):
    """Writes what the compiled model of a URDF is to have as attributes of the file.

    Args:
        source: The file.
        raw: Its mjModel.
        other: The file of the other side, if that is a URDF, too: what a link weighs is copied from
            the link of the same name, letter by letter.
    """

    def __init__(self, source: XmlSource, raw: Any, other: XmlSource | None) -> None:
        self._source, self._raw, self._other = source, raw, other

    def texts(
        self, edits: Iterable[Edit], spec_edits: Iterable[SpecEdit] = ()
    ) -> list[AttributeText]:
        """Return the attributes that undo one difference.

        Raises:
            NotWrittenError: No attribute does.
        """
        target = FileTarget(self._raw, edits, spec_edits)
        texts: list[AttributeText] = []
        for (kind, number), arrays in target.elements().items():
            arrays -= {*_DERIVED}
            if kind == "opt":
                root, tags = self._source.root, ("mujoco",)
                texts += option_texts(self._source, target, arrays, root, tags)
            elif kind in ("jnt", "dof"):
                joint = int(self._raw.dof_jntid[number]) if kind == "dof" else number
                texts += self._of_joint(target, joint, number, arrays)
            elif kind == "body":
                texts += self._of_body(target, number, arrays)
            elif kind == "geom":
                texts += self._of_geom(target, number, arrays)
            else:
                raise NotWrittenError(f"a URDF has no {kind}")
        return texts

    def _of_joint(
        self, target: FileTarget, joint: int, number: int, arrays: set[str]
    ) -> list[AttributeText]:
        """Return the attributes of a joint.

        Args:
            target: What the model is to have.
            joint: Id of the joint.
            number: Of its row in the arrays: of the joint, or of its degree of freedom.
            arrays: The arrays that are changed.
        """
        element = self._named("joint", self._raw.joint(joint).name)
        texts: list[AttributeText] = []
        for array in sorted(arrays):
            match array:
                case "dof_damping" | "dof_frictionloss":
                    attribute = "damping" if array == "dof_damping" else "friction"
                    text = number_text(float(target.value(array, number)))
                    texts.append(self._inside(element, "dynamics", attribute, text))
                case "jnt_axis":
                    text = numbers_text(target.value(array, number))
                    texts.append(self._inside(element, "axis", "xyz", text))
                case "jnt_range":
                    self._check_limited(target, "jnt_limited", number)
                    for attribute, end in zip(
                        ("lower", "upper"), target.value(array, number), strict=True
                    ):
                        texts.append(self._inside(element, "limit", attribute, number_text(end)))
                case "jnt_actfrcrange":
                    self._check_limited(target, "jnt_actfrclimited", number)
                    low, high = target.value(array, number)
                    if low != -high:
                        raise NotWrittenError("a URDF has one effort for both directions")
                    texts.append(self._inside(element, "limit", "effort", number_text(high)))
                case _:
                    if target.is_changed(array, number) and not array.endswith("limited"):
                        word = array.partition("_")[2]
                        raise NotWrittenError(f"a URDF has no {word} of a joint")
        return texts

    def _check_limited(self, target: FileTarget, flag: str, number: int) -> None:
        """Raise NotWrittenError where a range is to begin or to end to count."""
        if target.is_changed(flag, number) or not target.value(flag, number):
            raise NotWrittenError("whether a joint is limited is its type in a URDF")

    def _of_body(self, target: FileTarget, body: int, arrays: set[str]) -> list[AttributeText]:
        """Return the attributes of a link, and those of the joint that it hangs on."""
        link = self._named("link", self._raw.body(body).name)
        texts: list[AttributeText] = []
        if arrays & {*_PLACES}:
            texts += self._place_of_link(target, body, link)
        if arrays & {*_WEIGHTS}:
            texts += self._weigh(target, body, link, arrays)
        unknown = arrays - {*_PLACES, *_WEIGHTS}
        if unknown:
            raise NotWrittenError(f"a URDF has no {min(unknown).partition('_')[2]} of a link")
        return texts

    def _place_of_link(
        self, target: FileTarget, body: int, link: XmlElement
    ) -> list[AttributeText]:
        """Return the origin of the joint that a link hangs on."""
        joint = self._joint_above(link)
        parent = self._raw.body(int(self._raw.body_parentid[body])).name
        if joint is None:
            raise NotWrittenError("it hangs on the world, and on no joint of the file")
        parent_link = self._inner(joint, "parent", "link")
        base, axes = self._place_in(parent_link, parent)
        position = axes.T @ (target.value("body_pos", body) - base)
        matrix = axes.T @ matrix_from_quat(target.value("body_quat", body))
        return self._origin(joint, target, ("body_pos", "body_quat"), body, (position, matrix))

    def _place_in(self, name: str, container: str) -> tuple[Array, Array]:
        """Return the place of a link in the one that it is a part of, behind fixed joints.

        Args:
            name: Of the link.
            container: Name of the body that it is compiled into; of the world for the first link.

        Returns:
            Its position (3,) [m] and its axes (3, 3).
        """
        position, axes = np.zeros(3), _AXES
        while name != container:
            joint = self._joint_above(self._named("link", name))
            if joint is None:
                break
            turn = _matrix(self._inner(joint, "origin", "rpy"))
            shift = self._inner(joint, "origin", "xyz")
            offset = np.array([float(word) for word in shift.split()]) if shift else np.zeros(3)
            position, axes = offset + turn @ position, turn @ axes
            name = self._inner(joint, "parent", "link")
        return position, axes

    def _origin(
        self,
        element: XmlElement,
        target: FileTarget,
        arrays: tuple[str, str],
        number: int,
        place: tuple[Array, Array],
    ) -> list[AttributeText]:
        """Return the attributes of the `<origin>` of an element.

        Args:
            element: The element.
            target: What the model is to have.
            arrays: Those of the position and of the quaternion.
            number: Of the row in them.
            place: The position (3,) [m] and the axes (3, 3) to be written.
        """
        texts: list[AttributeText] = []
        if target.is_changed(arrays[0], number):
            text = numbers_text(tidied(place[0]))
            texts.append(self._inside(element, "origin", "xyz", text))
        if target.is_changed(arrays[1], number):
            text = numbers_text(tidied(_roll_pitch_yaw(place[1])))
            texts.append(self._inside(element, "origin", "rpy", text))
        return texts

    def _weigh(
        self, target: FileTarget, body: int, link: XmlElement, arrays: set[str]
    ) -> list[AttributeText]:
        """Return the attributes of the inertial of a link."""
        fused = self._fused_into(link)
        if self._other is not None:
            copied = self._copied([link, *fused])
            if copied is not None:
                return copied
        if any(self._child(each, "inertial") for each in fused):
            raise NotWrittenError(
                "links behind fixed joints are a part of it: which one is unknown"
            )
        inertial = self._child(link, "inertial")
        if inertial is None:
            raise NotWrittenError("the link has no <inertial>")
        texts: list[AttributeText] = []
        if "body_mass" in arrays:
            mass = number_text(float(target.value("body_mass", body)))
            texts.append(self._inside(inertial, "mass", "value", mass))
        if "body_ipos" in arrays:
            centre = numbers_text(target.value("body_ipos", body))
            texts.append(self._inside(inertial, "origin", "xyz", centre))
        if arrays & {"body_inertia", "body_iquat"}:
            axes = matrix_from_quat(target.value("body_iquat", body))
            tensor = axes @ np.diag(target.value("body_inertia", body)) @ axes.T
            own = _matrix(self._inner(inertial, "origin", "rpy"))
            tensor = own.T @ tensor @ own
            entries = tidied(tensor[place] for place in _INERTIA.values())
            for attribute, entry in zip(_INERTIA, entries, strict=True):
                texts.append(self._inside(inertial, "inertia", attribute, number_text(entry)))
        return texts

    def _copied(self, links: Sequence[XmlElement]) -> list[AttributeText] | None:
        """Return what links weigh in the other file; None where it has no such links."""
        assert self._other is not None
        texts: list[AttributeText] = []
        for link in links:
            there = [each for each in self._other.elements if each.tag == "link"]
            there = [each for each in there if each.name == link.name]
            ours = self._child(link, "inertial")
            theirs = self._child(there[0], "inertial", self._other) if there else None
            if ours is None and theirs is None and there:
                continue
            if ours is None or theirs is None:
                return None
            texts += self._copied_inertial(ours, theirs)
        return texts if texts else None

    def _copied_inertial(self, ours: XmlElement, theirs: XmlElement) -> list[AttributeText]:
        """Return the attributes of an inertial that are other ones in the other file."""
        assert self._other is not None
        texts: list[AttributeText] = []
        for tag, attributes in (
            ("origin", ("xyz", "rpy")),
            ("mass", ("value",)),
            ("inertia", tuple(_INERTIA)),
        ):
            source = self._child(theirs, tag, self._other)
            for attribute in attributes:
                usual = "0 0 0" if tag == "origin" else "0"
                wanted = source.attributes.get(attribute, usual) if source else usual
                now = self._inner(ours, tag, attribute)
                if (now if now else usual).split() != wanted.split():
                    texts.append(self._inside(ours, tag, attribute, wanted))
        return texts

    def _of_geom(self, target: FileTarget, geom: int, arrays: set[str]) -> list[AttributeText]:
        """Return the attributes of a collision shape."""
        unknown = arrays - {*_SHAPE}
        if unknown:
            raise NotWrittenError(f"a URDF has no {min(unknown).partition('_')[2]} of a shape")
        body = int(self._raw.geom_bodyid[geom])
        link = self._named("link", self._raw.body(body).name)
        if any(self._child(each, "collision") for each in self._fused_into(link)):
            raise NotWrittenError("links behind fixed joints have shapes that are a part of it")
        geoms = [k for k in range(self._raw.ngeom) if self._raw.geom_bodyid[k] == body]
        shapes = [each for each in self._children(link) if each.tag == "collision"]
        if len(shapes) != len(geoms):
            raise NotWrittenError("the link has shapes that are only drawn")
        shape = shapes[geoms.index(geom)]
        place = target.value("geom_pos", geom), matrix_from_quat(target.value("geom_quat", geom))
        texts = self._origin(shape, target, ("geom_pos", "geom_quat"), geom, place)
        if target.is_changed("geom_type", geom):
            raise NotWrittenError("another kind of shape is another element in a URDF")
        if target.is_changed("geom_size", geom):
            texts += self._sized(shape, target.value("geom_size", geom))
        return texts

    def _sized(self, shape: XmlElement, size: Array) -> list[AttributeText]:
        """Return the attributes of the size of a shape: (3,) [m], as the engine has it."""
        geometry = self._child(shape, "geometry")
        solid = next(iter(self._children(geometry)), None) if geometry else None
        if solid is None:
            raise NotWrittenError("the shape has no geometry")
        match solid.tag:
            case "box":
                return [AttributeText(solid, "size", numbers_text(2.0 * size))]
            case "sphere":
                return [AttributeText(solid, "radius", number_text(float(size[0])))]
            case "cylinder" | "capsule":
                return [
                    AttributeText(solid, "radius", number_text(float(size[0]))),
                    AttributeText(solid, "length", number_text(2.0 * float(size[1]))),
                ]
        raise NotWrittenError(f"the size of a {solid.tag} stands in its file")

    def _named(self, tag: str, name: str) -> XmlElement:
        """Return a link or a joint.

        Raises:
            NotWrittenError: The file has none of that name.
        """
        for element in self._children(self._source.root):
            if element.tag == tag and element.name == name and name:
                return element
        raise NotWrittenError(f"the file has no {tag} {name}")

    def _joint_above(self, link: XmlElement) -> XmlElement | None:
        """Return the joint that a link hangs on."""
        for joint in self._children(self._source.root):
            if joint.tag == "joint" and self._inner(joint, "child", "link") == link.name:
                return joint
        return None

    def _fused_into(self, link: XmlElement) -> list[XmlElement]:
        """Return the links behind fixed joints, which are compiled as a part of a link."""
        fused: list[XmlElement] = []
        for joint in self._children(self._source.root):
            is_fixed = joint.tag == "joint" and joint.attributes.get("type") == "fixed"
            if is_fixed and self._inner(joint, "parent", "link") == link.name:
                child = self._named("link", self._inner(joint, "child", "link"))
                fused += [child, *self._fused_into(child)]
        return fused

    def _children(self, element: XmlElement, source: XmlSource | None = None) -> list[XmlElement]:
        return [*(source if source else self._source).children(element)]

    def _child(
        self, element: XmlElement, tag: str, source: XmlSource | None = None
    ) -> XmlElement | None:
        """Return the first element of a kind right inside another; None without one."""
        return next((e for e in self._children(element, source) if e.tag == tag), None)

    def _inner(self, element: XmlElement, tag: str, attribute: str) -> str:
        """Return an attribute of an element right inside another; "" without one."""
        inner = self._child(element, tag)
        return inner.attributes.get(attribute, "") if inner else ""

    def _inside(self, element: XmlElement, tag: str, attribute: str, text: str) -> AttributeText:
        """Return an attribute of an element right inside another, which may be a new one."""
        inner = self._child(element, tag)
        if inner is None:
            return AttributeText(element, attribute, text, child=(tag,))
        return AttributeText(inner, attribute, text)


def _matrix(text: str) -> Array:
    """Return the rotation (3, 3) of roll, pitch and yaw as a file has them; "" is none."""
    if not text:
        return _AXES
    roll, pitch, yaw = (float(word) for word in text.split())
    return rotation(_AXES[2], yaw) @ rotation(_AXES[1], pitch) @ rotation(_AXES[0], roll)


def _roll_pitch_yaw(matrix: Array) -> list[float]:
    """Return the angles [rad] of a rotation (3, 3), about axes that stay.

    Raises:
        NotWrittenError: Roll and yaw turn about one axis.
    """
    cosine = math.hypot(matrix[0, 0], matrix[1, 0])
    if cosine < _LOCKED:
        raise NotWrittenError("its pitch is 90°, at which roll and yaw are not known apart")
    roll = math.atan2(matrix[2, 1], matrix[2, 2])
    pitch = math.atan2(-matrix[2, 0], cosine)
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    return [roll, pitch, yaw]
