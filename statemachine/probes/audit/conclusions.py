"""What follows from the findings: which state suffices, and what breaks a smaller one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...engines.auditing import ITSELF, ONLY
from ...engines.futures import FutureGap, worst
from ...measures.text import grouped
from ...page import Figures
from .trials import (
    EACH_OTHER,
    FORGETS,
    NO_CONTACTS,
    NOT_RESTORED,
    RESTORE,
    WITHOUT,
    AuditFinding,
)

_NEARLY = 1e-6  # of a difference: what is left of it is rounding


def conclude(findings: Sequence[AuditFinding]) -> Figures:
    """Draw the conclusion of one driver's findings.

    Returns:
        suffice: Candidates whose future was exact at every save point, whatever was restored.
        fail: The others, and the largest gap of each.
        agree: Candidates whose restores have one future, be it that of the run or not.
        missing: Components without which something differs: the engine's name of it; at which
            points, into whatever it is restored, and at which in the run itself, which nobody has
            written into; and the worst gap of it.
        idle: Components without which nothing differs.
        smallest: Whether those of `missing` alone suffice; None where that was not tried.
        forgotten: By way to save, what it does not bring back.
        touching: By save point, how far off all that can be written is in a fresh one, as
            it stands and with contacts switched off.
        in_contact: Where nearly all that is missing acts through contacts, and nothing else.
        not_read_back: Candidates that do not read back as they were saved, before any step,
            and where.
    """

    def by_case(experiment: str, among: bool = False) -> dict[str, list[AuditFinding]]:
        return grouped(
            (finding.case, finding)
            for finding in findings
            if finding.experiment == experiment and (finding.into == EACH_OTHER) == among
        )

    tried, among, left_out = by_case(RESTORE), by_case(RESTORE, among=True), by_case(WITHOUT)
    alone = tried.pop(ONLY, None)
    missing = [
        Figures(
            field=name,
            points=_differing(of_name),
            itself=_differing(finding for finding in of_name if finding.into == ITSELF),
            gap=_worst(of_name),
        )
        for name, of_name in left_out.items()
    ]
    forgets = [f for f in findings if f.experiment == FORGETS and f.into != NOT_RESTORED]
    restores = {(f.case, f.into, f.point): f.gap for f in findings if f.experiment == RESTORE}
    without_contacts = [finding for finding in findings if finding.experiment == NO_CONTACTS]
    touching = {
        off.point: (restores[off.case, off.into, off.point], off.gap) for off in without_contacts
    }
    return Figures(
        suffice=tuple(case for case in tried if not _differing(tried[case])),
        fail={case: _worst(tried[case]) for case in tried if _differing(tried[case])},
        agree=tuple(case for case in among if case in tried and not _differing(among[case])),
        missing=tuple(component for component in missing if component.points),
        idle=tuple(component.field for component in missing if not component.points),
        smallest=None if alone is None else not _differing(alone),
        forgotten={
            way: tuple(f.case for f in forgets if f.into == way and not f.gap.exact)
            for way in dict.fromkeys(finding.into for finding in forgets)
        },
        touching=touching,
        in_contact=tuple(
            point
            for point, (standing, off) in touching.items()
            if not standing.exact and off.size <= _NEARLY * standing.size
        ),
        not_read_back={
            case: points
            for case, of_case in tried.items()
            if (points := _differing(finding for finding in of_case if finding.gap.first == 0))
        },
    )


def _differing(findings: Iterable[AuditFinding]) -> tuple[str, ...]:
    """The save points at which a future differs."""
    return tuple(dict.fromkeys(finding.point for finding in findings if not finding.gap.exact))


def _worst(findings: Sequence[AuditFinding]) -> FutureGap:
    return worst([finding.gap for finding in findings])
