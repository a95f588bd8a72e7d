"""What an audit found, as a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ..engines.futures import FutureGap, worst
from ..measures.text import NONE, capital, milliseconds, rough
from ..page import Block, Items, Page, Table, Text, Verdict
from ..probes.audit import Audit, Audited
from ..probes.audit.trials import (
    AGAIN,
    BOXES,
    EACH_OTHER,
    FALL,
    FORGETS,
    NO_CONTACTS,
    NOT_RESTORED,
    RESTORE,
    STEPS,
    WITHOUT,
    AuditFinding,
)

_OF_THE_STATE = (RESTORE, WITHOUT, FORGETS, NO_CONTACTS)
_AT_REST = 1e-2  # of the fastest joint or body [rad/s or m/s]
_SAME = "same"

ORIGIN = "{model} on {engines}, {timestep} a step, seed {seed}"
METHOD = (
    "A run is saved, and goes on. Then it is restored, and goes on again. Are all positions and "
    "velocities the same, byte for byte, right after the restore and after each of {steps} steps? "
    "What was saved is restored in three places: in the run itself; in a fresh one; and in a used "
    "one, which had other commands before and, where they stay, has forces left applied. A cell "
    "says 'same' if every byte is. Otherwise it gives the largest difference: of a joint or an "
    "orientation in °, of a slide or a free body in mm; or 'bytes', if only bytes differ."
)
NOT_ASKED = "{backend} itself, by its own functions, was not asked."
NOT_TRIED = "Not tried: {what}."
PLACES = "{name}: where runs are saved (speeds in rad/s or m/s)"
BY_POINT = "{name}: restored, against going on"
BY_TARGET = "{name}: the same, by what it is restored in"
FORGOTTEN = "{name}: changed after the save, at {point}, and then restored"
TOUCHING = "{name}: in a fresh one, with and without contacts"
PROMISES = "{name}: what should change nothing"
DIFFERS = "{name}: what changes the bytes that follow, at the worst"
NEEDED = "{name}: what has to be restored, and by how much the run differs without it"
FALLEN = (
    "Among the runs with a call before each step are {number} of another model: {boxes} boxes fall "
    "onto each other, {steps} steps each. Contacts come and go there."
)
KEPT = "{name}: kept at every save point at which they were tried: {kept} of {promises} promises"

# What follows; each holds only if it has something to name.
SUFFICES = (
    "{name}: the state that suffices: {what}. The bytes are the same at every save point, whatever "
    "it was restored in."
)
NOTHING_SUFFICES = (
    "{name}: no candidate suffices: none has the same bytes at every save point, whatever it is "
    "restored in."
)
ALONE = {
    True: "{name}: what has to be restored suffices alone: it was tried.",
    False: "{name}: what has to be restored does not suffice alone.",
}
IDLE = "nothing differs without {what}"
READ_BACK = "before any step, not every byte reads back as it was saved: {what}"
IN_CONTACT = "what cannot be written acts through contacts, at {what}"
AGREE = "all restores of one state have one future, though not that of the run: {what}"
HISTORY = (
    "what did bring every future back is a new one, and the whole past once more: here the state "
    "is the history"
)


def page(results: Mapping[str, Audit]) -> Page:
    """What was tried, engine by engine, and last what follows from it.

    Args:
        results: By backend.
    """
    first = next(iter(results.values()))
    blocks: list[Block] = [Text(METHOD.format(steps=first.steps))]
    for backend, result in results.items():
        blocks.append(_places(result.audited[0]))
        if result.audited[0].layer != "engine":
            blocks.append(Text(NOT_ASKED.format(backend=backend)))
        for one in result.audited:
            blocks += [*_of_one(one), *_promises(one)]
        if result.without:
            blocks.append(Text(NOT_TRIED.format(what="; ".join(result.without))))
    blocks += [b for r in results.values() for one in r.audited for b in _conclusion(one)]
    made = first.provenance
    of = [result.provenance for result in results.values()]
    origin = ORIGIN.format(
        model=made.model_file,
        engines=", ".join(f"{each.backend} {each.versions[each.backend]}" for each in of),
        timestep=milliseconds(made.timestep),
        seed=made.seed,
    )
    return Page("What exactly is the state?", origin, blocks)


def _of_one(one: Audited) -> list[Block]:
    """What was found of the state of one driver."""
    rows = _candidates(one)
    return [_by_point(one, rows), Text(one.legend), _by_target(one, rows), *_forgotten(one)]


def _places(one: Audited) -> Table:
    rows = [
        (
            seen.point,
            seen.how,
            f"{seen.time:.3g} s",
            "at rest" if seen.speed < _AT_REST else rough(seen.speed),
            str(seen.contacts),
            NONE if seen.limits is None else str(seen.limits),
        )
        for seen in one.points
    ]
    return Table(
        ("save point", "how to get there", "after", "speed", "contacts", "limits"),
        rows,
        title=PLACES.format(name=one.name),
        words=frozenset({0, 1}),
    )


def _candidates(one: Audited) -> dict[str, list[AuditFinding]]:
    """What was tried as a state, by what a table calls it."""
    found: dict[str, list[AuditFinding]] = {}
    for each in one.findings:
        if each.experiment in (RESTORE, WITHOUT):
            without = each.experiment == WITHOUT
            found.setdefault(f"all but {each.case}" if without else each.case, []).append(each)
    return found


def _by_point(one: Audited, rows: Mapping[str, Sequence[AuditFinding]]) -> Table:
    points = [seen.point for seen in one.points]
    against = {name: [each for each in of if each.into != EACH_OTHER] for name, of in rows.items()}
    return Table(
        ("what is restored", *points),
        [
            (name, *(_worst(each for each in of if each.point == point) for point in points))
            for name, of in against.items()
        ],
        title=BY_POINT.format(name=one.name),
    )


def _by_target(one: Audited, rows: Mapping[str, Sequence[AuditFinding]]) -> Table:
    kinds = {"run itself": "the run itself", "fresh": "a fresh one", "used": "a used one"}
    shown = []
    for name, of in rows.items():
        cells = [
            # A way that cannot leave its own run is restored there twice.
            _worst(each for each in of if each.into.startswith(into))
            for into in (*kinds.values(), EACH_OTHER)
        ]
        firsts = {each.gap.first for each in of if each.into != EACH_OTHER} - {None}
        steps = sorted(step for step in firsts if step is not None)
        shown.append((name, *cells, " to ".join(map(str, steps[:1] + steps[1:][-1:])) or NONE))
    return Table(
        ("what is restored", *kinds, EACH_OTHER, "from step"),
        shown,
        title=BY_TARGET.format(name=one.name),
    )


def _forgotten(one: Audited) -> list[Block]:
    """What is changed after a save and not brought back; and what contacts have to do with it."""
    of = [each for each in one.findings if each.experiment == FORGETS]
    blocks: list[Block] = []
    if of:
        cells = {(each.into, each.case): each.gap.exact for each in of}
        what = list(dict.fromkeys(each.case for each in of))
        ways = [way for way in dict.fromkeys(each.into for each in of) if way != NOT_RESTORED]

        def word(way: str, case: str) -> str:
            if cells[NOT_RESTORED, case]:
                return "does not show"
            return "brought back" if cells[way, case] else "stays"

        blocks.append(
            Table(
                ("restored by", *what),
                [(way, *(word(way, case) for case in what)) for way in ways],
                title=FORGOTTEN.format(name=one.name, point=of[0].point),
                words=frozenset(range(len(what) + 1)),
            )
        )
    touching = one.conclusion.touching
    if touching:
        case = next(each.case for each in one.findings if each.experiment == NO_CONTACTS)
        blocks.append(
            Table(
                (f"restored: {case}", *touching),
                [
                    ("as it stands", *(cell(standing) for standing, _ in touching.values())),
                    ("contacts switched off", *(cell(off) for _, off in touching.values())),
                ],
                title=TOUCHING.format(name=one.name),
            )
        )
    return blocks


def _promises(one: Audited) -> list[Block]:
    """What should change nothing."""
    tried: dict[tuple[str, str, bool], list[AuditFinding]] = {}
    for each in one.findings:
        if each.experiment not in _OF_THE_STATE or each.promised:
            tried.setdefault((each.case, each.into, each.promised), []).append(each)
    if not tried:
        return []
    rows, differ, broken = [], [], []
    for (case, into, promised), of in tried.items():
        off = [each for each in of if not each.gap.exact]
        broken.append(not all(each.holds for each in of))
        same = f"{len(of) - len(off)} of {len(of)}"
        rows.append((case, into, same, _PROMISED[promised, broken[-1]]))
        if off:
            gap = worst([each.gap for each in off])
            sizes = rough(gap.length, "m"), rough(gap.angle, "rad"), str(gap.first)
            differ.append((case, ", ".join(each.point for each in off), *sizes))
    promises = sum(promised for *_, promised in tried)
    drops = {each.point for each in one.findings if each.point.startswith(FALL)}
    fallen = FALLEN.format(number=len(drops), boxes=BOXES, steps=STEPS)
    kept = KEPT.format(name=one.name, kept=promises - sum(broken), promises=promises)
    heads = ("what is done", "compared with", "same bytes at", "promised")
    emphasis = frozenset(k for k, is_broken in enumerate(broken) if is_broken)
    words = frozenset({0, 1, 2, 3})
    title = PROMISES.format(name=one.name)
    blocks: list[Block] = [Table(heads, rows, title, words=words, emphasis=emphasis)]
    if differ:
        heads = ("what is done", "differs at", "by", "and", "from step")
        blocks.append(Table(heads, differ, DIFFERS.format(name=one.name), words=frozenset({0, 1})))
    return [*blocks, *([Text(fallen)] if drops else []), Verdict(kept, not any(broken))]


_PROMISED = {(True, False): "yes", (True, True): "yes, broken", (False, False): "no"}


def _worst(findings: Iterable[AuditFinding]) -> str:
    gaps = [each.gap for each in findings]
    return cell(worst(gaps)) if gaps else NONE


def _conclusion(one: Audited) -> list[Block]:
    """What follows; all of it from the findings."""
    of = one.conclusion
    again = [each.gap.exact for each in one.findings if each.experiment == AGAIN]
    facts = {
        IDLE: of.idle,
        READ_BACK: [f"{name} (at {', '.join(at)})" for name, at in of.not_read_back.items()],
        IN_CONTACT: of.in_contact,
        AGREE: [name for name in of.agree if name not in of.suffice],
        HISTORY: [AGAIN] if again and all(again) and not of.suffice else [],
    }
    suffices = SUFFICES if of.suffice else NOTHING_SUFFICES
    blocks: list[Block] = [Text(suffices.format(name=one.name, what=" or ".join(of.suffice)))]
    if of.missing:
        rows = [
            (each.field, *_where(each.itself, one), cell(each.gap), str(each.gap.first))
            for each in of.missing
        ]
        heads = ("left out", "the run itself differs at", "differs by", "from step")
        words = frozenset({0, 1})
        blocks.append(Table(heads, rows, NEEDED.format(name=one.name), words=words))
    if of.smallest is not None:
        blocks.append(Text(ALONE[of.smallest].format(name=one.name)))
    lines = [capital(text.format(what=", ".join(what))) for text, what in facts.items() if what]
    return [*blocks, Items([f"{line}." for line in lines])] if lines else blocks


def _where(points: Sequence[str], one: Audited) -> tuple[str]:
    """Save points where the run itself needs a field; without one, only a used run does."""
    if len(points) == len(one.points):
        return ("all",)
    return (", ".join(points) or "none; only a used one does",)


def cell(off: FutureGap) -> str:
    """The larger of angle and length, or that every byte is the same."""
    if off.exact:
        return _SAME
    if not off.size:  # of a velocity, or a 0 that became -0
        return "bytes"
    if off.angle >= off.length:
        return rough(off.angle, "rad")
    return rough(off.length, "m")
