"""The state is two arrays, and they do not line up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..experiments import state
from ._words import page_of, where
from .page import Code, Page, Table, Text, Verdict


def run(model: Any, options: Mapping[str, Any], progress: Any) -> state.Layout:
    """Read the layout."""
    return state.run(model)


def page(results: Mapping[str, state.Layout]) -> Page:
    """Sizes, slots, the keyframe's time."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text(
            "All that changes lives in a Data. Its state is two arrays: qpos says where every "
            "joint is, qvel how fast it moves. A hinge takes one number in each. A free body "
            "takes seven in qpos (three of position, four of a quaternion) and six in qvel "
            "(three linear, three angular), because four numbers of a quaternion describe "
            "only three ways to turn."
        ),
        Table(
            ("", "nq", "nv", "nu", "nbody"),
            [
                (name, str(layout.nq), str(layout.nv), str(layout.nu), str(layout.nbody))
                for name, layout in results.items()
            ],
            title="Sizes: qpos, qvel, ctrl, bodies (the world is one)",
        ),
    ]
    for name, layout in results.items():
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
                title=f"{where(results, name)}who owns which slots",
                words=frozenset({0, 1}),
            )
        )
    blocks.append(
        Code(
            (
                "joint = model.joint_id('wrist_flex')",
                "data.qpos[model.jnt_qposadr[joint]]   # never arithmetic",
                "data.qvel[model.jnt_dofadr[joint]]",
            )
        )
    )
    if first.nq != first.nv:
        blocks.append(
            Verdict(f"qpos and qvel have different lengths: {first.nq} and {first.nv}", True)
        )
    for name, layout in results.items():
        if layout.keyframe_time is None:
            continue
        blocks.append(
            Verdict(
                f"{where(results, name)}after a reset to keyframe 0 ({layout.keyframe!r}) "
                f"data.time is {layout.keyframe_time:g} s, not {layout.fresh_time:g}: time is "
                "a number of the state like any other",
                layout.keyframe_time != layout.fresh_time,
            )
        )
    return page_of("The state is two arrays, and they do not line up", results, blocks)


def _slots(start: int, stop: int) -> str:
    return f"[{start}]" if stop == start + 1 else f"[{start}:{stop}]"
