"""Differences of two compiled models as attributes of the second one's MJCF.

Every number is written in full and in the unit of the file. What a class of defaults says is never
changed: the element gets an attribute of its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..description.file_form import FileForm, NotWrittenError
from ..description.file_numbers import number_text, numbers_text
from ..description.xml_source import AttributeText, XmlElement, XmlSource
from ..records import Edit, SpecEdit
from . import compared_fields as fields
from ._file_target import FileTarget
from ._mjcf_elements import MjcfElements
from ._mjcf_weights import MjcfWeights
from ._mjcf_writer import ElementWriter
from ._orientation import CompilerSettings
from ._quantities import word_in

_KINDS = {"jnt": "joint", "dof": "joint", "qpos": "joint", "eq": "equality"}
_GAINS = ("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm")
_WEIGHTS = ("body_mass", "body_ipos", "body_iquat", "body_inertia")
_SHAPE = ("geom_size", "geom_type", "geom_pos", "geom_quat")
_DERIVED = ("geom_rbound", "geom_aabb", "geom_fluid")  # they follow from the shape
# One for each output of an actuator, of which that of a ball joint has three.
_OF_OUTPUTS = {"actuator_gear", "actuator_lengthrange"}
_OPTION_WORDS = {
    **{"euler": "Euler", "rk4": "RK4", "pgs": "PGS", "cg": "CG", "newton": "Newton"},
}


class MjcfForm(FileForm):
    """Writes what the compiled model of a file is to have as attributes of the file.

    Args:
        source: The file.
        raw: Its mjModel.
        settings: Those of its compiler.
        weights: What its geoms weigh, and those of the other side; None where the other side is no
            MJCF.
    """

    def __init__(
        self, source: XmlSource, raw: Any, settings: CompilerSettings, weights: MjcfWeights | None
    ) -> None:
        self._source, self._raw, self._settings = source, raw, settings
        self._weights = weights
        self._elements = MjcfElements(source, raw)

    def texts(
        self, edits: Iterable[Edit], spec_edits: Iterable[SpecEdit] = ()
    ) -> list[AttributeText]:
        """Return the attributes that undo one difference.

        Raises:
            NotWrittenError: No attribute does.
        """
        target = FileTarget(self._raw, edits, spec_edits)
        texts: list[AttributeText] = []
        for (kind, number), names in target.elements().items():
            if names & _OF_OUTPUTS and self._has_several_outputs:
                raise NotWrittenError("an actuator of the file has several outputs, each its own")
            if kind == "opt":
                texts += option_texts(self._source, target, names, self._source.root)
                continue
            element = self._elements.find(_KINDS.get(kind, kind), self._number(kind, number))
            texts += self._of_element(target, kind, number, element, names)
        return texts

    @property
    def _has_several_outputs(self) -> bool:
        """Tell whether an actuator has more than one output."""
        return bool(np.any(self._raw.actuator_outnum > 1))

    def _number(self, kind: str, number: int) -> int:
        """Return the id of an element; of a degree of freedom that of its joint."""
        if kind == "qpos":
            return int(np.flatnonzero(self._raw.jnt_qposadr <= number)[-1])
        return int(self._raw.dof_jntid[number]) if kind == "dof" else number

    def _of_element(
        self, target: FileTarget, kind: str, number: int, element: XmlElement, names: set[str]
    ) -> list[AttributeText]:
        """Return the attributes of one element, with the arrays that are changed."""
        writer = ElementWriter(self._settings, target, number, element)
        rest = {name for name in names if target.is_changed(name, number)} - {*_DERIVED}
        if kind == "body" and rest & {*_WEIGHTS}:
            self._weigh(writer, number, element, rest & {*_WEIGHTS})
            rest -= {*_WEIGHTS}
        if kind == "actuator" and rest & {*_GAINS}:
            rest -= {*_GAINS}
            writer.gains()
        if kind == "geom" and rest & {*_SHAPE}:
            writer.shape(self._raw, rest)
            rest -= {*_SHAPE}
        for array in sorted(rest):
            writer.write(array, self._raw)
        return writer.texts

    def _weigh(
        self,
        writer: ElementWriter,
        body: int,
        element: XmlElement,
        names: set[str],
    ) -> None:
        """Write what a body weighs: its inertial, the weights of its geoms, or a new inertial."""
        if self._settings.total_mass:
            raise NotWrittenError("settotalmass of the file scales all masses")
        inertial = self._elements.inertial_of(element)
        if inertial is not None and not self._settings.inertia_from_geoms:
            writer.inertial(inertial, names)
            return
        geoms = [k for k in range(self._raw.ngeom) if self._raw.geom_bodyid[k] == body]
        if self._weights is not None:
            change = self._weights.of_body(body, geoms)
            for geom, (attribute, value) in change.values.items():
                place = self._elements.find("geom", geom)
                writer.texts.append(AttributeText(place, attribute, number_text(value)))
            if change.values or change.follows_from_shapes:
                return
        if self._settings.inertia_from_geoms:
            raise NotWrittenError("the file computes every inertia from geoms (inertiafromgeom)")
        writer.new_inertial()


def option_texts(
    source: XmlSource,
    target: FileTarget,
    arrays: set[str],
    root: XmlElement,
    around: tuple[str, ...] = (),
) -> list[AttributeText]:
    """Return attributes of `<option>` and its `<flag>`.

    Args:
        source: The file.
        target: What the model is to have.
        arrays: The options that are changed.
        root: The element that a new one is put into.
        around: Tags between that and a new `<option>`.
    """
    options = _Options(source, root, around)
    texts: list[AttributeText] = []
    for array in sorted(arrays):
        option = array.removeprefix("opt.")
        if option in fields.FLAGS:
            for word, text in target.flags(option).items():
                texts.append(options.text(("option", "flag"), word, text))
        elif option == "disableactuator":
            groups = int(target.value(array, ()))
            numbers = [str(k) for k in range(32) if groups >> k & 1]
            texts.append(options.text(("option",), "actuatorgroupdisable", " ".join(numbers)))
        else:
            texts.append(options.text(("option",), option, _option_text(target, option)))
    return texts


@dataclass(frozen=True)
class _Options:
    """Where the options of a file stand.

    Attributes:
        source: The file.
        root: The element that a new one is put into.
        around: Tags between that and a new `<option>`.
    """

    source: XmlSource
    root: XmlElement
    around: tuple[str, ...]

    def text(self, tags: tuple[str, ...], attribute: str, text: str) -> AttributeText:
        """Return an attribute of a setting, of which a later element of the file wins."""
        elements = [each for each in self.source.elements if each.tag == tags[-1]]
        having = [each for each in elements if attribute in each.attributes]
        if having:
            return AttributeText(having[-1], attribute, text)
        if elements:
            return AttributeText(elements[-1], attribute, text)
        return AttributeText(self.root, attribute, text, child=(*self.around, *tags))


def _option_text(target: FileTarget, option: str) -> str:
    """Return the text of an option of the engine."""
    value = target.value(f"opt.{option}", ())
    if option in fields.OPTION_CHOICES:
        word = word_in(fields.OPTION_CHOICES[option], int(value))
        return _OPTION_WORDS.get(word, word)
    return numbers_text(np.atleast_1d(value))
