"""What the comparison of two files results in: one list of differences, and how the rest agrees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ...engines.description.file_changes import AttributeChange
from ...engines.description.lines import SourceLine
from ..compare.matched import RenamedPair

Value = float | str | bool | tuple[float, ...] | None

# What a difference is a matter of, in the order in which a reader wants what weighs alike.
SUBJECTS = {
    "structure": "What is in one of them only, or hangs elsewhere",
    "places": "Where the joints are, at zero",
    "tool frame": "Frames that are fixed to a link",
    "armature": "Armature: the rotor's inertia as the joint feels it",
    "drive": "What drives the joints",
    "effort": "Largest force of a joint",
    "damping": "Damping of the joints",
    "dry friction": "Dry friction of the joints",
    "spring": "Springs in the joints",
    "limits": "Limits of the joints",
    "speed": "Largest speed of a joint",
    "mass": "Masses",
    "centre of mass": "Centres of mass",
    "inertia": "Inertias about the centre of mass",
    "shapes": "What touches",
    "contact": "How it touches",
    "settings": "Settings of the simulation",
    "further": "What else can change a motion",
    "drawing": "What is only drawn",
    "control": "What only a controller reads",
}


@dataclass(frozen=True)
class ListedDifference:
    """A quantity of an element that is not the same in two files.

    Attributes:
        subject: A key of `SUBJECTS`.
        kind: Of the element, as MJCF calls it: "body", "joint", "geom", "actuator", "option", …
        element: Its name on the left; on the right, where only that has it; "" of the whole model.
        quantity: What of it, by MuJoCo's name where that has one.
        unit: SI unit of each number; "" without one.
        left, right: Its values; None where a file does not say.
        size: How far they are apart, in `unit`; None where that is not a number.
        share: How much it weighs, from 0 to 1; of what, `effect` says.
        effect: What it means for a motion, as far as that was computed.
        matters: Whether it makes the two files differ; else it is said for the record.
        left_line, right_line: Where the element is in each file; None where that is not known.
        cause: The difference of the compiled models that it is a quantity of, as `..why` names it;
            "" where only the text of a file tells of it.
        refused: Why the right cannot be brought to the left in it; "" where it can, or where only
            the text of a file tells of it.
        supplied: Whether it does not matter since the backend supplies it in a run.
    """

    subject: str
    kind: str
    element: str
    quantity: str
    unit: str
    left: Value
    right: Value
    size: float | None
    share: float
    effect: str
    matters: bool
    left_line: SourceLine | None
    right_line: SourceLine | None
    cause: str
    refused: str
    supplied: bool = False

    @property
    def key(self) -> tuple[str, str, str]:
        """Return what identifies it: the kind of its element, the element, and the quantity."""
        return self.kind, self.element, self.quantity


@dataclass(frozen=True)
class FileFault:
    """What a compiler refuses in a file, and what is used instead.

    Everything else is compared as the file states it.

    Attributes:
        side: "left" or "right".
        kind: Of the element, as MJCF calls it: "body", "mesh", "geom", …
        element: Its name.
        quantity: What of it: "inertia", its principal moments in the order of the file's
            axes; "mass"; "file" of a mesh; …
        unit: SI unit of each number; "" without one.
        stated: What the file says; None where it says nothing.
        used: What a run has instead; None where the element is left out.
        factor: By how much the number that changed most was changed, at least 1; None where no
            number was, or one was zero.
        reason: Why, as MuJoCo says it.
        line: Where the element stands; None where that is not known.
    """

    side: str
    kind: str
    element: str
    quantity: str
    unit: str
    stated: Value
    used: Value
    factor: float | None
    reason: str
    line: SourceLine | None


@dataclass(frozen=True)
class QuantityAgreement:
    """Quantities of a subject that are the same in two files, within rounding.

    Attributes:
        subject: A key of `SUBJECTS`.
        unit: SI unit of the quantities.
        count: How many they are.
        compared: How many were compared.
        worst: The largest difference of those that agree, in `unit`.
        element: The joint, link or frame of the largest difference.
        digits: To how many digits they agree; 17 is every bit of a float64.
    """

    subject: str
    unit: str
    count: int
    compared: int
    worst: float
    element: str
    digits: int


@dataclass(frozen=True)
class DifferenceChange:
    """What of the right's file undoes a difference, or several that are the same change.

    Attributes:
        cause: The difference of the compiled models, as `..why` names it.
        attributes: What of the file gets another value; none where nothing of it does.
        not_written: Why no attribute undoes it; "" where one does.
    """

    cause: str
    attributes: tuple[AttributeChange, ...]
    not_written: str


@dataclass(frozen=True)
class PoseGap:
    """How far apart the same links are where both robots have the same joint positions.

    Attributes:
        poses: How many poses, the zero pose among them.
        seed: Of the others.
        distance: The largest between the same link here and there [m].
        angle: The largest between the same link here and there [rad].
        link: The link that is furthest off.
        joints: How many joints were moved.
    """

    poses: int
    seed: int
    distance: float
    angle: float
    link: str
    joints: int


@dataclass(frozen=True)
class FileSide:
    """One side: a file, or what an engine made of one.

    Attributes:
        file: The file, with its folder.
        format: "URDF", "MJCF", "MJB", or "engine" for what an engine made of a file.
        reader: What read it, with its version.
        links: How many bodies it has, the world apart.
        joints: How many joints it has.
        shapes: How many shapes it touches with.
        visuals: How many shapes it only draws.
        mass: Of the robot in all [kg], what is fixed in the world included.
        notes: What the reader notes, in sentences.
        emulated: The engine that read it, where that emulates the contract in a run; else "".
        is_mjcf: Whether its file is no URDF.
        unlike_its_users: What a run behind the contract has that the engine's users do not have;
            "" if there is nothing, or no such run.
    """

    file: str
    format: str
    reader: str
    links: int
    joints: int
    shapes: int
    visuals: int
    mass: float
    notes: tuple[str, ...]
    emulated: str
    is_mjcf: bool
    unlike_its_users: str


@dataclass(frozen=True)
class ModelsComparison:
    """Every difference between two files.

    Attributes:
        left: The left side.
        right: The right side.
        faults: What a compiler refuses in either file.
        differences: The weightiest subjects first, and in each the weightiest difference.
        agreements: How well the rest agrees.
        posed: Whether the same positions give the same poses.
        notes: What a reader should know, in sentences.
        digits: Numbers that agree to so many count as equal.
        has_actuators: Whether the left can be commanded.
        versions: Of what computed it.
        skipped: What was not compared, in sentences.
        labels: Both sides as one types them for a run.
        renamed: What was taken for one although the names differ, and nobody said so.
        changes: What of the right's file undoes each difference that acts on a motion; none where
            an engine was asked, or the file has no text that can be changed.
    """

    left: FileSide
    right: FileSide
    faults: tuple[FileFault, ...]
    differences: tuple[ListedDifference, ...]
    agreements: tuple[QuantityAgreement, ...]
    posed: PoseGap
    notes: tuple[str, ...]
    digits: int
    has_actuators: bool
    versions: Mapping[str, str]
    skipped: tuple[str, ...]
    labels: tuple[str, str] = field(metadata={"json": False})
    renamed: tuple[RenamedPair, ...]
    changes: tuple[DifferenceChange, ...]

    @property
    def mass(self) -> tuple[float, float]:
        """Return the mass of each whole robot [kg]."""
        return self.left.mass, self.right.mass

    @property
    def equal(self) -> bool:
        """Tell whether everything was compared, and nothing was found that matters."""
        return not self.skipped and not any(row.matters for row in self.differences)
