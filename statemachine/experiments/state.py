"""What a state is made of: which joint owns which slots of qpos and of qvel."""

from __future__ import annotations

from dataclasses import dataclass

from ..engines import part
from ..engines.parts import AsItComes, Term
from ..interface import JointType, Model, make_data, reset
from ..scenarios.provenance import Provenance, provenance


@dataclass(frozen=True)
class Joint:
    """One joint's slots: qpos[qpos_start:qpos_stop] and qvel[qvel_start:qvel_stop]."""

    name: str
    type: str
    qpos_start: int
    qpos_stop: int
    qvel_start: int
    qvel_stop: int


@dataclass(frozen=True)
class Layout:
    """Sizes and addresses of a model's state.

    Attributes:
        keyframe_time: `data.time` after a reset to keyframe 0; None without one.
        keyframe: Its name.
        fresh_time: `data.time` of a fresh Data.
        terms: What the engine itself calls all this, where that differs.
    """

    nq: int
    nv: int
    nu: int
    nbody: int
    joints: tuple[Joint, ...]
    fresh_time: float
    keyframe: str | None
    keyframe_time: float | None
    terms: tuple[Term, ...]
    provenance: Provenance


def run(model: Model) -> Layout:
    """Read the layout off a Model, and the time off a Data at keyframe 0."""
    joints = []
    for name, kind, place, dof in zip(
        model.joint_names, model.jnt_type, model.jnt_qposadr, model.jnt_dofadr, strict=True
    ):
        known = JointType(int(kind))
        joints.append(
            Joint(
                name=name,
                type=known.name.lower(),
                qpos_start=int(place),
                qpos_stop=int(place) + known.nq,
                qvel_start=int(dof),
                qvel_stop=int(dof) + known.nv,
            )
        )
    own: AsItComes | None = part(model.backend, "as_it_comes")
    with make_data(model) as data:
        fresh, name, time = data.time, None, None
        if model.keyframes:
            reset(model, data, keyframe=0)
            name, time = model.keyframes[0].name, data.time
    return Layout(
        nq=model.nq,
        nv=model.nv,
        nu=model.nu,
        nbody=model.nbody,
        joints=tuple(joints),
        fresh_time=fresh,
        keyframe=name,
        keyframe_time=time,
        terms=own.terms(model) if own else (),
        provenance=provenance(model),
    )
