"""What of the right's file undoes each cause of an explanation, attribute by attribute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...engines.description.file_changes import AttributeChange
from ...engines.description.file_form import FileForm, NotWrittenError
from ...engines.description.xml_source import XmlSource
from ...errors import StateMachineError
from ...interface import Model
from ..compare.matching import match_models
from .causes import Cause, causes, differences_of
from .explanation import Explanation, Share
from .rewriting import changes_of, form_of_right, reason_not_written
from .written import as_written

OF_THE_RUN = "it is of the run, and stands in no element of the file"
OF_THE_ENGINE = "it is a setting of the engine, and does not stand in the file"
_UNKNOWN = "no attribute of the file is known to undo it"


def with_changes(
    result: Explanation, left: Model, right: Model, names: Mapping[str, str], finer: bool
) -> Explanation:
    """Return an explanation whose causes know what of the right's file undoes them.

    Args:
        result: The explanation.
        left: The left side.
        right: The right side.
        names: Joints, bodies, sites and actuators of the left that go by other names on the right.
        finer: Whether every difference is divided into its entries.
    """
    if left.compiled is None or right.compiled is None:
        return result
    matched = match_models(left, right, names)
    rows = differences_of(left, right, matched, finer=finer)
    all_causes = causes(rows, finer)
    written = as_written(left.path, right.path, all_causes)
    by_name = {text.name: cause for text, cause in zip(written, all_causes, strict=True)}
    try:
        form = form_of_right(left, right, matched, XmlSource(right.path))
    except StateMachineError:  # it is a binary file
        return result
    shares = [_with_changes(row, by_name.get(row.name), form) for row in result.shares]
    shapes = _changes_of_shapes(shares, by_name, right)
    for number, row in enumerate(shares):
        cause = by_name.get(row.name)
        if cause is not None and row.kind == "body" and not (row.changes or row.not_written):
            changes: list[AttributeChange] = []
            for body in _elements(cause, "body"):
                changes += shapes.get(body, ())
            shares[number] = replace(row, changes=tuple(dict.fromkeys(changes)))
    return replace(result, shares=tuple(shares))


def _changes_of_shapes(
    shares: Sequence[Share], causes_by_name: Mapping[str, Cause], right: Model
) -> dict[int, list[AttributeChange]]:
    """Return the changes of geoms by the body that they weigh, by its id."""
    changes: dict[int, list[AttributeChange]] = {}
    for row in shares:
        cause = causes_by_name.get(row.name)
        if cause is None or row.kind != "geom":
            continue
        for geom in _elements(cause, "geom"):
            body = int(right.compiled.geom_bodyid[geom])
            changes.setdefault(body, []).extend(row.changes)
    return changes


def _elements(cause: Cause, kind: str) -> list[int]:
    """Return the ids of the elements of a kind on the right that a cause is of."""
    edits = [edit for edit in cause.edits(1) if edit[0].startswith(f"{kind}_")]
    ids = [index[0] for _, index, _ in edits if index]
    return list(dict.fromkeys(number for number in ids if isinstance(number, int)))


def _with_changes(row: Share, cause: Cause | None, form: FileForm) -> Share:
    """Return a cause with what of the file undoes it, or why nothing does."""
    if row.kind == "engine":
        return replace(row, not_written=OF_THE_ENGINE)
    if row.kind == "run":
        return replace(row, not_written=OF_THE_RUN)
    if cause is None:
        return replace(row, not_written=_UNKNOWN)
    reason = reason_not_written(cause)
    if reason:
        return replace(row, not_written=reason)
    try:
        changes: tuple[AttributeChange, ...] = changes_of(
            form.texts(cause.edits(1), cause.spec_edits(1))
        )
    except NotWrittenError as error:
        return replace(row, not_written=str(error))
    return replace(row, changes=changes)
