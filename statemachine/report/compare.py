"""The page of a comparison of two runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..compare import Agreement, Comparison, Contact, Touch, Witness
from ..comparison import QUANTITIES
from ..comparison.text import few, figure, milliseconds, quantity, sentence, short_time
from ..page import Page, Table, Text, Verdict

# Of the promises that a backend may emulate, those that move the arm.
_PHYSICS = ("position servo", "armature", "joint damping", "dry friction", "joint limits")
_WORDS = {"agrees": "agree", "settles": "settle", "differs": "DIFFER"}


def page(
    comparison: Comparison,
    says: str = "",
    said: Sequence[str] = (),
    witness: Witness | None = None,
    touches: Sequence[Touch] = (),
) -> Page:
    """Figures and verdicts, then the reasons of the tolerances.

    Args:
        comparison: What was found.
        says: What happens in the experiment.
        said: What stood in for a run, line by line.
        witness: What a third party says of both sides' fingertips.
        touches: Who touches whom on each side.
    """
    one, two = comparison.one, comparison.two
    blocks: list[Any] = []
    if says:
        blocks.append(Text(says))
    blocks += [Text(sentence(line)) for line in (*said, *comparison.notes)]
    blocks.append(
        Table(
            ("quantity", "max", "at", "RMS", "settled", "from", "verdict"),
            [_row(found) for found in comparison.agreements],
            title=f"{one.label} against {two.label}: how far apart (times in s)",
            words=frozenset({0, 6}),
            emphasis=frozenset(
                k for k, found in enumerate(comparison.agreements) if found.verdict == "differs"
            ),
        )
    )
    blocks.append(Text(_summary(comparison)))
    told = [_touch(touch, one.backend, two.backend) for touch in touches]
    if told:
        blocks.append(Text(" ".join(told)))
    blocks.append(
        Text(
            f"Compared at {comparison.moments} moments over {comparison.until:g} s. Settled is "
            "the mean over the last tenth of them (of forces: how far apart the means are); from "
            "is when it is first beyond its tolerance. A quantity agrees if it is never beyond "
            "it, settles if what is settled is not beyond it, and differs otherwise."
        )
    )
    blocks.append(
        Table(
            ("quantities", "tolerance", "because"),
            _reasons(comparison),
            title="What does not matter, and why",
            words=frozenset({0, 2}),
        )
    )
    for side in (one, two):
        emulated = [name for name in side.provenance.emulated if name in _PHYSICS]
        if emulated and side.defaults == "model":
            blocks.append(
                Text(
                    f"{side.backend}: what the model asks for and the engine lacks is emulated "
                    f"({', '.join(emulated)}). The engine as its own users meet it: "
                    "--defaults engine."
                )
            )
            break
    text = "Neither side is the truth, and two engines that agree may both be wrong."
    if witness is not None:
        text += (
            f" So a third party was asked where {witness.site} is in each of {witness.rows} "
            f"poses: {witness.by} puts it within {witness.one:.0e} m of {one.backend}'s and "
            f"within {witness.two:.0e} m of {two.backend}'s."
        )
    blocks.append(Text(text))
    blocks.append(Verdict(_verdict(comparison), comparison.agrees))
    title = f"{one.experiment}: {one.label} and {two.label}"
    return Page(title, _origin(comparison), blocks)


def _row(found: Agreement) -> tuple[str, ...]:
    if found.kind == "contact":
        gap = found.note or quantity(found.max, found.unit)
        return (found.name, gap, f"{found.at:.3f}", "", "", "", _WORDS[found.verdict])
    since = "" if found.since is None else f"{found.since:.3f}"
    return (
        found.name,
        quantity(found.max, found.unit),
        f"{found.at:.3f}",
        quantity(found.rms, found.unit),
        quantity(found.settled, found.unit),
        since,
        _WORDS[found.verdict],
    )


def _reasons(comparison: Comparison) -> list[tuple[str, str, str]]:
    """One row for each tolerance: who shares it, how much, why."""
    shared: dict[tuple[str, str], list[str]] = {}
    for found in comparison.agreements:
        key = (quantity(found.tolerance, found.unit), found.reason)
        shared.setdefault(key, []).append(found.kind)
    return [
        (", ".join(dict.fromkeys(QUANTITIES[kind].plural for kind in kinds)), value, reason)
        for (value, reason), kinds in shared.items()
    ]


def _summary(comparison: Comparison) -> str:
    counts = [
        sum(found.verdict == verdict for found in comparison.agreements)
        for verdict in ("agrees", "settles", "differs")
    ]
    total = len(comparison.agreements)
    if counts[0] == total:
        worst = comparison.worst
        text = f"All {total} quantities agree at every moment that was compared"
        if worst is not None:
            text += (
                f"; nearest to its tolerance comes {worst.name}, with "
                f"{quantity(worst.max, worst.unit)} of {quantity(worst.tolerance, worst.unit)}"
            )
        return text + "."
    apart = [found.since for found in comparison.agreements if found.since is not None]
    text = f"Of {total} quantities {counts[0]} agree, {counts[1]} settle and {counts[2]} differ."
    if apart:
        first = min(apart)
        names = [found.name for found in comparison.agreements if found.since == first]
        text += f" They part at {short_time(first)}: first {few(names)}."
    return text


def _touch(touch: Touch, one: str, two: str) -> str:
    """What becomes of a contact on each side, in a sentence."""
    first, second = _end(touch.one, one), _end(touch.two, two)
    return f"{touch.pair}: {first}; {second}."


def _end(contact: Contact, backend: str) -> str:
    if contact.last is None:
        return f"on {backend} they never touch"
    if contact.ends:
        force, total = figure(contact.force), figure(contact.total)
        return f"on {backend} in touch at the end, pressed with {force} N (with friction {total} N)"
    return f"on {backend} last in touch at {short_time(contact.last)}"


def _verdict(comparison: Comparison) -> str:
    if comparison.agrees:
        return f"{comparison.one.backend} and {comparison.two.backend} agree within tolerance"
    if comparison.ended:
        sides = [side.backend for side in (comparison.one, comparison.two) if side.ended]
        return f"both runs come to their end (not: {' and '.join(sides)})"
    found = comparison.agreements
    parts = []
    for verdict, word in (("differs", "differ"), ("settles", "settle")):
        names = [each.name for each in found if each.verdict == verdict]
        if names:
            parts.append(f"{len(names)} {word}: {few(names, 4, '; ')}")
    return f"not within tolerance always: of {len(found)} quantities {'. '.join(parts)}"


def _origin(comparison: Comparison) -> str:
    words = []
    for side in (comparison.one, comparison.two):
        seed = side.provenance.seed
        text = f"{side.label}, {milliseconds(side.timestep)}"
        words.append(text + (f", seed {seed}" if seed is not None else ""))
    file = comparison.one.provenance.model_file
    digest = comparison.one.provenance.model_sha256[:8]
    return f"{file} ({digest}); {'; '.join(words)}"
