"""What an explanation says: the cause first, then every difference with its part of the gap.

The first sentence is made in `why_answer`, the table in `why_table`, the values of a cause in
`why_values`.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...engines.records import DifferingQuantity
from ...installed import DEFAULT
from ...measures.text import NONE, capital, few, listed, percent, quantity, sentence, short_time
from ...show import report_template as template
from ...show.blocks import Block, Items, Page, Text
from ...show.report_template import if_true
from ..compare.chaos import CLEAR
from ..compare.labels import lacking
from . import ADDS_UP, UNEXPLAINED, Explanation, Share
from .answer_page import amount, answer, missing, parts, proofs, refused
from .locate import Localisation
from .table_page import has_effect, is_beyond, is_noisy, table, without_effect
from .values_page import texts_of, title_of

_SINGULAR = {"joints": "worst joint", "slides": "worst slide", "ball joints": "worst ball joint"}
ADD = "add what the left has"
PLAYED = "the models were run again, with the recorded starts and commands"

Slots = dict[str, str | float | Items | Sequence[Block] | None]  # of a template, by name


def page(result: Explanation, said: Sequence[str] = ()) -> Page:
    """Say what the gap comes from, what differs, what each difference explains, and what stays.

    Args:
        result: The explanation.
        said: Lines to say before anything else.
    """
    title, *further = [*missing(result.missing), answer(result)]
    slots = _origin(result) | _hints(result) | _verdict(result)
    return template.page(
        "lab/why/why",
        title=title,
        first=_first_lines(result, [*further, *said]),
        causes=causes(result),
        changes=steps(result),
        parts=three_parts(result)[1:],
        **slots,
    )


def _origin(result: Explanation) -> Slots:
    """Return what was run, and how long it took."""
    left, right = result.labels
    return {
        "experiment": result.experiment,
        "left": left,
        "right": right,
        "seconds": result.seconds,
        "runs": result.runs,
        "took": short_time(result.took),
        "moments": result.moments,
    }


def _first_lines(result: Explanation, said: Sequence[str]) -> list[Text]:
    """Return what stands before the causes."""
    only = lacking(result.unmatched, ("the left", "the right"))
    lines = [sentence(line) for line in (*said, *only, *result.notes)]
    return [Text(line) for line in (*lines, *proofs(result), result.says) if line]


def _hints(result: Explanation) -> Slots:
    """Return where to look for what is not explained."""
    engines = {side.backend for side in result.provenance}
    files = {side.model_sha256 for side in result.provenance}
    slots: Slots = {"both": if_true(len(engines) > 1 and len(files) > 1)}
    return slots | _where_the_rest_may_be(result, engines) | _what_is_between(result, engines)


def _is_found(result: Explanation) -> bool:
    """Tell whether all that is not explained was localised."""
    return result.located > UNEXPLAINED >= result.unexplained


def _where_the_rest_may_be(result: Explanation, engines: set[str]) -> Slots:
    """Return what the rest of the gap may come from, where the question is not answered."""
    slots: Slots = {"refused": None, "engines": None, "files": None}
    if result.verdict.holds or not result.verdict.divides:
        return slots
    names = [row.name for row in refused(result)]
    if names:
        slots["refused"] = ", ".join(names[:4])
    elif len(engines) == 1:
        slots["files"] = if_true(True)
    elif not _is_found(result):
        slots["engines"] = if_true(True)
    return slots


def _what_is_between(result: Explanation, engines: set[str]) -> Slots:
    """Return what is said of a gap between engines that was localised."""
    is_between = result.verdict.divides and _is_found(result) and len(engines) > 1
    by_contact = any(place.name == "contact" for place in result.found_in)
    is_soft = is_between and by_contact and DEFAULT in engines
    return {"between": if_true(is_between), "soft": if_true(is_soft)}


def _verdict(result: Explanation) -> Slots:
    """Return the last line: whether the question is answered."""
    three = f" {parts(result)}." if result.verdict.divides else ""
    return {"holds": result.verdict.holds, "answer": answer(result), "three": three}


def causes(result: Explanation) -> list[Block]:
    """Say how far apart the sides are, and how much of it each difference explains."""
    able = [row for row in result.shares if not row.note]
    small = without_effect(result, able)
    slots = (
        _how_far_apart(result)
        | _what_has_no_part(result)
        | _how_it_was_divided(result, able)
        | _what_could_not_be_run(result)
        | _chaos(result)
    )
    return template.blocks(
        "lab/why/why_causes",
        table=table(result, able, small),
        more=few([row.name for row in small], 6) or None,
        located=_located(result),
        **slots,
    )


def _how_far_apart(result: Explanation) -> Slots:
    """Return the gap that is explained, and the gaps in other quantities."""
    gap = result.first[result.quantity]
    worst, rms, end = (quantity(size, gap.unit) for size in (gap.worst, gap.rms, gap.end))
    return {
        "what": _SINGULAR.get(result.quantity, result.quantity),
        "at": short_time(gap.at),
        "worst": worst,
        "rms": rms,
        "end": end,
        "explained": result.quantity,
        "elsewhere": _elsewhere(result),
        "between": if_true(result.between),
    }


def _elsewhere(result: Explanation) -> str | None:
    """Return the gaps in other quantities; None if there are none."""
    gaps = [
        f"{name.replace(',', '')} {quantity(gap.worst, gap.unit)}"
        for name, gap in result.first.items()
        if name != result.quantity
    ]
    return "; ".join(gaps) or None


def _what_has_no_part(result: Explanation) -> Slots:
    """Return what is said where nothing differs, or where a difference cannot show."""
    anything = result.shares or result.found_in or result.unread
    return {
        "same": if_true(not anything),
        "unread": few(list(result.unread), 6) or None,
        "hardly_move": ", ".join(result.still) or None,
    }


def _located(result: Explanation) -> list[Block]:
    """Say what was left out on both sides, or which integrator both were given."""
    blocks: list[Block] = []
    for number, place in enumerate(result.found_in):
        before = listed([row.name for row in result.found_in[:number]])
        slots = _integrator(place, before) if place.values else _feature(place, result.quantity)
        blocks += template.blocks("lab/why/why_located", **slots)
    return blocks


def _integrator(place: Localisation, before: str) -> Slots:
    """Return what is said of an integrator.

    Args:
        place: The part of the gap.
        before: What was left out before, in words; "" if nothing was.
    """
    return {
        "cause": None,
        "idle": None,
        "still": None,
        "integrator": None if before else place.without,
        "before": before or None,
        "then": place.without,
        "alone": percent(place.alone),
    }


def _feature(place: Localisation, still: str) -> Slots:
    """Return what is said of a feature that was left out on both sides.

    Args:
        place: The part of the gap.
        still: The quantity that may hardly move any more.
    """
    return {
        "cause": None if place.is_still else place.name,
        "idle": place.name if place.is_still else None,
        "still": still,
        "integrator": None,
        "before": None,
        "then": None,
        "alone": None,
    }


def _how_it_was_divided(result: Explanation, able: Sequence[Share]) -> Slots:
    """Return how the parts were computed, and how they are read.

    Args:
        result: The explanation.
        able: The causes that can be equalized.
    """
    slots: Slots = {
        "add_up": None,
        "all_sets": if_true(result.method == "all sets"),
        "orders": None,
        "beyond": if_true(any(is_beyond(row) for row in able)),
    }
    if result.method == "one at a time":
        slots["add_up"] = f"{100 * ADDS_UP:g} %"
    if result.method == "drawn orders":
        slots["orders"] = result.orders
    return slots | _how_parts_are_read(result, able)


def _how_parts_are_read(result: Explanation, able: Sequence[Share]) -> Slots:
    """Return what is said of the columns of the table.

    Args:
        result: The explanation.
        able: The causes that can be equalized.
    """
    if result.method == "nothing":
        return {"shares": None, "several": None, "no_figure": None}
    lacks_figures = any(row.alone is None or row.last is None for row in able)
    return {
        "shares": if_true(True),
        "several": if_true(len(able) > 1),
        "no_figure": if_true(lacks_figures),
    }


def _what_could_not_be_run(result: Explanation) -> Slots:
    """Return what cannot be equalized, and which sets of causes could not be run."""
    rows = refused(result)
    such_as = result.impossible[0] if result.impossible else ()
    return {
        "refused_too": if_true(rows),
        "refused": Items([f"{capital(row.name)}: {row.note}." for row in rows]),
        "impossible": len(result.impossible) or None,
        "such_as": ", ".join(such_as),
    }


def _chaos(result: Explanation) -> Slots:
    """Return what rounding and chaos make of the gap."""
    slots: Slots = {"draws": result.draws, "clear": f"{CLEAR:g}"}
    slots |= dict.fromkeys(("negligible", "chaos", "noise", "noise_part", "quiet"))
    floor = amount(result, result.floor)
    if result.gap <= result.negligible:
        slots["negligible"] = amount(result, result.negligible)
    elif not result.verdict.divides:
        slots["chaos"] = floor
    if is_noisy(result):
        slots["noise"] = floor
        slots["noise_part"] = percent(result.floor / result.gap)
    elif result.verdict.divides and result.floor > 0:
        slots["quiet"] = floor
    return slots


def steps(result: Explanation) -> list[Block]:
    """Say what to change, where, and what is left of the gap with everything changed."""
    if not result.verdict.divides:
        return []
    able = [row for row in result.shares if not (row.note or row.chosen)]
    lines: list[str] = []
    for row in able:
        if has_effect(row):
            lines += _changes(row)
    some_are_left = 0 < len(lines) < len(able)
    slots: Slots = {
        "any": if_true(lines),
        "changes": Items(lines),
        "quantity": result.quantity,
        "redundant": ", ".join(result.redundant) or None,
        "others": if_true(some_are_left and len(result.first) > 1),
    }
    slots |= _with_everything_changed(result) if lines else {"left": None, "engine": None}
    slots |= _chosen_integrator(result)
    return template.blocks("lab/why/why_changes", **slots)


def _with_everything_changed(result: Explanation) -> Slots:
    """Return what of the gap stays, and the engine whose settings can be changed at once."""
    left = None if result.brought is None else amount(result, result.brought)
    return {"left": left, "engine": _engine_as_it_comes(result)}


def _changes(row: Share) -> list[str]:
    """Return what to change for one cause: a line for each quantity."""
    place = f"{row.place.file}, line {row.place.line}: " if row.place else ""
    if not row.values:
        return [f"{place}{row.name}: {NONE} → {NONE}"]
    return [f"{place}{title_of(row, value)}: {_change(value)}" for value in row.values]


def _change(value: DifferingQuantity) -> str:
    """Say what the right is to be given."""
    left, right = texts_of(value)
    if (left, right) == ("there", NONE):
        return ADD
    return f"{right} → {left}"


def _engine_as_it_comes(result: Explanation) -> str | None:
    """Return an engine with its own settings, where such settings are causes; else None."""
    if not any(row.kind == "engine" for row in result.shares):
        return None
    for label, made in zip(result.labels, result.provenance, strict=True):
        comes_with_its_own = ":engine" in label or "engine defaults" in label
        if comes_with_its_own and made.backend != DEFAULT:
            return made.backend
    return None


def _chosen_integrator(result: Explanation) -> Slots:
    """Return the side that alone has integrators to choose from, and the one to choose."""
    for row in result.shares:
        if row.chosen:
            side, integrator = row.chosen
            return {"side": side, "integrator": integrator}
    return {"side": None, "integrator": None}


def three_parts(result: Explanation) -> list[Block]:
    """Say the three parts of the gap, and what they mean; nothing where there is none."""
    if not result.verdict.divides:
        return []
    blocks = template.blocks("lab/why/why_parts", parts=parts(result))
    if result.verdict.holds and not result.located:
        return blocks[:1]  # they need no explanation
    return blocks
