"""PyBullet behind the contract. The engine owns a hidden world; a Data is one client.

By default the contract is *emulated*: the servo, armature and friction of the model, zeros
when fresh, values that a write leaves alone. The capability record says where.
`defaults="engine"` gives PyBullet as its own users meet it after `loadURDF`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, cast

from ..errors import EngineWarning
from ..installed import engine_version
from ..interface import (
    BEHAVIOURS,
    OPTIONS,
    Array,
    Behaviour,
    Capabilities,
    Ints,
)
from ..interface.checks import HUGE
from ..interface.options import checked_options
from ..interface.records import AS_WRITTEN, Defaults, ReadOptions
from ..measures.text import few
from . import edits as _edits
from .bullet.client import MOST_CLIENTS
from .bullet.driven import Act, DrivenWorld
from .bullet.file import UrdfFile
from .bullet.plan import Plan
from .bullet.scope import as_targets, check, ignored, otherwise, softness
from .bullet.weights import weighed_as_it_comes
from .bullet.world import ENGINE_TIMESTEP, World
from .compiled.model import (
    check_numbers,
    compile_file,
    compiler_warnings,
    facts,
    fastest,
)
from .hidden_data import HiddenModel

if TYPE_CHECKING:
    from .compiled.types import MjModel

_EMULATED = {
    "stale after a write": "by copies of the adapter; the engine's own values follow a write",
    "stale after a step": "poses of the state before are computed when they are read",
    "zeros when fresh": "by the adapter; the engine has poses from the first moment",
    "position servo": "the adapter solves the model's servo and sends torques; the engine's own "
    "way is POSITION_CONTROL; an infinite ctrl is clamped to its range, or refused",
    "latency": "by the adapter, which keeps the last commands, in whole engine steps",
    "armature": "the engine has none: the adapter reckons with it, and gives the engine's links a "
    "part of it as inertia",
    "joint damping": "by the adapter, as the file's integrator treats it (RK4 as Euler); the "
    "engine's jointDamping is explicit",
    "dry friction": "by the adapter, MuJoCo's soft friction; the engine ignores that of a URDF",
    "joint limits": "by the adapter, MuJoCo's soft limits; the engine's own are off",
    "free joint conventions": "converted: the engine speaks of the centre of mass, and x y z w; "
    "it turns a body wrongly beyond 45° a step. A free body alone is the engine's own, whose steps "
    "are of its centre of mass, and explicit: a spinning one parts from MuJoCo's by what vanishes "
    "with the timestep",
    "forces by part": "contact: what a step did beyond all other forces; those as solved",
}
_NATIVE = {
    "contacts": "the engine's own, which are hard: solref, solimp and the friction cone have no "
    "counterpart. It multiplies the frictions of two links: they are chosen so that the products "
    "are the model's; load and replace(friction=…) warn where that cannot be. Edges of a mesh are "
    "rounded by 1 mm",
}
_RESTORE = (
    "two restores of one State have the same future, bit by bit, but not that of the run it was "
    "taken from: the engine's memory of contacts cannot be read"
)
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
_NO_OPTION = dict.fromkeys(
    ("damping", "mass", "friction", "kp", "kv", "latency", "limits"),
    "with defaults='engine' it stays as it was loaded; load the model without that to set it",
) | {"frictionloss": _AS_IT_COMES["dry friction"].note}


def _capabilities(as_it_comes: bool, max_qvel: Array | None = None, soft: str = "") -> Capabilities:
    """Return the record of a Model; before there is one, without its bound and its geoms'
    softness.
    """
    behaviours = {name: Behaviour("emulated", note) for name, note in _EMULATED.items()}
    behaviours |= {name: Behaviour("native", note) for name, note in _NATIVE.items()}
    if soft:
        note = f"{_NATIVE['contacts']}. A solref or solimp of their own have {soft}"
        behaviours["contacts"] = Behaviour("native", note)
    behaviours["exact restore"] = Behaviour("unsupported", _RESTORE)
    options = tuple(name for name in OPTIONS if name != "integrator")
    if as_it_comes:
        behaviours |= _AS_IT_COMES
        options = ("actuation", "gravity", "timestep", "substeps", "contacts", "max_qvel")
    behaviours["no automatic reset"] = Behaviour(
        "emulated",
        "the adapter looks at every step, and raises DivergedError where qvel is beyond "
        f"{_bound(max_qvel)} (max_qvel) or qpos beyond {HUGE:g}; the engine goes on in silence",
    )
    return Capabilities(
        options=options,
        integrators=(),
        behaviours={name: behaviours[name] for name in BEHAVIOURS},
        shared_model=False,
        exact_restore=False,
        # A Model has two clients of its own: the still copy and the look-ahead.
        data_per_process=MOST_CLIENTS // 3,
        refused=_NO_OPTION if as_it_comes else {},
    )


def _bound(max_qvel: Array | None) -> str:
    """Return the bound of a Model in words, as "2e+05" or "2e+05 to 1e+10"."""
    if max_qvel is None or not len(max_qvel):
        return "its bound"
    low, high = max_qvel.min(), max_qvel.max()
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def load(
    path: Path,
    defaults: Defaults = "model",
    options: Mapping[str, Any] = MappingProxyType({}),
    read_options: ReadOptions = AS_WRITTEN,
) -> PybulletModel:
    """Compile an MJCF, URDF or MJB file, and write it as URDF for PyBullet.

    Args:
        path: The file.
        options: As `Model.replace` takes them; what they switch off is not refused.
        defaults: "engine" is what `loadURDF` gives without flags: velocity motors in the joints,
            damping 0.04, friction 0.5, inertias of the collision shapes, 1 kg for a link without
            <inertial>, no contact between two links of one robot, no <mimic>, no gravity until
            it is set, 1/240 s a step. PyBullet reads a URDF itself, by `useFixedBase` unless it
            has a floating joint; of an MJCF a URDF is written. ctrl is then what
            POSITION_CONTROL aims at.
        read_options: How the file is read.

    Raises:
        ModelError: It cannot be compiled, or PyBullet cannot read what was written.
        UnsupportedError: It has something that PyBullet has no counterpart for, or there is no
            such option.
        BadInputError: The value of an option has the wrong shape, kind or size.
    """
    with compiler_warnings() as texts:
        raw = compile_file(path, read_options)
    for text in texts:
        warnings.warn(f"MuJoCo, which compiles {path}: {text}", EngineWarning, stacklevel=3)
    if defaults == "engine":
        raw.opt.gravity[:] = 0
        raw.opt.timestep = ENGINE_TIMESTEP
    checked = checked_options(FileFacts.of(raw, _capabilities(defaults == "engine")), options)
    substeps = checked.get("substeps", 1)
    if checked:
        timestep = _edits.step_length(float(raw.opt.timestep), substeps, checked)
        raw = _edits.edited(raw, checked, timestep)
    file = UrdfFile.read(path, read_options) if defaults == "engine" else None
    plan = Plan(raw, file)
    check(plan, "pybullet", defaults == "engine")
    model = PybulletModel(plan, path, substeps, defaults, checked.get("max_qvel"))
    # What PyBullet cannot read shows now.
    World(plan, model._kind).close()
    if defaults == "model":
        _tell(plan, ignored(plan), stacklevel=4)
    else:
        for difference in (*as_targets(plan), *otherwise(plan)):
            warnings.warn(f"PyBullet: {difference}", EngineWarning, stacklevel=3)
    return model._inherit_start(model, checked)


@dataclass(frozen=True, eq=False)
class FileFacts:
    """What options are checked against before there is a Model of a file.

    Attributes:
        capabilities: The record that the Model will have.
        nv, nu, nbody, ngeom: Counts.
        jnt_type, jnt_dofadr: (njnt,) as in a Model.
        dof_armature, dof_damping, dof_frictionloss: (nv,) as in a Model.
        body_mass: (nbody,) [kg].
        body_names, actuator_names: Names, "" of what has none.
        actuator_kp: (nu,) gains of position servos, NaN for other actuators.
        backend: Name of the backend.
    """

    capabilities: Capabilities
    nv: int
    nu: int
    nbody: int
    ngeom: int
    jnt_type: Ints
    jnt_dofadr: Ints
    dof_armature: Array
    dof_damping: Array
    dof_frictionloss: Array
    body_mass: Array
    body_names: tuple[str, ...]
    actuator_names: tuple[str, ...]
    actuator_kp: Array
    backend: str = "pybullet"

    @classmethod
    def of(cls, raw: MjModel, capabilities: Capabilities) -> FileFacts:
        """Take them from a compiled model."""
        known = facts(raw)
        wanted = {field.name: known[field.name] for field in fields(cls) if field.name in known}
        return cls(capabilities=capabilities, **wanted)


def base_stands(model: PybulletModel) -> bool:
    """Tell whether PyBullet as it comes does not move a base that has a free joint in the model."""
    if model.plan.file is None or not model.plan.file.floats:
        return False
    with closing(World(model.plan, "engine")) as world:
        return world.stands


def _tell(plan: Plan, settings: list[str], stacklevel: int) -> None:
    """Warn of what is not as the model has it: settings, and friction of the first few pairs."""
    pairs = plan.surfaces.differences
    rubbing = [
        f"it has one friction for each body, a model one for each pair: {len(pairs)} differ, such "
        f"as {few(pairs[:1])}"
    ]
    if differences := "; ".join([*settings, *(rubbing if pairs else [])]):
        warnings.warn(f"PyBullet: {differences}", EngineWarning, stacklevel=stacklevel)


def _urdf_texts(plan: Plan, kind: str) -> dict[str, str]:
    """Return the URDFs that PyBullet reads: by the root of each tree, or by the file's own name."""
    if plan.file is not None:
        return {plan.file.path.name: plan.file.content.decode(errors="replace")}
    texts: dict[str, str] = {}
    for root in (0, *plan.roots):
        name = plan.raw.body(root).name or f"body {root}"
        texts[name], _ = plan.described(root, kind)
    return texts


