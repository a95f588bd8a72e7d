"""MuJoCo without us."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import MissingEngineError
from ...installed import require
from .. import RawEngine

if TYPE_CHECKING:
    from ...description.records import Robot
    from ...drawing.camera import Camera
    from ...drawing.shots import Drawer
    from ...interface import Array, Data, Model
    from ..auditing import Driver
    from ..call_watch import CallWatch
    from ..measured import Phrases
    from ..records import Counterparts, Edit, ModelDifference

_OPTIONS = ("disableflags", "enableflags", "timestep", "gravity", "integrator")


class MujocoEngine(RawEngine):
    """MuJoCo as its own users drive it; it compiles MJCF, and weighs states, for all others."""

    primes = "qacc_warmstart, the accelerations of the step before"
    sharper = 2  # drawn so many times as large, and made smaller: edges are smooth then
    steps = ("mj_step", "mj_step2")
    forwards = ("mj_forward", "mj_kinematics", "mj_fwdPosition")

    def plain_run(self, path: Path, commands: Array, keyframe: int | None) -> Array | None:
        """By MjModel.from_xml_path and mj_step; None: it looks for no ROS packages."""
        from ...backends.binary import is_binary, read_binary

        mujoco = require("mujoco")
        try:
            if is_binary(path):
                model = mujoco.MjModel.from_binary_path(path.name, {path.name: read_binary(path)})
            else:
                model = mujoco.MjModel.from_xml_path(str(path))
        except ValueError:
            return None
        data = mujoco.MjData(model)
        if keyframe is not None:
            mujoco.mj_resetDataKeyframe(model, data, keyframe)
        rows = [np.concatenate((data.qpos, data.qvel))]
        for ctrl in commands:
            data.ctrl[:] = ctrl
            mujoco.mj_step(model, data)
            rows.append(np.concatenate((data.qpos, data.qvel)))
        return np.array(rows)

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """A function of `conventions`."""
        from . import conventions

        return getattr(conventions, question, None)

    def phrases(self) -> Phrases:
        """A Model, a Data, and functions that take both."""
        from .phrasebook import PHRASES

        return PHRASES

    def driver(self, model: Model, seed: int) -> Driver:
        """MjModel, MjData, mj_step."""
        from .audit import MujocoDriver

        return MujocoDriver(model, seed)

    def call_watch(self) -> CallWatch:
        """An MjData and an MjModel show all that is in them."""
        from .calls import MujocoWatch

        return MujocoWatch()

    def mass_matrix(self, model: Model, data: Data, qpos: Array) -> Array:
        """That of the state that the derived arrays of `data` belong to."""
        mass = np.zeros((model.nv, model.nv))
        if model.nv:
            require("mujoco").mj_fullM(model.raw, data.raw, mass)
        return mass

    def prime(self, model: Model, data: Data, before: Mapping[str, Array]) -> None:
        """The solver of contacts begins with the accelerations "qacc" (nv,)."""
        if "qacc" in before:
            data.raw.qacc_warmstart[:] = before["qacc"]

    def read(self, path: Path, name: str) -> Robot:
        """What its compiler makes of it."""
        from .description import loaded

        return loaded(path, name, "engine")

    def read_file(self, path: Path, name: str) -> Robot:
        """What an MJCF says itself; one some of whose meshes are missing is read without them."""
        from .description import read_file

        return read_file(path, name)

    def describe(self, compiled: Any, name: str) -> Robot:
        """The description in an mjModel."""
        from .description import description_of

        return description_of(compiled, name, f"mujoco {require('mujoco').__version__}", "MJCF")

    def differences(
        self, one: Any, two: Any, pairs: Counterparts, *, world: bool = True
    ) -> tuple[ModelDifference, ...]:
        """All that two mjModels differ in and that can change a motion."""
        from .differences import differences

        return differences(one, two, pairs, world=world)

    def sensors(self, one: Any, two: Any, pairs: Counterparts) -> list[ModelDifference]:
        """What their sensors differ in."""
        from .differences import sensors

        return sensors(one, two, pairs)

    def entries(self, two: Any, difference: ModelDifference) -> tuple[ModelDifference, ...]:
        """A difference by its single entries."""
        from .differences import entries

        return entries(two, difference)

    def edited(self, raw: Any, edits: Iterable[Edit]) -> Any:
        """A copy of an mjModel with these edits."""
        from .differences import edited

        return edited(raw, edits)

    def counts(self, compiled: Any) -> dict[str, int]:
        """Its actuators, and the planes of the world."""
        from .given import counts

        return counts(compiled)

    def with_parts(
        self,
        taker: Path,
        giver: Path,
        parts: Collection[str],
        names: Mapping[str, Mapping[str, str]],
    ) -> Any:
        """By MjSpec."""
        from .given import with_parts

        return with_parts(taker, giver, parts, names)

    def energies(self, model: Model, qpos: Array, qvel: Array) -> Array:
        """By mj_energyPos and mj_energyVel."""
        from ...interface import make_data

        mujoco = require("mujoco")
        energies = np.empty((len(qpos), 2))
        with make_data(model) as data:
            raw = data.raw
            for k in range(len(qpos)):
                data.qpos[:], data.qvel[:] = qpos[k], qvel[k]
                mujoco.mj_fwdPosition(model.raw, raw)
                mujoco.mj_energyPos(model.raw, raw)
                mujoco.mj_energyVel(model.raw, raw)
                energies[k] = raw.energy[1], raw.energy[0]
        return energies

    def opengl(self) -> str:
        """The MUJOCO_GL that it draws with here."""
        from ._opengl import offscreen_opengl, opengl_remedy

        require("mujoco")
        opengl = offscreen_opengl()
        if opengl is None:
            remedy = opengl_remedy()
            raise MissingEngineError(
                f"MuJoCo finds no OpenGL to draw with: {remedy}", engine="OpenGL"
            )
        return opengl

    def drawn_by(self, opengl: str) -> str:
        """With the OpenGL that it was told."""
        return f"MuJoCo (MUJOCO_GL={opengl})" if opengl else "MuJoCo"

    def drawer(self, file: Path, size: tuple[int, int], camera: Camera, ghost: bool) -> Drawer:
        """An OpenGL context without a window."""
        from .rendering import MujocoDrawer

        return MujocoDrawer(file, size, camera, ghost)

    def drawing_environment(self, opengl: str, known: dict[str, str]) -> dict[str, str]:
        """With MUJOCO_GL."""
        from ._opengl import environment

        return environment(opengl, known)

    def drawing_diagnosis(self) -> tuple[bool, str, str]:
        """By drawing, each OpenGL in a process of its own."""
        from ._opengl import diagnosis

        return diagnosis()

    def watched_data(self) -> type[Data]:
        """Its verbs are mj_step and mj_forward."""
        from ...backends.mujoco_backend import MujocoData

        return MujocoData

    def origin(self, raw: Any) -> object:
        """The names of an MjModel lie in one memory, its copies' too."""
        return raw.names

    def settings(self, raw: Any) -> dict[str, list[float]]:
        """Options of an MjModel by name, and the checksums of its arrays."""
        values = {
            f"opt.{name}": np.atleast_1d(getattr(raw.opt, name)).tolist() for name in _OPTIONS
        }
        for name in dir(raw):
            value = None if name.startswith("_") else getattr(raw, name)
            if isinstance(value, np.ndarray):
                values[name] = [float(zlib.crc32(value.tobytes()))]
        return values

    def backend(self) -> ModuleType:
        """The backend of MJCF."""
        from ...backends import mujoco_backend

        return mujoco_backend
