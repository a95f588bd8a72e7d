"""The elements of a URDF: links, joints, frames and inertias as XML.

Numbers are written so that reading them back gives the same float64.
"""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from ...interface import Array


def joint_element(
    name: str, kind: str, parent: str, child: str, origin: Element, *extra: Element
) -> Element:
    """Return a joint of a kind between two links, by their names.

    Args:
        name: The joint's.
        kind: Its type in a URDF, as "revolute".
        parent: Name of the link that carries it.
        child: Name of the link that it carries.
        origin: Where its frame is in that of the parent.
        *extra: What else it has: its axis, its limits.
    """
    ends = element("parent", link=parent), element("child", link=child)
    return element("joint", origin, *ends, *extra, name=name, type=kind)


def bare_link(name: str, mass: float, inertia: Array) -> Element:
    """Return a link without geoms, whose centre of mass is its frame."""
    inside = element("inertial", element("mass", value=mass), inertia_element(inertia))
    return element("link", inside, name=name)


def inertia_element(tensor: Array) -> Element:
    """Return the element of an inertia (3, 3) [kg m²]."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = tensor
    return element("inertia", ixx=xx, ixy=xy, ixz=xz, iyy=yy, iyz=yz, izz=zz)


def origin_element(pos: Array, mat: Array) -> Element:
    """Return the element of a frame at a place (3,) [m], turned by a matrix (3, 3)."""
    return element("origin", xyz=pos, rpy=_rpy(mat))


def _rpy(mat: Array) -> Array:
    """Return the angles (3,) with mat = Rz(yaw)·Ry(pitch)·Rx(roll), to full precision everywhere.

    At a pitch of ±90° roll is arbitrary; yaw is computed from the roll that was
    chosen, so that the product is right whatever it is.
    """
    pitch = np.arctan2(-mat[2, 0], np.hypot(mat[0, 0], mat[1, 0]))
    roll = np.arctan2(mat[2, 1], mat[2, 2])
    s, c = np.sin(roll), np.cos(roll)
    yaw = np.arctan2(s * mat[0, 2] - c * mat[0, 1], c * mat[1, 1] - s * mat[1, 2])
    return np.array([roll, pitch, yaw])


def element(tag: str, *inside: Element, **attributes: Any) -> Element:
    """Return an element; a number is the shortest text that reads back as the same float64."""
    written = Element(tag)
    for name, value in attributes.items():
        if not isinstance(value, str):  # no negative zero
            value = " ".join(map(repr, (np.atleast_1d(value) + 0.0).tolist()))  # noqa: PLW2901
        written.set(name, value)
    written.extend(inside)
    return written
