"""What a recording tells of the parameters of an arm, and of causes, as tables."""

from __future__ import annotations

from collections.abc import Sequence

from ...measures.text import NO_NUMBER, percent
from ...show.blocks import Table, TableCell
from .parameter_texts import (
    REASON_WORDS,
    factor_text,
    figure_text,
    half_width_text,
    interval_text,
    name_of_parameter,
    number_text,
    unit_text,
)
from .results import UNITS, CauseShare, FittedParameter, IdentificationResult, Kind

UNKNOWN = "?"
_OF_MODEL = "the model"
_LEFT_OUT = "…"
_MOST_KINDS = 4  # columns for which there is room


def joint_table(parameters: Sequence[FittedParameter], most: int) -> Table:
    """Return what is determined: a row for each joint, a column for each kind.

    Of five kinds the last, offsets, has no column: it is no figure of the model.

    Args:
        parameters: All of them.
        most: How many joints have a row; how many more there are stands below.
    """
    of_joints = [each for each in parameters if each.joint is not None]
    determined = [each for each in of_joints if each.verdict == "determined"]
    known: set[Kind] = {each.kind for each in determined}
    kinds = sorted(known, key=list(UNITS).index)[:_MOST_KINDS]
    joints = list(dict.fromkeys(each.joint for each in determined if each.kind in kinds))
    cells = {(each.joint, each.kind): _cell_of(each) for each in of_joints}
    rows: list[list[str]] = []
    if len(joints) == most + 1:  # one that is left out would take as much room
        most += 1
    for joint in joints[:most]:
        rows.append([joint or "", *(cells.get((joint, kind), NO_NUMBER) for kind in kinds)])
    if len(joints) > most:
        rows.append([f"{len(joints) - most} more", *[_LEFT_OUT] * len(kinds)])
    if rows:
        rows.append([_OF_MODEL, *(_model_text(of_joints, kind) for kind in kinds)])
    headers = ["fitted", *(f"{kind}, {unit_text(kind)}" for kind in kinds)]
    return Table(headers, rows)


def _cell_of(parameter: FittedParameter) -> str:
    """Return a figure with half of its interval; a question mark where it cannot be told."""
    if parameter.verdict != "determined":
        return UNKNOWN
    return f"{number_text(parameter.kind, parameter.fitted)} ± {half_width_text(parameter)}"


def _model_text(parameters: Sequence[FittedParameter], kind: Kind) -> str:
    """Return the figures of a kind that the model has, from the least to the largest."""
    values = [each.model for each in parameters if each.kind == kind]
    ends = dict.fromkeys(number_text(kind, value) for value in (min(values), max(values)))
    return " to ".join(ends)


def determined_table(parameters: Sequence[FittedParameter]) -> Table:
    """Return the parameters that are determined, with intervals."""
    headers = ("parameter", "model", "fitted", "95 % within", "times")
    rows = [
        [*_figures(each), factor_text(each)] for each in parameters if each.verdict == "determined"
    ]
    return Table(headers, rows)


def undetermined_table(parameters: Sequence[FittedParameter]) -> Table:
    """Return the parameters that the recording cannot tell, and what each lacks."""
    headers = ("parameter", "model", "fitted", "95 % within", "fails by")
    rows: list[list[str]] = []
    for each in parameters:
        if each.verdict == "cannot tell":
            reasons = ", ".join(REASON_WORDS[reason] for reason in each.reasons)
            rows.append([*_figures(each), reasons])
    return Table(headers, rows, words=frozenset({0, 4}))


def _figures(parameter: FittedParameter) -> list[str]:
    """Return name and figures of a parameter, the unit once."""
    kind = parameter.kind
    return [
        name_of_parameter(parameter),
        number_text(kind, parameter.model),
        figure_text(kind, parameter.fitted),
        interval_text(parameter),
    ]


def ranked_shares(result: IdentificationResult) -> list[CauseShare]:
    """Return the causes, the largest share first."""
    return sorted(result.shares, key=lambda share: -share.share)


def share_table(result: IdentificationResult) -> Table:
    """Return the causes with their shares, and what each takes away alone and last."""
    headers = ("cause", "share of the gap", "alone", "last")
    rows: list[tuple[str, ...]] = []
    for share in ranked_shares(result):
        part = TableCell(percent(share.share), share=share.share)
        rows.append((share.cause, part, percent(share.alone), percent(share.last)))
    return Table(headers, rows)
