"""What a compiled model is to have in each of its arrays, by the edits of a difference."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ...installed import require
from ..description.file_form import NotWrittenError
from ..records import Edit, ElementReference, SpecEdit
from . import compared_fields as fields

# Attributes of a description that say what an actuator drives.
_DRIVES = ("trntype", "target", "slidersite", "refsite")
_SKIPPED = ("activations", "actdim")

ElementKey = tuple[str, int]  # the prefix of its arrays, and its id


class FileTarget:
    """What a compiled model is to have.

    Args:
        raw: The mjModel, as its file has it.
        edits: What is set in it.
        spec_edits: What is set in its description.
    """

    def __init__(
        self, raw: Any, edits: Iterable[Edit], spec_edits: Iterable[SpecEdit] = ()
    ) -> None:
        self._raw = raw
        self._edits: dict[tuple[str, int], list[tuple[tuple[Any, ...], Any]]] = {}
        self._options: dict[str, Any] = {}
        self._flags: dict[str, dict[int, bool]] = {}
        self.references: dict[tuple[str, int], ElementReference] = {}
        for array, index, value in edits:
            if array.startswith("opt."):
                self._add_option(array, index, value)
            else:
                key = array, _number_in(index, array)
                self._edits.setdefault(key, []).append((index[1:], value))
        for edit in spec_edits:
            self._add_spec_edit(edit)

    def _add_option(self, array: str, index: tuple[Any, ...], value: Any) -> None:
        """Add what is set in an option: a flag, all of it, or one of its numbers."""
        option = array.removeprefix("opt.")
        if option in fields.FLAGS:
            self._flags.setdefault(option, {})[int(index[0])] = bool(value)
            return
        now = self._options.get(array, np.array(getattr(self._raw.opt, option)))
        if index:
            now = np.array(now)
            now[index] = value
        else:
            now = value
        self._options[array] = now

    def _add_spec_edit(self, edit: SpecEdit) -> None:
        """Add what is set in a description."""
        if edit.attribute in _SKIPPED:
            return
        array = f"{edit.kind}_{edit.attribute}"
        if isinstance(edit.value, ElementReference):
            self.references[array, edit.element] = edit.value
            self._edits.setdefault((array, edit.element), [])
        elif edit.attribute not in _DRIVES:
            self._edits.setdefault((array, edit.element), []).append(((), edit.value))

    def elements(self) -> dict[ElementKey, set[str]]:
        """Return the arrays that are changed, by the element that they are of."""
        elements: dict[ElementKey, set[str]] = {}
        for array, number in self._edits:
            elements.setdefault((array.partition("_")[0], number), set()).add(array)
        options = {*self._options, *(f"opt.{field}" for field in self._flags)}
        if options:
            elements["opt", 0] = options
        return elements

    def before(self, array: str, number: int) -> Any:
        """Return what an element has in an array as the file has it.

        0 of what only a description has.
        """
        rows = getattr(self._raw, array, None)
        return np.array(0) if rows is None else np.array(rows[number])

    def value(self, array: str, number: int | tuple[()]) -> Any:
        """Return what an element, or an option, is to have in an array."""
        if array.startswith("opt."):
            option = array.removeprefix("opt.")
            return self._options.get(array, getattr(self._raw.opt, option))
        assert isinstance(number, int)
        now = self.before(array, number)
        for index, value in self._edits.get((array, number), ()):
            if index:
                now[index] = value
            elif np.ndim(now):
                now[: np.size(value)] = value
            else:
                now = np.array(value)
        return now

    def is_changed(self, array: str, number: int) -> bool:
        """Tell whether an element is to have something else in an array."""
        if (array, number) in self.references:
            return True
        before, value = self.before(array, number), self.value(array, number)
        return not np.array_equal(before, value)

    def joint_of_qpos(self, place: int) -> int:
        """Return the id of the joint whose coordinate stands at a place of qpos."""
        return int(np.flatnonzero(self._raw.jnt_qposadr <= place)[-1])

    def flags(self, field: str) -> dict[str, str]:
        """Return the flags that are changed, by their attribute: "enable" or "disable"."""
        mujoco = require("mujoco")
        bits = mujoco.mjtDisableBit if field == "disableflags" else mujoco.mjtEnableBit
        texts: dict[str, str] = {}
        for bit, raised in self._flags.get(field, {}).items():
            word = bits(bit).name.partition("_")[2].lower()
            enabled = raised == (field == "enableflags")
            texts[word] = "enable" if enabled else "disable"
        return texts


def _number_in(index: tuple[Any, ...], array: str) -> int:
    """Return the id of the element that an edit is of.

    Raises:
        NotWrittenError: It is of several.
    """
    if index and isinstance(index[0], int | np.integer):
        return int(index[0])
    raise NotWrittenError(f"what differs of {array} is of no single element")
