"""What of the right's file undoes each difference, attribute by attribute."""

from __future__ import annotations

from collections.abc import Collection

from ...engines.description.file_changes import AttributeChange
from ...engines.description.file_form import FileForm, NotWrittenError
from ...engines.description.xml_source import XmlSource
from ...errors import StateMachineError
from ...interface import Model
from ..compare.matching import Matched
from ..why.causes import Cause, causes, differences_of
from ..why.rewriting import changes_of, form_of_right, reason_not_written
from .records import DifferenceChange

_SUFFIXES = (".xml", ".mjcf", ".urdf")


def difference_changes(
    left: Model, right: Model, matched: Matched, acting: Collection[str]
) -> tuple[DifferenceChange, ...]:
    """Return what of the right's file undoes differences of two compiled models.

    Args:
        left: The left side.
        right: The right side, as its file is compiled.
        matched: What of one is what of the other.
        acting: Titles of the differences that act on a motion; of others nothing is told.

    Returns:
        An entry for each cause; none where the right's file has no text that can be changed.
    """
    if right.path.suffix.lower() not in _SUFFIXES:
        return ()
    try:
        form = form_of_right(left, right, matched, XmlSource(right.path))
    except StateMachineError:  # one of them is no XML, or its macros are still to be expanded
        return ()
    rows = [row for row in differences_of(left, right, matched) if row.title in acting]
    return tuple(_change_of(cause, form) for cause in causes(rows))


def _change_of(cause: Cause, form: FileForm) -> DifferenceChange:
    """Return what undoes one cause, or why no attribute does."""
    reason = reason_not_written(cause)
    changes: tuple[AttributeChange, ...] = ()
    if not reason:
        try:
            changes = changes_of(form.texts(cause.edits(1), cause.spec_edits(1)))
        except NotWrittenError as error:
            reason = str(error)
    return DifferenceChange(cause.name, changes, reason)
