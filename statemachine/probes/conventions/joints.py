"""In which order the joints come, and whether a fixed one takes a number."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from ...installed import require
from . import UNDECIDED, Figure, Finding, Findings, Question
from ._bullet import load, world

QUESTION = Question(
    "In which order do the joints come, and does a fixed one take a number?",
    "A command in the order of another engine moves the wrong joints. Look joints up by name.",
)
# (name, parent, kind) in the order of the file; the parent is named by the joint above it.
# Listed, depth first, breadth first, each by file or by alphabet: all different here.
TREE = (
    ("lima", "zulu", "hinge"),
    ("zulu", "base", "hinge"),
    ("weld", "zulu", "fixed"),
    ("kilo", "weld", "hinge"),
    ("echo", "base", "hinge"),
    ("bravo", "echo", "hinge"),
    ("alpha", "zulu", "hinge"),
)
FIXED = "weld"


def depth_first(parent: str, by_name: bool) -> Iterator[str]:
    """Names of the joints below a link."""
    children = [name for name, above, _ in TREE if above == parent]
    for name in sorted(children) if by_name else children:
        yield name
        yield from depth_first(name, by_name)


def breadth_first(by_name: bool) -> Iterator[str]:
    """Names of all joints, level by level."""
    level = ["base"]
    while level:
        below: list[str] = []
        for parent in level:
            children = [name for name, above, _ in TREE if above == parent]
            below += sorted(children) if by_name else children
        yield from below
        level = below


_listed = [name for name, _, _ in TREE]
ORDERS = {
    "as listed": _listed,
    "by alphabet": sorted(_listed),
    "depth first, children as listed": list(depth_first("base", False)),
    "depth first, children by alphabet": list(depth_first("base", True)),
    "breadth first, children as listed": list(breadth_first(False)),
    "breadth first, children by alphabet": list(breadth_first(True)),
}


def order_of(names: Sequence[str], of: str) -> Findings:
    """Which rule gives the engine's names; and whether the fixed joint is among them."""
    moving = [name for name in names if name != FIXED]
    answer = next(
        (rule for rule, order in ORDERS.items() if [n for n in order if n != FIXED] == moving),
        UNDECIDED,
    )
    number = names.index(FIXED) if FIXED in names else None
    return (
        Finding(answer, (Figure("", tuple(moving)),), of),
        Finding(
            "none" if number is None else "takes a number",
            (Figure("joints with a number", len(names)),),
            f"fixed joint, {of}",
        ),
    )


_INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    "</inertial>"
)


def _link(joint: str) -> str:
    """The link under a joint: its name backwards, whose alphabet is another one."""
    return joint if joint == "base" else joint[::-1]


# The links stand in the opposite order, so that no rule about links passes for one about joints.
URDF = (
    f'<robot name="tree"><link name="base">{_INERTIAL}</link>'
    + "".join(f'<link name="{_link(name)}">{_INERTIAL}</link>' for name, _, _ in reversed(TREE))
    + "".join(
        f'<joint name="{name}" type="{"continuous" if kind == "hinge" else "fixed"}">'
        f'<parent link="{_link(parent)}"/><child link="{_link(name)}"/></joint>'
        for name, parent, kind in TREE
    )
    + "</robot>"
)


def _mjcf(parent: str) -> str:
    """The bodies below one, with their joints; a fixed joint is a body without one."""
    return "".join(
        f'<body name="{name}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        + (f'<joint name="{name}"/>' if kind == "hinge" else "")
        + f"{_mjcf(name)}</body>"
        for name, above, kind in TREE
        if above == parent
    )


MJCF = f'<mujoco><worldbody><body name="base">{_mjcf("base")}</body></worldbody></mujoco>'


def mujoco() -> Findings:
    """The ids of the joints, from a URDF and from an MJCF."""
    mj = require("mujoco")
    found: Findings = ()
    for of, text in (("URDF", URDF), ("MJCF", MJCF)):
        model = mj.MjModel.from_xml_string(text)
        name = partial(mj.mj_id2name, model, mj.mjtObj.mjOBJ_JOINT)
        found += order_of([name(joint) for joint in range(model.njnt)], of)
    return found


def pybullet() -> Findings:
    """The indices of the joints, from a URDF."""
    with world() as (pb, client):
        body = load(pb, client, URDF, fixed=True)
        count = pb.getNumJoints(body, client)
        return order_of(
            [pb.getJointInfo(body, k, client)[1].decode() for k in range(count)], "URDF"
        )


def pinocchio() -> Findings:
    """The names of the joints after the universe, from a URDF and from an MJCF."""
    pin = require("pinocchio")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "tree.xml"  # of an MJCF it takes files only
        file.write_text(MJCF, encoding="utf-8")
        models = {"URDF": pin.buildModelFromXML(URDF), "MJCF": pin.buildModelFromMJCF(str(file))}
    found: Findings = ()
    for of, model in models.items():
        found += order_of(list(model.names)[1:], of)
    return found
