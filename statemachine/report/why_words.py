"""What an attribution says, in figures and sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..compare.why import FACTORS, UNEXPLAINED, Attribution, FactorTrial
from ..measures import Deviation
from ..measures.text import listed, percent, quantity, short_time

_WORTH = 0.005  # the least part of the gap that is spoken of
_SOME = 0.1  # part of the gap from which on a factor is a cause
_PROOF = 1e-3  # of the gap: nearer than this until the first touch, the touch parts them
_OPENS = 1.5  # times the gap of equal settings: a setting put back that opens more is named
_OTHERWISE = 0.05  # of the gap: a part that changes by more with the order is given both ways
_AT_TOUCH = ("contact", "limits", "surfaces")  # what does nothing before something is met


SMALL = 0.01  # of the gap: a chaos floor below that is not spoken of
THREE = (
    "Explained: it goes where settings are brought to the same. Located: it goes only where "
    "something is left out on both sides, which says where it comes from, and not why. "
    "Unexplained: it stays."
)


def three(explained: float, located: float, unexplained: float) -> str:
    """The three parts of a gap, in a sentence."""
    return (
        f"{percent(explained)} of the gap is explained, {percent(located)} is located, "
        f"{percent(unexplained)} is unexplained"
    )


def gap_sentence(gaps: Mapping[str, Deviation], of: str, begins: str, hint: str = "") -> str:
    """How far apart two runs are in one of some quantities; the others follow."""
    gap = gaps[of]
    worst, rms, end = (quantity(size, gap.unit) for size in (gap.worst, gap.rms, gap.end))
    what = f"worst {of.removesuffix('s')}" if of in ("joints", "slides", "ball joints") else of
    text = (
        f"{begins}, the {what} is up to {worst} apart, at {short_time(gap.at)} (root mean square "
        f"{rms}, in the end {end})."
    )
    others = [f"{name} {quantity(g.worst, g.unit)}" for name, g in gaps.items() if name != of]
    return text + (f" Elsewhere: {', '.join(others)}{hint}." if others else "")


def inside(floor: str) -> str:
    """What is said of a gap that is inside the chaos floor."""
    return (
        f"The same side is as far from itself, {floor}, when its start and its commands are "
        "changed by no more than is known of them (the chaos floor): nothing can be concluded "
        "from a gap that is no larger."
    )


def noisy(floor: str, part: float) -> str:
    """What is said of a chaos floor that is a part of the gap."""
    return f"The chaos floor is {floor}, {percent(part)} of the gap: smaller parts say nothing."


def amount(result: Attribution, value: float | None) -> str:
    """A gap of the attribution's quantity, with its unit."""
    return quantity(value, result.unit)


def shown(result: Attribution, value: float | None, trial: FactorTrial | None = None) -> str:
    """A gap, marked where it is out of all proportion; not of a trial that moves one too."""
    own = trial is not None and bool(trial.moved)
    return amount(result, value) + ("!" if not own and astray(result, value) else "")


def astray(result: Attribution, value: float | None) -> bool:
    """Whether a gap is more than twice what one moves at all, and than the first gap."""
    return value is not None and value > 2 * max(result.extent, result.gap)


def causes(result: Attribution) -> tuple[str, ...]:
    """What takes the largest difference away, of the ladder; what is a proof comes first."""
    if not result.alone:
        return ()
    counted = [trial for trial in result.ladder if trial.explains is not None]
    if max((trial.explains or 0.0 for trial in counted), default=0.0) < _SOME:
        return ("None of the factors that were tried explains a tenth of it.",)
    worth = [trial for trial in counted if (trial.explains or 0.0) >= _WORTH]
    worth.sort(key=lambda trial: -(trial.explains or 0.0))
    found = []
    touch = result.touch
    contact = next((t for t in worth if t.factor == "contact" and t.way == "off"), None)
    if contact is not None and touch and touch.time and touch.before < _PROOF * result.gap:
        what = touch.what.split("; ", maxsplit=1)[0]
        verb = "are" if result.quantity in ("joints", "slides") else "is"
        found.append(
            f"Until the first touch, {what} at {short_time(touch.time)}, the {result.quantity} "
            f"{verb} {amount(result, touch.before)} apart."
        )
    same = [f"{title(t.factor)} {percent(t.explains)}" for t in worth if not moves(t)]
    if same:
        found.append(f"Of that, made the same, each added to those before: {', '.join(same)}.")
    other = [
        f"{title(t.factor)} takes {percent(t.explains)} of it away*" for t in worth if moves(t)
    ]
    if other:
        found.append(
            f"{'Then, left' if same else 'Left'} out on both sides, {', '.join(other)}. "
            f"* This moves {result.names[0]} itself: a hint, not a proof."
        )
    return tuple(found)


def moves(trial: FactorTrial) -> bool:
    """Whether it moves the first side itself, so that the gap is of another motion."""
    return bool(trial.moved and trial.worst is not None and trial.way != "none")


def title(factor: str) -> str:
    """A factor in words."""
    return FACTORS[factor].title if factor in FACTORS else factor


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
            f"Of the {gap}, each added to those before: {', '.join(parts)}. "
            f"With all these changes together {left} is left."
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
        parts = [f"{FACTORS[t.factor].title} {shown(result, t.put_back)}" for t in opened]
        found.append(
            f"With all settings the same, {amount(result, same)}. As it came, alone, each of these "
            f"opens more again: {', '.join(parts)}."
        )
    contact = next((t for t in counted if t.factor == "contact" and t.way == "off"), None)
    settings = [t for t in counted if t.way == "parity"]
    if contact is not None:
        found.append(
            f"Where all settings are the same, {one} and {two} are {amount(result, same)} apart "
            f"with contacts and {amount(result, contact.worst)} without: the engines differ in how "
            "they compute contact."
        )
        touch = result.touch
        if touch and touch.time and touch.before < _PROOF * result.gap:
            acting = [t.factor for t in result.alone if t.way in ("off", "one side")]
            named = [FACTORS[name].title for name in acting if name not in _AT_TOUCH]
            what = touch.what.split("; ", maxsplit=1)[0]
            found.append(
                f"The run itself says the same: before the first contact, {what} at "
                f"{short_time(touch.time)}, the two are only {amount(result, touch.before)} apart, "
                f"though {listed(named)} act from the start."
            )
        elif touch and not touch.time and not settings:
            found.append("Something touches from the start, so no moment shows the rest alone.")
    if abs(result.unexplained) > UNEXPLAINED:
        found.append(
            f"{percent(result.unexplained)} of the gap is none of these: look at what is not in "
            "the table, masses and shapes first."
        )
    return found


def _other_orders(result: Attribution, worth: Sequence[FactorTrial]) -> list[str]:
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
            along = f" (and {titles(by_itself.along)} with it)" if by_itself.along else ""
            said = [f"{percent(first)} if it comes first"] if first is not None else []
            said += [f"{percent(last)} if last{along}"] if last is not None else []
            parts.append(f"{FACTORS[rung.factor].title} {', '.join(said)}")
    return [f"In another order the parts are others: {'; '.join(parts)}."] if parts else []


def titles(names: Sequence[str]) -> str:
    """Factors by their titles: "armature, dry friction and joint limits"."""
    return listed([FACTORS[name].title for name in names])
