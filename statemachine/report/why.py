"""The page of an attribution: what each difference explains, and what stays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..compare.why import FACTORS, Attribution, Trial
from ..page import Page, Table, Text, Verdict
from .figures_of import quantity as in_units
from .figures_of import short_time

_BAR = 16  # characters of the longest bar
_WORTH = 0.005  # the least part of the gap that the conclusion speaks of
_ENOUGH = 0.1  # what may stay unexplained without the answer being no
_OPENS = 1.5  # times the gap of equal settings: a setting put back that opens more is named
_OTHERWISE = 0.05  # of the gap: a part that changes by more with the order is given both ways
_AT_TOUCH = ("contact", "limits", "surfaces")  # what does nothing before something is met
_KINDS = {"rad": "joint", "m": "body"}


def page(result: Attribution, said: Sequence[str] = ()) -> Page:
    """What the gap is, each factor alone, all of them together, and what follows.

    Args:
        result: The attribution.
        said: Lines to say before anything else.
    """
    blocks: list[Any] = [Text(line) for line in (*said, result.says) if line]
    blocks.append(Text(_gap_sentence(result)))
    if not result.alone:
        blocks.append(
            Text(
                f"What is below {amount(result, result.negligible)} is taken for rounding: "
                "there is nothing to explain."
            )
        )
        return Page(_title(result), _origin(result), blocks)
    blocks += [_alone(result), *(Text(line) for line in _notes(result))]
    blocks += [_ladder(result), Text(f"The order. {' '.join(result.order)}")]
    blocks += [Text(line) for line in conclusion(result)]
    blocks.append(
        Verdict(
            f"{percent(1 - result.unexplained)} of the gap is explained, "
            f"{percent(result.unexplained)} is not",
            abs(result.unexplained) <= _ENOUGH,
        )
    )
    return Page(_title(result), _origin(result), blocks)


def _title(result: Attribution) -> str:
    one, two = result.names
    return f"{result.experiment}: why {two} is not {one}"


def _origin(result: Attribution) -> str:
    return (
        f"{result.one} and {result.two}, {result.seconds:g} s, "
        f"{result.runs} runs compared at {result.moments} moments"
    )


def amount(result: Attribution, value: float | None) -> str:
    """A gap of the attribution's quantity, with its unit."""
    if value is None:
        return "–"
    return in_units(value, _KINDS[result.unit])


def percent(part: float | None) -> str:
    """A part of the gap; tiny ones with their power of ten."""
    if part is None:
        return "–"
    value = 100 * part
    if value == 0:
        return "0 %"
    if abs(value) < 1e-6:
        return "< 1e-6 %"
    if abs(value) < 0.05:
        return f"{value:.0e} %".replace("e-0", "e-")
    if 99.95 <= value < 100:
        return "> 99.9 %"
    return f"{value:.1f} %" if abs(value) < 1000 else f"{value:.0f} %"


def _what(result: Attribution) -> str:
    if result.quantity == "joints":
        return "the worst joint"
    if result.quantity == "slides":
        return "the worst slide"
    return f"the {result.quantity}"


def _gap_sentence(result: Attribution) -> str:
    gap = result.first[result.quantity]
    text = (
        f"As they come, {_what(result)} is up to {amount(result, gap.worst)} apart, at "
        f"{short_time(gap.at)} (root mean square {amount(result, gap.rms)}, in the end "
        f"{amount(result, gap.end)})."
    )
    others = [
        f"{name} {in_units(other.worst, _KINDS[other.unit])}"
        for name, other in result.first.items()
        if name != result.quantity
    ]
    if others:
        text += f" Elsewhere: {', '.join(others)}."
    if result.between:
        text += " The timesteps have too few moments in common: rows between were interpolated."
    return text


