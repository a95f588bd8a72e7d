"""The engines without us: what each does and calls things when its own users drive it.

Each engine has a room here, a package with a `RawEngine`; conventions, phrasebook, calls,
comparison, robots, pictures, grading and doctor ask it by the engine's name, and name no engine
themselves. What a room does not override is not asked, and the page says so. The methods import
what they need: to look a room up imports no engine.

So an engine is `backends/NAME_backend.py`, `engines/NAME` and a row of `installed.ENGINES`; one of
another distribution declares entry points instead of the row.
"""

from __future__ import annotations

import functools
import importlib
import importlib.metadata
from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar, cast

from ..errors import BadInputError, MissingEngineError, UnsupportedError
from ..installed import raise_if_interrupted

if TYPE_CHECKING:
    from ..interface import Array, Data, Model
    from ..interface.records import ReadOptions
    from ..show.drawing.scene import Camera, Drawer
    from .call_watch import CallWatch
    from .description.reading import Comparable, ModelReading
    from .description.records import Robot
    from .measured import Phrases
    from .records import (
        Counterparts,
        Dials,
        Edit,
        EngineTerm,
        ModelDifference,
        SpecEdit,
        UncommandedJoint,
        WayBack,
    )

_ROOMS: dict[str, str] = {
    "mujoco": f"{__name__}.mujoco:MujocoEngine",
    "pybullet": f"{__name__}.pybullet:PybulletEngine",
    "pinocchio": f"{__name__}.pinocchio:PinocchioEngine",
}


Method = TypeVar("Method", bound=Callable[..., Any])


def _needed(method: Method) -> Method:
    """A method without which what was asked cannot be done: it raises UnsupportedError.

    It is marked as abstract for type checkers, which then want no body.
    """

    @functools.wraps(method)
    def lacking(self: RawEngine, *_arguments: Any, **_named: Any) -> Any:
        raise UnsupportedError(
            f"{self.name} has no {method.__name__!r} in its room",
            backend=self.name,
            feature=method.__name__,
            reason="not written",
        )

    return cast("Method", lacking)


def function_of(place: str) -> Any:
    """A method that is a function, or a class, and is imported when the method is called.

    Args:
        place: "package.module:function", from this package on.
    """
    module, _, name = place.partition(":")

    def call(_self: RawEngine, *arguments: Any, **named: Any) -> Any:
        return getattr(importlib.import_module(module, __name__), name)(*arguments, **named)

    return call


