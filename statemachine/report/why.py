"""What an explanation says: the cause first, then every difference with its part of the gap.

The first sentence is made in `why_answer`, the table in `why_table`, the values of a cause in
`why_values`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..compare.labels import lacking
from ..compare.perturbed import CLEAR
from ..compare.why import ADDS_UP, UNEXPLAINED, Explanation, Share
from ..compare.why.locate import Localisation
from ..installed import DEFAULT
from ..measures.text import NONE, capital, few, listed, percent, quantity, sentence, short_time
from ..page import Block, Items, Page, Text
from . import template
from .template import if_true
from .why_answer import amount, answer, missing, parts, proofs, refused
from .why_table import has_effect, is_beyond, is_noisy, table, without_effect
from .why_values import figure_of, has_several_figures, values_of

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
    return template.page(
        "why",
        title=title,
        experiment=result.experiment,
        left=result.labels[0],
        right=result.labels[1],
        seconds=result.seconds,
        runs=result.runs,
        took=short_time(result.took),
        moments=result.moments,
        first=_first_lines(result, [*further, *said]),
        causes=causes(result),
        changes=steps(result),
        parts=three_parts(result)[1:],
        **_hints(result),
        **_verdict(result),
    )


def _first_lines(result: Explanation, said: Sequence[str]) -> list[Text]:
    """Return what stands before the causes."""
    only = lacking(result.unmatched, ("the left", "the right"))
    lines = [sentence(line) for line in (*said, *only, *result.notes)]
    return [Text(line) for line in (*lines, *proofs(result), result.says) if line]


def _hints(result: Explanation) -> Slots:
    """Return where to look for what is not explained."""
    verdict = result.verdict
    engines = {side.backend for side in result.provenance}
    files = {side.model_sha256 for side in result.provenance}
    names = [row.name for row in refused(result)]
    stays = verdict.divides and not verdict.holds
    all_found = result.located > UNEXPLAINED >= result.unexplained
    between = all_found and verdict.divides and len(engines) > 1
    by_contact = "contact" in {place.name for place in result.found_in}
    may_be_refused = stays and bool(names)
    may_be_engines = stays and not names and not all_found and len(engines) > 1
    may_be_files = stays and not names and len(engines) == 1
    return {
        "refused": ", ".join(names[:4]) if may_be_refused else None,
        "engines": if_true(may_be_engines),
        "files": if_true(may_be_files),
        "between": if_true(between),
        "soft": if_true(between and DEFAULT in engines and by_contact),
        "both": if_true(len(engines) > 1 and len(files) > 1),
    }


def _verdict(result: Explanation) -> Slots:
    """Return the last line: whether the question is answered."""
    three = f" {parts(result)}." if result.verdict.divides else ""
    return {"holds": result.verdict.holds, "answer": answer(result), "three": three}


def causes(result: Explanation) -> list[Block]:
    """Say how far apart the sides are, and how much of it each difference explains."""
    able = [row for row in result.shares if not row.note]
    small = without_effect(result, able)
    return template.blocks(
        "why_causes",
        **_how_far_apart(result),
        **_what_is_said_without_parts(result),
        table=table(result, able, small),
        more=few([row.name for row in small], 6) or None,
        located=_located(result),
        hardly_move=", ".join(result.still) or None,
        **_how_it_was_divided(result, able),
        **_what_could_not_be_run(result),
        **_chaos(result),
    )


def _how_far_apart(result: Explanation) -> Slots:
    """Return the gap that is explained, and the gaps in other quantities."""
    gap = result.first[result.quantity]
    others = [
        f"{name.replace(',', '')} {quantity(other.worst, other.unit)}"
        for name, other in result.first.items()
        if name != result.quantity
    ]
    return {
        "what": _SINGULAR.get(result.quantity, result.quantity),
        "at": short_time(gap.at),
        "worst": quantity(gap.worst, gap.unit),
        "rms": quantity(gap.rms, gap.unit),
        "end": quantity(gap.end, gap.unit),
        "explained": result.quantity,
        "elsewhere": "; ".join(others) or None,
        "between": if_true(result.between),
    }


def _what_is_said_without_parts(result: Explanation) -> Slots:
    """Return what is said where nothing differs, or where a difference is only read."""
    anything = result.shares or result.found_in or result.unread
    return {
        "same": if_true(not anything),
        "unread": few(list(result.unread), 6) or None,
    }


def _located(result: Explanation) -> list[Block]:
    """Say what was left out on both sides, or which integrator both were given."""
    blocks: list[Block] = []
    for number, place in enumerate(result.found_in):
        before = listed([row.name for row in result.found_in[:number]])
        slots = _integrator(place, before) if place.values else _feature(place, result.quantity)
        blocks += template.blocks("why_located", **slots)
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
    """Return how the parts were computed, and how they are read."""
    method = result.method
    has_shares = method != "nothing"
    lacks_figures = any(row.alone is None or row.last is None for row in able)
    return {
        "add_up": f"{100 * ADDS_UP:g} %" if method == "one at a time" else None,
        "all_sets": if_true(method == "all sets"),
        "orders": result.orders if method == "drawn orders" else None,
        "shares": if_true(has_shares),
        "several": if_true(has_shares and len(able) > 1),
        "no_figure": if_true(has_shares and lacks_figures),
        "beyond": if_true(any(is_beyond(row) for row in able)),
    }


def _what_could_not_be_run(result: Explanation) -> Slots:
    """Return what cannot be equalized, and which sets of causes could not be run."""
    rows = refused(result)
    return {
        "refused_too": if_true(rows),
        "refused": Items([f"{capital(row.name)}: {row.note}." for row in rows]),
        "impossible": len(result.impossible) or None,
        "such_as": ", ".join(next(iter(result.impossible), ())),
    }


def _chaos(result: Explanation) -> Slots:
    """Return what rounding and chaos make of the gap."""
    floor = amount(result, result.floor)
    is_rounding = result.gap <= result.negligible
    divides, noisy = result.verdict.divides, is_noisy(result)
    may_be_chance = not divides and not is_rounding
    is_quiet = divides and not noisy and result.floor > 0
    return {
        "negligible": amount(result, result.negligible) if is_rounding else None,
        "chaos": floor if may_be_chance else None,
        "draws": result.draws,
        "clear": f"{CLEAR:g}",
        "noise": floor if noisy else None,
        "noise_part": percent(result.floor / result.gap) if noisy else None,
        "quiet": floor if is_quiet else None,
    }


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
    stays = None
    if lines and result.brought is not None:
        stays = amount(result, result.brought)
    return template.blocks(
        "why_changes",
        any=if_true(lines),
        engine=_engine_as_it_comes(result) if lines else None,
        changes=Items(lines),
        left=stays,
        quantity=result.quantity,
        redundant=", ".join(result.redundant) or None,
        others=if_true(some_are_left and len(result.first) > 1),
        **_chosen_integrator(result),
    )


def _changes(row: Share) -> list[str]:
    """Return what to change for one cause; a line for each figure, where they differ."""
    place = f"{row.place.file}, line {row.place.line}: " if row.place else ""
    if not has_several_figures(row):
        return [f"{place}{row.name}{figure_of(row)}: {_change(row)}"]
    lines: list[str] = []
    for values, unit in zip(row.values, row.units, strict=True):
        single = replace(row, values=(values,), units=(unit,))
        lines.append(f"{place}{row.name}, {values.name}: {_change(single)}")
    return lines


def _change(row: Share) -> str:
    """Say what the right is to be given."""
    left, right = values_of(row)
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
    blocks = template.blocks("why_parts", parts=parts(result))
    if result.verdict.holds and not result.located:
        return blocks[:1]  # they need no explanation
    return blocks
