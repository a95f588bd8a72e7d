"""A URDF that PyBullet reads itself: what its users get of it, and so what `defaults="engine"` is.

`loadURDF` without flags gives a link without <inertial> 1 kg, takes inertias from the collision
shapes, lets no two links of one robot meet, and knows no <mimic>. Of an MJCF there is no such file:
PyBullet's own reader of that format has neither actuators nor includes, so a URDF is written of it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ...errors import ModelError, UnsupportedError
from ...interface.records import AS_WRITTEN, ReadOptions
from ..file_text import urdf_text
from .client import as_file, load_urdf

# PyBullet has room for 128 numbers of a tree, and of a position for 7 of its base; from 122 joints
# on what it reports is wrong, and from 127 links on it has no such tree.
MOST_LINKS = 120


@dataclass(frozen=True)
class UrdfFile:
    """A URDF as it was when it was loaded.

    Attributes:
        path: Where it is: PyBullet looks for meshes from there.
        content: Its bytes.
        floats: Whether PyBullet floats its base, which is its default: where `load` was given
            base="free", or the file has a joint of type floating. Else it is fixed to the world, as
            MuJoCo's compiler does, by `useFixedBase`.
        may_float: Whether it would float in PyBullet, unless it is told to fix it: the first link
            is no "world", which weighs nothing there.
        without_inertial: Links to which PyBullet gives 1 kg.
        mimics: Joints that follow another one by the file, and none in PyBullet.
        floating: Joints of type floating: PyBullet fixes them.
    """

    path: Path
    content: bytes
    floats: bool
    may_float: bool
    without_inertial: tuple[str, ...]
    mimics: tuple[str, ...]
    floating: tuple[str, ...]

    @classmethod
    def read(cls, path: Path, options: ReadOptions = AS_WRITTEN) -> UrdfFile | None:
        """Read a file; None if it is no URDF.

        Args:
            path: The file.
            options: How it is read. Inertias need not be balanced: PyBullet has its own.

        Raises:
            ModelError: Its links are no tree: PyBullet would end the process.
            UnsupportedError: It has more links than PyBullet has room for.
        """
        try:
            content = path.read_bytes()
            if not options.meshes and (text := urdf_text(path, options=options)) is not None:
                content = text.encode()
            root = ElementTree.fromstring(content)
        except (OSError, ElementTree.ParseError, ValueError, LookupError):
            return None
        if root.tag != "robot":
            return None
        links = {link.get("name", ""): link for link in root.findall("link")}
        joints = root.findall("joint")
        children = Counter(_end(joint, "child") for joint in joints)
        roots = [name for name in links if not children[name]]
        twice = [name for name, count in children.items() if count > 1]
        if len(roots) != 1 or twice:
            what = (
                f"it has {len(roots)} roots" if not twice else f"{twice[0]!r} hangs on two joints"
            )
            raise ModelError(f"PyBullet cannot read {path}: {what}")
        if len(links) > MOST_LINKS:
            raise UnsupportedError(
                f"PyBullet has no room for the {len(links)} links of {path}; it has for "
                f"{MOST_LINKS}",
                backend="pybullet",
                feature="a tree of so many parts",
                reason=f"{len(links)} links",
            )
        floating = _names(joint for joint in joints if joint.get("type") == "floating")
        mimics = _names(joint for joint in joints if joint.find("mimic") is not None)
        # One that is fixed to the world weighs nothing; so does one of this name, in PyBullet.
        floats = bool(floating) if options.base is None else options.base == "free"
        still = {"world"} if floats else {"world", *roots}
        light = [name for name, link in links.items() if link.find("inertial") is None]
        return cls(
            path=path.absolute(),
            content=content,
            floats=floats,
            may_float=roots != ["world"],
            without_inertial=tuple(name for name in light if name not in still),
            mimics=mimics,
            floating=floating,
        )

    @classmethod
    def is_one(cls, path: Path) -> bool:
        """Tell whether a file is a URDF that PyBullet can read."""
        try:
            return cls.read(path) is not None
        except (ModelError, UnsupportedError):
            return False

    def load(self, client: int) -> int:
        """Put it into a world as PyBullet's users do, without flags; the body's number.

        Raises:
            ModelError: PyBullet cannot read it; or its meshes are needed, and it was changed or is
                not there any more.
        """
        fixed = not self.floats
        if b"<mesh" not in self.content:
            with as_file(self.content.decode(errors="replace")) as name:
                return load_urdf(client, name, self.path.name, useFixedBase=fixed)
        try:
            same = self.path.read_bytes() == self.content
        except OSError:
            same = False
        if not same:
            raise ModelError(
                f"{self.path} is not as it was loaded, and PyBullet reads it anew for each Data: "
                "load it again"
            )
        return load_urdf(client, str(self.path), self.path.name, useFixedBase=fixed)


def _names(elements: Iterable[ElementTree.Element]) -> tuple[str, ...]:
    """Return the names of elements, "" of one without a name."""
    return tuple(element.get("name", "") for element in elements)


def _end(joint: ElementTree.Element, tag: str) -> str:
    """Give the link that a joint names as its parent or child; "" for none."""
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")
