"""The table of what differs, and each difference's part of the gap."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...measures.text import NO_NUMBER, capital, percent
from ...show.blocks import Block, Section, Table, TableCell
from .answer_page import amount
from .explanation import Explanation, Share
from .locate import Localisation
from .values_page import (
    distinct,
    heading_of,
    relative_difference,
    sides_of,
    texts_of,
    title_of,
)

_SAME = "″"  # in the rows of a cause's further quantities, which have one part with the first
_SHOWN = 12  # rows; the rest is folded away
_SMALL = 0.01  # of the gap: a chaos floor below that is not spoken of
_NO_PART = 1e-3  # of the gap: causes below that are one row
_SUMMARY_HEADS = ("what", "left", "right", "part", "right's file")
_FILE_OR_OPTION = "right's file or option"
_HEADS = ("what", "left", "right", "part", "alone", "last")
_WORDS = frozenset({0, 1, 2})  # columns
_TITLE = "What differs, and its part of the {gap} of the {quantity} ({measure})"
_MEASURES = {
    "worst": "each run at its largest",
    "end": "at the last moment",
    "rms": "as a root mean square",
}

Row = tuple[str, ...]


def summary_table(result: Explanation, most: int) -> Table:
    """Return the causes of the first screen, the largest share first; the rest is one row.

    Args:
        result: The explanation.
        most: How many rows it has before the one that counts the rest.
    """
    acting = [
        row for row in equalizable_shares(result) if has_effect(row) or not result.verdict.divides
    ]
    parts: list[tuple[Row, float]] = []
    for row in acting:
        parts.append((_summary_of_cause(result, row), row.share if row.share else row.weight()))
    for place in result.found_in:
        parts.append((_summary_of_place(place), place.share))
    parts.sort(key=lambda pair: -abs(pair[1]))
    shown = [row for row, _ in parts[:most]]
    more = len(equalizable_shares(result)) + len(result.found_in) - len(shown)
    if more:
        share = None
        if result.verdict.divides and result.is_complete:
            share = result.explained + result.located - sum(part for _, part in parts[:most])
        shown.append(_row_of_rest(more, share))
    heads = _SUMMARY_HEADS
    if any(row.option for row in acting):
        heads = (*heads[:4], _FILE_OR_OPTION)
    # Where nothing stands in the file; and ranges need the room.
    if not result.is_complete or all(row[4] == NO_NUMBER for row in shown):
        heads, shown = heads[:4], [row[:4] for row in shown]
    return Table(heads, shown, words=frozenset({0, 1, 2, 4}))


def _summary_of_cause(result: Explanation, row: Share) -> Row:
    """Return a cause in one row, with the option or the line of the right's file that says it."""
    left, right = sides_of(row, most=1)
    place = NO_NUMBER
    if row.option:
        place = row.option
    elif row.place is not None:
        place = f"{row.place.file}:{row.place.line}"
    elif row.changes:
        place = f"{row.changes[0].file}:{row.changes[0].line}"
    return capital(heading_of(row)), left, right, _parts(result, row)[0], place


def _summary_of_place(place: Localisation) -> Row:
    """Return what was localised in one row."""
    left, right = place.values or (NO_NUMBER, NO_NUMBER)
    return f"{capital(place.name)} (localised)", left, right, percent(place.share), NO_NUMBER


def _row_of_rest(count: int, share: float | None) -> Row:
    """Return the row that counts the causes that have none of their own.

    Args:
        count: How many they are.
        share: What they take away together, as a part of the gap; None where it was not divided.
    """
    return f"{count} more", NO_NUMBER, NO_NUMBER, percent(share), NO_NUMBER


def equalizable_shares(result: Explanation) -> list[Share]:
    """Return the causes that can be equalized."""
    return [row for row in result.shares if not row.note]


