"""What an audit found, as a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ..engines.futures import worst
from ..measures.text import NONE, count, milliseconds, rough
from ..page import Block, Page, Table, Text, Verdict
from ..probes.audit import Audit, Audited
from ..probes.audit.trials import (
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
from .audit_words import cell, sentences

_OF_THE_STATE = (RESTORE, WITHOUT, FORGETS, NO_CONTACTS)
_AT_REST = 1e-2  # of the fastest joint or body [rad/s or m/s]


def page(results: Mapping[str, Audit]) -> Page:
    """What was tried, engine by engine, and last what follows from it.

    Args:
        results: By backend.
    """
    first = next(iter(results.values()))
    blocks: list[Block] = [
        Text(
            "A run is saved, and goes on. Then it is restored, and goes on again. Are all "
            "positions and velocities the same, byte for byte, right after the restore and after "
            f"each of {first.steps} steps? What was saved is restored in three places: in the "
            "run itself; in a fresh one; and in a used one, which had other commands before and, "
            "where they stay, has forces left applied. A cell says 'same' if every byte is. "
            "Otherwise it gives the largest difference: of a joint or an orientation in °, of a "
            "slide or a free body in mm; or 'bytes', if only bytes differ."
        )
    ]
    for backend, result in results.items():
        blocks.append(_places(result.audited[0]))
        if result.audited[0].layer != "engine":
            blocks.append(Text(f"{backend} itself, by its own functions, was not asked."))
        for one in result.audited:
            blocks += [*_of_one(one), *_promises(one)]
        if result.without:
            blocks.append(Text(f"Not tried: {'; '.join(result.without)}."))
    for result in results.values():
        for one in result.audited:
            blocks += [Text(text) for text in sentences(one)]
    made = first.provenance
    of = [result.provenance for result in results.values()]
    engines = ", ".join(f"{each.backend} {each.versions[each.backend]}" for each in of)
    origin = (
        f"{made.model_file} on {engines}, {milliseconds(made.timestep)} a step, seed {made.seed}"
    )
    return Page("What exactly is the state?", origin, blocks)


def _of_one(one: Audited) -> list[Block]:
    """What was found of the state of one driver."""
    rows = _candidates(one)
    return [_by_point(one, rows), Text(one.legend), _by_target(one, rows), *_forgotten(one)]


def _places(one: Audited) -> Table:
    rows = []
    for seen in one.points:
        measured = "at rest" if seen.speed < _AT_REST else f"moves at {rough(seen.speed)}"
        measured += f", {count(seen.contacts, 'contact', zero='no')}"
        measured += f", {count(seen.limits, 'limit')}" if seen.limits else ""
        rows.append((seen.point, seen.how, f"{seen.time:.3g} s", measured))
    return Table(
        ("save point", "how to get there", "after", "measured there"),
        rows,
        title=f"{one.name}: where runs are saved (speeds in rad/s or m/s)",
        words=frozenset({0, 1, 3}),
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
        title=f"{one.name}: restored, against going on",
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
        between = f"{steps[0]} to {steps[-1]}" if len(steps) > 1 else str(*steps)
        shown.append((name, *cells, between or NONE))
    return Table(
        ("what is restored", *kinds, EACH_OTHER, "from step"),
        shown,
        title=f"{one.name}: the same, by what it is restored in",
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
                title=f"{one.name}: changed after the save, at {of[0].point}, and then restored",
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
                title=f"{one.name}: in a fresh one, with and without contacts",
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
    rows = []
    for (case, into, promised), of in tried.items():
        same = sum(each.gap.exact for each in of)
        off = "" if same == len(of) else f", else {_worst(of)}"
        rows.append((case, into, f"{same} of {len(of)}{off}", "yes" if promised else "no"))
    promises = [of for (*_, promised), of in tried.items() if promised]
    broken = [[each for each in of if not each.holds] for of in promises]
    kept = sum(not of for of in broken)
    return [
        Table(
            ("what is done", "compared with", "same bytes at", "promised"),
            rows,
            title=f"{one.name}: what should change nothing",
            words=frozenset({0, 1, 2, 3}),
        ),
        *_fallen(one),
        *(Verdict(_broken(one, of), False) for of in broken if of),
        Verdict(
            f"{one.name}: of {len(promises)} promises {kept} are kept at every save point at "
            "which they were tried",
            kept == len(promises),
        ),
    ]


def _fallen(one: Audited) -> list[Text]:
    drops = dict.fromkeys(each.point for each in one.findings if each.point.startswith(FALL))
    if not drops:
        return []
    return [
        Text(
            f"Among the runs with a call before each step are {len(drops)} of another model: "
            f"{BOXES} boxes fall onto each other, {STEPS} steps each. Contacts come and go there."
        )
    ]


def _broken(one: Audited, of: Sequence[AuditFinding]) -> str:
    off, where = worst([each.gap for each in of]), ", ".join([each.point for each in of])
    return (
        f"{one.name}: {of[0].case}, compared with {of[0].into}: differs at {where}, from step "
        f"{off.first}, by {cell(off)} at the worst"
    )


def _worst(findings: Iterable[AuditFinding]) -> str:
    gaps = [each.gap for each in findings]
    return cell(worst(gaps)) if gaps else NONE
