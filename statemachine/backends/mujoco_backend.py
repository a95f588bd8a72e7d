"""MuJoCo behind the contract. The caller owns the state: a Data *is* an MjData.

Everything is native here: the inputs are the engine's memory, the derived arrays
its own buffers, seen read-only.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np

from ..errors import BadInputError, StateMachineError
from ..interface import (
    BEHAVIOURS,
    FORCES,
    INPUTS,
    MOCAP,
    OPTIONS,
    POSES,
    Behaviour,
    Capabilities,
    Contacts,
    Data,
    Model,
    State,
)
from ..interface.checks import HUGE, TINY, check_vector, engine_steps, unsupported
from ..interface.records import AS_WRITTEN, Defaults, ReadOptions, StateLayout
from ..models import AnyPath
from .compiled.model import check_numbers, compile_file, compiler_warnings, facts
from .compiled.spec_files import ENGINE_ERRORS
from .mujoco.alarms import AlarmError, Alarms, end_error, gave_up, pass_on, resets_itself
from .served.release_parts import constraint_part, contact_arrays

# Not RK4: after its step the derived values are neither of the state before nor after.
INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}
_NATIVE = Behaviour("native", "the engine's own")
_NOTES = {
    "position servo": Behaviour(
        "native", "the engine's own; an infinite ctrl is clamped to its range, or refused"
    ),
    "latency": Behaviour(
        "native",
        "the engine's own delay of an actuator, in whole engine steps; with the option latency the "
        "command before a keyframe was that of the keyframe, where a file's own delay finds zero",
    ),
    "forces by part": Behaviour("native", "rows of the constraint solver, by their type"),
    "exact restore": Behaviour("native", "mjSTATE_INTEGRATION, warm start included"),
    "no automatic reset": Behaviour(
        "native",
        "the engine's flag mjDSBL_AUTORESET; DivergedError where qpos, qvel or qacc is beyond "
        f"{HUGE:g}, the engine's own bound",
    ),
}


def capabilities(raw: mujoco.MjModel) -> Capabilities:
    """Return the record of one compiled model: two of its own settings show in it."""
    behaviours = {name: _NOTES.get(name, _NATIVE) for name in BEHAVIOURS}
    if raw.opt.integrator == int(mujoco.mjtIntegrator.mjINT_RK4):
        behaviours["stale after a step"] = Behaviour(
            "unsupported", "with RK4 derived values are those of its fourth stage"
        )
    if resets_itself(raw):
        behaviours["no automatic reset"] = Behaviour(
            "unsupported", "the engine's default: it resets, and the divergence is raised after"
        )
    asleep = bool(raw.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP))
    if asleep:
        behaviours["exact restore"] = Behaviour(
            "unsupported", "the counters of sleeping bodies are in no State"
        )
    return Capabilities(
        options=tuple(name for name in OPTIONS if name != "max_qvel"),
        integrators=tuple(INTEGRATORS),
        behaviours=behaviours,
        shared_model=True,
        exact_restore=not asleep,
    )


_DISABLE = mujoco.mjtDisableBit
_INTEGRATION = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def _is_component(bits: int) -> bool:
    """Tell whether these are the bits of a single component of the integration state."""
    return bits.bit_count() == 1 and bool(bits & _INTEGRATION)


# Every single component of the integration state, in the engine's own order.
STATE_COMPONENTS = {
    name.removeprefix("mjSTATE_").lower(): bit
    for name, bit in mujoco.mjtState.__members__.items()
    if name != "mjNSTATE" and _is_component(int(bit))
}


def load(
    path: Path, defaults: Defaults = "model", read_options: ReadOptions = AS_WRITTEN
) -> MujocoModel:
    """Compile an MJCF, URDF or MJB file.

    Args:
        path: The file.
        defaults: "engine" leaves the engine's automatic reset as the file has it
            (a divergence is raised all the same); nothing else differs, since
            nothing is emulated on MuJoCo.
        read_options: How the file is read.

    Raises:
        ModelError: MuJoCo cannot compile the file; with its reason.
    """
    with compiler_warnings() as texts:
        raw = compile_file(path, read_options)
    if defaults == "model":
        raw.opt.disableflags |= int(_DISABLE.mjDSBL_AUTORESET)
    pass_on(texts, stacklevel=4)
    return MujocoModel(raw, path, substeps=1)


class MujocoModel(Model):
    """A compiled mjModel, shared by all its Data."""

    raw: mujoco.MjModel

    def __init__(self, raw: mujoco.MjModel, path: Path, substeps: int) -> None:
        super().__init__(
            backend="mujoco",
            engine_version=mujoco.__version__,
            path=path,
            raw=raw,
            capabilities=capabilities(raw),
            timestep=float(raw.opt.timestep) * substeps,
            substeps=substeps,
            **facts(raw),
        )

    @property
    def compiled(self) -> mujoco.MjModel:
        return self.raw

    def save_binary(self, path: AnyPath) -> None:
        """Write the compiled model as a binary model (.mjb).

        `load` takes it back with `trust_binary=True`.

        Args:
            path: The file; one that is there is replaced.

        Raises:
            OSError: It cannot be written.
        """
        from .compiled.binary_models import saved

        Path(path).write_bytes(saved(self.raw).tobytes())

    def with_compiled(self, compiled: mujoco.MjModel) -> MujocoModel:
        check_numbers(compiled, str(self.path))
        return MujocoModel(compiled, self.path, self.substeps)._inherit_start(self, {})

    def _make_data(self) -> MujocoData:
        try:
            return MujocoData(self)
        except StateMachineError:
            raise
        except ENGINE_ERRORS as error:
            raise gave_up(error) from error

    def _make_worlds(
        self, n: int, workers: int, derived: tuple[str, ...], options: dict[str, Any]
    ) -> Any:
        from .edits import CONSTANTS_FOLLOW
        from .mujoco.worlds import MujocoWorlds

        base, arrays = self._varied(options) if options else (self, {})
        follow = bool(CONSTANTS_FOLLOW & options.keys())
        layout = partial(_layout, base)
        return MujocoWorlds(self, base, (n, workers), derived, (arrays, follow), layout)

    def _varied(self, options: dict[str, Any]) -> tuple[MujocoModel, dict[str, Any]]:
        """Return what worlds share, and the arrays of the compiled model that each has of its own.

        Args:
            options: Checked options of `replace`, each with a value for each world.

        Returns:
            A Model, and (n, ...) arrays by name; see `changes`.
        """
        from .edits import step_length, varied

        self._check_friction(options)
        given = {name: np.array(values) for name, values in options.items()}
        substeps = given.pop("substeps", np.array([self.substeps]))
        if (substeps != substeps[0]).any():
            raise BadInputError("substeps must be the same in all worlds: they step together")
        count = int(substeps[0])
        if "integrator" in given:
            given["integrator"] = np.array([int(INTEGRATORS[n]) for n in options["integrator"]])
        if "timestep" in given:
            lengths = [step_length(length, count, {}) for length in options["timestep"]]
            given["timestep"] = np.array(lengths)
        raw = copy.copy(self.raw)
        # As `_replace` has it, so that a timestep is the same to the last bit.
        raw.opt.timestep = step_length(self.timestep, count, {})
        raw, arrays = varied(raw, given)
        return MujocoModel(raw, self.path, count)._inherit_start(self, options), arrays

    def _check_friction(self, options: Mapping[str, Any]) -> None:
        """Raise UnsupportedError where the friction of geoms would be without effect."""
        override = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
        if "friction" in options and self.raw.opt.enableflags & override:
            reason = "the file overrides the friction of all contacts (flag override)"
            raise unsupported(self, "friction", reason)

    def _replace(self, options: dict[str, Any]) -> MujocoModel:
        from .edits import edited, step_length

        self._check_friction(options)
        substeps = options.get("substeps", self.substeps)
        try:
            raw = edited(self.raw, options, step_length(self.timestep, substeps, options))
        except StateMachineError:
            raise
        except ENGINE_ERRORS as error:
            raise gave_up(error) from error
        if "integrator" in options:
            raw.opt.integrator = int(INTEGRATORS[options["integrator"]])
        return MujocoModel(raw, self.path, substeps)


class MujocoData(Data):
    """An MjData. Inputs and derived arrays are views of its memory."""

    __slots__ = ("_alarms", "_views")

    _raw: mujoco.MjData | None
    _alarms: Any  # Alarms; None once closed

    def __init__(self, model: MujocoModel) -> None:
        raw = mujoco.MjData(model.raw)
        alarms = Alarms(model.raw, raw)
        # Views of their own, so that what raw shows stays writable.
        views = {name: getattr(raw, name).view() for name in (*POSES, "qacc", *FORCES)}
        for view in views.values():
            view.setflags(write=False)
        self._views, self._alarms = views, alarms
        self._layout = _layout(model, model.raw.nhistory)
        inputs = {name: getattr(raw, name).view() for name in (*INPUTS, *MOCAP)}
        super().__init__(
            model,
            _transition(model, raw),
            inputs,
            (alarms.now, alarms.seen),
            (model.raw, raw),
        )

    @property
    def raw(self) -> mujoco.MjData:
        if self._raw is None:
            self._refuse_if_unusable()
        return cast("mujoco.MjData", self._raw)

    @property
    def time(self) -> float:
        return self.raw.time

    def _derive(self, name: str) -> Any:
        if name == "contacts":
            return Contacts(**contact_arrays(self._model.raw, self.raw))
        array = self._views.get(name)
        if array is None:
            array = constraint_part(self._model.raw, self.raw, name)
            array.setflags(write=False)
        return array

    def _recompute(self) -> None:
        mujoco.mj_forward(self._model.raw, self.raw)
        self._raise_pending_warnings()

    def _reset(self, key: int | None) -> None:
        if key is None:
            mujoco.mj_resetData(self._model.raw, self.raw)
        else:
            mujoco.mj_resetDataKeyframe(self._model.raw, self.raw, key)
            if self._model._holds_start:
                from .delays import hold

                hold(self._model.raw, self.raw.history, self.raw.ctrl)
        self._alarms.clear()

    def _get_state(self) -> State:
        fingerprint, layout = self._layout
        vector = np.empty(sum(size for _, size in layout))
        mujoco.mj_getState(self._model.raw, self.raw, vector, _INTEGRATION)
        check_vector(vector, layout, self._model)
        return State("mujoco", mujoco.__version__, fingerprint, layout, vector.tobytes())

    def _set_state(self, state: State) -> None:
        # A reset first: it clears the counters, without which a second divergence
        # would go unreported, and whatever else the last run left behind.
        mujoco.mj_resetData(self._model.raw, self.raw)
        mujoco.mj_setState(self._model.raw, self.raw, state.vector, _INTEGRATION)
        self._alarms.clear()

    def _set_time(self, time: float) -> None:
        self.raw.time = time

    def _close(self) -> None:
        self._alarms = None
        self._views.clear()

    def _raise_pending_warnings(self) -> None:
        if self._pending_warnings != self._seen_warnings:
            self._alarms.raise_pending()

    def _failed(self, error: Exception) -> None:
        if isinstance(error, mujoco.FatalError):
            fatal = gave_up(error)
            self._make_unusable(str(fatal))
            raise fatal from error
        if isinstance(error, AlarmError):
            entry = error.entry(self._model)
            command = error.quantity == "ctrl"
            diverged = f"{entry} was not finite at time {error.time:g} s"
            self._make_unusable(f"it was stepped with a bad {entry}" if command else diverged)
            raise end_error(self._model, error, "This Data") from None


def _transition(model: MujocoModel, raw: mujoco.MjData) -> Callable[..., None]:
    """Return the engine's step, of (mjModel, mjData, nstep=1); Python runs only where it must."""
    mj_step, substeps = mujoco.mj_step, model.substeps

    def finer(engine_model: mujoco.MjModel, engine_data: mujoco.MjData, nstep: int = 1) -> None:
        mj_step(engine_model, engine_data, engine_steps(nstep, substeps))

    advance = mj_step if substeps == 1 else finer
    qpos, low, high = memoryview(raw.qpos), -TINY, TINY
    starts = [start for _, start in model._quaternions]
    if not starts:
        return advance
    only = starts[0]

    # MuJoCo takes a zero quaternion for the identity without a word. One whose first number
    # is not zero is not zero, which is the cheapest test; others are looked at again.
    def checked(engine_model: mujoco.MjModel, engine_data: mujoco.MjData, nstep: int = 1) -> None:
        for start in starts:
            if low < qpos[start] < high:
                model._check_quaternions(engine_data.qpos)
        advance(engine_model, engine_data, nstep)

    def checked_one(
        engine_model: mujoco.MjModel, engine_data: mujoco.MjData, nstep: int = 1
    ) -> None:
        if qpos[only] < high and qpos[only] > low:
            model._check_quaternions(engine_data.qpos)
        advance(engine_model, engine_data, nstep)

    return checked_one if len(starts) == 1 else checked


def _layout(model: MujocoModel, nhistory: int) -> StateLayout:
    """Return the fingerprint and layout of the States of a model.

    Args:
        model: The Model.
        nhistory: Size of the buffers of a Data.
    """
    sizes = {
        name: int(mujoco.mj_stateSize(model.raw, int(bit)))
        for name, bit in STATE_COMPONENTS.items()
    }
    sizes["history"] = nhistory
    always = ("time", *INPUTS)  # even where they are empty
    layout = tuple((name, size) for name, size in sizes.items() if size or name in always)
    return model._with_fingerprint(layout)
