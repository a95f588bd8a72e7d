"""Model and Data of an engine that keeps a world of its own.

The arrays of the Data lie beside the world. What is written into them reaches the world with
the next step; what the engine does reaches them at its end. What is derived is computed when it
is read, from a copy of the moment that it belongs to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..errors import DivergedError, EngineError
from ..interface import (
    DERIVED,
    INPUTS,
    MOCAP,
    POSES,
    Array,
    Contacts,
    Data,
    Ints,
    Keyframe,
    Model,
    State,
)
from ..interface.checks import HUGE, check_entries, check_writable, engine_steps, unsupported
from .hidden_world import HiddenWorld, LookAhead, Memory, Moment, bounded


class HiddenModel(Model):
    """A Model whose every Data has a world of its own.

    Attributes:
        max_qvel: (nv,) [rad/s or m/s]; a step after which a velocity is beyond it raises
            DivergedError.
    """

    max_qvel: Array
    _open_world: Callable[[], HiddenWorld]
    _look_ahead: LookAhead

    def __init__(self, open_world: Callable[[], HiddenWorld], **facts: Any) -> None:
        """Fill in the facts.

        Args:
            open_world: Opens a world; to be pickled with the Model.
            **facts: What `Model.__init__` wants, and max_qvel, which is `HUGE` by default; see
                `compiled.fastest`.
        """
        facts.setdefault("max_qvel", np.full(facts["nv"], HUGE))
        super().__init__(_open_world=open_world, _look_ahead=LookAhead(open_world), **facts)

    def _make_data(self) -> HiddenData:
        return HiddenData(self)


class Machine:
    """The state of one Data, and the step that advances it.

    A step is all of it or nothing, also when it is interrupted. A write is seen by its bytes.

    Attributes:
        qpos, qvel, ctrl, mocap_pos, mocap_quat: The Data's arrays.
        commands: The last three in a row: what is commanded.
        time: Simulated time [s].
        past_commands: (steps, nu) the commands of the last engine steps, the newest last: as many
            as the longest latency takes.
        world: Where the engine is; another one after some resets.
        moment: What is derived belongs to it; None on a fresh or reset Data.
        derived: What was read of that so far, by name.
    """

    def __init__(self, model: HiddenModel) -> None:
        self._model, self._substeps = model, model.substeps
        self._bounds = np.full(model.nq, HUGE), np.minimum(model.max_qvel, HUGE)
        self._fastest = float(self._bounds[1].min(initial=HUGE))
        self.world = model._open_world()
        self.qpos, self.qvel = np.zeros(model.nq), np.zeros(model.nv)
        self.commands = np.zeros(model.nu + 7 * model.nmocap)
        self.ctrl, places, turns = np.split(self.commands, [model.nu, model.nu + 3 * model.nmocap])
        self.mocap_pos, self.mocap_quat = places.reshape(-1, 3), turns.reshape(-1, 4)
        self._delay_steps = np.rint(model.actuator_delay / self.world.timestep).astype(np.int64)
        self._longest_delay = int(self._delay_steps.max(initial=0))
        self._used = False
        self.reset(None)

    def reset(self, key: int | None) -> None:
        """Be in the default state, or in a keyframe's."""
        silent, still = np.zeros(len(self.ctrl)), np.zeros(len(self.qvel))
        model, qpos0 = self._model, self.world.qpos0
        led = model.mocap_pos0, model.mocap_quat0
        default = Keyframe("", 0.0, qpos0, still, silent, *led)
        frame = default if key is None else model.keyframes[key]
        commands = np.concatenate([frame.ctrl, frame.mocap_pos.ravel(), frame.mocap_quat.ravel()])
        start = Moment(frame.qpos, frame.qvel, commands, self.world.memory_at(key))
        before = frame.ctrl if model._holds_start else silent
        self.restart(frame.time, start, np.tile(before, (self._longest_delay, 1)))

    def restart(self, time: float, start: Moment, past_commands: Array) -> None:
        """Take a state whole; nothing of before has any part in what follows.

        Args:
            time: Of the state [s].
            start: The state; its ctrl is what the Data's commands are.
            past_commands: The commands before it; see `past_commands` of the class.
        """
        if self._used:
            self.world = self.world.renewed()
            self._used = False
        self.time = time
        self.qpos[:], self.qvel[:], self.commands[:] = start.qpos, start.qvel, start.ctrl
        self.past_commands = past_commands
        self._place(start.memory)
        self._command()
        self.moment: Moment | None = None
        self.derived: dict[str, Any] = {}

    def _place(self, memory: Memory) -> None:
        # Until all is in its place the world is elsewhere, and `_memory` says what it is to know.
        self._world_is_elsewhere, self._world_knows_moment, self._memory = True, False, memory
        qpos, qvel = self.qpos.copy(), self.qvel.copy()
        self.world.place(qpos, qvel, memory)
        # What the arrays were left at, and its bytes, by which a write is seen.
        self._last_state = qpos, qvel, qpos.tobytes(), qvel.tobytes()
        self._world_is_elsewhere = False

    def _command(self) -> None:
        """Take the command as it is now, and pass on what acts."""
        self._commands_taken = b"?"  # until the world has taken it
        self._ctrl, commanded = self.ctrl.copy(), self.commands.tobytes()
        self._pass_on(self.past_commands)
        self._commands_taken = commanded

    def _pass_on(self, past_commands: Array) -> None:
        """Tell the world the command that acts in its next step."""
        self._acting = self._acts(self._ctrl, past_commands)
        self.world.command(self._acting)

    def _acts(self, ctrl: Array, past_commands: Array) -> Array:
        """Return the values that act in a step: a command, late where there is a latency, and
        the mocap bodies.
        """
        commands = self.commands.copy()
        commands[: len(ctrl)] = self._model._acting(
            "ctrl", acting(ctrl, past_commands, self._delay_steps)
        )
        return commands

    def run(self, _model: None, _data: None, nstep: int = 1) -> None:
        """Advance by `nstep` timesteps; all of it or, if anything is raised, nothing."""
        steps = engine_steps(nstep, self._substeps)
        check_writable(self.qpos, "qpos")
        check_writable(self.qvel, "qvel")
        world = self.world
        if self.commands.tobytes() != self._commands_taken:
            acting = self._model._acting("ctrl", self.ctrl)
            check_entries(acting, "ctrl", self._model._coordinate_name)
            for name in MOCAP:
                check_entries(getattr(self, name).ravel(), name)
            self._command()
        written = self._written
        if written:
            check_entries(self.qpos, "qpos", self._model._coordinate_name)
            check_entries(self.qvel, "qvel", self._model._coordinate_name)
            self._model._check_quaternions(self.qpos)
        if written or self._world_is_elsewhere:
            self._place(self._remembered(written))
        self._used, start = True, world.memory
        derived_before = self.moment, self.derived
        try:
            time, past_commands, before, memory = (
                self.time,
                self.past_commands,
                self._last_state[:2],
                start,
            )
            if steps > 1:
                for count in [1] * (steps - 1) if self._longest_delay else [steps - 1]:
                    time, past_commands = self._ahead(time, past_commands, count)
                before, memory = world.read(), world.memory
            past_commands = self._commands(past_commands)
            world.step()
            time += world.timestep
            moment = Moment(*before, self._acting, memory)
            qpos, qvel = world.read()
            if not bounded(qpos, qvel, self._fastest):
                self._diverge(time)
            left = qpos, qvel, qpos.tobytes(), qvel.tobytes()
            self.moment, self._world_knows_moment, self.derived = moment, True, {}
            # Nothing can interrupt this line, and no other moves the Data.
            self.qpos[:], self.qvel[:], self.time, self._last_state, self.past_commands = (
                qpos,
                qvel,
                time,
                left,
                past_commands,
            )
        except BaseException:
            # The engine is elsewhere now; the arrays are not, nor is what else is known.
            self._world_is_elsewhere, self._world_knows_moment, self._memory = True, False, start
            self.moment, self.derived = derived_before
            raise

    def _ahead(self, time: float, past_commands: Array, count: int) -> tuple[float, Array]:
        """Take engine steps before the last; the time after them, and the commands until then."""
        past_commands, timestep = self._commands(past_commands), self.world.timestep
        for _ in range(self.world.advance(count, self._fastest)):
            time += timestep
        if self.world.diverging(self._fastest):
            self._diverge(time)
        return time, past_commands

    def _commands(self, past_commands: Array) -> Array:
        """Pass on what acts in the next step; the commands until after it."""
        if not self._longest_delay:
            return past_commands
        self._pass_on(past_commands)
        return np.concatenate([past_commands[1:], self._ctrl[None]])

    def _diverge(self, time: float) -> None:
        """Raise DivergedError for the first coordinate that is not finite, or beyond its bound."""
        for name, array, most in zip(INPUTS, self.world.read(), self._bounds, strict=False):
            bad = np.flatnonzero(~(np.abs(array) <= most))
            if len(bad):
                index = int(bad[0])
                entry = f"{name}[{index}]{self._model._coordinate_name(name, index)}"
                what = "became NaN, infinite or huge"
                if abs(array[index]) < HUGE:
                    what = f"= {array[index]:.3g} went beyond max_qvel, {most[index]:.3g},"
                raise DivergedError(
                    f"{entry} {what} at time {time:g} s. "
                    "This Data now takes only reset and set_state",
                    quantity=name,
                    index=index,
                    time=time,
                )

    @property
    def _written(self) -> bool:
        """Tell whether qpos or qvel was written since the engine left it."""
        return self._last_state[2:] != (self.qpos.tobytes(), self.qvel.tobytes())

    def _remembered(self, written: bool) -> Memory:
        """Return the memory that the world is given of the step before the present."""
        world = self.world
        now = self._memory if self._world_is_elsewhere else world.memory
        if not written:
            return now
        names, fresh = dict(world.memory_layout), world.memory_at(None)
        return [
            old if name in world.kept_memory else new  # what belongs to another state
            for name, old, new in zip(names, now, fresh, strict=True)
        ]

    def present(self) -> Moment:
        """Return all that decides the next engine step, with the command that acts in it."""
        memory = self._remembered(self._written)
        ctrl = self._acts(self.ctrl, self.past_commands)
        return Moment(self.qpos.copy(), self.qvel.copy(), ctrl, memory)

    def forward(self) -> None:
        """Let everything derived belong to the present."""
        self.moment, self._world_knows_moment, self.derived = self.present(), False, {}

    def derive(self, name: str) -> Any:
        """Return an array of `records.DERIVED`, or "contacts"; computed at the first reading."""
        if name not in self.derived:
            values = self._compute(name)
            for value in values.values():
                if isinstance(value, np.ndarray):
                    value.setflags(write=False)
            self.derived |= values
        return self.derived[name]

    def _compute(self, name: str) -> Mapping[str, Any]:
        moment = self.moment
        if moment is None:
            return _nothing(self._model)
        if name in POSES and (poses := self.world.kinematics(moment, name)):
            return poses
        if self._world_knows_moment:  # the world is still where the step that ends there left it
            return self.world.derive(name, moment, self.derive)
        return self._model._look_ahead.at(moment)


