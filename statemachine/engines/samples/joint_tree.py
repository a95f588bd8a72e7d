"""A tree of hinges and a fixed joint, whose order tells by which rule an engine counts joints."""

from __future__ import annotations

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