def _alone(result: Attribution) -> Table:
    set_back = any(trial.put_back is not None for trial in result.alone)
    rows = []
    for trial in result.alone:
        last = _figure(result, trial.put_back) if set_back else amount(result, trial.moved)
        rows.append(
            (
                FACTORS[trial.factor].title,
                _brought(result, trial),
                _figure(result, trial.worst, trial),
                percent(trial.explains) + ("*" if _another(trial) else ""),
                last,
            )
        )
    headers = (
        "",
        "brought to",
        "gap",
        "explains",
        "put back" if set_back else f"moves {result.names[0]} by",
    )
    return Table(headers, rows, "One at a time: what happens to the gap", frozenset({0, 1}))


def _brought(result: Attribution, trial: Trial) -> str:
    if trial.way == "parity":
        had = trial.had if trial.did == f"as {result.names[0]}" else trial.had[::-1]
        return f"{had[1]} → {had[0]}"
    return trial.did or "–"


def _figure(result: Attribution, value: float | None, trial: Trial | None = None) -> str:
    """A gap, marked where it is out of all proportion; not of a trial that moves one too."""
    own = trial is not None and bool(trial.moved)
    return amount(result, value) + ("!" if not own and _astray(result, value) else "")


def _astray(result: Attribution, value: float | None) -> bool:
    return value is not None and value > 2 * max(result.extent, result.gap)


def _another(trial: Trial) -> bool:
    """Whether one itself moves otherwise with it: then the gap is that of another motion."""
    return bool(trial.moved) and trial.worst is not None


def _notes(result: Attribution) -> list[str]:
    one, two = result.names[0], result.names[1]
    found = []
    if any(trial.put_back is not None for trial in result.alone):
        found.append(
            "Explains: the part of the gap that goes when this alone is brought to the same; "
            "below zero, the gap grows. Put back: the gap when all settings are the same and "
            "this one is as it came. The parts need not add up: one setting can hide another."
        )
    found += [
        f"{_upper(FACTORS[trial.factor].title)}, put back, takes {_titles(trial.along)} back "
        "with it: they can be set only where it is."
        for trial in result.alone
        if trial.along
    ]
    if any(_another(trial) for trial in result.alone):
        found.append(
            f"* This moves {one} itself, so the gap is that of another motion. A smaller gap "
            "there is a hint, not a proof."
        )
    marked = [t.put_back for t in result.alone] + [t.worst for t in result.alone if not t.moved]
    if any(_astray(result, gap) for gap in marked):
        found.append(
            f"! More than twice what {one} moves at all ({amount(result, result.extent)}), and "
            f"than the gap itself: so {two} does not do the experiment any more."
        )
    for trial in result.alone:
        if trial.note:
            found.append(f"{_upper(FACTORS[trial.factor].title)}: {trial.note}.")
    if any(trial.way == "one side" for trial in result.alone):
        found.append(f"Integrator: {two} has none to choose from, so only {one} was changed.")
    return found


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _ladder(result: Attribution) -> Table:
    shown = [result.gap, *(t.worst for t in result.ladder if t.worst is not None)]
    longest = max(shown)
    rows = [("as they come", "", amount(result, result.gap), "", _bar(result.gap, longest))]
    for trial in result.ladder:
        rows.append(
            (
                f"+ {FACTORS[trial.factor].title}",
                trial.did.removesuffix(", both"),
                amount(result, trial.worst),
                _rung(trial),
                "" if trial.worst is None else _bar(trial.worst, longest),
            )
        )
    rows.append(("unexplained", "", amount(result, result.left), percent(result.unexplained), ""))
    return Table(
        ("", "brought to", "gap left", "explains", ""),
        rows,
        "All of them, one on top of the other",
        frozenset({0, 1, 4}),
        frozenset({len(rows) - 1}),
    )


def _rung(trial: Trial) -> str:
    if trial.explains is None and trial.worst:
        return trial.note
    return percent(trial.explains) + ("*" if _another(trial) else "")


def _bar(value: float, longest: float) -> str:
    return "█" * round(_BAR * value / longest)