def acting(ctrl: Array, past_commands: Array, delay_steps: Ints) -> Array:
    """Return the command (nu,) that acts in a step: each number as it was its delay ago.

    Args:
        ctrl: (nu,) of the step.
        past_commands: (steps, nu) of the steps before, the newest last.
        delay_steps: (nu,) steps by which each number acts late, at most as many as `past_commands`.
    """
    if not len(past_commands):
        return ctrl.copy()
    commands = np.concatenate([past_commands, ctrl[None]])
    return commands[len(past_commands) - delay_steps, np.arange(len(ctrl))]


class HiddenData(Data):
    """A Machine as a Data."""

    __slots__ = ("_machine",)

    def __init__(self, model: HiddenModel) -> None:
        self._machine = machine = Machine(model)
        sizes = {"time": 1, "qpos": model.nq, "qvel": model.nv, "ctrl": model.nu}
        if model.nmocap:
            sizes |= {"mocap_pos": 3 * model.nmocap, "mocap_quat": 4 * model.nmocap}
        layout = (*sizes.items(), *machine.world.memory_layout)
        if machine.past_commands.size:
            layout = (*layout, ("given", machine.past_commands.size))
        self._layout = model._with_fingerprint(layout)
        inputs = {name: getattr(machine, name) for name in (*INPUTS, *MOCAP)}
        super().__init__(model, machine.run, inputs)

    @property
    def raw(self) -> Any:
        """Return the engine's own object; read from it, and write through qpos and qvel."""
        if self._unusable == "closed":
            self._refuse_if_unusable()
        return self._machine.world.raw

    @property
    def time(self) -> float:
        if self._unusable == "closed":
            self._refuse_if_unusable()
        return self._machine.time

    def _derive(self, name: str) -> Any:
        if name in self._machine.world.unavailable:
            raise unsupported(self._model, "contacts" if name == "contacts" else "forces by part")
        return self._machine.derive(name)

    def _recompute(self) -> None:
        self._machine.forward()

    def _reset(self, key: int | None) -> None:
        self._machine.reset(key)

    def _get_state(self) -> State:
        now = self._machine.present()
        inputs = [self._machine.time], now.qpos, now.qvel, self._machine.commands
        parts = [*inputs, *now.memory, self._machine.past_commands.ravel()]
        blob = np.concatenate(parts).tobytes()
        model, (fingerprint, layout) = self._model, self._layout
        return State(model.backend, model.engine_version, fingerprint, layout, blob)

    def _set_state(self, state: State) -> None:
        for name in INPUTS:
            check_entries(
                self._model._acting(name, state[name]), name, self._model._coordinate_name
            )
        self._model._check_quaternions(state["qpos"])
        memory = [state[name] for name, _ in self._machine.world.memory_layout]
        led = [state[name] for name, _ in self._layout[1] if name in MOCAP]
        commands = np.concatenate([state["ctrl"], *led])
        start = Moment(state["qpos"], state["qvel"], commands, memory)
        past_commands = self._machine.past_commands
        if past_commands.size:
            past_commands = state["given"].reshape(past_commands.shape)
        self._machine.restart(state.time, start, past_commands)

    def _set_time(self, time: float) -> None:
        self._machine.time = time

    def _close(self) -> None:
        self._machine.world.close()

    def _failed(self, error: Exception) -> None:
        world = self._machine.world
        if isinstance(error, DivergedError):
            self._make_unusable(f"{error.quantity}[{error.index}] diverged at {error.time:g} s")
        elif isinstance(error, world.errors):
            self._make_unusable(f"{world.engine} gave up: {error}")
            raise EngineError(f"{world.engine} gave up: {error}") from error


def _nothing(model: Model) -> dict[str, Any]:
    """Return what a fresh Data says: zeros, and no contacts."""
    shapes = {
        "xpos": (model.nbody, 3),
        "xquat": (model.nbody, 4),
        "site_xpos": (model.nsite, 3),
        "site_xmat": (model.nsite, 9),
    }
    values: dict[str, Any] = {name: np.zeros(shapes.get(name, (model.nv,))) for name in DERIVED}
    values["contacts"] = _no_contacts()
    return values


def _no_contacts() -> Contacts:
    geom, vectors = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 3))
    frame = np.zeros((0, 3, 3))
    return Contacts(geom, np.zeros(0), vectors, frame, force=vectors, torque=vectors)
