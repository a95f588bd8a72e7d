"""What rooms tell of an engine as it comes, and of two compiled models, as records."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ..interface import Array, Ints, Model
from ..rotations import Placement

Setting = Literal["model", "off"]  # of a dial; one that is not named is as it comes


@dataclass(frozen=True)
class EngineTerm:
    """A thing of the interface, and what the engine itself has for it.

    Attributes:
        thing: What is meant, as "joint elbow_flex".
        ours: What the interface has for it, as "qpos[2]".
        engine: What the engine has for it.
    """

    thing: str
    ours: str
    engine: str


@dataclass(frozen=True)
class UncommandedJoint:
    """A joint that nobody commands, some time after its model was loaded as it comes.

    Attributes:
        label: What was done to the engine before.
        time: Simulated time [s].
        position: Of the joint then [rad; of a slide, m].
        motor: What the engine's own motor exerts on it [N·m or N].
        explicit: Largest h·D/M of the joint damping that the engine applies explicitly; above 2 a
            joint gains speed from being damped.
        gravity: Length of the gravity of a fresh world [m/s²].
        widest: How far any joint of the robot is from zero then [rad or m].
        turns: In how many steps the joint's velocity changed its sign.
        steps: How many steps were taken.
    """

    label: str
    time: float
    position: float
    motor: float
    explicit: float
    gravity: float
    widest: float
    turns: int
    steps: int


@dataclass(frozen=True)
class WayBack:
    """One of the engine's own ways to go back to an earlier state.

    Attributes:
        name: What is done.
        difference: Of the second future from the first: the largest of a coordinate [rad or m];
            zero means the same bits.
    """

    name: str
    difference: float


class Dials(ABC):
    """What can be set in an engine's own way or in the model's.

    Attributes:
        model: The model as it comes, with the options of an experiment.
        emulated: The same file behind the contract, with the same options.
        words: What the engine's own setting of a factor is, in a few words.
        self_pairs: Pairs of bodies of one robot that meet behind the contract, and not as it comes.
    """

    words: Mapping[str, str]

    def __init__(self, model: Model, emulated: Model) -> None:
        """Take a Model as it comes, and that of its file behind the contract."""
        self.model, self.emulated = model, emulated
        self.self_pairs = 0

    @property
    @abstractmethod
    def frictions(self) -> Array:
        """Return the friction (nsolid,) that the engine reports of each body that touches."""

    @abstractmethod
    def build(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        """Return a Model with some of the dials turned."""


@dataclass(frozen=True, eq=False)
class BodyPair:
    """A rigid part of one model, or the world, and its counterpart in another.

    Attributes:
        left, right: Ids of the bodies that carry it.
        align: The frame of `left` in that of `right`, as the same solid.
        moved: Whether it hangs on another part in the other model.
    """

    left: int
    right: int
    align: Placement
    moved: bool


Pairs = tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Counterparts:
    """What of one model is what of another.

    Attributes:
        joints, sites: Pairs of ids.
        actuators: Pairs of places in ctrl.
        solids: The rigid parts that both have, parents first; the world is the first.
    """

    joints: Pairs
    sites: Pairs
    actuators: Pairs
    solids: tuple[BodyPair, ...]


# The figure of a difference that is the angle [rad] by which the second model's element is turned.
TURNED = "turned by"

# What the subject of a difference begins with that is of the order in which the joints of one body
# turn it: the names of these joints follow. Each quantity is called by the joint that it is of.
ORDER_OF_JOINTS = "order of the joints "

# What a compiled model has of a quantity: a word where the engine has a list of them; None where it
# has none at all.
QuantityValue = float | str | bool | tuple[float, ...] | None

# An array of a compiled model or an option, where in it, and what is to stand there.
Edit = tuple[str, tuple[int | slice, ...], Any]


@dataclass(frozen=True)
class ElementReference:
    """An element of a compiled model, which another one refers to by its name.

    Attributes:
        kind: "joint", "site", "tendon", "body", …
        element: Its id.
    """

    kind: str
    element: int


@dataclass(frozen=True)
class SpecEdit:
    """What is set in the description of a model, which is then compiled anew.

    So is undone what no edit of a compiled model can undo, such as another size of the state.

    Attributes:
        kind: Of the element: "actuator", "body".
        element: Its id in the compiled model.
        attribute: Its name in MuJoCo's MjSpec, as "dyntype"; "activations" of an actuator are
            its entries of act in all keyframes, one keyframe after the other.
        value: What is to stand there: a number, some, or an element that is referred to.
    """

    kind: str
    element: int
    attribute: str
    value: float | tuple[float, ...] | ElementReference


@dataclass(frozen=True)
class DifferingQuantity:
    """One quantity in which two sides differ.

    Attributes:
        quantity: What it is called, by MuJoCo's name where that has one: "solimp", "kp", "mass".
        left, right: The value of each side, in `unit`. Of an array of which a file may write the
            first numbers alone (solref, solimp, friction, gear, …) those up to the last that
            differs; a word where the engine has a list of them; None where a side has none.
        unit: SI unit of each number; "" without one.
    """

    quantity: str
    left: QuantityValue
    right: QuantityValue
    unit: str = ""


@dataclass(frozen=True, eq=False)
class ModelDifference:
    """One thing in which two compiled models differ, and what makes them alike.

    Attributes:
        subject: What it is: "mass", "range", "gravity".
        kind: Of the element that it is of: "body", "joint", "geom", "actuator", "option", …
        where: Name of that element; "" of the whole model.
        values: Each quantity that differs; none where only the element as a whole does.
        edits: What brings the second model to the first.
        edits_one: What brings the first to the second, where only it can be changed.
        refused: Why neither can be equalized with the other; "" if one can.
        spec_edits: What brings the second to the first where it has to be compiled anew; needs a
            file that can be.
        spec_edits_one: What brings the first to the second so, where the second's file cannot.
        only_read: Whether the engine does not use it, so that nothing depends on it but a function
            of the user's that reads it.
    """

    subject: str
    kind: str
    where: str
    values: tuple[DifferingQuantity, ...]
    edits: tuple[Edit, ...] = ()
    edits_one: tuple[Edit, ...] = ()
    refused: str = ""
    spec_edits: tuple[SpecEdit, ...] = ()
    spec_edits_one: tuple[SpecEdit, ...] = ()
    only_read: bool = False

    @property
    def title(self) -> str:
        """Return the name of the dial, and what it is of."""
        return f"{self.subject} of {self.where}" if self.where else self.subject


@dataclass(frozen=True, eq=False)
class RunArrays:
    """What a run was, as arrays: a row for each moment.

    Attributes:
        qpos: (n, nq) positions.
        qvel: (n, nv) velocities.
        ctrl: (n, nu) commands.
        act: (n, na) activations; (n, 0) where they were not recorded.
        contact_geom: (k, 2) ids of the geoms of each contact of the run.
    """

    qpos: Array
    qvel: Array
    ctrl: Array
    act: Array
    contact_geom: Ints


KnownChangeName = Literal[
    "kv of a limited servo",
    "boxes in contact",
    "cylinders in contact",
    "mimic of a URDF",
    "turned inertial of a URDF",
]


@dataclass(frozen=True)
class KnownChange:
    """A known change between two releases of an engine, as its probe shows it on both.

    Attributes:
        name: Which change.
        probe: What was measured, as the engine's probes call it.
        left, right: What the probe measures on the release of each side: the part of kv that is in
            the derivative, a number of contact points, a number of equality constraints, or a
            product of inertia [kg m²].
        elements: What of the model it concerns in this run: actuators, pairs of bodies, joints or
            links, by name.
    """

    name: KnownChangeName
    probe: str
    left: float
    right: float
    elements: tuple[str, ...]
