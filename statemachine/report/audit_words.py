"""What follows from an audit, in sentences, and its figures as words."""

from __future__ import annotations

from collections.abc import Sequence

from ..engines.futures import FutureGap, worst
from ..measures.text import rough
from ..probes.audit import Audited
from ..probes.audit.conclusions import Conclusion, Missing
from ..probes.audit.trials import AGAIN, LOOK

_SAME = "same"


def sentences(one: Audited) -> list[str]:
    """What follows, in sentences; all of it from the findings."""
    said, of = [], one.conclusion
    points = [seen.point for seen in one.points]
    if of.suffice:
        said.append(
            f"{one.name}: the state that suffices: {' or '.join(of.suffice)}. The bytes are the "
            f"same at {_all(points)}, whatever it was restored in."
        )
    else:
        said.append(
            f"{one.name}: no candidate suffices: none has the same bytes at {_all(points)}, "
            "whatever it is restored in."
        )
    said += _what_breaks(one.name, of, points)
    if of.not_read_back:
        where = [f"{name} (at {', '.join(at)})" for name, at in of.not_read_back.items()]
        said.append(
            f"{one.name}: before any step, not every byte reads back as it was saved: "
            f"{', '.join(where)}."
        )
    if of.in_contact:
        sizes = [of.touching[point] for point in of.in_contact]
        said.append(
            f"{one.name}: what cannot be written acts through contacts: at "
            f"{', '.join(of.in_contact)} the future is off by {cell(worst([s for s, _ in sizes]))} "
            f"as it stands, and by {cell(worst([off for _, off in sizes]))} where the contacts "
            "are switched off."
        )
    for what in dict.fromkeys(of.forgotten.values()):
        ways = [way for way, forgotten in of.forgotten.items() if forgotten == what]
        if what:
            said.append(f"{one.name}: not brought back by {', '.join(ways)}: {', '.join(what)}.")
    agree = [name for name in of.agree if name not in of.suffice]
    if agree:
        said.append(
            f"{one.name}: all restores of one state have one future, though not that of the "
            f"run: {', '.join(agree)}."
        )
    for case in dict.fromkeys(each.case for each in one.findings if each.experiment == LOOK):
        off = [e for e in one.findings if (e.experiment, e.case) == (LOOK, case)]
        differs = [each for each in off if not each.gap.exact and not each.promised]
        if differs:
            most = worst([each.gap for each in differs])
            said.append(
                f"{one.name}: {case} before each step changes what follows, at "
                f"{', '.join([each.point for each in differs])}: a body or joint by up to "
                f"{rough(most.length, 'm')} and {rough(most.angle, 'rad')}."
            )
    again = [each for each in one.findings if each.experiment == AGAIN]
    if not of.suffice and again and all(each.gap.exact for each in again):
        said.append(
            f"{one.name}: what did bring every future back is a new one, and the whole past "
            "once more: here the state is the history."
        )
    return said


def _what_breaks(name: str, of: Conclusion, points: Sequence[str]) -> list[str]:
    if not of.missing:
        return []
    lines = []
    itself = [each for each in of.missing if each.itself]
    others = [each for each in of.missing if not each.itself]
    alone = {
        None: "",
        True: " These alone suffice: it was tried.",
        False: " These alone do not suffice.",
    }
    text = f"{name}: to restore the run itself one needs {', '.join(_with(itself, points))}"
    if others:
        text += f"; to restore a used one also {', '.join([each.field for each in others])}"
    lines.append(f"{text}.{alone[of.smallest]}")
    lines.append(
        f"{name}: left out, each of these makes the run differ, at the worst by so much: "
        + "; ".join(
            f"{each.field} by {cell(each.gap)}, from step {each.gap.first} on"
            for each in of.missing
        )
        + "."
    )
    if of.idle:
        lines.append(f"{name}: without {', '.join(of.idle)} nothing differed.")
    return lines


def _with(missing: Sequence[Missing], points: Sequence[str]) -> list[str]:
    """Fields, and where they matter, if not everywhere."""
    found = []
    for each in missing:
        at = each.itself
        few = len(at) <= len(points) / 2
        where = (
            f"only at {', '.join(at)}"
            if few
            else "not at " + ", ".join(p for p in points if p not in at)
        )
        found.append(each.field if len(at) == len(points) else f"{each.field} ({where})")
    return found


def _all(points: Sequence[str]) -> str:
    return f"all of {len(points)} save points" if len(points) > 1 else "the one save point"


def cell(off: FutureGap) -> str:
    """The larger of angle and length, or that every byte is the same."""
    if off.exact:
        return _SAME
    if not off.size:  # of a velocity, or a 0 that became -0
        return "bytes"
    if off.angle >= off.length:
        return rough(off.angle, "rad")
    return rough(off.length, "m")
