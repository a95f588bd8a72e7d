"""The state is two arrays; slot k of one need not be slot k of the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..engines import room
from ..engines.records import Term
from ..interface import JointType, Model, make_data, reset
from ..page import Page, Question, Slots, Table, Text
from ..runs.drive import Progress
from ..runs.provenance import Provenance, provenance
from ._words import alike, differences, page_of, typed
from .records import Session
from .session import CodeRun


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """Sizes, and the slots of each joint."""
    return f"""\
import statemachine as sm

model = {load}
print(model.nq, model.nv, model.nu)
for j, name in enumerate(model.joint_names):
    print(model.jnt_qposadr[j], model.jnt_dofadr[j], name)
"""


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


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Layout:
    """Read the layout off the Model, and the time off a Data at keyframe 0."""
    play()
    model = play.model
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
        terms=room(model.backend).terms(model),
        provenance=provenance(model),
    )


def page(results: Mapping[str, Layout], session: Session) -> Page:
    """Sizes, slots, the keyframe's time."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text(
            "The array qpos says where the joints of a Data are, and qvel says how fast they "
            "move. qpos has nq numbers, qvel has nv, and ctrl has nu. jnt_qposadr says where a "
            "joint begins in qpos, and jnt_dofadr where it begins in qvel."
        ),
        *typed(session, _question(first)),
        Text(
            "A hinge takes one number in each. A free body takes seven in qpos (three of "
            "position, four of a quaternion) and six in qvel (three linear, three angular): a "
            "rotation has three degrees of freedom, but a quaternion describes it by four numbers."
        ),
        Table(
            ("", "nq", "nv", "nu", "nbody"),
            [
                (name, str(layout.nq), str(layout.nv), str(layout.nu), str(layout.nbody))
                for name, layout in results.items()
            ],
            title="Lengths of qpos, qvel and ctrl; number of bodies, the world included",
        ),
    ]
    for names, layout in alike(results, lambda each: each.joints):
        blocks.append(
            Table(
                ("joint", "type", "qpos", "qvel"),
                [
                    (
                        joint.name or "(no name)",
                        joint.type,
                        _slots(joint.qpos_start, joint.qpos_stop),
                        _slots(joint.qvel_start, joint.qvel_stop),
                    )
                    for joint in layout.joints
                ],
                title=f"{names}Who owns which slots",
                words=frozenset({0, 1}),
            )
        )
    blocks.append(
        Slots(
            "Who owns which slots",
            {
                "qpos": [(j.name, j.qpos_start, j.qpos_stop) for j in first.joints],
                "qvel": [(j.name, j.qvel_start, j.qvel_stop) for j in first.joints],
            },
        )
    )
    apart = [
        joint.name or "(no name)"
        for joint in first.joints
        if (joint.qpos_start, joint.qpos_stop) != (joint.qvel_start, joint.qvel_stop)
    ]
    if apart:
        blocks.append(
            Text(
                f"qpos has {first.nq} numbers and qvel {first.nv}. The slots of {', '.join(apart)} "
                "differ, and so would those of any joint after it. So look addresses up in "
                "jnt_qposadr and jnt_dofadr; do not compute them."
            )
        )
    else:
        blocks.append(
            Text(
                "In this model every joint has the same slots in qpos and qvel. This is not so in "
                "every model."
            )
        )
    for name, layout in results.items():
        if layout.terms:
            blocks.append(
                Table(
                    ("", "here", f"in {name} itself"),
                    [(term.thing, term.ours, term.engine) for term in layout.terms],
                    title=f"What {name} calls it",
                    words=frozenset({0, 1, 2}),
                )
            )
    blocks += differences(results, [("names, sizes and slots", _layouts)])
    return page_of("Positions and velocities do not line up", results, blocks)


def _layouts(one: Layout, two: Layout) -> str:
    sizes = [(each.nq, each.nv, each.nu, each.nbody, each.joints) for each in (one, two)]
    return "none" if sizes[0] == sizes[1] else "they differ: see above"


def _question(first: Layout) -> Question:
    return Question(
        f"qpos has nq = {first.nq} numbers. How many has qvel?",
        (f"{first.nq}: one velocity for each position", f"{first.nu}, as ctrl has", f"{first.nv}"),
        {first.nq: 0}.get(first.nv, 2),
        f"nv = {first.nv}: a free body has seven positions and six velocities."
        if first.nv != first.nq
        else "Here no joint has more positions than velocities; a free body would.",
    )


def _slots(start: int, stop: int) -> str:
    return f"[{start}]" if stop == start + 1 else f"[{start}:{stop}]"
