"""PyBullet without us."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ...installed import require
from .. import RawEngine

if TYPE_CHECKING:
    from ...backends import pybullet_backend as backend
    from ...description.records import Robot
    from ...drawing.camera import Camera
    from ...drawing.shots import Drawer
    from ...interface import Array, Data, Model
    from ..auditing import Driver
    from ..call_watch import CallWatch
    from ..measured import Phrases
    from ..records import Dials, LeftAlone, Term, WayBack


class PybulletEngine(RawEngine):
    """PyBullet as its own users drive it."""

    emulated = True
    # Of the servo law, which the backend solves. The engine's own impulses of the step before can
    # be neither read nor written.
    primes = (
        "the contact and friction forces that its servos work against; the engine takes nothing"
    )

    def terms(self, model: Model) -> tuple[Term, ...]:
        """What the interface's names are here, by looking at a loaded model."""
        from .as_it_comes import terms

        return terms(model)

    def left_alone(self, model: Model, seconds: float, joint: int) -> tuple[LeftAlone, ...]:
        """In the engine's own timestep."""
        from .as_it_comes import left_alone

        return left_alone(model, seconds, joint)

    def ways_back(self, model: Model) -> tuple[WayBack, ...]:
        """In the middle of contact."""
        from .as_it_comes import ways_back

        return ways_back(model)

    def dials(self, model: Model, options: Mapping[str, Any]) -> Dials | None:
        """Of a Model with `defaults="engine"`."""
        from ...backends import pybullet_backend as backend
        from .dials import PybulletDials

        if not isinstance(model, backend.PybulletModel) or model.defaults != "engine":
            return None
        emulated = backend.load(model.path).replace(**options)
        return PybulletDials(
            cast("backend.PybulletModel", model.replace(**options)),
            cast("backend.PybulletModel", emulated),
        )

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """A function of `conventions`."""
        from . import conventions

        return getattr(conventions, question, None)

    def phrases(self) -> Phrases:
        """A world behind a number, bodies and joints by number, functions with both."""
        from .phrasebook import PHRASES

        return PHRASES

    def driver(self, model: Model, seed: int) -> Driver:
        """A client, stepSimulation, its own motors and its own ways to save."""
        from .audit import PybulletDriver

        return PybulletDriver(model, seed)

    def call_watch(self) -> CallWatch:
        """Worlds that are told apart by a number only."""
        from .calls import PybulletWatch

        return PybulletWatch()

    def mass_matrix(self, model: Model, data: Data, qpos: Array) -> Array:
        """With the rotors that the backend adds.

        NaN for free bodies, of which the engine does not tell it, and between trees.
        """
        from ...backends._bullet_client import pb
        from ...backends._bullet_ghost import ghost_of

        # What is stepped carries the armature in links of its own: the ghost is the true arm.
        own = cast("backend.PybulletModel", model)
        world = data.raw if own.defaults == "engine" else ghost_of(own.plan)
        armature = model.capabilities.behaviours["armature"].support != "unsupported"
        mass = super().mass_matrix(model, data, qpos)
        for tree in world.trees:
            if tree.joints:
                places = qpos[tree.qpos].tolist()
                own = np.array(pb.calculateMassMatrix(tree.body, places, 0, world.client))
                if armature:
                    own += np.diag(model.dof_armature[tree.dofs])
                mass[np.ix_(tree.dofs, tree.dofs)] = own
        return mass

    def prime(self, model: Model, data: Data, before: Mapping[str, Array]) -> None:
        """The servo law knows the forces (nv,) of the step before."""
        from ...interface import get_state, set_state

        state = get_state(model, data)
        parts = {name: state[name].copy() for name, _ in state.layout}
        for part, force in (("contact", "qfrc_contact"), ("friction", "qfrc_friction")):
            if part in parts and force in before:
                parts[part][:] = before[force]
        set_state(model, data, replace(state, blob=np.concatenate(list(parts.values())).tobytes()))

    def read(self, path: Path, name: str) -> Robot:
        """Of a URDF what loadURDF leaves, else what the backend loads."""
        from .reading import read

        return read(path, name)

    def opengl(self) -> str:
        """Nothing that it needs beside itself."""
        require("pybullet")
        return ""

    def drawn_by(self, opengl: str) -> str:
        """It needs no OpenGL."""
        return "PyBullet's software renderer"

    def drawer(self, file: Path, size: tuple[int, int], camera: Camera, ghost: bool) -> Drawer:
        """A world for each side."""
        from .rendering import PybulletDrawer

        return PybulletDrawer(file, size, camera, ghost)

    def backend(self) -> ModuleType:
        """The backend, which takes what MuJoCo's compiler makes of a file."""
        from ...backends import pybullet_backend

        return pybullet_backend
