"""The second diagram: the slots of qpos above those of qvel, joint by joint."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ....interface import JointType, Model
from ....show.diagrams.shapes import Arrow, Box, Label, Look, Shape, clean, cut, length_of
from ....show.pictures import Diagram
from ....show.templates import PageContent
from .texts import diagram_of

_WIDTH = 76
_LEFT = 5  # column of the first slot: before it stand the names of the arrays
_NAME = 24  # columns of a joint's name, with its type, at most
_ROOM = 26  # columns for it where the mark of what is cut off takes more than one
_BANDS_MOST = 3  # with more joints than these hold, those that are alike are drawn as one
_ENDS = 2  # joints that are drawn at the beginning of many that are alike; one is at their end
_NO_NAME = "(no name)"
# What the slots of a joint of several are: how many, and their name.
_QPOS_PARTS = {"free": ((3, "position"), (4, "quaternion")), "ball": ((4, "quaternion"),)}
_QVEL_PARTS = {"free": ((3, "linear"), (3, "angular")), "ball": ((3, "angular"),)}


@dataclass(frozen=True)
class JointSlotsContent(PageContent):
    """What is said of the diagram.

    Attributes:
        nq: Length of qpos.
        nv: Length of qvel.
        joints: Number of joints.
        shifted: Joints with other slots in qvel than in qpos.
        left_out: Number of joints that are not drawn one by one.
    """

    template = "joint_slots.md.j2"

    nq: int
    nv: int
    joints: int
    shifted: tuple[str, ...]
    left_out: int


@dataclass(frozen=True)
class _Piece:
    """A joint, or several that are alike and drawn as one.

    Attributes:
        name: Of the joint; how many they are.
        type: "free", "ball", "slide" or "hinge"; "" of several.
        joints: Number of joints.
        qpos: First slot in qpos and the slot after the last.
        qvel: First slot in qvel and the slot after the last.
    """

    name: str
    type: str
    joints: int
    qpos: tuple[int, int]
    qvel: tuple[int, int]

    @property
    def look(self) -> Look:
        """Return how its slots look."""
        return "state" if self.qpos == self.qvel else "apart"

    @property
    def short_name(self) -> str:
        """Return its name, cut off where there is no room for it."""
        return cut(clean(self.name), _NAME - len(self.type) - 2)

    @property
    def label(self) -> str:
        """Return what stands above it."""
        return f"{self.short_name}  {self.type}".rstrip()

    def columns(self, pitch: int) -> int:
        """Return how many columns its slots take.

        Args:
            pitch: Number of columns from a slot to the next.
        """
        if self.joints > 1:
            return max(pitch, *(len(text) + 3 for text in (_range(self.qpos), _range(self.qvel))))
        return pitch * (self.qpos[1] - self.qpos[0])


def joint_slots(model: Model) -> Diagram:
    """Return the diagram of the slots of each joint of a Model."""
    joints = [_joint(model, joint) for joint in range(model.njnt)]
    pitch = max(4, len(str(model.nq)) + 2)
    pieces = joints
    if len(list(_bands(joints, pitch))) > _BANDS_MOST:
        pieces = list(_shortened(joints))
    bands = list(_bands(pieces, pitch))
    drawn = bands[:_BANDS_MOST]
    shapes: list[Shape] = []
    top = 0
    for band in drawn:
        band_shapes, top = _band(band, pitch, top)
        shapes += band_shapes
    hidden = sum(piece.joints for band in bands[_BANDS_MOST:] for piece in band)
    if hidden:
        shapes.append(Label(f"{hidden} more joints", _LEFT, top, _WIDTH - _LEFT, "faint"))
    if not joints:
        shapes += [Label("no joints", 0, 0, _WIDTH, "faint")]
    single = sum(1 for band in drawn for piece in band if piece.joints == 1)
    content = JointSlotsContent(
        nq=model.nq,
        nv=model.nv,
        joints=len(joints),
        shifted=tuple(joint.short_name for joint in joints if joint.look == "apart"),
        left_out=len(joints) - single,
    )
    return diagram_of(content, shapes)


def _joint(model: Model, joint: int) -> _Piece:
    """Return a joint with its slots."""
    kind = JointType(int(model.jnt_type[joint]))
    place, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    name = model.joint_names[joint]
    return _Piece(
        name=name if name else _NO_NAME,
        type=kind.name.lower(),
        joints=1,
        qpos=(place, place + kind.nq),
        qvel=(dof, dof + kind.nv),
    )


def _shortened(joints: Sequence[_Piece]) -> Iterator[_Piece]:
    """Yield joints; of many that follow each other and are alike, all but a few as one."""
    for _, group in itertools.groupby(joints, _likeness):
        run = list(group)
        if len(run) <= _ENDS + 2:
            yield from run
            continue
        yield from run[:_ENDS]
        yield _as_one(run[_ENDS:-1])
        yield run[-1]


def _as_one(joints: Sequence[_Piece]) -> _Piece:
    """Return joints that follow each other as one piece."""
    first, last = joints[0], joints[-1]
    return _Piece(
        name=f"{len(joints)} more",
        type="",
        joints=len(joints),
        qpos=(first.qpos[0], last.qpos[1]),
        qvel=(first.qvel[0], last.qvel[1]),
    )


def _likeness(joint: _Piece) -> tuple[int, bool]:
    """Return what joints have in common that are drawn as one."""
    return joint.qpos[1] - joint.qpos[0], joint.look == "apart"


def _bands(pieces: Sequence[_Piece], pitch: int) -> Iterator[list[_Piece]]:
    """Yield the pieces in rows that are narrow enough."""
    band: list[_Piece] = []
    column = _LEFT
    for piece in pieces:
        width = max(piece.columns(pitch), pitch // 2 + 2 + length_of(piece.label))
        if band and column + width >= _WIDTH:
            yield band
            band, column = [], _LEFT
        band.append(piece)
        column += piece.columns(pitch)
    if band:
        yield band


def _band(band: Sequence[_Piece], pitch: int, top: int) -> tuple[list[Shape], int]:
    """Return a row of pieces, and the row below it.

    Args:
        band: The pieces, from left to right.
        pitch: Number of columns from a slot to the next.
        top: Its first row.
    """
    has_parts = any(piece.type in _QPOS_PARTS for piece in band)
    qpos_top = top + len(band)
    between = 3 if has_parts else 1
    qvel_top = qpos_top + 3 + between
    cells: list[Shape] = []
    names: list[Shape] = []
    column = _LEFT
    for row, piece in enumerate(band, start=top):
        cells += _slots(piece.qpos, piece, column, qpos_top, pitch)
        cells += _slots(piece.qvel, piece, column, qvel_top, pitch)
        cells += _between(piece, column, qpos_top + 3, between, pitch)
        middle = column + pitch // 2
        names.append(Arrow(((middle + 1, row), (middle, row), (middle, qpos_top)), has_head=False))
        names.append(Label(piece.label, middle + 2, row, _ROOM, _strong(piece), is_code=True))
        column += piece.columns(pitch)
    arrays = [
        Label("qpos", 0, qpos_top + 1, 4, is_code=True),
        Label("qvel", 0, qvel_top + 1, 4, is_code=True),
    ]
    return [*cells, *names, *arrays], qvel_top + 4


def _strong(piece: _Piece) -> Look:
    """Return how the name of a piece looks."""
    return "apart" if piece.look == "apart" else "plain"


def _slots(
    slots: tuple[int, int], piece: _Piece, left: int, top: int, pitch: int
) -> Iterator[Shape]:
    """Yield the slots of a piece in one array, each with its number."""
    start, stop = slots
    if piece.joints > 1:
        width = piece.columns(pitch)
        yield Box(left, top, width + 1, 3, piece.look, is_dashed=True)
        yield _slot_label(_range(slots), left, top, width, piece.look)
        return
    for number in range(start, stop):
        column = left + (number - start) * pitch
        yield Box(column, top, pitch + 1, 3, piece.look)
        yield _slot_label(str(number), column, top, pitch, piece.look)


def _slot_label(text: str, left: int, top: int, width: int, look: Look) -> Label:
    """Return what stands in the middle of a box of slots, `width` columns from edge to edge."""
    middle = left + width // 2
    return Label(text, middle, top + 1, width - 1, look, is_code=True, is_centered=True)


def _between(piece: _Piece, left: int, top: int, rows: int, pitch: int) -> Iterator[Shape]:
    """Yield what stands between the slots of a piece: whether they line up, and what they are."""
    width = piece.columns(pitch)
    middle = top + rows // 2
    mark = "=" if piece.look == "state" else "≠"
    of_qpos, of_qvel = (slots[1] - slots[0] for slots in (piece.qpos, piece.qvel))
    if piece.joints == 1 and of_qpos != of_qvel:
        mark = f"≠  {of_qpos} and {of_qvel} slots"
    yield Label(mark, left + width // 2, middle, width - 1, piece.look, is_centered=True)
    if piece.joints > 1:
        return
    for parts, row in ((_QPOS_PARTS, top), (_QVEL_PARTS, top + 2)):
        column = left
        for slots, name in parts.get(piece.type, ()):
            half = slots * pitch // 2
            yield Label(name, column + half, row, slots * pitch - 1, is_centered=True)
            column += slots * pitch


def _range(slots: tuple[int, int]) -> str:
    """Write the first and the last of some slots."""
    return f"{slots[0]} to {slots[1] - 1}"
