"""How much detail a page can carry."""

from __future__ import annotations

from dataclasses import dataclass

from ...runs import Trace


@dataclass(frozen=True)
class Budget:
    """A share of the most that is drawn in any page."""

    share: float = 1.0

    @property
    def triangles(self) -> int:
        """Of all shapes."""
        return int(24_000 * self.share)

    @property
    def contacts(self) -> int:
        """Of one side, at all moments together."""
        return int(9_000 * self.share)

    def points(self, charts: int) -> int:
        """Of one curve, if there are so many charts."""
        return max(60, min(600, int(9_000 * self.share) // max(1, charts)))

    def frames(self, one: Trace, two: Trace) -> int:
        """Moments that can be shown; each takes 14 bytes for each body of both sides."""
        bodies = len(one.header.bodies) + len(two.header.bodies)
        return max(60, min(1200, int(450_000 * self.share) // (14 * max(1, bodies))))
