"""PyBullet behind the contract. The engine owns a hidden world; a Data is one client.

By default the contract is *emulated*: the servo, armature and friction of the model, zeros
when fresh, values that a write leaves alone. The capability record says where.
`defaults="engine"` gives PyBullet as its own users meet it after `loadURDF`.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..errors import DivergedError, EngineError, EngineWarning
from ..installed import engine_version
from ..interface import (
    BEHAVIOURS,
    INPUTS,
    OPTIONS,
    Array,
    Behaviour,
    Capabilities,
    Contacts,
    Data,
    Model,
    State,
)
from ..interface.checks import check_entries
from . import _bullet_urdf as urdf
from ._bullet_client import pb
from ._bullet_machine import Machine, Mirror
from ._bullet_plan import Plan
from ._bullet_scope import check, ignored
from ._bullet_shared import Shared
from ._bullet_world import ENGINE_TIMESTEP, World
from ._mjcf import compile_file, edited, facts, heard, step_length, with_fingerprint

_EMULATED = {
    "stale after a write": "by copies of the adapter; the engine's own values follow a write",
    "stale after a step": "poses of the state before are computed when they are read",
    "zeros when fresh": "by the adapter; the engine has poses from the first moment",
    "position servo": "the adapter solves the model's servo and sends torques; the engine's own "
    "way is POSITION_CONTROL; an infinite ctrl is clamped to its range, or refused",
    "armature": "the engine has none: the adapter reckons with it, and gives the engine's links a "
    "part of it as inertia",
    "joint damping": "by the adapter, as the file's integrator treats it (RK4 as Euler); the "
    "engine's jointDamping is explicit",
    "dry friction": "by the adapter, MuJoCo's soft friction; the engine ignores that of a URDF",
    "joint limits": "by the adapter, MuJoCo's soft limits; the engine's own are off",
    "free joint conventions": "converted: the engine speaks of the centre of mass, and x y z w; "
    "it turns a body wrongly beyond 45° a step",
    "forces by part": "contact: what a step did beyond all other forces; those as solved",
    "no automatic reset": "the adapter looks at every step; the engine goes on with NaN in silence",
}
_NATIVE = {
    "contacts": "the engine's own, which are hard: solref, solimp and the friction cone have no "
    "counterpart. It multiplies the frictions of two links: they are chosen so that the products "
    "are the model's, and load warns where that cannot be",
}
_RESTORE = (
    "two restores of one State have the same future, bit by bit, but not that of the run it was "
    "taken from: the engine's memory of contacts cannot be read"
)
_TOLD = ("qfrc_bias", "qfrc_actuator")  # of the forces, under defaults="engine"
_AS_IT_COMES = {
    "position servo": Behaviour(
        "native",
        "POSITION_CONTROL; with actuation off its motors hold every joint still; an infinite ctrl "
        "is refused",
    ),
    "armature": Behaviour("unsupported", "the engine has none"),
    "joint damping": Behaviour("native", "that of the URDF, explicit, and 0.04 on every body"),
    "dry friction": Behaviour("unsupported", "the engine ignores that of a URDF"),
    "joint limits": Behaviour("native", "those of the URDF"),
    "forces by part": Behaviour("unsupported", "the engine tells its bias and its motors' torque"),
    "contacts": Behaviour("native", "friction 0.5, and none between the links of one robot"),
}


def _capabilities(as_it_comes: bool) -> Capabilities:
    behaviours = {name: Behaviour("emulated", note) for name, note in _EMULATED.items()}
    behaviours |= {name: Behaviour("native", note) for name, note in _NATIVE.items()}
    behaviours["exact restore"] = Behaviour("unsupported", _RESTORE)
    options = tuple(name for name in OPTIONS if name != "integrator")
    if as_it_comes:
        behaviours |= _AS_IT_COMES
        options = ("actuation", "gravity", "timestep", "substeps", "contacts")
    return Capabilities(
        options=options,
        integrators=(),
        behaviours={name: behaviours[name] for name in BEHAVIOURS},
        shared_model=False,
        exact_restore=False,
    )


def load(
    path: str | os.PathLike[str], defaults: Literal["model", "engine"] = "model"
) -> PybulletModel:
    """Compile an MJCF, URDF or MJB file, and write it as URDF for PyBullet.

    Args:
        path: The file.
        defaults: "engine" is what `loadURDF` gives: velocity motors in the joints,
            damping 0.04, friction 0.5, inertias of the collision shapes, no gravity until
            it is set, 1/240 s a step. ctrl is then what POSITION_CONTROL aims at.

    Raises:
        ModelError: It cannot be compiled, or PyBullet cannot read what was written.
        UnsupportedError: It has something that PyBullet has no counterpart for.
    """
    with heard() as texts:
        raw = compile_file(path)
    for text in texts:
        warnings.warn(f"MuJoCo, which compiles {path}: {text}", EngineWarning, stacklevel=3)
    if defaults == "engine":
        raw.opt.gravity[:] = 0
        raw.opt.timestep = ENGINE_TIMESTEP
    plan = Plan(raw)
    check(plan, "pybullet", Path(path))
    model = PybulletModel(plan, Path(path), 1, defaults)
    World(plan, model._shared.kind).close()  # what PyBullet cannot read shows now
    differences = [*ignored(raw), *plan.surfaces.differences]
    if differences and defaults == "model":
        warnings.warn(f"PyBullet: {'; '.join(differences)}", EngineWarning, stacklevel=3)
    return model


class PybulletModel(Model):
    """The description that every Data's world is made from.

    `raw` is what PyBullet reads: the text of a URDF by the name of its root body.
    """

    _shared: Shared
    _mirror: Mirror

    def __init__(
        self,
        plan: Plan,
        path: Path,
        substeps: int,
        defaults: Literal["model", "engine"],
    ) -> None:
        as_it_comes, raw = defaults == "engine", plan.raw
        shared = Shared(plan, "engine" if as_it_comes else "stepped")
        super().__init__(
            backend="pybullet",
            engine_version=engine_version("pybullet"),
            path=path,
            raw={
                raw.body(b).name or f"body {b}": plan.described(b, shared.kind)
                for b in (0, *urdf.roots(raw))
            },
            capabilities=_capabilities(as_it_comes),
            timestep=float(raw.opt.timestep) * substeps,
            substeps=substeps,
            **facts(raw),
            _shared=shared,
            _mirror=Mirror(shared),
        )

    def _make_data(self) -> PybulletData:
        return PybulletData(self)

    def _replace(self, options: dict[str, Any]) -> PybulletModel:
        raw = edited(self._shared.raw, options)
        substeps = options.get("substeps", self.substeps)
        raw.opt.timestep = step_length(self.timestep, substeps, options)
        defaults = "engine" if self._shared.kind == "engine" else "model"
        plan = Plan(raw)
        check(plan, "pybullet", None)
        return PybulletModel(plan, self.path, substeps, defaults)


class PybulletData(Data):
    """A machine around one client."""

    __slots__ = ("_layout", "_machine")

    _machine: Machine
    _layout: tuple[str, tuple[tuple[str, int], ...]]
    _home: PybulletModel  # pyright: ignore[reportIncompatibleVariableOverride]

    def __init__(self, model: PybulletModel) -> None:
        machine = Machine(
            model._shared,
            model._mirror,
            model._check_quaternions,
            model._coordinate_name,
            model.substeps,
        )
        for name, value in (("_machine", machine), ("_layout", _layout(model))):
            object.__setattr__(self, name, value)
        inputs = {name: getattr(machine, name) for name in INPUTS}
        super().__init__(model, machine.run, inputs)

    @property
    def raw(self) -> World:
        """The client and the ids in it; read from it, and write through qpos and qvel."""
        if self._trouble == "closed":
            self._refuse_if_troubled()
        return self._machine.world

    @property
    def time(self) -> float:
        if self._trouble == "closed":
            self._refuse_if_troubled()
        return self._machine.time

    def _derive(self, name: str) -> Array:
        if self._trouble:
            self._refuse_if_troubled()
        if name.startswith("q") and self._home._shared.kind == "engine" and name not in _TOLD:
            raise self._home._unsupported("forces by part")
        return self._machine.derive(name)

    def _find_contacts(self) -> Contacts:
        return self._machine.derive("contacts")

    def _recompute(self) -> None:
        self._machine.forward()

    def _reset(self, key: int | None) -> None:
        model = self._home
        if key is None:
            qpos0 = model._shared.raw.qpos0
            self._machine.restart(0.0, qpos0, np.zeros(model.nv), np.zeros(model.nu))
        else:
            frame = model.keyframes[key]
            self._machine.restart(frame.time, frame.qpos, frame.qvel, frame.ctrl)

    def _get_state(self) -> State:
        now = self._machine.present
        fingerprint, layout = self._layout
        parts = [np.array([self._machine.time]), now.qpos, now.qvel, now.ctrl]
        if len(layout) > len(parts):
            parts += self._machine.gathered(now.observed)
        blob = np.concatenate(parts).tobytes()
        return State("pybullet", self._home.engine_version, fingerprint, layout, blob)

    def _set_state(self, state: State) -> None:
        parts = [state[name] for name, _ in self._layout[1]]
        for name, part in zip(INPUTS, parts[1:4], strict=True):
            check_entries(part, name, self._home._coordinate_name)
        self._home._check_quaternions(parts[1])
        observed = self._machine.parted(*parts[4:]) if parts[4:] else None
        qpos, qvel, ctrl = parts[1:4]
        self._machine.restart(float(parts[0][0]), qpos, qvel, ctrl, observed)

    def _state_layout(self) -> tuple[str, tuple[tuple[str, int], ...]]:
        return self._layout

    def _set_time(self, time: float) -> None:
        self._machine.time = time

    def _close(self) -> None:
        self._machine.close()

    def _failed(self, error: Exception) -> None:
        if isinstance(error, DivergedError):
            self._give_up(f"{error.quantity}[{error.index}] was not finite at {error.time:g} s")
        elif isinstance(error, pb.error):
            self._give_up(f"PyBullet gave up: {error}")
            raise EngineError(f"PyBullet gave up: {error}") from error


def _layout(model: PybulletModel) -> tuple[str, tuple[tuple[str, int], ...]]:
    layout = [("time", 1), ("qpos", model.nq), ("qvel", model.nv), ("ctrl", model.nu)]
    if model._shared.kind == "stepped":
        layout += [("contact", model.nv), ("friction", model.nv)]
    return with_fingerprint(model, tuple(layout))
