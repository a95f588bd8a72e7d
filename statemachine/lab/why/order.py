"""The right as a function of the user's sees it once it has the order of the left.

Who reads qpos or writes ctrl by number meets other elements where a file has them in another order,
or has one more among them. To make that the same the function is given a model in the order of the
left, with the values of the right, and a Data of it that shows what the right does. So a function
that finds its joints by name finds them in both.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...backends import on_default
from ...engines import raw_engine_of
from ...engines.records import BodyPair, Counterparts, Pairs
from ...installed import DEFAULT
from ...interface import Array, Data, Model
from ...rotations import HERE, Placement
from ..compare.matching import Matched
from ..runs.scenarios import Controller


def slots_of_ctrl(matched: Matched, *, ordered: bool, completed: bool) -> list[tuple[int, int]]:
    """Return which number of a list of commands is for which number of the right's ctrl.

    Args:
        matched: What of the left is what of the right.
        ordered: Whether the actuators that both have are in the order of the left.
        completed: Whether the list has the places of the left, with those of actuators that the
            right has not; else those of the right.
    """
    right_slots = [b for _, b in sorted(matched.actuators)]
    if completed:
        places = sorted(a for a, _ in matched.actuators)
        unmatched: list[tuple[int, int]] = []
    else:
        places = sorted(right_slots)
        unmatched = [(b, b) for b in range(matched.right.nu) if b not in places]
    common = zip(places, right_slots if ordered else sorted(right_slots), strict=True)
    return sorted([*common, *unmatched])


def in_order_of_left(left: Model, right: Model, matched: Matched) -> Model:
    """Return a model with the elements of the left, in their order, and the values of the right.

    What cannot be brought over stays as the left has it.

    Args:
        left: The Model of the left.
        right: The Model of the right, as it is run.
        matched: What of the left is what of the right.
    """
    engine = raw_engine_of(DEFAULT)
    solids = [
        BodyPair(pair.right, pair.left, _inverse(pair.align), pair.moved) for pair in matched.solids
    ]
    swapped = Counterparts(
        joints=_turned(matched.joints),
        sites=_turned(matched.sites),
        actuators=_turned(matched.actuators),
        solids=tuple(solids),
    )
    rows = [
        *engine.differences(right.compiled, left.compiled, swapped),
        *engine.readable(right.compiled, left.compiled, swapped),
    ]
    edits = [edit for row in rows if not row.refused for edit in row.edits]
    view = on_default(left).with_compiled(engine.edited(left.compiled, edits))
    if (view.timestep, view.substeps) != (right.timestep, right.substeps):
        view = view.replace(timestep=right.timestep, substeps=right.substeps)
    return view


def _inverse(align: Placement) -> Placement:
    """Return the way back; `HERE` itself is told from a placement that is only equal to it."""
    return HERE if align is HERE else align.inverse


def _turned(pairs: Pairs) -> Pairs:
    return tuple(sorted((b, a) for a, b in pairs))


def seen_in_order_of_left(
    controller_of: Callable[[Model], Controller],
    view: Model,
    matched: Matched,
    slots: list[tuple[int, int]],
    starts: tuple[Array, Array],
    *,
    mocap_in_order: bool,
) -> Controller:
    """Return a controller of the right that sees it in the order of the left.

    Args:
        controller_of: Makes the controller that reads and writes in the order of a Model.
        view: That of `in_order_of_left`.
        matched: What of the left is what of the right.
        slots: Which of its commands is for which number of the right's ctrl.
        starts: Ctrl (nu,) of the left, and of the right, which what nobody commands keeps.
        mocap_in_order: Whether mocap bodies, too, are in the order of the left.
    """
    controller = controller_of(view)
    data = raw_engine_of(DEFAULT).data_in_other_order(
        view, _elements(view, matched, mocap_in_order)
    )
    data.ctrl[:] = starts[0]

    def translate(_right: Model, source: Data) -> Array | None:
        data.show(source)
        before = np.array(data.ctrl)
        ctrl = controller(view, data)
        data.give_back()
        if ctrl is not None:
            data.ctrl[:] = np.asarray(ctrl, np.float64)
        elif np.array_equal(before, data.ctrl):  # nor did it write into data.ctrl
            return None
        return _by_number(data.ctrl, slots, starts[1])

    return translate


def sorted_by_number(
    controller: Controller, slots: list[tuple[int, int]], start: Array
) -> Controller:
    """Return a controller whose list of commands is sorted into ctrl of the right.

    Args:
        controller: Writes a list of commands.
        slots: Which of its commands is for which number of the right's ctrl.
        start: (nu,) ctrl of the right, which what nobody commands keeps.
    """

    def translate(model: Model, data: Data) -> Array | None:
        ctrl = controller(model, data)
        if ctrl is None:
            return None
        return _by_number(np.asarray(ctrl, np.float64), slots, start)

    return translate


def _by_number(values: Array, slots: list[tuple[int, int]], start: Array) -> Array:
    """Return ctrl (nu,) of the right from a list of commands (n,), which may be too short."""
    ctrl = np.array(start)
    for slot, number in slots:
        if slot < len(values):
            ctrl[number] = values[slot]
    return ctrl


def _elements(
    view: Model, matched: Matched, mocap_in_order: bool
) -> dict[str, list[tuple[int, int]]]:
    """Return pairs of ids, or of places in an array, by kind: of the left, and of the right."""
    right = matched.right
    places = matched.places
    elements = {
        kind: list(zip(*places[part], strict=True))
        for kind, part in (
            ("qpos", "qpos"),
            ("dof", "qvel"),
            ("act", "act"),
            ("mocap_pos", "mocap_pos"),
            ("mocap_quat", "mocap_quat"),
        )
    }
    elements |= {
        "joint": list(matched.joints),
        "body": list(matched.bodies),
        "site": list(matched.sites),
    }
    if not mocap_in_order:
        for part, size in (("mocap_pos", 3), ("mocap_quat", 4)):
            count = size * min(view.nmocap, right.nmocap)
            elements[part] = [(k, k) for k in range(count)]
    return elements | raw_engine_of(DEFAULT).shown_elements(view.compiled, right.compiled, matched)
