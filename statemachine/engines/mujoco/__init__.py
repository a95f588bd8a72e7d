"""MuJoCo without us."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import MissingEngineError
from ...installed import require
from ..methods import function_of
from ..raw_engine import RawEngine

if TYPE_CHECKING:
    from ...interface import Array, Data, Model

_OPTIONS = ("disableflags", "enableflags", "timestep", "gravity", "integrator")


class MujocoEngine(RawEngine):
    """MuJoCo as its own users drive it; it compiles MJCF, and weighs states, for all others."""

    primes = "qacc_warmstart, the accelerations of the step before"
    supersampling = 2  # drawn so many times as large, and made smaller: edges are smooth then
    steps = ("mj_step", "mj_step2")
    forwards = ("mj_forward", "mj_kinematics", "mj_fwdPosition")
    phrases = function_of(".mujoco.conventions:phrases")
    call_watch = function_of(".mujoco.calls:MujocoWatch")
    read = function_of(".mujoco.file_reading:read")
    read_file = function_of(".mujoco.file_reading:read_file")
    read_robot = function_of(".mujoco.robot_reading:read_robot")
    element_names = function_of(".mujoco.description:element_names")
    moment_arms = function_of(".mujoco.moment_arms:moment_arms")
    describe = function_of(".mujoco.description:describe")
    differences = function_of(".mujoco.differences:differences")
    sensors = function_of(".mujoco._sensors:sensors")
    readable = function_of(".mujoco._readable:readable")
    shown_elements = function_of(".mujoco._readable:shown_elements")
    entries = function_of(".mujoco.differences:entries")
    integrator = function_of(".mujoco.differences:integrator")
    flags = function_of(".mujoco.differences:flags")
    edited = function_of(".mujoco.differences:edited")
    can_be_respecified = function_of(".mujoco.respecified:can_be_respecified")
    file_form = function_of(".mujoco.file_form:file_form")
    respecified = function_of(".mujoco.respecified:respecified")
    in_places_of = function_of(".mujoco.respecified:in_places_of")
    counts = function_of(".mujoco.given_parts:counts")
    with_parts = function_of(".mujoco.given_parts:with_parts")
    read_otherwise = function_of(".mujoco.readings:read_otherwise")
    known_changes = function_of(".mujoco.known_changes:known_changes")
    drawer = function_of(".mujoco.rendering:MujocoDrawer")
    drawing_environment = function_of(".mujoco.rendering:environment")
    import_environment = function_of(".mujoco.rendering:import_environment")
    drawing_diagnosis = function_of(".mujoco.rendering:diagnosis")

    def plain_run(self, path: Path, commands: Array, keyframe: int | None) -> Array | None:
        """Return a run by MjModel.from_xml_path and mj_step; None where a ROS package would be
        looked for.
        """
        from ...backends.binary import is_binary, read_binary

        mujoco = require("mujoco")
        try:
            if is_binary(path):
                model = mujoco.MjModel.from_binary_path(path.name, {path.name: read_binary(path)})
            else:
                model = mujoco.MjModel.from_xml_path(str(path))
            data = mujoco.MjData(model)
        except (ValueError, MemoryError, RuntimeError, mujoco.FatalError):
            return None
        if keyframe is not None:
            mujoco.mj_resetDataKeyframe(model, data, keyframe)
        rows = [np.concatenate((data.qpos, data.qvel))]
        for ctrl in commands:
            data.ctrl[:] = ctrl
            mujoco.mj_step(model, data)
            rows.append(np.concatenate((data.qpos, data.qvel)))
        return np.array(rows)

    @contextmanager
    def stepper(
        self, model: Model, qpos: Array, qvel: Array, ctrl: Array
    ) -> Iterator[Callable[[int], object]]:
        """Yield a function that advances by mj_step."""
        mujoco = require("mujoco")
        data = mujoco.MjData(model.raw)
        data.qpos[:], data.qvel[:], data.ctrl[:] = qpos, qvel, ctrl
        yield lambda steps: mujoco.mj_step(model.raw, data, steps)

    def ignored(self, model: Model) -> list[str]:
        """Return the time constants of contacts that the engine raises (its flag refsafe)."""
        raw, off = model.compiled, require("mujoco").mjtDisableBit.mjDSBL_REFSAFE
        if raw is None or raw.opt.disableflags & int(off):
            return []
        times = raw.geom_solref[:, 0]
        raised = int(((times > 0) & (times < 2 * raw.opt.timestep)).sum())
        what = f"a contact's solref below two timesteps acts as two (refsafe; geoms: {raised})"
        return [what] if raised else []

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """Return a function of `conventions`."""
        from . import conventions

        return getattr(conventions, question, None)

    def mass_matrix(self, model: Model, data: Data, qpos: Array) -> Array:
        """Return the mass matrix (nv, nv) of the state that the derived arrays of `data` belong
        to.
        """
        mass = np.zeros((model.nv, model.nv))
        if model.nv:
            require("mujoco").mj_fullM(model.raw, data.raw, mass)
        return mass

    def prime(self, model: Model, data: Data, before: Mapping[str, Array]) -> None:
        """Set the accelerations "qacc" (nv,) with which the solver of contacts begins."""
        if "qacc" in before:
            data.raw.qacc_warmstart[:] = before["qacc"]

    def energies(
        self,
        model: Model,
        qpos: Array,
        qvel: Array,
        made: Callable[[Model], AbstractContextManager[Data]],
    ) -> Array:
        """Return the energies (n, 2) [J] by mj_energyPos and mj_energyVel."""
        from ...interface import reset

        mujoco = require("mujoco")
        energies = np.empty((len(qpos), 2))
        with made(model) as data:
            raw = data.raw
            reset(model, data)
            for k in range(len(qpos)):
                data.qpos[:], data.qvel[:] = qpos[k], qvel[k]
                mujoco.mj_fwdPosition(model.raw, raw)
                mujoco.mj_energyPos(model.raw, raw)
                mujoco.mj_energyVel(model.raw, raw)
                energies[k] = raw.energy[1], raw.energy[0]
        return energies

    def opengl(self) -> str:
        """Return the value of MUJOCO_GL with which the engine draws here.

        Raises:
            MissingEngineError: It finds no OpenGL to draw with.
        """
        from .rendering import offscreen_opengl, opengl_remedy

        require("mujoco")
        opengl = offscreen_opengl()
        if opengl is None:
            raise MissingEngineError(
                f"MuJoCo finds no OpenGL to draw with: {opengl_remedy()}", engine="OpenGL"
            )
        return opengl

    def drawn_by(self, opengl: str) -> str:
        """Return the engine's name, with the OpenGL that it draws with."""
        return f"MuJoCo (MUJOCO_GL={opengl})" if opengl else "MuJoCo"

    def watched_data(self) -> type[Data]:
        """Return a Data whose verbs are mj_step and mj_forward."""
        from ...backends.mujoco_backend import MujocoData

        return MujocoData

    def data_in_other_order(self, model: Model, elements: Mapping[str, Any]) -> Any:
        """Return a Data whose derived arrays are looked up in the Data that it shows."""
        from ...backends.mujoco.other_order import DataInOtherOrder

        return DataInOtherOrder(model, elements)

    def origin(self, raw: Any) -> object:
        """Return the memory of an MjModel's names, which its copies share."""
        return raw.names

    def settings(self, raw: Any) -> dict[str, list[float]]:
        """Return the options of an MjModel by name, and the checksums of its arrays."""
        values = {
            f"opt.{name}": np.atleast_1d(getattr(raw.opt, name)).tolist() for name in _OPTIONS
        }
        for name in dir(raw):
            value = None if name.startswith("_") else getattr(raw, name)
            if isinstance(value, np.ndarray):
                values[name] = [float(zlib.crc32(value.tobytes()))]
        return values

    def backend(self) -> ModuleType:
        """Return the backend of MJCF."""
        from ...backends import mujoco_backend

        return mujoco_backend
