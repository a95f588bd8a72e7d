"""The names of links and joints in a URDF, each once."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..compiled.types import MjModel

_LONGEST = 200  # PyBullet cuts names at 1,023 bytes


class Names:
    """What bodies, joints and sites are called in a URDF, each name once.

    MuJoCo lets a joint and a body, or two things without names, go by one name; a URDF
    that does is not a file to some readers and the end of the process to others.

    Attributes:
        links: Of each body's link; joints: of each joint; tips: of each site's link.
        between: Of the link between two joints of one body, by the first of them.
        fixed: Of the fixed joint of each body; tips_fixed: of each site's link.
    """

    def __init__(self, raw: MjModel) -> None:
        self._taken = links, joints = set[str](), set[str]()
        bodies = range(raw.nbody)
        self.links = {b: _once(raw.body(b).name or f"body_{b}", links) for b in bodies}
        self.joints = {j: _once(raw.joint(j).name or f"joint_{j}", joints) for j in range(raw.njnt)}
        self.tips = {
            s: _once(raw.site(s).name or f"site_{s}", links, "_site") for s in range(raw.nsite)
        }
        self.between = {j: _once(f"{name}_link", links) for j, name in self.joints.items()}
        self.fixed = {b: _once(f"{name}_fixed", joints) for b, name in self.links.items()}
        self.tips_fixed = {s: _once(f"{name}_fixed", joints) for s, name in self.tips.items()}
        self._parts: dict[tuple[int, int], tuple[str, str]] = {}

    def part(self, body: int, part: int) -> tuple[str, str]:
        """Return the names of the link of a part of a body, and of its fixed joint."""
        if (body, part) not in self._parts:
            name = f"{self.links[body]}_part_{part}"
            link, fixed = (
                _once(text, taken)
                for text, taken in zip((name, f"{name}_fixed"), self._taken, strict=True)
            )
            self._parts[body, part] = link, fixed
        return self._parts[body, part]


def _once(name: str, taken: set[str], suffix: str = "") -> str:
    """Return a name that is not taken yet, and not so long that a reader cuts it."""
    first = name = name.encode()[:_LONGEST].decode(errors="ignore")
    if name in taken and suffix:
        name = first + suffix
    number = 2
    while name in taken:
        name, number = f"{first}{suffix}_{number}", number + 1
    taken.add(name)
    return name
