"""What is known to have changed between two releases of an engine, in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...engines.records import KnownChange, KnownChangeName
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks


@dataclass(frozen=True)
class ShownChange:
    """A known change between two releases, with the names of both.

    Attributes:
        release: The older one.
        next: The newer one.
        change: What its probe shows on both.
    """

    release: str
    next: str
    change: KnownChange

    @property
    def name(self) -> KnownChangeName:
        """Which change it is."""
        return self.change.name

    @property
    def probe(self) -> str:
        """What was measured."""
        return self.change.probe

    @property
    def left(self) -> float:
        """What the probe measures on the older one."""
        return self.change.left

    @property
    def right(self) -> float:
        """What the probe measures on the newer one."""
        return self.change.right

    @property
    def elements(self) -> tuple[str, ...]:
        """What of the model it concerns."""
        return self.change.elements

    @property
    def more(self) -> str:
        """The release on which the probe measures more."""
        return self.release if abs(self.left) > abs(self.right) else self.next

    @property
    def less(self) -> str:
        """The release on which the probe measures less."""
        return self.next if abs(self.left) > abs(self.right) else self.release


@dataclass(frozen=True)
class KnownChangesPart(PageContent):
    """Known changes, a sentence for each.

    Attributes:
        changes: With the names of both releases.
    """

    template = "known_changes.md.j2"
    changes: Sequence[ShownChange]


def known_changes_blocks(changes: Sequence[ShownChange]) -> list[Block]:
    """Return a sentence for each known change; nothing where there is none."""
    return render_blocks(KnownChangesPart(changes))
