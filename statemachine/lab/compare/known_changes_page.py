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
        """Return the name of the change."""
        return self.change.name

    @property
    def probe(self) -> str:
        """Return the name of the probe that measures the change."""
        return self.change.probe

    @property
    def left(self) -> float:
        """Return what the probe measures on the older release."""
        return self.change.left

    @property
    def right(self) -> float:
        """Return what the probe measures on the newer release."""
        return self.change.right

    @property
    def elements(self) -> tuple[str, ...]:
        """Return the elements of the model that the change concerns."""
        return self.change.elements

    @property
    def more(self) -> str:
        """Return the release on which the probe measures the larger magnitude."""
        return self.release if abs(self.left) > abs(self.right) else self.next

    @property
    def less(self) -> str:
        """Return the release on which the probe measures the smaller magnitude."""
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
