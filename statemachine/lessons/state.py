"""The state is two arrays; slot k of one need not be slot k of the other."""

from __future__ import annotations

from typing import Any

from ..engines import room
from ..interface import JointType, Model, make_data, reset
from ..measures.text import grouped, listed
from ..page import Figures, Slots, Table
from ..runs.drive import Progress
from ..runs.header import provenance
from .session import CodeRun, Options
from .template import Results, differences

NO_NAME = "(no name)"
_SIZES = ("nq", "nv", "nu", "nbody")


def code(model: Model, options: Options, load: str) -> str:
    """Sizes, and the slots of each joint."""
    return f"""\
import statemachine as sm

model = {load}
print(model.nq, model.nv, model.nu)
for j, name in enumerate(model.joint_names):
    print(model.jnt_qposadr[j], model.jnt_dofadr[j], name)
"""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Read the layout off the Model, and the time off a Data at keyframe 0.

    Returns:
        nq, nv, nu, nbody: Sizes of the Model.
        joints: The slots of each: qpos[qpos_start:qpos_stop] and qvel[qvel_start:qvel_stop].
        fresh_time: `data.time` of a fresh Data.
        keyframe: Name of keyframe 0; keyframe_time: `data.time` after a reset to it; None without
            one.
        terms: What the engine itself calls all this, where that differs.
    """
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
        Figures(
            name=name,
            type=kind.name.lower(),
            qpos_start=place,
            qpos_stop=place + kind.nq,
            qvel_start=dof,
            qvel_stop=dof + kind.nv,
        )
        for name, kind, place, dof in rows
    )
    with make_data(model) as data:
        fresh, name, time = data.time, None, None
        if model.keyframes:
            reset(model, data, keyframe=0)
            name, time = model.keyframes[0].name, data.time
    return Figures(
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


def slots(result: Figures) -> dict[str, Any]:
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


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """Sizes, and who owns which slots; engines that say the same share a table."""
    sizes = [
        (name, *(str(getattr(layout, size)) for size in _SIZES)) for name, layout in results.items()
    ]
    owners = grouped((tuple(map(_row, layout.joints)), name) for name, layout in results.items())
    return {
        "sizes": Table(
            ("", *_SIZES),
            sizes,
            title="Lengths of qpos, qvel and ctrl; number of bodies, the world included",
        ),
        "owners": [
            Table(
                ("joint", "type", "qpos", "qvel"),
                rows,
                title=f"Which slots are whose, on {listed(names)}",
                words=frozenset({0, 1}),
            )
            for rows, names in owners.items()
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


def _row(joint: Figures) -> tuple[str, ...]:
    places = (joint.qpos_start, joint.qpos_stop), (joint.qvel_start, joint.qvel_stop)
    return (joint.name or NO_NAME, joint.type, *(_slots(*ends) for ends in places))


def _compared(left: Figures, right: Figures) -> str:
    same = all(getattr(left, name) == getattr(right, name) for name in (*_SIZES, "joints"))
    return "none" if same else "they differ: see above"


def _slots(start: int, stop: int) -> str:
    return f"[{start}]" if stop == start + 1 else f"[{start}:{stop}]"
