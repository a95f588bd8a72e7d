"""The state is two arrays; slot k of one need not be slot k of the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..engines import room
from ..engines.records import Term
from ..interface import JointType, Model, make_data, reset
from ..measures.text import listed
from ..page import Slots, Table
from ..runs.drive import Progress
from ..runs.provenance import provenance
from .session import CodeRun, LessonResult
from .template import differences

NO_NAME = "(no name)"
_SIZES = ("nq", "nv", "nu", "nbody")


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
class Layout(LessonResult):
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


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Layout:
    """Read the layout off the Model, and the time off a Data at keyframe 0."""
    play()
    model = play.model
    rows = zip(
        model.joint_names,
        (JointType(int(kind)) for kind in model.jnt_type),
        model.jnt_qposadr.tolist(),
        model.jnt_dofadr.tolist(),
        strict=True,
    )
    joints = tuple(
        Joint(name, kind.name.lower(), place, place + kind.nq, dof, dof + kind.nv)
        for name, kind, place, dof in rows
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
        joints=joints,
        fresh_time=fresh,
        keyframe=name,
        keyframe_time=time,
        terms=room(model.backend).terms(model),
        provenance=provenance(model),
    )


def slots(result: Layout) -> dict[str, Any]:
    """What the page says."""
    shifted = [
        joint.name or NO_NAME
        for joint in result.joints
        if (joint.qpos_start, joint.qpos_stop) != (joint.qvel_start, joint.qvel_stop)
    ]
    return {
        "shifted": ", ".join(shifted),
        "right": 0 if result.nv == result.nq else 2,
    }


def tables(results: Mapping[str, Layout], first: Layout) -> dict[str, Any]:
    """Sizes, and who owns which slots; engines that say the same share a table."""
    sizes = [
        (name, *(str(getattr(layout, size)) for size in _SIZES)) for name, layout in results.items()
    ]
    owners: dict[tuple[Joint, ...], list[str]] = {}
    for name, layout in results.items():
        owners.setdefault(layout.joints, []).append(name)
    return {
        "sizes": Table(
            ("", *_SIZES),
            sizes,
            title="Lengths of qpos, qvel and ctrl; number of bodies, the world included",
        ),
        "owners": [
            Table(
                ("joint", "type", "qpos", "qvel"),
                [
                    (
                        joint.name or NO_NAME,
                        joint.type,
                        _slots(joint.qpos_start, joint.qpos_stop),
                        _slots(joint.qvel_start, joint.qvel_stop),
                    )
                    for joint in joints
                ],
                title=f"Which slots are whose, on {listed(names)}",
                words=frozenset({0, 1}),
            )
            for joints, names in owners.items()
        ],
        "picture": Slots(
            "Which slots are whose",
            {
                "qpos": [(j.name, j.qpos_start, j.qpos_stop) for j in first.joints],
                "qvel": [(j.name, j.qvel_start, j.qvel_stop) for j in first.joints],
            },
        ),
        "terms": [
            Table(
                ("", "here", f"in {name} itself"),
                [(term.thing, term.ours, term.engine) for term in layout.terms],
                title=f"What {name} calls it",
                words=frozenset({0, 1, 2}),
            )
            for name, layout in results.items()
            if layout.terms
        ],
        "differences": differences(results, {"names, sizes and slots": _compared}),
    }


def _compared(left: Layout, right: Layout) -> str:
    same = all(getattr(left, name) == getattr(right, name) for name in (*_SIZES, "joints"))
    return "none" if same else "they differ: see above"


def _slots(start: int, stop: int) -> str:
    return f"[{start}]" if stop == start + 1 else f"[{start}:{stop}]"