def conclusion(result: Attribution) -> list[str]:
    """What the figures say, in sentences."""
    one, two = result.names[0], result.names[1]
    gap, left = amount(result, result.gap), amount(result, result.left)
    counted = [trial for trial in result.ladder if trial.explains is not None]
    found = []
    worth = sorted(
        (t for t in counted if abs(t.explains or 0.0) >= _WORTH),
        key=lambda t: -(t.explains or 0.0),
    )
    if not worth:
        found.append(
            f"None of these factors takes anything of the {gap} away: the cause is none of them."
        )
    else:
        parts = [f"{FACTORS[t.factor].title} {percent(t.explains)}" for t in worth]
        found.append(
            f"Of the {gap}, one on top of the other: {', '.join(parts)}. "
            f"With all of it the same or left out, {left} stays."
        )
    found += _other_orders(result, worth)
    most = max((t.worst or 0.0 for t in counted), default=0.0)
    if most > 1.05 * result.gap:
        found.append(
            f"On the way the gap grew to {amount(result, most)}: as they come, some of these "
            "differences hide others, and the parts depend on the order."
        )
    same = result.settings_same
    opened = sorted(
        (t for t in result.alone if (t.put_back or 0.0) > max(_OPENS * same, result.negligible)),
        key=lambda t: -(t.put_back or 0.0),
    )
    if opened:
        parts = [f"{FACTORS[t.factor].title} {_figure(result, t.put_back)}" for t in opened]
        found.append(
            f"With all settings the same, {amount(result, same)}. As it came, alone, each of these "
            f"opens more again: {', '.join(parts)}."
        )
    contact = next((t for t in counted if t.factor == "contact" and t.way == "off"), None)
    settings = [t for t in counted if t.way == "parity"]
    if contact is not None:
        found.append(
            f"Where all settings are the same, {one} and {two} are {amount(result, same)} apart "
            f"with contacts, {amount(result, contact.worst)} without: what contact explains is "
            "how each engine makes it."
        )
        touch = result.touch
        if touch is not None and touch.before < 1e-3 * result.gap:
            acting = [t.factor for t in result.alone if t.way in ("off", "one side")]
            named = [FACTORS[name].title for name in acting if name not in _AT_TOUCH]
            what = touch.what.split("; ", maxsplit=1)[0]
            found.append(
                f"The motion as it comes says the same. Until {what}, at "
                f"{short_time(touch.time)}, the two are {amount(result, touch.before)} apart, "
                f"though {_and(named)} act from the start."
            )
        elif touch is None and not settings:
            found.append("Something touches from the start, so no moment shows the rest alone.")
    if abs(result.unexplained) > _ENOUGH:
        found.append(
            f"{percent(result.unexplained)} of the gap is none of these: look at what is not in "
            "the table, masses and shapes first."
        )
    return found


def _other_orders(result: Attribution, worth: Sequence[Trial]) -> list[str]:
    """What settings explain if they come first or last, where that is another part."""
    alone = {trial.factor: trial for trial in result.alone}
    parts = []
    for rung in worth:
        if rung.way != "parity" or rung.explains is None:
            continue
        by_itself = alone[rung.factor]
        # Brought to the same it can come first only if it can be without the others.
        first = by_itself.explains if by_itself.way == "parity" else None
        last = result.last(by_itself)
        known = [each for each in (first, last) if each is not None]
        if any(abs(each - rung.explains) > _OTHERWISE for each in known):
            along = f" (and {_titles(by_itself.along)} with it)" if by_itself.along else ""
            said = [f"{percent(first)} if it comes first"] if first is not None else []
            said += [f"{percent(last)} if last{along}"] if last is not None else []
            parts.append(f"{FACTORS[rung.factor].title} {', '.join(said)}")
    return [f"In another order the parts are others: {'; '.join(parts)}."] if parts else []


def _titles(names: Sequence[str]) -> str:
    return _and([FACTORS[name].title for name in names])


def _and(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
