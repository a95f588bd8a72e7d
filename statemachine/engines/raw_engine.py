"""The room of an engine: what is asked of it without us, each method optional."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .compiled_models import CompiledModels
from .methods import mandatory

if TYPE_CHECKING:
    from ..interface import Array, Data, Model
    from ..show.drawing.scene import Camera, Drawer
    from .call_watch import CallWatch
    from .measured import Phrases
    from .records import (
        Dials,
        EngineTerm,
        KnownChange,
        RunArrays,
        UncommandedJoint,
        WayBack,
    )


class RawEngine(CompiledModels):
    """An engine as its own users drive it; each method is optional.

    Attributes:
        name: The engine's.
        emulated: Whether the backend emulates some of the contract, so that what the engine does
            must not be read from there.
        primes: What of the step before the engine takes, in words; "" for nothing.
        supersampling: It draws so many times as large as a picture is shown.
        steps: Names of its functions f(model, data[, nstep]) that advance time.
        forwards: Names of those f(model, data) that only recompute.
        survives_fork: Whether a model that ran in a process may run in a fork of it.
        tells_acceleration: Whether qacc is what the forces give, before it is integrated; else it
            is what the velocities change by in the step.
    """

    emulated = False
    primes = ""
    supersampling = 1
    steps: tuple[str, ...] = ()
    forwards: tuple[str, ...] = ()
    survives_fork = True
    tells_acceleration = True

    def __init__(self, name: str) -> None:
        self.name = name

    def can(self, method: str) -> bool:
        """Tell whether the engine's room defines a method."""
        return getattr(type(self), method) is not getattr(RawEngine, method)

    def ignored(self, model: Model) -> list[str]:
        """Return what of a Model's file its backend leaves out, each in a few words."""
        return []

    def read_otherwise(self, left: Model, right: Model) -> list[str]:
        """Say what only one of two releases of the engine reads in the file of both Models."""
        return []

    def reader(self, model: Model) -> str:
        """Return what reads the file of a Model, with its version: "mujoco 4.0.0".

        By default it is the engine itself.
        """
        return f"{self.name} {model.engine_version}"

    def figures_as_read(self, model: Model) -> Any:
        """Return the figures that the reader of a Model's file made of it: masses, gains, options …

        By default they are those of the Model.

        Returns:
            A compiled model of the installed MuJoCo; None where the reader does not tell them.
        """
        return model.compiled

    def known_changes(
        self, left: Model, right: Model, runs: tuple[RunArrays, RunArrays]
    ) -> list[KnownChange]:
        """Return the known changes between two releases that concern a run of both."""
        return []

    # The engine as it comes. Nothing here goes through an adapter that emulates the contract.

    def terms(self, model: Model) -> tuple[EngineTerm, ...]:
        """Return what the interface calls things, and what the engine does."""
        return ()

    def uncommanded_joint(
        self, model: Model, seconds: float, joint: int
    ) -> tuple[UncommandedJoint, ...]:
        """Return how a joint moves that nobody commands, on four freshly loaded models.

        As it comes; with the model's gravity; without the engine's own motors too; and
        without the damping of joints.

        Args:
            model: A Model on this engine.
            seconds: Simulated time.
            joint: Id of a hinge or slide.
        """
        return ()

    def restore_methods(self, model: Model) -> tuple[WayBack, ...]:
        """Return which of the engine's own ways to go back to an earlier state is exact."""
        return ()

    def unlike_its_users(self, model: Model) -> list[str]:
        """Say what a run behind the contract has that the engine's own users do not have."""
        return []

    def would_float(self, model: Model) -> bool:
        """Tell whether the engine's own loader lets a base float that is fixed in a Model."""
        return False

    def dials(self, model: Model, options: Mapping[str, Any]) -> Dials | None:
        """Return the dials between the engine as it comes and the contract; None for any other
        Model.
        """
        return None

    def plain_run(self, path: Path, commands: Array, keyframe: int | None) -> Array | None:
        """Return a run of a file as the engine's own users run it, where the interface promises the
        same bits.

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
        """Return what measures the answer to a question of `probes.conventions`; None if nothing
        does.
        """
        return None

    def phrases(self) -> Phrases:
        """Return which of its calls does what, as lines to type."""
        from .measured import Phrases

        return Phrases(("", ""), {})

    @mandatory
    @abstractmethod
    def stepper(
        self, model: Model, qpos: Array, qvel: Array, ctrl: Array
    ) -> AbstractContextManager[Callable[[int], object]]:
        """Return a function that advances a simulation by so many steps, by the engine's own
        functions alone.

        Args:
            model: A Model on this engine.
            qpos: (nq,) where it starts.
            qvel: (nv,) its velocities there.
            ctrl: (nu,) the command.
        """

    @mandatory
    @abstractmethod
    def call_watch(self) -> CallWatch:
        """Return which of its functions can be watched, and what they change."""

    # One step from a given state, past the interface.

    def mass_matrix(self, model: Model, data: Data, qpos: Array) -> Array:
        """Return the engine's mass matrix (nv, nv) at a pose, armature included; NaN if not told.

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
                other side offers: "qacc", "qfrc_contact", "qfrc_friction".
        """

    # Pictures without a screen.

    @mandatory
    @abstractmethod
    def opengl(self) -> str:
        """Return the OpenGL that it draws with here; "" for its own choice, or where none is
        needed.

        Raises:
            MissingEngineError: It cannot draw here; the message says why, and what to do.
        """

    @mandatory
    @abstractmethod
    def drawn_by(self, opengl: str) -> str:
        """Return what a reader is told of what draws."""

    @mandatory
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

    @mandatory
    @abstractmethod
    def drawing_environment(self, opengl: str, known: dict[str, str]) -> dict[str, str]:
        """Return the environment of a process in which the engine takes this OpenGL."""

    @mandatory
    @abstractmethod
    def drawing_diagnosis(self) -> tuple[bool, str, str]:
        """Tell whether it draws here, what was found, and the next step if there is one."""

    def import_environment(self) -> dict[str, str]:
        """Return environment variables with which the engine is imported sooner."""
        return {}

    # What a student can do with it past the interface, and where a fault is seeded.

    def watched_data(self) -> type[Data] | None:
        """Return the backend's Data whose verbs call `steps` and `forwards`; None: nothing is
        watched.
        """
        return None

    @mandatory
    @abstractmethod
    def origin(self, raw: Any) -> object:
        """Return an object that an engine's own model and its copies have in common, and no
        other.
        """

    def settings(self, raw: Any) -> dict[str, list[float]]:
        """Return the settings of an engine's own model that a student can change, by name."""
        return {}

    @mandatory
    @abstractmethod
    def backend(self) -> ModuleType:
        """Return the backend's module, with `compile_file`, `facts` and `edited`, to put a fault
        in.
        """
