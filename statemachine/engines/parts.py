"""What the parts "as_it_comes" and "dials" of a room offer, and the records that they give.

A part is a module; its functions are those of the protocol, without `self`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, Protocol

from ..description.records import Robot
from ..drawing.camera import Camera
from ..drawing.shots import Drawer
from ..interface import Array, Data, Model
from .auditing import Driver


@dataclass(frozen=True)
class Term:
    """What the interface calls a thing, and what an engine calls it."""

    thing: str
    ours: str
    engine: str


@dataclass(frozen=True)
class LeftAlone:
    """A joint that nobody commands, on an engine as it comes.

    Attributes:
        label: What was done to the engine before.
        time: Simulated time [s].
        position: Of the joint then [rad; of a slide, m].
        motor: What the engine's own motor exerts on it [N·m or N].
        explicit: Largest h·D/M of the joint damping that the engine applies explicitly;
            above 2 a joint gains speed from being damped.
        gravity: Length of the gravity of a fresh world [m/s²].
        widest: How far any joint of the robot is from zero then [rad or m].
        turns: In how many steps the joint's velocity changed its sign.
        steps: Of how many.
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
    """A way to go back to an earlier state, and how far the second future is from the first.

    Attributes:
        name: What is done.
        difference: Largest difference of a coordinate; zero means the same bits.
    """

    name: str
    difference: float


class AsItComes(Protocol):
    """The part "as_it_comes": a model as the engine's own users load it.

    An engine has it where the backend emulates some of the contract: what the engine does must
    not be read from the emulation then.
    """

    def terms(self, model: Model) -> tuple[Term, ...]:
        """What the engine calls the things of the interface."""
        ...

    def left_alone(self, model: Model, seconds: float, joint: int) -> tuple[LeftAlone, ...]:
        """A joint that nobody commands, after some time [s], on four freshly loaded models.

        As it comes; with the model's gravity; without the engine's own motors too; and
        without the damping of joints.
        """
        ...

    def ways_back(self, model: Model) -> tuple[WayBack, ...]:
        """Which of the engine's own ways to go back is exact."""
        ...


Setting = Literal["model", "off"]  # of a dial; one that is not named is as it comes


class Dials(Protocol):
    """What can be set in an engine's own way or in the model's.

    Attributes:
        model: The model as it comes, with the options of an experiment.
        emulated: The same file behind the contract, with the same options.
        with_servo: What only an adapter can give, and so only the world of the model's law.
        words: What the engine's own setting of a factor is, in a few words.
        frictions: (nsolid,) friction that the engine tells of each body that touches.
    """

    with_servo: tuple[str, ...]
    words: Mapping[str, str]

    @property
    def model(self) -> Model: ...
    @property
    def emulated(self) -> Model: ...
    @property
    def frictions(self) -> Array: ...

    def build(self, dials: Mapping[str, Setting], values: Mapping[str, Any]) -> Model:
        """A Model with some of them turned."""
        ...


class DialsPart(Protocol):
    """The part "dials": Models between an engine as it comes and the contract."""

    def dials(self, model: Model, options: Mapping[str, Any]) -> Dials | None:
        """The dials of a Model of the engine as it comes; None of any other Model."""
        ...

    def frictionless(self, model: Model) -> Model:
        """The same Model with surfaces that have no friction."""
        ...


class AuditPart(Protocol):
    """The part "audit": the engine by its own functions, to find out what its state is."""

    def driver(self, model: Model, seed: int) -> Driver:
        """What starts, steps, saves and restores; `seed` is of what it draws."""
        ...


class ReadingPart(Protocol):
    """The part "reading": what the engine makes of a file, as a description."""

    def read(self, path: Path, name: str) -> Robot:
        """What it makes of a file, with its own defaults.

        Args:
            path: The file.
            name: What the description goes by.

        Raises:
            MissingEngineError: It is not installed here.
            ModelError: It cannot read the file.
        """
        ...


class CompilerPart(ReadingPart, Protocol):
    """The part "reading" of the engine whose format MJCF is."""

    def read_file(self, path: Path, name: str) -> Robot:
        """What an MJCF says itself; meshes may be missing. Arguments and errors as of `read`."""
        ...

    def describe(self, compiled: Any, name: str) -> Robot:
        """The description in a compiled model; its joints are in the order of the model's."""
        ...


