"""What an audit found, as a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..engines.measured import FutureGap, worst
from ..measures.text import NONE, grouped, milliseconds, rough
from ..page import Block, Figures, Page, Table
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
)
from . import template
from .template import if_true, versions_of

_OF_THE_STATE = (RESTORE, WITHOUT, FORGETS, NO_CONTACTS)
_AT_REST = 1e-2  # of the fastest joint or body [rad/s or m/s]


def page(results: Mapping[str, Figures]) -> Page:
    """What was tried, engine by engine, and last what follows from it.

    Args:
        results: By backend.
    """
    first = next(iter(results.values()))
    made_with = [result.provenance for result in results.values()]
    versions = {source.backend: source.versions[source.backend] for source in made_with}
    drivers = [driver for result in results.values() for driver in result.audited]
    return template.page(
        "audit",
        model=first.provenance.model_file,
        engines=versions_of(versions),
        timestep=milliseconds(first.provenance.timestep),
        seed=first.provenance.seed,
        steps=first.steps,
        tables=[block for name, result in results.items() for block in _tables(name, result)],
        conclusions=[block for driver in drivers for block in _conclusion(driver)],
    )


def _tables(backend: str, result: Figures) -> list[Block]:
    """What was found of one backend."""
    first = result.audited[0]
    places = Table.of(
        first.points,
        {
            "save point": lambda seen: seen.point,
            "how to get there": lambda seen: seen.how,
            "after": lambda seen: f"{seen.time:.3g} s",
            "speed": lambda seen: "at rest" if seen.speed < _AT_REST else rough(seen.speed),
            "contacts": lambda seen: str(seen.contacts),
            "limits": lambda seen: NONE if seen.limits is None else str(seen.limits),
        },
        f"{first.name}: where runs are saved (speeds in rad/s or m/s)",
        words={"how to get there"},
    )
    return template.blocks(
        "audit_backend",
        backend=backend,
        places=places,
        not_asked=if_true(first.layer != "engine"),
        drivers=[block for driver in result.audited for block in _of_driver(driver)],
        without="; ".join(result.without) or None,
    )


def _of_driver(driver: Figures) -> list[Block]:
    """What was found of the state of one driver, and of what should change nothing."""
    candidates = grouped(
        (f"all but {finding.case}" if finding.experiment == WITHOUT else finding.case, finding)
        for finding in driver.findings
        if finding.experiment in (RESTORE, WITHOUT)
    )
    return template.blocks(
        "audit_driver",
        name=driver.name,
        by_point=_by_point(driver, candidates),
        legend=driver.legend,
        by_target=_by_target(driver, candidates),
        forgotten=_forgotten(driver),
        touching=_touching(driver),
        **_promises(driver),
    )


def _by_point(driver: Figures, candidates: Mapping[str, Sequence[Figures]]) -> Table:
    points = [seen.point for seen in driver.points]
    rows = [
        (
            name,
            *(
                _worst(f for f in findings if f.point == at and f.into != EACH_OTHER)
                for at in points
            ),
        )
        for name, findings in candidates.items()
    ]
    return Table(("what is restored", *points), rows, f"{driver.name}: restored, against going on")


def _by_target(driver: Figures, candidates: Mapping[str, Sequence[Figures]]) -> Table:
    targets = {
        "run itself": "the run itself",
        "fresh": "a fresh one",
        "used": "a used one",
        EACH_OTHER: EACH_OTHER,
    }
    rows = []
    for name, findings in candidates.items():
        # A way that cannot leave its own run is restored there twice.
        cells = [
            _worst(f for f in findings if f.into.startswith(into)) for into in targets.values()
        ]
        firsts = {f.gap.first for f in findings if f.into != EACH_OTHER and f.gap.first is not None}
        first_and_last = dict.fromkeys((min(firsts), max(firsts))) if firsts else (NONE,)
        rows.append((name, *cells, " to ".join(map(str, first_and_last))))
    title = f"{driver.name}: the same, by what it is restored in"
    return Table(("what is restored", *targets, "from step"), rows, title)


def _forgotten(driver: Figures) -> Table | None:
    """What is changed after a save and not brought back."""
    findings = [finding for finding in driver.findings if finding.experiment == FORGETS]
    if not findings:
        return None
    exact = {(finding.into, finding.case): finding.gap.exact for finding in findings}
    cases = list(dict.fromkeys(finding.case for finding in findings))

    def word(way: str, case: str) -> str:
        if exact[NOT_RESTORED, case]:
            return "does not show"
        return "brought back" if exact[way, case] else "stays"

    ways = dict.fromkeys(finding.into for finding in findings if finding.into != NOT_RESTORED)
    rows = [(way, *(word(way, case) for case in cases)) for way in ways]
    title = f"{driver.name}: changed after the save, at {findings[0].point}, and then restored"
    return Table(("restored by", *cases), rows, title, words=frozenset(range(len(cases) + 1)))


def _touching(driver: Figures) -> Table | None:
    """What contacts have to do with what is not restored."""
    gaps = driver.conclusion.touching
    case = next(
        (finding.case for finding in driver.findings if finding.experiment == NO_CONTACTS), ""
    )
    rows = [
        ("as it stands", *(cell(standing) for standing, _ in gaps.values())),
        ("contacts switched off", *(cell(off) for _, off in gaps.values())),
    ]
    title = f"{driver.name}: in a fresh one, with and without contacts"
    return Table((f"restored: {case}", *gaps), rows, title) if gaps else None


def _promises(driver: Figures) -> dict[str, Any]:
    """What should change nothing: slots of `audit_driver.md`."""
    tried = grouped(
        ((finding.case, finding.into, finding.promised), finding)
        for finding in driver.findings
        if finding.experiment not in _OF_THE_STATE or finding.promised
    )
    intact = {key: all(finding.holds for finding in findings) for key, findings in tried.items()}
    differing = {key: [f for f in of if not f.gap.exact] for key, of in tried.items()}
    promised = [holds for (*_, is_promised), holds in intact.items() if is_promised]
    rows = Table.of(
        tried,
        {
            "what is done": lambda key: key[0],
            "compared with": lambda key: key[1],
            "same bytes at": lambda key: (
                f"{len(tried[key]) - len(differing[key])} of {len(tried[key])}"
            ),
            "promised": lambda key: _PROMISED[key[2], intact[key]],
        },
        f"{driver.name}: what should change nothing",
        words={"compared with", "same bytes at", "promised"},
        emphasis=lambda key: not intact[key],
    )
    gaps = {key: worst([finding.gap for finding in of]) for key, of in differing.items() if of}
    changes = Table.of(
        gaps,
        {
            "what is done": lambda key: key[0],
            "differs at": lambda key: ", ".join(finding.point for finding in differing[key]),
            "by": lambda key: rough(gaps[key].length, "m"),
            "and": lambda key: rough(gaps[key].angle, "rad"),
            "from step": lambda key: str(gaps[key].first),
        },
        f"{driver.name}: what changes the bytes that follow, at the worst",
        words={"differs at"},
    )
    return {
        "promises": rows,
        "differing": changes,
        "drops": len({f.point for f in driver.findings if f.point.startswith(FALL)}) or None,
        "boxes": BOXES,
        "steps": STEPS,
        "holds": all(intact.values()) if tried else None,
        "intact": sum(promised),
        "promised": len(promised),
    }


_PROMISED = {(True, True): "yes", (True, False): "yes, broken", (False, True): "no"}


def _worst(findings: Iterable[Figures]) -> str:
    gaps = [finding.gap for finding in findings]
    return cell(worst(gaps)) if gaps else NONE


def _conclusion(driver: Figures) -> list[Block]:
    """What follows; all of it from the findings."""
    of = driver.conclusion
    again = [finding.gap.exact for finding in driver.findings if finding.experiment == AGAIN]
    needed = Table.of(
        of.missing,
        {
            "left out": lambda missing: missing.field,
            "the run itself differs at": lambda missing: _where(missing.itself, driver),
            "differs by": lambda missing: cell(missing.gap),
            "from step": lambda missing: str(missing.gap.first),
        },
        f"{driver.name}: what has to be restored, and by how much the run differs without it",
        words={"the run itself differs at"},
    )
    read_back = [f"{name} (at {', '.join(points)})" for name, points in of.not_read_back.items()]
    return template.blocks(
        "audit_conclusion",
        name=driver.name,
        suffices=" or ".join(of.suffice) or None,
        none_suffices=if_true(not of.suffice),
        needed=needed,
        alone=if_true(of.smallest is True),
        not_alone=if_true(of.smallest is False),
        idle=", ".join(of.idle) or None,
        read_back=", ".join(read_back) or None,
        in_contact=", ".join(of.in_contact) or None,
        agree=", ".join(name for name in of.agree if name not in of.suffice) or None,
        history=if_true(again and all(again) and not of.suffice),
    )


def _where(points: Sequence[str], driver: Figures) -> str:
    """Save points where the run itself needs a field; without one, only a used run does."""
    if len(points) == len(driver.points):
        return "all"
    return ", ".join(points) or "none; only a used one does"


def cell(off: FutureGap) -> str:
    """The larger of angle and length, or that every byte is the same."""
    if off.exact:
        return "same"
    if not off.size:  # of a velocity, or a 0 that became -0
        return "bytes"
    return rough(off.angle, "rad") if off.angle >= off.length else rough(off.length, "m")
