"""What of a file gets another value, attribute by attribute."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AttributeChange:
    """An attribute of one element of a file that gets another value.

    Attributes:
        file: Name of the file, without its folder.
        line: Number of the line on which the element begins, from 1.
        element: The element, as its tag and its name.
        attribute: Name of the attribute.
        old: Its text; "" where the element has no such attribute.
        new: Its new text; "" where it is taken away.
    """

    file: str
    line: int
    element: str
    attribute: str
    old: str
    new: str

    @property
    def old_text(self) -> str:
        """Return the attribute as the file has it."""
        return f'{self.attribute}="{self.old}"'

    @property
    def new_text(self) -> str:
        """Return the attribute as it is to be."""
        return f'{self.attribute}="{self.new}"'


@dataclass(frozen=True)
class UnwrittenChange:
    """A difference that no attribute of the file undoes.

    Attributes:
        cause: What it is, and of what.
        reason: Why it is not written.
    """

    cause: str
    reason: str