class PybulletModel(HiddenModel):
    """The description that every Data's world is made from.

    `raw` is what PyBullet reads: the text of a URDF by the name of its root body.

    Attributes:
        plan: The compiled model, and what follows from it for every world.
        defaults: As `load` was given: "engine" for PyBullet as it comes.
        acts: What is set in every world that is opened.
    """

    plan: Plan
    defaults: Defaults
    acts: tuple[Act, ...]
    _kind: Literal["stepped", "engine"]
    _asked: Array | None  # max_qvel, where it was set

    def __init__(
        self,
        plan: Plan,
        path: Path,
        substeps: int,
        defaults: Defaults,
        max_qvel: Array | None = None,
        acts: tuple[Act, ...] = (),
    ) -> None:
        as_it_comes, raw = defaults == "engine", plan.raw
        bound = fastest(raw) if max_qvel is None else max_qvel
        kind: Literal["stepped", "engine"] = "engine" if as_it_comes else "stepped"
        capabilities = _capabilities(as_it_comes, bound, softness(plan))
        known = facts(raw)
        known["timestep"], known["substeps"] = float(raw.opt.timestep) * substeps, substeps
        if as_it_comes:
            known["_clamps"] = False
        super().__init__(
            partial(DrivenWorld, plan, kind, acts),
            backend="pybullet",
            engine_version=engine_version("pybullet"),
            path=path,
            raw=_urdf_texts(plan, kind),
            capabilities=capabilities,
            max_qvel=bound,
            **known,
            plan=plan,
            defaults=defaults,
            acts=acts,
            _kind=kind,
            _asked=max_qvel,
        )

    @property
    def compiled(self) -> MjModel:
        return self.plan.raw

    def with_compiled(self, compiled: MjModel) -> PybulletModel:
        check_numbers(compiled, str(self.path))
        plan = Plan(compiled, weighed=self.plan.weighed)
        if self.plan.file:
            plan = Plan(weighed_as_it_comes(self.plan, compiled), weighed=True)
        return self._of(plan, self.substeps, self._asked)._inherit_start(self, {})

    @property
    def shared_worlds(self) -> dict[str, World]:
        """Return the worlds that its Data share, of those that were needed so far."""
        worlds: dict[str, World] = {}
        if self.plan.ghost is not None:
            worlds["still copy"] = self.plan.ghost
        if (ahead := cast("DrivenWorld | None", self._look_ahead.world)) is not None:
            worlds["look-ahead"] = ahead.raw
        return worlds

    def _replace(self, options: dict[str, Any]) -> PybulletModel:
        substeps = options.get("substeps", self.substeps)
        timestep = _edits.step_length(self.timestep, substeps, options)
        raw = _edits.edited(self.plan.raw, options, timestep)
        plan = Plan(raw, self.plan.file, self.plan.weighed)
        model = self._of(plan, substeps, options.get("max_qvel", self._asked))
        if "friction" in options:
            _tell(model.plan, [], stacklevel=4)
        return model

    def _of(self, plan: Plan, substeps: int, asked: Array | None) -> PybulletModel:
        check(plan, "pybullet", self.defaults == "engine")
        return PybulletModel(plan, self.path, substeps, self.defaults, asked, self.acts)
