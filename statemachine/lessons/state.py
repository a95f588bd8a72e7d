"""The state is two arrays; slot k of one need not be slot k of the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..experiments import state
from ..page import Code, Page, Table, Text
from ._words import differences, page_of


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
    for names, layout in _alike(results, lambda each: each.joints):
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
    last = first.joints[-1] if first.joints else None
    if last is not None:
        blocks.append(
            Code(
                (
                    f"j = model.joint_id({last.name!r})",
                    _line("qpos", "q", last.qpos_stop - last.qpos_start),
                    _line("qvel", "dof", last.qvel_stop - last.qvel_start),
                )
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
                f"qpos has {first.nq} numbers and qvel {first.nv}. Of {', '.join(apart)} the slots "
                "differ: take them from jnt_qposadr and jnt_dofadr, never by arithmetic."
            )
        )
    else:
        blocks.append(
            Text("In this model every joint has the same slots in qpos and qvel; in others not.")
        )
    for names, layout in _alike(results, lambda each: (each.keyframe_time, each.fresh_time)):
        if layout.keyframe_time is None:
            continue
        times = f"{layout.keyframe_time:g} s; on a fresh Data it is {layout.fresh_time:g} s"
        blocks.append(
            Text(
                f"{names}After a reset to keyframe 0 ({layout.keyframe!r}), "
                f"data.time is {times}. Time is a number of the state like any other."
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
    return page_of("The state is two arrays", results, blocks)


def _alike(
    results: Mapping[str, state.Layout], of: Callable[[state.Layout], Any]
) -> list[tuple[str, state.Layout]]:
    """Engines that say the same are shown once: the prefix "a, b: " and one's result."""
    groups: dict[Any, list[str]] = {}
    for name, layout in results.items():
        groups.setdefault(of(layout), []).append(name)
    several = len(results) > 1
    return [
        (f"{', '.join(names)}: " if several else "", results[names[0]]) for names in groups.values()
    ]


def _layouts(one: state.Layout, two: state.Layout) -> str:
    sizes = [(each.nq, each.nv, each.nu, each.nbody, each.joints) for each in (one, two)]
    return "none" if sizes[0] == sizes[1] else "they differ: see above"


def _line(array: str, kind: str, size: int) -> str:
    address = f"model.jnt_{'qpos' if kind == 'q' else 'dof'}adr[j]"
    slots = address if size == 1 else f"{address} : {address} + {size}"
    return f"data.{array}[{slots}]"


def _slots(start: int, stop: int) -> str:
    return f"[{start}]" if stop == start + 1 else f"[{start}:{stop}]"
