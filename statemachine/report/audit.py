"""What an audit found, as a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..engines.futures import FutureGap, worst
from ..measures.text import NONE, milliseconds, rough
from ..page import Block, Items, Page, Table, Text
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
from . import template
from .template import if_true

_OF_THE_STATE = (RESTORE, WITHOUT, FORGETS, NO_CONTACTS)
_AT_REST = 1e-2  # of the fastest joint or body [rad/s or m/s]

# What follows beside the state; each holds only if it has something to name.
FACTS = {
    "idle": "Nothing differs without {what}.",
    "read back": "Before any step, not every byte reads back as it was saved: {what}.",
    "in contact": "What cannot be written acts through contacts, at {what}.",
    "agree": "All restores of one state have one future, though not that of the run: {what}.",
    "history": "What did bring every future back is a new one, and the whole past once more: here "
    "the state is the history.",
}


def page(results: Mapping[str, Audit]) -> Page:
    """What was tried, engine by engine, and last what follows from it.

    Args:
        results: By backend.
    """
    first = next(iter(results.values()))
    tables: list[Block] = []
    for backend, result in results.items():
        tables.append(_places(result.audited[0]))
        if result.audited[0].layer != "engine":
            tables.append(Text(f"{backend} itself, by its own functions, was not asked."))
        for driver in result.audited:
            tables += _of_driver(driver)
        if result.without:
            tables.append(Text(f"Not tried: {'; '.join(result.without)}."))
    versions = [(r.provenance.backend, r.provenance.versions) for r in results.values()]
    drivers = [driver for result in results.values() for driver in result.audited]
    return template.page(
        "audit",
        model=first.provenance.model_file,
        engines=", ".join(f"{backend} {each[backend]}" for backend, each in versions),
        timestep=milliseconds(first.provenance.timestep),
        seed=first.provenance.seed,
        steps=first.steps,
        tables=tables,
        conclusions=[block for driver in drivers for block in _conclusion(driver)],
    )


def _of_driver(driver: Audited) -> list[Block]:
    """What was found of the state of one driver, and of what should change nothing."""
    rows = _candidates(driver)
    return template.blocks(
        "audit_driver",
        name=driver.name,
        by_point=[_by_point(driver, rows)],
        legend=driver.legend,
        by_target=[_by_target(driver, rows)],
        forgotten=_forgotten(driver),
        touching=_touching(driver),
        **_promises(driver),
    )


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
        title=f"{one.name}: where runs are saved (speeds in rad/s or m/s)",
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
        shown.append((name, *cells, " to ".join(map(str, steps[:1] + steps[1:][-1:])) or NONE))
    return Table(
        ("what is restored", *kinds, EACH_OTHER, "from step"),
        shown,
        title=f"{one.name}: the same, by what it is restored in",
    )


def _forgotten(one: Audited) -> list[Block]:
    """What is changed after a save and not brought back."""
    of = [each for each in one.findings if each.experiment == FORGETS]
    if not of:
        return []
    cells = {(each.into, each.case): each.gap.exact for each in of}
    cases = list(dict.fromkeys(each.case for each in of))
    ways = [way for way in dict.fromkeys(each.into for each in of) if way != NOT_RESTORED]

    def word(way: str, case: str) -> str:
        if cells[NOT_RESTORED, case]:
            return "does not show"
        return "brought back" if cells[way, case] else "stays"

    rows = [(way, *(word(way, case) for case in cases)) for way in ways]
    title = f"{one.name}: changed after the save, at {of[0].point}, and then restored"
    return [Table(("restored by", *cases), rows, title, words=frozenset(range(len(cases) + 1)))]


def _touching(one: Audited) -> list[Block]:
    """What contacts have to do with what is not restored."""
    gaps = one.conclusion.touching
    if not gaps:
        return []
    case = next(each.case for each in one.findings if each.experiment == NO_CONTACTS)
    rows = [
        ("as it stands", *(cell(standing) for standing, _ in gaps.values())),
        ("contacts switched off", *(cell(off) for _, off in gaps.values())),
    ]
    title = f"{one.name}: in a fresh one, with and without contacts"
    return [Table((f"restored: {case}", *gaps), rows, title)]


def _promises(one: Audited) -> dict[str, Any]:
    """What should change nothing: slots of `audit_driver.md`."""
    tried: dict[tuple[str, str, bool], list[AuditFinding]] = {}
    for each in one.findings:
        if each.experiment not in _OF_THE_STATE or each.promised:
            tried.setdefault((each.case, each.into, each.promised), []).append(each)
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
    promised = sum(promised for *_, promised in tried)
    heads = ("what is done", "compared with", "same bytes at", "promised")
    emphasis = frozenset(k for k, is_broken in enumerate(broken) if is_broken)
    title = f"{one.name}: what should change nothing"
    changes = ("what is done", "differs at", "by", "and", "from step")
    changing = f"{one.name}: what changes the bytes that follow, at the worst"
    return {
        "promises": [Table(heads, rows, title, words=frozenset(range(4)), emphasis=emphasis)]
        if rows
        else [],
        "differing": [Table(changes, differ, changing, words=frozenset({0, 1}))] if differ else [],
        "drops": len({each.point for each in one.findings if each.point.startswith(FALL)}) or None,
        "boxes": BOXES,
        "steps": STEPS,
        "holds": not any(broken) if tried else None,
        "intact": promised - sum(broken),
        "promised": promised,
    }


_PROMISED = {(True, False): "yes", (True, True): "yes, broken", (False, False): "no"}


def _worst(findings: Iterable[AuditFinding]) -> str:
    gaps = [each.gap for each in findings]
    return cell(worst(gaps)) if gaps else NONE


def _conclusion(one: Audited) -> list[Block]:
    """What follows; all of it from the findings."""
    of = one.conclusion
    again = [each.gap.exact for each in one.findings if each.experiment == AGAIN]
    facts = {
        "idle": of.idle,
        "read back": [f"{name} (at {', '.join(at)})" for name, at in of.not_read_back.items()],
        "in contact": of.in_contact,
        "agree": [name for name in of.agree if name not in of.suffice],
        "history": [AGAIN] if again and all(again) and not of.suffice else [],
    }
    lines = [FACTS[name].format(what=", ".join(what)) for name, what in facts.items() if what]
    rows = [
        (each.field, _where(each.itself, one), cell(each.gap), str(each.gap.first))
        for each in of.missing
    ]
    heads = ("left out", "the run itself differs at", "differs by", "from step")
    title = f"{one.name}: what has to be restored, and by how much the run differs without it"
    return template.blocks(
        "audit_conclusion",
        name=one.name,
        suffices=" or ".join(of.suffice) or None,
        none_suffices=if_true(not of.suffice),
        needed=[Table(heads, rows, title, words=frozenset({0, 1}))] if rows else [],
        alone=if_true(of.smallest is True),
        not_alone=if_true(of.smallest is False),
        facts=[Items(lines)] if lines else [],
    )


def _where(points: Sequence[str], one: Audited) -> str:
    """Save points where the run itself needs a field; without one, only a used run does."""
    if len(points) == len(one.points):
        return "all"
    return ", ".join(points) or "none; only a used one does"


def cell(off: FutureGap) -> str:
    """The larger of angle and length, or that every byte is the same."""
    if off.exact:
        return "same"
    if not off.size:  # of a velocity, or a 0 that became -0
        return "bytes"
    if off.angle >= off.length:
        return rough(off.angle, "rad")
    return rough(off.length, "m")
