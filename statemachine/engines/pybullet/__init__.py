"""PyBullet without us."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ...errors import UnsupportedError
from ...installed import require
from ..methods import function_of
from ..raw_engine import RawEngine

if TYPE_CHECKING:
    from ...backends import pybullet_backend as backend
    from ...interface import Array, Data, Model
    from ..records import Dials


class PybulletEngine(RawEngine):
    """PyBullet as its own users drive it."""

    emulated = True
    # Of the servo law, which the backend solves. The engine's own impulses of the step before can
    # be neither read nor written.
    primes = (
        "the contact and friction forces that the servos work against, but not the engine's own "
        "contact impulses, which cannot be set"
    )
    terms = function_of(".pybullet.as_it_comes:terms")
    uncommanded_joint = function_of(".pybullet.as_it_comes:uncommanded_joint")
    restore_methods = function_of(".pybullet.as_it_comes:restore_methods")
    phrases = function_of(".pybullet.conventions:phrases")
    stepper = function_of(".pybullet.driven:stepper")
    call_watch = function_of(".pybullet.calls:PybulletWatch")
    read = function_of(".pybullet.reading:read")
    reader = function_of(".pybullet.figures:reader")
    figures_as_read = function_of(".pybullet.figures:figures_as_read")
    drawer = function_of(".pybullet.rendering:PybulletDrawer")

    def dials(self, model: Model, options: Mapping[str, Any]) -> Dials | None:
        """Return the dials of a Model with `defaults="engine"`, None for any other.

        Raises:
            UnsupportedError: PyBullet fixes the floating base of the model.
        """
        from ...backends import pybullet_backend as backend
        from .dials import PybulletDials, with_parts_of

        if not isinstance(model, backend.PybulletModel) or model.defaults != "engine":
            return None
        if backend.base_stands(model):
            raise UnsupportedError(
                f"PyBullet makes a fixed joint of the floating joint of {model.path.name}: what "
                "else differs from a run on @pybullet cannot be told apart from that",
                backend=model.backend,
                feature="causes of a gap",
                reason="a floating joint is fixed",
            )
        of_file = backend.load(model.path, read_options=model.read_options)
        emulated = with_parts_of(of_file, model).replace(**options)
        return PybulletDials(model.replace(**options), emulated)

    def unlike_its_users(self, model: Model) -> list[str]:
        from ...backends.bullet.file import UrdfFile
        from ...backends.pybullet_backend import PybulletModel

        if not isinstance(model, PybulletModel) or model.defaults == "engine":
            return []
        whole = UrdfFile.is_one(model.path)
        pairs = len(model.plan.surfaces.of_one_robot(whole))
        if not pairs:
            return []
        several = f"{pairs} pairs" if pairs > 1 else "one pair"
        return [
            f"on {model.backend} the links of one robot can touch each other, as in MuJoCo "
            f"({several}); PyBullet's users have that only with URDF_USE_SELF_COLLISION"
        ]

    def would_float(self, model: Model) -> bool:
        from ...backends.pybullet_backend import PybulletModel

        if not isinstance(model, PybulletModel) or model.plan.file is None:
            return False  # an MJCF says it, and the URDF that is written of it is loaded so
        return model.plan.file.may_float and not model.plan.file.floats

    def ignored(self, model: Model) -> list[str]:
        from ...backends.bullet.scope import as_targets, ignored
        from ...backends.pybullet_backend import PybulletModel

        if not isinstance(model, PybulletModel):
            return []
        return (as_targets if model.defaults == "engine" else ignored)(model.plan)

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """Return a function of `conventions`."""
        from . import conventions

        return getattr(conventions, question, None)

    def mass_matrix(self, model: Model, data: Data, qpos: Array) -> Array:
        """Return the mass matrix (nv, nv), with the rotors that the backend adds.

        NaN for free bodies, of which the engine does not tell it, and between trees.
        """
        from ...backends.bullet.driven import ghost_of

        # What is stepped carries the armature in links of its own: the ghost is the true arm.
        own = cast("backend.PybulletModel", model)
        world = data.raw if own.defaults == "engine" else ghost_of(own.plan)
        armature = model.capabilities.behaviours["armature"].support != "unsupported"
        mass = super().mass_matrix(model, data, qpos)
        for tree in world.trees:
            if tree.driven:
                own = world.mass_matrix(tree, qpos[tree.qpos].tolist())
                if armature:
                    own += np.diag(model.dof_armature[tree.dofs])
                mass[np.ix_(tree.dofs, tree.dofs)] = own
        return mass

    def prime(self, model: Model, data: Data, before: Mapping[str, Array]) -> None:
        """Set the forces (nv,) of the step before, which the servo law uses."""
        from ...interface import get_state, set_state

        forces = {"contact": "qfrc_contact", "friction": "qfrc_friction"}
        given = {part: before[force] for part, force in forces.items() if force in before}
        set_state(model, data, get_state(model, data).with_parts(**given))

    def opengl(self) -> str:
        """Return nothing: the engine needs no OpenGL."""
        require("pybullet")
        return ""

    def drawn_by(self, opengl: str) -> str:
        """Return the engine's name; it needs no OpenGL."""
        return "PyBullet's software renderer"

    def backend(self) -> ModuleType:
        """Return the backend, which takes what MuJoCo's compiler makes of a file."""
        from ...backends import pybullet_backend

        return pybullet_backend
