"""MuJoCo itself: MjModel, MjData, mj_step."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array, Model
from ..auditing import ONLY, Disturbance, Driver, SaveMethod, SavePoint, copied

# What another past may have left in them, as a part of the weight or inertia that it acts on.
_PUSH = 0.1
_SEVERAL, _THREADS = 3, 2  # simulations, and threads, of the engine's own pools
mj: Any = require("mujoco")
_STATE = mj.mjtState


class MujocoDriver(Driver):
    """The engine through its own functions."""

    layer = "engine"
    legend = (
        "Names are those of mj_getState and mj_setState. 'all but' is mjSTATE_INTEGRATION with "
        "one component left out, each that this model has; 'only those that matter' are the "
        "components whose absence showed."
    )

    def __init__(self, model: Model, seed: int) -> None:
        super().__init__(model, seed)
        self.name = f"MuJoCo {model.engine_version} itself"
        self._there: dict[SavePoint, Any] = {}
        self.integration = int(_STATE.mjSTATE_INTEGRATION)
        # Every component that this model has, by the engine's own name for it.
        self.fields = {
            name.removeprefix("mjSTATE_").lower(): int(bit)
            for name, bit in _STATE.__members__.items()
            if name != "mjNSTATE"
            and int(bit).bit_count() == 1
            and mj.mj_stateSize(model.raw, int(bit))
        }

    def fresh(self, point: SavePoint) -> Any:
        return mj.MjData(point.model.raw)

    @contextmanager
    def at(self, point: SavePoint) -> Iterator[Any]:
        """By a copy of all that the first machine had there: the ways are long, and many."""
        with self.new(point) as machine:
            if point not in self._there:
                self.arrive(machine, point)
                self._there[point] = copy(machine)
            mj.mj_copyData(machine, machine.model, self._there[point])
            yield machine

    def close(self, machine: Any) -> None:
        """It goes with its last name."""

    def reset(self, machine: Any) -> None:
        mj.mj_resetData(machine.model, machine)

    def advance(self, machine: Any, nstep: int = 1) -> None:
        mj.mj_step(machine.model, machine, nstep)

    def leave_traces(self, machine: Any, point: SavePoint) -> None:
        """Every component that stepping does not change is left at something else."""
        model, data = machine.model, machine
        around = partial(np.random.default_rng(self.seed + 2).uniform, -_PUSH, _PUSH)
        data.time += 1.0
        data.qfrc_applied[:] += around(size=model.nv) * model.dof_M0
        data.xfrc_applied[:, :3] += around(size=(model.nbody, 3)) * model.body_mass[:, None] * 9.81
        data.xfrc_applied[:, 3:] += around(size=(model.nbody, 3)) * model.body_inertia
        data.mocap_pos[:] += around(size=data.mocap_pos.shape)
        data.userdata[:] += 1.0
        data.eq_active[:] = 1 - data.eq_active

    def touching(self, machine: Any) -> tuple[int, int]:
        mj.mj_forward(machine.model, machine)
        limit = int(mj.mjtConstraint.mjCNSTR_LIMIT_JOINT)
        return int(machine.ncon), int((machine.efc_type == limit).sum())

    def save_methods(self, point: SavePoint) -> tuple[SaveMethod, ...]:
        """Parts of the integration state, then all of it but one component."""
        qpos, qvel = int(_STATE.mjSTATE_QPOS), int(_STATE.mjSTATE_QVEL)
        ctrl, full = int(_STATE.mjSTATE_CTRL), int(_STATE.mjSTATE_FULLPHYSICS)
        candidates = {
            "qpos qvel": qpos | qvel,
            "qpos qvel ctrl": qpos | qvel | ctrl,
            "qpos qvel ctrl time": qpos | qvel | ctrl | int(_STATE.mjSTATE_TIME),
            "mjSTATE_PHYSICS": int(_STATE.mjSTATE_PHYSICS),
            "mjSTATE_FULLPHYSICS": full,
            "FULLPHYSICS + USER": full | int(_STATE.mjSTATE_USER),
            "mjSTATE_INTEGRATION": self.integration,
        }
        return (
            *(self.way(name, spec) for name, spec in candidates.items()),
            SaveMethod(
                "mj_copyData", copied(copy, lambda m, other: mj.mj_copyData(m, m.model, other))
            ),
            *(
                self.way(f"INTEGRATION without {name}", self.integration & ~bit, name)
                for name, bit in self.fields.items()
            ),
        )

    def only(self, fields: tuple[str, ...]) -> SaveMethod:
        return self.way(ONLY, sum(self.fields[name] for name in fields))

    def way(self, name: str, spec: int, left_out: str = "") -> SaveMethod:
        """The candidate of a mask of components."""
        save = copied(
            lambda m: saved(m, spec), lambda m, state: mj.mj_setState(m.model, m, state, spec)
        )
        return SaveMethod(name, save, left_out)

    def disturbances(self, point: SavePoint) -> tuple[Disturbance, ...]:

        def halves(machine: Any) -> None:
            mj.mj_step1(machine.model, machine)
            mj.mj_step2(machine.model, machine)

        # The engine's manual keeps the two halves for integrators of one stage.
        one_stage = int(point.model.raw.opt.integrator) != int(mj.mjtIntegrator.mjINT_RK4)
        return (
            Disturbance("mj_forward", lambda m: mj.mj_forward(m.model, m)),
            Disturbance("mj_inverse", lambda m: mj.mj_inverse(m.model, m), promised=False),
            Disturbance("mj_getState", lambda m: saved(m, self.integration)),
            Disturbance(
                f"mj_step1, mj_step2 for {'mj_step' if one_stage else 'RK4'}",
                halves,
                promised=one_stage,
                instead=True,
            ),
        )

    def pools(self) -> dict[str, Callable[[SavePoint, int], list[Array]]]:
        """The engine's own ways to run several simulations at once, on threads."""
        on = f"{_THREADS} threads"
        return {f"mujoco.rollout, {on}": self._rollout, f"mujoco.batch, {on}": self._batch}

    def _rollout(self, point: SavePoint, steps: int) -> list[Array]:
        user, model = int(_STATE.mjSTATE_USER), point.model.raw
        with self.at(point) as machine:
            start = saved(machine, int(_STATE.mjSTATE_FULLPHYSICS))
            inputs = saved(machine, user)
            warm, first = np.array(machine.qacc_warmstart), self.read(machine)
        out, _ = import_module("mujoco.rollout").rollout(
            model,
            [mj.MjData(model) for _ in range(_THREADS)],
            np.tile(start, (_SEVERAL, 1)),
            np.tile(inputs, (_SEVERAL, steps, 1)),
            control_spec=user,
            initial_warmstart=np.tile(warm, (_SEVERAL, 1)),
        )
        clock = mj.mj_stateSize(model, int(_STATE.mjSTATE_TIME))  # qpos and qvel follow it
        return [np.vstack((first, rows[:, clock : clock + len(first)])) for rows in out]

    def _batch(self, point: SavePoint, steps: int) -> list[Array]:
        batch = import_module("mujoco.batch").Batch(point.model.raw, _SEVERAL, _THREADS)
        with self.at(point) as machine:
            batch.state[:] = saved(machine, self.integration)
            first = self.read(machine)
        out = batch.rollout(steps, record=["qpos", "qvel"])
        futures = np.concatenate((out["qpos"], out["qvel"]), axis=2)
        return [np.vstack((first, future)) for future in futures]


def saved(machine: Any, spec: int) -> Array:
    """The components of an MjData that a mask of mjtState names, as the engine gives them."""
    state = np.empty(mj.mj_stateSize(machine.model, spec))
    mj.mj_getState(machine.model, machine, state, spec)
    return state