class RawEngine:
    """An engine as its own users drive it; each method is optional.

    Attributes:
        name: The engine's.
        emulated: Whether the backend emulates some of the contract, so that what the engine does
            must not be read from there.
        primes: What of the step before the engine takes, in words; "" for nothing.
        supersampling: It draws so many times as large as a picture is shown.
        steps: Names of its functions f(model, data[, nstep]) that advance time.
        forwards: Names of those f(model, data) that only recompute.
    """

    emulated = False
    primes = ""
    supersampling = 1
    steps: tuple[str, ...] = ()
    forwards: tuple[str, ...] = ()

    def __init__(self, name: str) -> None:
        self.name = name

    def can(self, method: str) -> bool:
        """Whether its room has a method of its own."""
        return getattr(type(self), method) is not getattr(RawEngine, method)

    def ignored(self, model: Model) -> list[str]:
        """What of a Model's file its backend leaves out, each in a few words."""
        return []

    def read_otherwise(self, left: Model, right: Model) -> list[str]:
        """Say what only one of two releases of the engine reads in the file of both Models."""
        return []

    # The engine as it comes. Nothing here goes through an adapter that emulates the contract.

    def terms(self, model: Model) -> tuple[EngineTerm, ...]:
        """Return what the interface calls things, and what the engine does."""
        return ()

    def left_alone(self, model: Model, seconds: float, joint: int) -> tuple[UncommandedJoint, ...]:
        """Return how a joint moves that nobody commands, on four freshly loaded models.

        As it comes; with the model's gravity; without the engine's own motors too; and
        without the damping of joints.

        Args:
            model: A Model on this engine.
            seconds: Simulated time.
            joint: Id of a hinge or slide.
        """
        return ()

    def ways_back(self, model: Model) -> tuple[WayBack, ...]:
        """Return which of the engine's own ways to go back to an earlier state is exact."""
        return ()

    def unlike_its_users(self, model: Model) -> list[str]:
        """Say what a run behind the contract has that the engine's own users do not have."""
        return []

    def dials(self, model: Model, options: Mapping[str, Any]) -> Dials | None:
        """What can be set between the engine as it comes and the contract; None of any other."""
        return None

    def plain_run(self, path: Path, commands: Array, keyframe: int | None) -> Array | None:
        """A file as the engine's own users run it, where the interface promises the same bits.

        Args:
            path: The file.
            commands: (n, nu) ctrl of each step.
            keyframe: Where to start; None for the default state.

        Returns:
            Positions and velocities (n + 1, nq + nv) at the start and after each step; None
            where the engine alone cannot open the file.
        """
        return None

    # What it takes for granted, and what it runs.

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """What measures the answer to a question of `probes.conventions`; None if nothing does."""
        return None

    def phrases(self) -> Phrases:
        """Which of its calls does what, as lines to type."""
        from .measured import Phrases

        return Phrases(("", ""), {})

    @_needed
    @abstractmethod
    def stepper(
        self, model: Model, qpos: Array, qvel: Array, ctrl: Array
    ) -> AbstractContextManager[Callable[[int], object]]:
        """What advances a simulation of it by so many steps, by its own functions alone.

        Args:
            model: A Model on this engine.
            qpos: (nq,) where it starts.
            qvel: (nv,) its velocities there.
            ctrl: (nu,) the command.
        """

    @_needed
    @abstractmethod
    def call_watch(self) -> CallWatch:
        """Which of its functions can be watched, and what they change."""

    # One step from a given state, past the interface.

    def mass_matrix(self, model: Model, data: Data, qpos: Array) -> Array:
        """The engine's mass matrix (nv, nv) at a pose, armature included; NaN if not told.

        Args:
            model: A Model on this engine.
            data: A Data of it, after a step from `qpos` or a forward.
            qpos: (nq,) where.
        """
        import numpy as np

        return np.full((model.nv, model.nv), np.nan)

    def prime(self, model: Model, data: Data, before: Mapping[str, Array]) -> None:
        """Let a Data, put to a state, know of the step before.

        Args:
            model: A Model on this engine.
            data: A Data of it.
            before: (nv,) arrays of that step by their names in the contract, those that the
                other side tells: "qacc", "qfrc_contact", "qfrc_friction".
        """

    # Files and compiled models.

    @_needed
    @abstractmethod
    def read(self, path: Path) -> ModelReading:
        """What it makes of a file with its own defaults, as a compiled model; see `read_robot`.

        Raises:
            MissingEngineError: It is not installed here.
            ModelError: It cannot read the file.
        """

    @_needed
    @abstractmethod
    def read_file(self, path: Path, comparable: Comparable | None = None) -> ModelReading:
        """A file as it says itself, as a compiled model.

        Args:
            path: An MJCF, URDF or MJB file.
            comparable: How it is made comparable with the other side; None for the elements of the
                file alone.

        Raises:
            MissingEngineError: It is not installed here.
            ModelError: It cannot read the file.
        """

    @_needed
    @abstractmethod
    def read_robot(self, robot: Robot, path: Path) -> ModelReading:
        """What another engine made of a file, as a compiled model.

        Args:
            robot: What the engine made of it.
            path: The file.

        Raises:
            ModelError: It cannot be compiled.
        """

    @_needed
    @abstractmethod
    def element_names(self, raw: Any) -> dict[str, list[str]]:
        """The names of all elements of a compiled model by their kind, in their order."""

    @_needed
    @abstractmethod
    def moment_arms(self, raw: Any) -> tuple[dict[str, float], ...]:
        """The moment arms of each actuator of a compiled model on hinges and slides, by joint."""

    @_needed
    @abstractmethod
    def describe(self, compiled: Any, name: str) -> Robot:
        """The description in a compiled model; its joints are in the order of the model's."""

    @_needed
    @abstractmethod
    def differences(
        self, left: Any, right: Any, pairs: Counterparts, *, world: bool = True
    ) -> tuple[ModelDifference, ...]:
        """All that two compiled models differ in and that can change a motion.

        Args:
            left: A compiled model.
            right: Another.
            pairs: What of one is what of the other.
            world: Whether gravity and the timestep are compared, too.
        """

    @_needed
    @abstractmethod
    def sensors(self, left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
        """What the sensors of two compiled models differ in, which only a controller reads."""

    @_needed
    @abstractmethod
    def readable(self, left: Any, right: Any, pairs: Counterparts) -> list[ModelDifference]:
        """What two compiled models differ in that the engine does not use: user and custom data."""

    @_needed
    @abstractmethod
    def shown_elements(
        self, left: Any, right: Any, pairs: Counterparts
    ) -> dict[str, list[tuple[int, int]]]:
        """Pairs of geoms, tendons and actuators, and of places in sensordata, by kind."""

    @_needed
    @abstractmethod
    def data_in_other_order(self, model: Model, elements: Mapping[str, Any]) -> Any:
        """A Data of a Model that shows what a Data of another one has.

        Args:
            model: In whose order it is shown.
            elements: By kind pairs of ids, or of places in an array: in `model`, in the other.
        """

    @_needed
    @abstractmethod
    def entries(self, right: Any, difference: ModelDifference) -> tuple[ModelDifference, ...]:
        """A difference by its single entries, or itself where it is of one piece.

        Args:
            right: The compiled model that its edits are of.
            difference: One of `differences`.
        """

    @_needed
    @abstractmethod
    def integrator(self, raw: Any) -> str:
        """The name of the integrator of a compiled model: "euler", "rk4", …"""

    @_needed
    @abstractmethod
    def edited(self, raw: Any, edits: Iterable[Edit]) -> Any:
        """A copy of a compiled model with these edits, and all that follows from them."""

    @_needed
    @abstractmethod
    def can_be_respecified(self, path: Path) -> bool:
        """Whether a file has a description that can be compiled anew; a binary one has none."""

    @_needed
    @abstractmethod
    def respecified(self, path: Path, raw: Any, edits: Sequence[SpecEdit]) -> Any:
        """The compiled model of a file with some elements set otherwise.

        Args:
            path: The file.
            raw: What was compiled of it, with the options that were set since then.
            edits: What is set.

        Raises:
            ModelError: It cannot be compiled so.
        """

    @_needed
    @abstractmethod
    def in_places_of(self, before: Any, after: Any, edits: Iterable[Edit]) -> tuple[Edit, ...]:
        """Edits of one compiled model as those of another, from `respecified`."""

    @_needed
    @abstractmethod
    def counts(self, compiled: Any) -> dict[str, int]:
        """How many "actuators" a compiled model has, and how many planes are its "floor"."""

    @_needed
    @abstractmethod
    def with_parts(
        self,
        taker: Path,
        giver: Path,
        parts: Collection[str],
        names: Mapping[str, Mapping[str, str]],
        options: ReadOptions,
    ) -> Any:
        """The compiled model of a file that has parts of another one instead of its own.

        Args:
            taker: The file.
            giver: The other.
            parts: Of `counts`.
            names: By kind ("joint", "body", "site") the names in `taker` of what `giver` has.
            options: How `taker` is read.

        Raises:
            ModelError: It cannot be made.
        """

    @_needed
    @abstractmethod
    def energies(
        self,
        model: Model,
        qpos: Array,
        qvel: Array,
        made: Callable[[Model], AbstractContextManager[Data]],
    ) -> Array:
        """Kinetic and potential energy (n, 2) [J] of states.

        Args:
            model: A model on this engine.
            qpos: (n, nq) positions [rad or m].
            qvel: (n, nv) velocities [rad/s or m/s].
            made: Gives a Data of it, which is changed.
        """

    # Pictures without a screen.

    @_needed
    @abstractmethod
    def opengl(self) -> str:
        """The OpenGL that it draws with here; "" for its own choice, or where none is needed.

        Raises:
            MissingEngineError: It cannot draw here; the message says why, and what to do.
        """

    @_needed
    @abstractmethod
    def drawn_by(self, opengl: str) -> str:
        """What a reader is told of what draws."""

    @_needed
    @abstractmethod
    def drawer(self, file: Path, size: tuple[int, int], camera: Camera, ghost: bool) -> Drawer:
        """Get ready to draw one side.

        Args:
            file: Its model.
            size: Width and height of the pictures, `supersampling` times as shown.
            camera: Where they are seen from.
            ghost: Whether it is the side that is drawn over the other one: in one colour,
                without what belongs to the world.
        """

    @_needed
    @abstractmethod
    def drawing_environment(self, opengl: str, known: dict[str, str]) -> dict[str, str]:
        """The environment of a process in which the engine takes this OpenGL."""

    @_needed
    @abstractmethod
    def drawing_diagnosis(self) -> tuple[bool, str, str]:
        """Whether it draws here, what was found, and the next step if there is one."""

    # What a student can do with it past the interface, and where a fault is seeded.

    def watched_data(self) -> type[Data] | None:
        """The backend's Data whose verbs call `steps` and `forwards`; None: nothing is watched."""
        return None

    @_needed
    @abstractmethod
    def origin(self, raw: Any) -> object:
        """What an engine's own model and its copies have in common, and no other."""

    def settings(self, raw: Any) -> dict[str, list[float]]:
        """What of an engine's own model a student can change, by name."""
        return {}

    @_needed
    @abstractmethod
    def backend(self) -> ModuleType:
        """The backend's module, with `compile_file`, `facts` and `edited`, to put a fault in."""


def room_names() -> list[str]:
    """Names of the engines that may have a room, whether or not they are installed."""
    for entry in importlib.metadata.entry_points(group="statemachine.engines"):
        _ROOMS.setdefault(entry.name, entry.value)
    return list(_ROOMS)


def register(name: str, kind: str) -> None:
    """Give an engine of another package a room.

    A package that declares it as an entry point of the group "statemachine.engines" is found
    without this, by the command line too.

    Args:
        name: The engine's name.
        kind: A subclass of `RawEngine`, as "package.module:Class".

    Raises:
        BadInputError: There is another room of that name.
    """
    if _ROOMS.setdefault(name, kind) != kind:
        raise BadInputError(f"there is a room for {name!r} already; choose another name")


def room(engine: str | None) -> RawEngine:
    """The room of an engine; an empty one if it has none.

    Args:
        engine: Its name; None for no engine.

    Raises:
        MissingEngineError: Its room cannot be imported.
    """
    # What is installed is looked through for names that are not known alone: that takes long.
    if engine is None or (engine not in _ROOMS and engine not in room_names()):
        return RawEngine(engine or "")
    module, _, kind = _ROOMS[engine].partition(":")
    try:
        return getattr(importlib.import_module(module), kind)(engine)
    except (ImportError, AttributeError) as error:
        raise_if_interrupted(error)
        raise MissingEngineError(
            f"the room of {engine!r} cannot be loaded from {_ROOMS[engine]!r}: {error}",
            engine=engine,
        ) from error


def rooms_with(method: str) -> list[str]:
    """Names of the engines whose rooms have a method of their own; none of them is imported."""
    rooms = []
    for engine in room_names():
        with suppress(MissingEngineError):
            rooms += [engine] if room(engine).can(method) else []
    return rooms
