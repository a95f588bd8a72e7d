"""Whether the base of a robot floats, on each of two sides: what is told, and what is taken over.

A URDF without a joint of type floating leaves open whether its base floats. In a comparison it has
the base of the other side unless it is told one: free, and then it starts at the place of the
other's, or fixed. A file that says it, as an MJCF does, keeps its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree

import numpy as np

from ...engines import raw_engine_of
from ...interface import Array, Model, make_data, reset
from ...interface.free_base import FreeBase
from ...interface.options import OptionValue
from ...release_names import engine_of
from ...rotations import HERE, Placement, matrix_from_quat
from ..runs.floating import BaseFrame, Bases, base_of, free_joint_of_base, free_joint_of_robot
from .matching import match_trees
from .sides import Side

_SIDES: tuple[Literal["left", "right"], ...] = ("left", "right")
_SAME = 1e-12  # [m] and of a quaternion; what is nearer is one place
_ONE_FRAME = 1e-6  # [m] and [rad]: to so much files write where a frame is


@dataclass(frozen=True, eq=False)
class LoadedSides:
    """Two sides, loaded.

    Attributes:
        models: The left and the right.
        bases: Whether their bases float.
    """

    models: tuple[Model, Model]
    bases: Bases


def load_sides(
    sides: Sequence[Side],
    options: Mapping[str, OptionValue],
    names: Mapping[str, str],
) -> LoadedSides:
    """Load two sides; one whose file leaves its base open gets that of the other.

    Args:
        sides: The left and the right.
        options: Of what is run; those of a side win.
        names: Joints, bodies and sites of the left that go by other names on the right.

    Raises:
        StateMachineError: As `Side.load`.
    """
    is_open = [_leaves_base_open(side, options) for side in sides]
    inherited_by: Literal["left", "right", ""] = ""
    if is_open[0] is is_open[1]:
        left, right = (side.load(**options) for side in sides)
    else:
        open_side = is_open.index(True)
        reference = sides[1 - open_side].load(**options)
        if base_of(reference) == "free":
            inherited_by = _SIDES[open_side]
            model = _floating(sides[open_side], options, reference, names, is_left=not open_side)
        else:
            model = sides[open_side].load(**options)  # it is fixed, as of every such file
        left, right = (reference, model) if open_side else (model, reference)
    bases = Bases(
        left=base_of(left),
        right=base_of(right),
        inherited_by=inherited_by,
        floating_loader=_floating_loader((left, right), is_open),
        frame=_base_frame(left, right, names),
    )
    return LoadedSides((left, right), bases)


def _floating_loader(
    models: tuple[Model, Model], is_open: Sequence[bool]
) -> Literal["left", "right", ""]:
    """Return the side whose engine's own loader would let its base float; "" for none."""
    for name, model, leaves_open in zip(_SIDES, models, is_open, strict=True):
        if leaves_open and raw_engine_of(engine_of(model.backend)).would_float(model):
            return name
    return ""


def _floating(
    side: Side,
    options: Mapping[str, OptionValue],
    other: Model,
    names: Mapping[str, str],
    *,
    is_left: bool,
) -> Model:
    """Load a side with a base that floats, and starts where that of another Model does.

    Args:
        side: The side.
        options: Of what is run.
        other: The Model of the other side.
        names: Joints, bodies and sites of the left that go by other names on the right.
        is_left: Whether the side is the left.
    """
    model = side.load(base="free", **options)
    start = _start_of(other, model, names, is_left=not is_left)
    return model if start is None else side.load(base=start, **options)


def _leaves_base_open(side: Side, options: Mapping[str, OptionValue]) -> bool:
    """Tell whether neither a side nor its file says whether its base floats."""
    if side.loaded is not None:
        return False
    if "base" in options or "base" in side.options or side.path.suffix.lower() != ".urdf":
        return False
    try:
        root = ElementTree.parse(side.path).getroot()
    except (OSError, ElementTree.ParseError, ValueError, LookupError):
        return False  # the engine says what is wrong with it
    links = {link.get("name") for link in root.findall("link")}
    is_floating = any(joint.get("type") == "floating" for joint in root.findall("joint"))
    return not is_floating and "world" not in links


def _start_of(
    reference: Model, model: Model, names: Mapping[str, str], *, is_left: bool
) -> FreeBase | None:
    """Return where a base has to start to be where that of another Model is; None at its own place.

    Args:
        reference: The other Model.
        model: The Model.
        names: Joints, bodies and sites of the left that go by other names on the right.
        is_left: Whether the other Model is the left.
    """
    from ...backends.compiled.algebra import (
        quat_of_matrix,  # it needs MuJoCo, which a trace does not
    )

    free_joint, base_joint = free_joint_of_base(reference), free_joint_of_base(model)
    if free_joint is None or base_joint is None:
        return None
    place = _place_of(reference, free_joint)
    if is_left:
        place = place @ _frame_on_right(
            reference, model, int(reference.jnt_bodyid[free_joint]), names
        )
    else:
        place = (
            place
            @ _frame_on_right(model, reference, int(model.jnt_bodyid[base_joint]), names).inverse
        )
    base_place = _place_of(model, base_joint)
    if place.distance(base_place) <= _SAME and place.angle(base_place) <= _SAME:
        return None
    x, y, z = place.pos.tolist()
    qw, qx, qy, qz = quat_of_matrix(place.mat.ravel()).tolist()
    return FreeBase((x, y, z), (qw, qx, qy, qz))


def _base_frame(left: Model, right: Model, names: Mapping[str, str]) -> BaseFrame | None:
    """Return the frame of the right's floating base in that of the left's.

    None where they are one, where a base does not float, and where both are of one file.
    """
    joints = free_joint_of_robot(left), free_joint_of_robot(right)
    if joints[0] is None or joints[1] is None or left.path == right.path:
        return None
    bodies = int(left.jnt_bodyid[joints[0]]), int(right.jnt_bodyid[joints[1]])
    frame = _frame_on_right(left, right, bodies[0], names)
    angle = frame.angle(HERE)
    if frame.distance(HERE) <= _ONE_FRAME and angle <= _ONE_FRAME:
        return None
    x, y, z = frame.pos.tolist()
    links = left.body_names[bodies[0]], right.body_names[bodies[1]]
    return BaseFrame((x, y, z), 0.0 if angle <= _ONE_FRAME else angle, *links)


def _frame_on_right(left: Model, right: Model, body: int, names: Mapping[str, str]) -> Placement:
    """Return the frame of the counterpart of a body of the left, in that of the body."""
    if left.compiled is None or right.compiled is None:
        return HERE
    for pair in match_trees(left, right, names, one_world=False).matching.pairs:
        if pair.left.body == body:
            return pair.align.inverse
    return HERE


def _place_of(model: Model, free_joint: int) -> Placement:
    """Return where a free joint puts its body in the default state."""
    with make_data(model) as data:
        reset(model, data)
        first = int(model.jnt_qposadr[free_joint])
        pose: Array = data.qpos[first : first + 7].copy()
    return Placement(pose[:3], matrix_from_quat(pose[3:] / np.linalg.norm(pose[3:])))
