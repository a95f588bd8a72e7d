"""The state is two arrays; slot k of one need not be slot k of the other."""

from __future__ import annotations

from dataclasses import dataclass

from ...engines import raw_engine_of
from ...interface import JointType, Model, make_data, reset
from ...lab.runs.drive import Progress
from ...lab.runs.provenance import Provenance, provenance
from ...show.pictures import Diagram
from .diagrams.joint_slots import joint_slots
from .session import CodeRun, Options


def code(model: Model, options: Options, load: str) -> str:
    """Write code that prints sizes, and the slots of each joint."""
    return f"""\
import statemachine as sm

model = {load}
print(model.nq, model.nv, model.nu)
for j, name in enumerate(model.joint_names):
    print(model.jnt_qposadr[j], model.jnt_dofadr[j], name)
"""


@dataclass(frozen=True)
class JointSlots:
    """Slots of a joint: qpos[qpos_start:qpos_stop] and qvel[qvel_start:qvel_stop].

    Attributes:
        name: Of the joint; "" where it has none.
        type: "free", "ball", "slide" or "hinge".
        qpos_start: Its first slot in qpos.
        qpos_stop: The slot after its last one in qpos.
        qvel_start: Its first slot in qvel.
        qvel_stop: The slot after its last one in qvel.
    """

    name: str
    type: str
    qpos_start: int
    qpos_stop: int
    qvel_start: int
    qvel_stop: int


@dataclass(frozen=True)
class Term:
    """Name that the engine itself has for a thing, and ours.

    Attributes:
        thing: What is meant.
        ours: What the interface has for it.
        engine: What the engine has for it.
    """

    thing: str
    ours: str
    engine: str


@dataclass(frozen=True)
class StateResult:
    """Layout of the state of a Model, and its time.

    Attributes:
        nq: Length of qpos.
        nv: Length of qvel.
        nu: Length of ctrl.
        nbody: Number of bodies, the world included.
        joints: The slots of each joint.
        fresh_time: `data.time` of a fresh Data [s].
        keyframe: Name of keyframe 0; None without one.
        keyframe_time: `data.time` after a reset to it [s]; None without one.
        terms: What the engine itself calls all this, where that differs.
        provenance: What it was computed with.
    """

    nq: int
    nv: int
    nu: int
    nbody: int
    joints: tuple[JointSlots, ...]
    fresh_time: float
    keyframe: str | None
    keyframe_time: float | None
    terms: tuple[Term, ...]
    provenance: Provenance


def run(play: CodeRun, options: Options, progress: Progress) -> StateResult:
    """Read the layout off the Model, and the time off a Data at keyframe 0."""
    play()
    model = play.model
    joints = tuple(slots_of_joint(model, joint) for joint in range(model.njnt))
    keyframe = keyframe_time = None
    with make_data(model) as data:
        fresh_time = data.time
        if model.keyframes:
            reset(model, data, keyframe=0)
            keyframe, keyframe_time = model.keyframes[0].name, data.time
    return StateResult(
        nq=model.nq,
        nv=model.nv,
        nu=model.nu,
        nbody=model.nbody,
        joints=joints,
        fresh_time=fresh_time,
        keyframe=keyframe,
        keyframe_time=keyframe_time,
        terms=_terms_of(model),
        provenance=provenance(model),
    )


def _terms_of(model: Model) -> tuple[Term, ...]:
    """Return what the engine itself calls what the interface has a name for."""
    terms = raw_engine_of(model.backend).terms(model)
    return tuple(Term(term.thing, term.ours, term.engine) for term in terms)


def slots_of_joint(model: Model, joint: int) -> JointSlots:
    """Return the slots of a joint."""
    kind = JointType(int(model.jnt_type[joint]))
    place, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    return JointSlots(
        name=model.joint_names[joint],
        type=kind.name.lower(),
        qpos_start=place,
        qpos_stop=place + kind.nq,
        qvel_start=dof,
        qvel_stop=dof + kind.nv,
    )


def diagram(model: Model) -> Diagram:
    """Draw what the lesson is about."""
    return joint_slots(model)
