"""The attributes of one element of an MJCF, from what its compiled model is to have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...interface import Array
from ...rotations import matrix_from_quat, times
from ..description.file_form import NotWrittenError
from ..description.file_numbers import beginning_text, degrees_of, number_text, numbers_text, tidied
from ..description.xml_source import AttributeText, XmlElement
from ..records import ElementReference
from . import compared_fields as fields
from ._file_target import FileTarget
from ._orientation import CompilerSettings, orientation_texts
from ._quantities import word_in

# Attributes of an MJCF by the array of the compiled model, where they are called otherwise.
_NAMES = {
    **{"jnt_solref": "solreflimit", "jnt_solimp": "solimplimit"},
    **{"jnt_actgravcomp": "actuatorgravcomp", "dof_solref": "solreffriction"},
    **{"dof_solimp": "solimpfriction", "tendon_solref_lim": "solreflimit"},
    **{"tendon_solimp_lim": "solimplimit", "tendon_solref_fri": "solreffriction"},
    **{"tendon_solimp_fri": "solimpfriction", "eq_active0": "active", "pair_dim": "condim"},
    **{"key_mpos": "mpos", "key_mquat": "mquat", "tendon_lengthspring": "springlength"},
}
# Ranges by their array: the attribute, and the one that says whether it counts.
_RANGES = {
    "jnt_range": ("range", "limited"),
    "jnt_actfrcrange": ("actuatorfrcrange", "actuatorfrclimited"),
    "actuator_ctrlrange": ("ctrlrange", "ctrllimited"),
    "actuator_forcerange": ("forcerange", "forcelimited"),
    "actuator_actrange": ("actrange", "actlimited"),
    "tendon_range": ("range", "limited"),
    "tendon_actfrcrange": ("actuatorfrcrange", "actuatorfrclimited"),
}
_OF_A_RANGE = {flag: array for array, flag in fields.LIMITED.items()}
# Arrays whose first number and polynomial stand in one attribute.
_POLYNOMIALS = {
    f"{kind}_{word}poly": f"{kind}_{word}"
    for kind in ("jnt", "dof", "tendon", "actuator")
    for word in ("stiffness", "damping")
}
# How many numbers of its size a geom has, by its type in words.
_SIZES = {"plane": 3, "sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
_HINGE, _SLIDE = 3, 2
_POLYNOMIAL = 5  # numbers of the polynomial by which one coordinate follows another


class ElementWriter:
    """Writes the attributes of one element.

    Attributes:
        texts: What was written.
    """

    def __init__(
        self,
        settings: CompilerSettings,
        target: FileTarget,
        number: int,
        element: XmlElement,
    ) -> None:
        self._settings, self._target = settings, target
        self._number, self._element = number, element
        self.texts: list[AttributeText] = []

    def write(self, array: str, raw: Any) -> None:
        """Write one array of the element."""
        if array in _POLYNOMIALS:
            array = _POLYNOMIALS[array]
        array = _OF_A_RANGE.get(array, array)
        special: dict[str, Callable[[Any], None]] = {
            "qpos_spring": self._reference_of_spring,
            "qpos0": self._reference,
            "body_pos": self._place_of_body,
            "body_quat": self._place_of_body,
            "site_pos": self._place_of_site,
            "site_quat": self._place_of_site,
            "actuator_dynprm": self._dynamics,
            "actuator_dyntype": self._dynamics,
            "actuator_target": self._drives,
            "wrap_prm": self._entry_of_tendon,
            "eq_data": self._parameters_of_equality,
        }
        if array in special:
            special[array](raw)
        elif array in _RANGES:
            self._range(array, raw)
        elif array in _POLYNOMIALS.values():
            self._with_polynomial(array)
        elif array in ("jnt_pos", "jnt_axis"):
            self._refuse_frames()
            self._set(array.partition("_")[2], numbers_text(self._value(array)))
        else:
            self._plain(array)

    def _entry_of_tendon(self, _raw: Any) -> None:
        """Write the coefficient of a joint in a tendon, or the divisor of a pulley."""
        attribute = "divisor" if self._element.tag == "pulley" else "coef"
        self._set(attribute, numbers_text(self._value("wrap_prm")))

    def _parameters_of_equality(self, _raw: Any) -> None:
        """Write the polynomial of a coupling, or the place of a connection in its first body.

        Where the second body of a connection has it follows from that.
        """
        match self._element.tag:
            case "joint" | "tendon":
                self._set("polycoef", numbers_text(self._value("eq_data")[:_POLYNOMIAL]))
            case "connect" if "anchor" in self._element.attributes:
                self._set("anchor", numbers_text(self._value("eq_data")[:3]))
            case tag:
                raise NotWrittenError(f"no attribute of a <{tag}> is what differs of it")

    def _set(self, attribute: str, text: str | None) -> None:
        """Write an attribute, if it is not so already."""
        if self._element.tag == "freejoint":
            raise NotWrittenError("a <freejoint> has no such attribute: write it as a <joint>")
        if text is None and attribute not in self._element.attributes:
            return
        if not any(each.attribute == attribute for each in self.texts):
            self.texts.append(AttributeText(self._element, attribute, text))

    def _value(self, array: str) -> Array:
        return np.atleast_1d(self._target.value(array, self._number))

    def _plain(self, array: str) -> None:
        """Write an array as it is compiled."""
        _, _, word = array.partition("_")
        attribute = _NAMES.get(array, word)
        value, before = self._value(array), np.atleast_1d(self._target.before(array, self._number))
        if not attribute or array.startswith("actuator_trn"):
            raise NotWrittenError(f"no attribute of the file is {array} of a compiled model")
        if array in fields.FLAGS_OF_ELEMENTS:
            self._set(attribute, "true" if value[0] else "false")
        elif value.dtype.kind in "iub" and len(value) == 1:
            self._set(attribute, str(int(value[0])))
        elif fields.is_beginning(array):
            text = self._element.attributes.get(attribute, "")
            self._set(attribute, beginning_text(value.tolist(), before.tolist(), text))
        else:
            self._set(attribute, numbers_text(value))

    def _range(self, array: str, raw: Any) -> None:
        """Write a range, and whether it counts."""
        attribute, flag = _RANGES[array]
        limited = bool(self._target.value(fields.LIMITED[array], self._number))
        was_limited = bool(self._target.before(fields.LIMITED[array], self._number))
        if limited:
            values = self._value(array).tolist()
            is_angle = array == "jnt_range" and raw.jnt_type[self._number] != _SLIDE
            if is_angle and self._settings.degrees:
                values = [degrees_of(value) for value in values]
            self._set(attribute, numbers_text(values))
        if limited != was_limited:
            self._set(flag, "true" if limited else "false")

    def _with_polynomial(self, array: str) -> None:
        """Write a stiffness or a damping, with the numbers of its polynomial if there are any."""
        first, rest = self._value(array), self._value(f"{array}poly")
        values = first.tolist()
        text = self._element.attributes.get(array.partition("_")[2], "")
        if rest.any() or len(text.split()) > 1:
            values += rest.tolist()
        self._set("springdamper", None)
        self._set(array.partition("_")[2], numbers_text(values))

    def _reference_of_spring(self, raw: Any) -> None:
        """Write where the spring of a joint is at rest."""
        self._position("qpos_spring", "springref", raw)

    def _reference(self, raw: Any) -> None:
        """Write what the coordinate of a joint is where the model is as it is drawn."""
        self._position("qpos0", "ref", raw)

    def _position(self, array: str, attribute: str, raw: Any) -> None:
        """Write a coordinate of a joint."""
        kind = raw.jnt_type[self._target.joint_of_qpos(self._number)]
        value = float(self._value(array)[0])
        if kind == _HINGE and self._settings.degrees:
            value = degrees_of(value)
        elif kind not in (_HINGE, _SLIDE):
            raise NotWrittenError(f"only a hinge and a slide have a {attribute}")
        self._set(attribute, number_text(value))

    def _refuse_frames(self) -> None:
        """Raise NotWrittenError where the place of an element is counted from a `<frame>`."""
        if any(each.tag == "frame" for each in self._element.around):
            raise NotWrittenError("it is in a <frame>, from which its place is counted")

    def _place_of_body(self, raw: Any) -> None:
        self._place("body_pos", "body_quat")

    def _place_of_site(self, raw: Any) -> None:
        if "fromto" in self._element.attributes:
            raise NotWrittenError("its place is given by the ends of the site (fromto)")
        self._place("site_pos", "site_quat")

    def _place(self, position: str, turn: str) -> None:
        """Write where an element is, and how it is turned, as far as that is changed."""
        self._refuse_frames()
        if self._target.is_changed(position, self._number):
            self._set("pos", numbers_text(self._value(position)))
        if self._target.is_changed(turn, self._number):
            self._turn(self._element, self._value(turn))

    def _turn(self, element: XmlElement, quaternion: Array) -> None:
        """Write an orientation as the element has it, else as a quaternion."""
        for attribute, text in orientation_texts(element, quaternion, self._settings).items():
            if text is not None or attribute in element.attributes:
                self.texts.append(AttributeText(element, attribute, text))

    def shape(self, raw: Any, names: set[str]) -> None:
        """Write type, size and place of a geom.

        Raises:
            NotWrittenError: Its shape stands in its asset.
        """
        kind = word_in("mjtGeom", int(self._target.value("geom_type", self._number)))
        position, turn = self._value("geom_pos"), self._value("geom_quat")
        if self._target.is_changed("geom_type", self._number):
            self._set("type", kind)
        if kind == "mesh" or kind not in _SIZES:
            if names & {"geom_size", "geom_type"}:
                raise NotWrittenError(f"the shape of a {kind} stands in its asset")
            position, turn = _before_mesh(raw, self._number, position, turn)
        is_moved = self._target.is_changed("geom_pos", self._number)
        is_turned = self._target.is_changed("geom_quat", self._number)
        is_sized = self._target.is_changed("geom_size", self._number)
        if is_moved or is_turned:
            self._refuse_frames()
        size = self._value("geom_size")
        if "fromto" in self._element.attributes:
            self._ends(kind, size, position, turn)
            return
        if is_sized or self._target.is_changed("geom_type", self._number):
            self._set("size", numbers_text(size[: _SIZES[kind]]))
        if is_moved or (is_turned and kind == "mesh"):
            self._set("pos", numbers_text(position))
        if is_turned:
            self._turn(self._element, turn)

    def _ends(self, kind: str, size: Array, position: Array, turn: Array) -> None:
        """Write a geom that is given by its two ends."""
        if kind not in ("capsule", "cylinder"):
            raise NotWrittenError("it is given by its two ends (fromto), and is to be no capsule")
        half = float(size[1]) * matrix_from_quat(turn)[:, 2]
        self._set("size", number_text(float(size[0])))
        ends = [*(position + half), *(position - half)]
        self._set("fromto", numbers_text(tidied(ends)))

    def inertial(self, inertial: XmlElement, names: set[str]) -> None:
        """Write what a body weighs into its `<inertial>`."""
        if "body_mass" in names:
            mass = float(self._value("body_mass")[0])
            self.texts.append(AttributeText(inertial, "mass", number_text(mass)))
        if "body_ipos" in names:
            centre = numbers_text(self._value("body_ipos"))
            self.texts.append(AttributeText(inertial, "pos", centre))
        if not names & {"body_inertia", "body_iquat"}:
            return
        moments, turn = self._value("body_inertia"), self._value("body_iquat")
        if "fullinertia" in inertial.attributes:
            axes = matrix_from_quat(turn)
            tensor = axes @ np.diag(moments) @ axes.T
            entries = [tensor[j, k] for j, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
            self.texts.append(AttributeText(inertial, "fullinertia", numbers_text(tidied(entries))))
            return
        self.texts.append(AttributeText(inertial, "diaginertia", numbers_text(moments)))
        if self._target.is_changed("body_iquat", self._number):
            self._turn(inertial, turn)

    def new_inertial(self) -> None:
        """Write an `<inertial>` into a body whose inertia was computed from its geoms."""
        values = {
            "pos": self._value("body_ipos"),
            "quat": self._value("body_iquat"),
            "mass": self._value("body_mass"),
            "diaginertia": self._value("body_inertia"),
        }
        for attribute, numbers in values.items():
            text = numbers_text(numbers)
            self.texts.append(AttributeText(self._element, attribute, text, child=("inertial",)))

    def gains(self) -> None:
        """Write the gains of an actuator in the words of its shortcut.

        Raises:
            NotWrittenError: An actuator of that shortcut cannot have these gains.
        """
        gain, bias = self._value("actuator_gainprm"), self._value("actuator_biasprm")
        words = [
            word_in(enumeration, int(self._value(array)[0]))
            for array, enumeration in (
                ("actuator_gaintype", "mjtGain"),
                ("actuator_biastype", "mjtBias"),
            )
        ]
        tag = self._element.tag
        if tag == "general":
            self._of_a_general(words, gain, bias)
        elif tag == "position" and _is_position(words, gain, bias):
            self._gain("kp", float(gain[0]), "gainprm")
            if bias[2] != self._target.before("actuator_biasprm", self._number)[2]:
                self._set("dampratio", None)
                self._set("kv", number_text(-float(bias[2])))
        elif tag == "velocity" and _is_velocity(words, gain, bias):
            self._gain("kv", float(gain[0]), "gainprm")
        else:
            raise NotWrittenError(f"a <{tag}> cannot have these gains")

    def _gain(self, attribute: str, value: float, array: str) -> None:
        if value != self._target.before(f"actuator_{array}", self._number)[0]:
            self._set(attribute, number_text(value))

    def _of_a_general(self, words: Sequence[str], gain: Array, bias: Array) -> None:
        """Write the gains of a `<general>`."""
        for attribute, word in zip(("gaintype", "biastype"), words, strict=True):
            if self._target.is_changed(f"actuator_{attribute}", self._number):
                self._set(attribute, word)
        for attribute, values in (("gainprm", gain), ("biasprm", bias)):
            array = f"actuator_{attribute}"
            if self._target.is_changed(array, self._number):
                before = self._target.before(array, self._number)
                text = self._element.attributes.get(attribute, "")
                self._set(attribute, beginning_text(values.tolist(), before.tolist(), text))

    def _dynamics(self, raw: Any) -> None:
        """Write the dynamics of an actuator's activation."""
        kind = word_in("mjtDyn", int(self._target.value("actuator_dyntype", self._number)))
        values = self._value("actuator_dynprm")
        tag = self._element.tag
        if tag == "general":
            if self._target.is_changed("actuator_dyntype", self._number):
                self._set("dyntype", kind)
            before = self._target.before("actuator_dynprm", self._number)
            text = self._element.attributes.get("dynprm", "")
            self._set("dynprm", beginning_text(values.tolist(), before.tolist(), text))
        elif tag == "position" and kind in ("none", "filterexact"):
            self._filter(kind, float(values[0]))
        elif tag == "cylinder" and kind == "filter":
            self._set("timeconst", number_text(float(values[0])))
        else:
            raise NotWrittenError(f"a <{tag}> cannot have these dynamics")

    def _filter(self, kind: str, constant: float) -> None:
        """Write the filter of a position servo, or take it away."""
        if kind != "none":
            self._set("timeconst", number_text(constant))
        elif "timeconst" in self._element.attributes:
            self._set("timeconst", None)
        else:  # its class of defaults has one
            self._set("timeconst", "0")

    def _drives(self, raw: Any) -> None:
        """Write what an actuator drives."""
        reference = self._target.references.get(("actuator_target", self._number))
        if not isinstance(reference, ElementReference) or reference.kind not in ("joint", "tendon"):
            raise NotWrittenError("it drives another thing, in another way")
        name = getattr(raw, reference.kind)(reference.element).name
        if not name or reference.kind not in self._element.attributes:
            raise NotWrittenError("what it is to drive has no name, or is of another kind")
        self._set(reference.kind, name)


def _is_position(words: Sequence[str], gain: Array, bias: Array) -> bool:
    """Tell whether gains are those of a position servo."""
    return (
        list(words) == ["fixed", "affine"]
        and not gain[1:].any()
        and bias[0] == 0
        and bias[1] == -gain[0]
        and not bias[3:].any()
    )


def _is_velocity(words: Sequence[str], gain: Array, bias: Array) -> bool:
    """Tell whether gains are those of a velocity servo."""
    return (
        list(words) == ["fixed", "affine"]
        and not gain[1:].any()
        and not bias[:2].any()
        and bias[2] == -gain[0]
    )


def _before_mesh(raw: Any, geom: int, position: Array, turn: Array) -> tuple[Array, Array]:
    """Return the place of a geom before the compiler moved it to the frame of its mesh."""
    mesh = int(raw.geom_dataid[geom])
    if mesh < 0:
        return position, turn
    back = raw.mesh_quat[mesh] * [1.0, -1.0, -1.0, -1.0]
    own_turn = times(turn, back)
    return position - matrix_from_quat(own_turn) @ raw.mesh_pos[mesh], own_turn
