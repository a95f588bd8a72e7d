"""What writes a difference of two compiled models as attributes of a file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable

from ..records import Edit, SpecEdit
from .xml_source import AttributeText


class NotWrittenError(Exception):
    """No attribute of the file undoes a difference; the message says why."""


class FileForm(ABC):
    """The form of a file: that of an MJCF, or that of a URDF."""

    @abstractmethod
    def texts(
        self, edits: Iterable[Edit], spec_edits: Iterable[SpecEdit] = ()
    ) -> list[AttributeText]:
        """Return the attributes that undo one difference.

        Args:
            edits: What is set in the compiled model of the file.
            spec_edits: What is set in its description.

        Raises:
            NotWrittenError: No attribute does.
        """