class EnergyPart(Protocol):
    """The part "energy" of the engine by which all are measured."""

    def energies(self, model: Model, qpos: Array, qvel: Array) -> Array:
        """Kinetic and potential energy (n, 2) [J] of states.

        Args:
            model: A model on this engine.
            qpos: (n, nq) positions [rad or m].
            qvel: (n, nv) velocities [rad/s or m/s].
        """
        ...


class OneStepPart(Protocol):
    """The part "one_step": what one step from a given state is compared by, past the interface.

    Attributes:
        PRIMES: What of the step before the engine takes, in words; "" for nothing.
    """

    PRIMES: str

    def mass_matrix(self, model: Model, data: Data, qpos: Array) -> Array:
        """The engine's mass matrix (nv, nv) at a pose, armature included; NaN if not told.

        Args:
            model: A Model on this engine.
            data: A Data of it, after a step from `qpos` or a forward.
            qpos: (nq,) where.
        """
        ...

    def prime(self, model: Model, data: Data, before: Mapping[str, Array]) -> None:
        """Let a Data, put to a state, know of the step before.

        Args:
            model: A Model on this engine.
            data: A Data of it.
            before: (nv,) arrays of that step by their names in the contract, those that the
                other side tells: "qacc", "qfrc_contact", "qfrc_friction".
        """
        ...


class PlainPart(Protocol):
    """The part "plain": a file as the engine's own users run it.

    An engine has it where the interface promises the engine's own bits.
    """

    def run(self, path: Path, commands: Array, keyframe: int | None) -> Array | None:
        """Positions and velocities (n + 1, nq + nv) at the start and after each step.

        Args:
            path: The file.
            commands: (n, nu) ctrl of each step.
            keyframe: Where to start; None for the default state.

        Returns:
            None where the engine alone cannot open the file.
        """
        ...


class RenderingPart(Protocol):
    """The part "rendering": pictures without a screen.

    Attributes:
        SHARPER: It draws so many times as large as a picture is shown.
        __name__: Of the module, which another process imports to draw.
    """

    SHARPER: int
    __name__: str

    def here(self) -> str:
        """The OpenGL that it draws with here; "" for its own choice, or where none is needed.

        Raises:
            MissingEngineError: It cannot draw here; the message says why, and what to do.
        """
        ...

    def label(self, opengl: str) -> str:
        """What a reader is told of what draws."""
        ...

    def drawer(self, files: Sequence[Path], size: tuple[int, int], camera: Camera) -> Drawer:
        """Get ready to draw.

        Args:
            files: The model of the solid side, and that of the ghost if there is one.
            size: Width and height of the pictures, `SHARPER` times as shown.
            camera: Where they are seen from.
        """
        ...


class OpenGLPart(RenderingPart, Protocol):
    """The part "rendering" of the engine that reads the models for all renderers."""

    def environment(self, opengl: str, known: dict[str, str]) -> dict[str, str]:
        """The environment of a process in which the engine takes this OpenGL."""
        ...

    def diagnosis(self) -> tuple[bool, str, str]:
        """Whether it draws here, what was found, and the next step if there is one."""
        ...


class WatchedPart(Protocol):
    """The part "watched": what a student can do with the engine past the interface.

    Attributes:
        STEPS: Names of its functions f(model, data[, nstep]) that advance time.
        FORWARDS: Names of those f(model, data) that only recompute.
        DATA: The backend's Data, whose verbs call these functions.
    """

    STEPS: tuple[str, ...]
    FORWARDS: tuple[str, ...]
    DATA: type[Data]

    def origin(self, raw: Any) -> object:
        """What an engine's own model and its copies have in common, and no other."""
        ...

    def settings(self, raw: Any) -> dict[str, list[float]]:
        """What of it a student can change, by name."""
        ...


class MutantsPart(Protocol):
    """The part "mutants": where a seeded fault is put in.

    Attributes:
        adapter: The backend's module, with `compile_file`, `facts` and `edited`.
    """

    adapter: ModuleType
