"""A model compiled anew from its file with some elements set otherwise, by MjSpec.

Some differences cannot be undone in a compiled model, whose arrays have the size that the compiler
gave them: whether an actuator has a state of its own, how many commands it keeps, what it drives.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...backends.binary import is_binary
from ...backends.compiled.model import ENGINE_ERRORS, compiler_warnings, read_spec, reason_of
from ...errors import ModelError
from ...interface import Array
from ..records import Edit, ElementReference, SpecEdit
from . import compared_fields as fields

ACTIVATIONS = "activations"
SIMPLE = "simple"  # of a body: whether its mass matrix may be stored as a diagonal
# The lists of an MjSpec by the kind of their elements.
_LISTS = {
    **{"actuator": "actuators", "body": "bodies", "joint": "joints", "site": "sites"},
    **{"tendon": "tendons", "geom": "geoms"},
}
# Counts that no edit here changes: a model that has others was not made of this file alone.
_COUNTS = ("nq", "nv", "nu", "nbody", "njnt", "ngeom", "nsite", "ntendon", "nactuator", "neq")


def can_be_respecified(path: Path) -> bool:
    """Tell whether a file has a description that can be compiled anew; a binary one has none."""
    return not is_binary(path)


def respecified(path: Path, raw: Any, edits: Sequence[SpecEdit]) -> Any:
    """Return the compiled model of a file with some elements set otherwise.

    Args:
        path: The file.
        raw: The mjModel that was made of it, with options that were set since then, which the
            result has, too.
        edits: What is set.

    Raises:
        ModelError: The file cannot be compiled so; `raw` was not made of it alone; or the compiler
            makes something else of what was set.
    """
    try:
        with compiler_warnings():
            spec = read_spec(path)
            before = spec.compile()
            _check_counts(path, before, raw)
            for body in {edit.element for edit in edits if edit.kind == "body"}:
                _give_inertial(_element(spec, "body", body), before)
            for edit in edits:
                _set(spec, edit)
            for key in spec.keys:  # act may have another size now; it is written below
                key.act = []
            after = spec.compile()
    except (ValueError, *ENGINE_ERRORS) as error:
        raise ModelError(f"{path.name} cannot be compiled anew: {reason_of(error)}") from error
    _check_what_was_set(path, after, edits)
    _carry_over(before, raw, after)
    _write_activations(raw, after, edits)
    return _with_room(raw, after)


def _check_counts(path: Path, compiled: Any, raw: Any) -> None:
    """Raise ModelError if a model was not made of a file alone."""
    for count in _COUNTS:
        if getattr(compiled, count) != getattr(raw, count):
            raise ModelError(
                f"{path.name} cannot be compiled anew: its {count} is {getattr(compiled, count)}, "
                f"and that of the model is {getattr(raw, count)}"
            )


def _element(spec: Any, kind: str, number: int) -> Any:
    """Return an element of a description that was compiled, by its id."""
    for element in getattr(spec, _LISTS[kind]):
        if element.id == number:
            return element
    raise ModelError(f"the file has no {kind} with the number {number}")


def _set(spec: Any, edit: SpecEdit) -> None:
    """Set what an edit says."""
    if edit.attribute == ACTIVATIONS:
        return
    element = _element(spec, edit.kind, edit.element)
    if isinstance(edit.value, ElementReference):
        setattr(element, edit.attribute, _name_in(spec, edit.value))
        return
    now = getattr(element, edit.attribute)
    enumeration = type(now)
    if hasattr(enumeration, "__members__"):
        setattr(element, edit.attribute, enumeration(int(edit.value)))  # type: ignore[arg-type]
    else:
        setattr(element, edit.attribute, edit.value)


def _give_inertial(body: Any, compiled: Any) -> None:
    """Give a body in a description the inertial that it has when it is compiled.

    What was to be computed of its geoms is said, so that a part of it can be set.
    """
    body.explicitinertial = True
    body.mass = float(compiled.body_mass[body.id])
    body.ipos, body.iquat = compiled.body_ipos[body.id], compiled.body_iquat[body.id]
    body.inertia = compiled.body_inertia[body.id]
    body.ialt.type = type(body.ialt.type)(0)  # a quaternion
    body.fullinertia = [np.nan] * 6


def _name_in(spec: Any, reference: ElementReference) -> str:
    """Return the name of an element; one that has none is given one, which acts on nothing."""
    element = _element(spec, reference.kind, reference.element)
    if not element.name:
        element.name = f"{reference.kind} number {reference.element}"
    return element.name


def _check_what_was_set(path: Path, after: Any, edits: Sequence[SpecEdit]) -> None:
    """Raise ModelError where the compiler made something else of what was set."""
    for edit in edits:
        array = getattr(after, f"{edit.kind}_{edit.attribute}", None)
        if array is None or isinstance(edit.value, ElementReference):
            continue
        if edit.attribute == SIMPLE:  # compiled it is how many degrees of freedom are, and which
            continue
        if not np.allclose(array[edit.element], edit.value, rtol=1e-9, atol=1e-15):
            raise ModelError(
                f"{path.name} cannot be given another {edit.attribute} of {edit.kind} "
                f"{edit.element}: MuJoCo's compiler makes {array[edit.element]} of {edit.value}"
            )


def _carry_over(before: Any, raw: Any, after: Any) -> None:
    """Write what was set in a compiled model since it was compiled into another one.

    Args:
        before: The model as its file has it.
        raw: The same, with what was set.
        after: The other, which is changed.
    """
    for name in dir(after):
        if name.startswith("_") or fields.known(name) in ("derived", "whole", ""):
            continue
        arrays = [getattr(model, name) for model in (before, raw, after)]
        if not isinstance(arrays[0], np.ndarray) or len({array.shape for array in arrays}) > 1:
            continue
        was_set = np.asarray(arrays[0] != arrays[1])
        if was_set.any():
            arrays[2][was_set] = arrays[1][was_set]
    for name in dir(after.opt):
        if name.startswith("_"):
            continue
        value = getattr(raw.opt, name)
        if not np.array_equal(getattr(before.opt, name), value):
            if np.ndim(value):
                getattr(after.opt, name)[:] = value
            else:
                setattr(after.opt, name, value)


def _write_activations(raw: Any, after: Any, edits: Iterable[SpecEdit]) -> None:
    """Write act of all keyframes: as it was, or as an edit says."""
    for actuator in range(after.nactuator):
        number, start = int(after.actuator_actnum[actuator]), int(after.actuator_actadr[actuator])
        if number and number == raw.actuator_actnum[actuator]:
            place = int(raw.actuator_actadr[actuator])
            now = raw.key_act[:, place : place + number]
            after.key_act[:, start : start + number] = now
    for edit in edits:
        if edit.attribute == ACTIVATIONS:
            number = int(after.actuator_actnum[edit.element])
            start = int(after.actuator_actadr[edit.element])
            values: Array = np.reshape(np.array(edit.value, float), (after.nkey, number))
            after.key_act[:, start : start + number] = values


def _with_room(raw: Any, after: Any) -> Any:
    """Return a model that keeps as many commands of each actuator as another one does."""
    from ...backends.delays import with_room

    if not raw.actuator_delay.any():
        return after
    return with_room(after, np.maximum(raw.actuator_history[:, 0], after.actuator_history[:, 0]))


def in_places_of(before: Any, after: Any, edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """Return edits of a compiled model as those of one whose activations stand elsewhere.

    Args:
        before: The mjModel that they are of.
        after: The same model, of which some actuators have another number of activations.
        edits: The edits; those of activations that are not there any more are left out.
    """
    moved: list[Edit] = []
    owners = np.repeat(np.arange(before.nactuator), before.actuator_actnum)
    for name, index, value in edits:
        if name != "key_act" or len(index) < 2 or isinstance(index[1], slice):
            moved.append((name, index, value))
            continue
        actuator = int(owners[index[1]])
        offset = index[1] - int(before.actuator_actadr[actuator])
        if offset < after.actuator_actnum[actuator]:
            place = int(after.actuator_actadr[actuator]) + offset
            moved.append((name, (index[0], place), value))
    return tuple(moved)