def tables(result: Explanation) -> list[Block]:
    """Return the differences, the largest share first; those without an effect are one row."""
    small = without_effect(result, equalizable_shares(result))
    rows: list[Row] = []
    for row in equalizable_shares(result):
        if row not in small:
            rows += _rows_of_cause(result, row)
    rows += [_row_of_place(place) for place in result.found_in]
    if small:
        rows.append(_row_of_small(small))
    if not rows:
        return []
    heads = _HEADS
    if all({*row[4:]} <= {NO_NUMBER, _SAME} for row in rows):  # nothing was equalized by itself
        heads, rows = heads[:4], [row[:4] for row in rows]
    most = _SHOWN if len(rows) > _SHOWN + 1 else len(rows)  # no table of one row
    shown = Table(heads, rows[:most], _title(result), words=_WORDS)
    if most == len(rows):
        return [shown]
    heading = f"{len(rows) - most} more differences, with smaller parts"
    more = Table(heads, rows[most:], heading, words=_WORDS)
    return [shown, Section("", heading, [more], folded=True)]


def without_effect(result: Explanation, rows: Sequence[Share]) -> list[Share]:
    """Return the differences without an effect, if there are several."""
    if not result.verdict.divides:
        return []
    small = [row for row in rows if not has_effect(row)]
    return small if len(small) > 1 else []


def has_effect(row: Share) -> bool:
    """Tell whether a cause takes away a part of the gap: in the mean, alone, last, in an order."""
    parts = [row.share, row.alone, row.last]
    if row.share is None and row.range is not None:  # the ends of an estimate are its errors
        parts += row.range
    return max(abs(part or 0.0) for part in parts) >= _NO_PART


def is_beyond(row: Share) -> bool:
    """Tell whether a cause takes away more than all of the gap."""
    return abs(row.share or 0.0) > 1.0 + _NO_PART


def is_noisy(result: Explanation) -> bool:
    """Tell whether small parts of a gap are chance, so that its floor has to be spoken of."""
    return result.verdict.divides and result.floor > _SMALL * result.gap


def _title(result: Explanation) -> str:
    if not result.verdict.divides:
        return "What differs"
    return _TITLE.format(
        gap=amount(result, result.gap),
        quantity=result.quantity,
        measure=_MEASURES[result.measure],
    )


def _rows_of_cause(result: Explanation, row: Share) -> list[Row]:
    """Return a row for each quantity of a cause; the parts stand in the first."""
    parts = _parts(result, row)
    if not row.values:
        return [(capital(row.name), NO_NUMBER, NO_NUMBER, *parts)]
    rows: list[Row] = []
    for value in sorted(distinct(row.values), key=relative_difference, reverse=True):
        left, right = texts_of(value)
        rows.append((capital(title_of(row, value)), left, right, *parts))
        parts = (_SAME, _SAME, _SAME)
    return rows


def _parts(result: Explanation, row: Share) -> Row:
    """Return the part of a cause, and what it takes away alone and last."""
    noise = result.floor / result.gap if result.verdict.divides else 0.0
    if (
        row.share is not None and abs(row.share) < noise and noise > _SMALL
    ):  # no part is claimed inside the floor
        return TableCell(f"< {percent(noise)}", share=row.share), NO_NUMBER, NO_NUMBER
    if row.share is None and row.alone is not None and row.last is None:
        return TableCell(f"{percent(row.alone)} alone", share=None), percent(row.alone), NO_NUMBER
    if row.share is None and row.last is not None and row.range == (row.last, row.last):
        part = TableCell(f"{percent(row.last)} last", share=None)
        return part, percent(row.alone), percent(row.last)
    if row.share is None and row.range is not None:
        ends = [f"{100 * round(end, 2) + 0.0:.0f}" for end in row.range]
        part = TableCell(f"{' to '.join(dict.fromkeys(ends))} %", share=None)
        return part, percent(row.alone), percent(row.last)
    explains = percent(row.share)
    if row.error and math.isfinite(row.error):
        explains += f" ± {percent(row.error)}"
    part = TableCell(explains, share=row.share)
    return part, percent(row.alone), percent(row.last)


def _row_of_place(place: Localisation) -> Row:
    """Return what a feature takes away when it is left out on both sides."""
    left, right = place.values or (NO_NUMBER, NO_NUMBER)
    mark = "†" if place.values else "*"
    part = TableCell(f"{percent(place.share)}{mark}", share=place.share)
    return capital(place.name), left, right, part, NO_NUMBER, NO_NUMBER


def _row_of_small(small: Sequence[Share]) -> Row:
    share = sum(row.share or 0.0 for row in small)
    part = TableCell(percent(share), share=share)
    return f"{len(small)} more, none above 0.1 %", NO_NUMBER, NO_NUMBER, part, NO_NUMBER, NO_NUMBER
