"""What follows from the findings: which state suffices, and what breaks a smaller one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..engines.auditing import ONLY
from ..engines.futures import FutureGap, worst
from .findings import EACH_OTHER, AuditFinding
from .restore import FORGETS, ITSELF, NO_CONTACTS, NOT_RESTORED, RESTORE, WITHOUT

_NEARLY = 1e-6  # of a difference: what is left of it is rounding


@dataclass(frozen=True)
class Missing:
    """A component, and what comes of leaving it out of an otherwise whole state.

    Attributes:
        field: The engine's name of it.
        points: Where the future differs without it, into whatever it is restored.
        itself: Where it differs in the run itself, which nobody has written into.
        gap: The worst of it.
    """

    field: str
    points: tuple[str, ...]
    itself: tuple[str, ...]
    gap: FutureGap


@dataclass(frozen=True)
class Conclusion:
    """What the findings say of the state.

    Attributes:
        suffice: Candidates whose future was exact at every save point, into everything.
        fail: The others, and the worst of each.
        agree: Candidates whose restores have one future, be it that of the run or not.
        missing: Components without which something differs, and what.
        idle: Components without which nothing differs.
        smallest: Whether those of `missing` alone suffice; None where that was not tried.
        forgotten: By way to save, what it does not bring back.
        touching: By save point, how far off all that can be written is in a fresh one, as
            it stands and with contacts switched off.
        not_read_back: Candidates that do not read back as they were saved, before any step,
            and where.
    """

    suffice: tuple[str, ...]
    fail: dict[str, FutureGap]
    agree: tuple[str, ...]
    missing: tuple[Missing, ...]
    idle: tuple[str, ...]
    smallest: bool | None
    forgotten: dict[str, tuple[str, ...]]
    touching: dict[str, tuple[FutureGap, FutureGap]]
    not_read_back: dict[str, tuple[str, ...]]

    @property
    def in_contact(self) -> tuple[str, ...]:
        """Where nearly all that is missing acts through contacts, and nothing else."""
        return tuple(
            point
            for point, (standing, off) in self.touching.items()
            if not standing.exact and off.size <= _NEARLY * standing.size
        )


def conclude(findings: Sequence[AuditFinding]) -> Conclusion:
    """Draw the conclusion of one driver's findings."""
    against = [each for each in findings if each.into != EACH_OTHER]
    tried = _by_case(each for each in against if each.experiment == RESTORE)
    among = _by_case(
        each for each in findings if each.experiment == RESTORE and each.into == EACH_OTHER
    )
    left = _by_case(each for each in against if each.experiment == WITHOUT)
    missing = tuple(_missing(name, of) for name, of in left.items() if _differing(of))
    alone = tried.pop(ONLY, None)
    return Conclusion(
        suffice=tuple(name for name, of in tried.items() if not _differing(of)),
        fail={n: worst([f.gap for f in of]) for n, of in tried.items() if _differing(of)},
        agree=tuple(n for n, of in among.items() if n in tried and not _differing(of)),
        missing=missing,
        idle=tuple(name for name, of in left.items() if not _differing(of)),
        smallest=None if alone is None else not _differing(alone),
        forgotten=_forgotten(findings),
        touching=_touching(findings),
        not_read_back={
            name: points
            for name, of in tried.items()
            if (points := _differing(each for each in of if each.gap.first == 0))
        },
    )


def _by_case(findings: Iterable[AuditFinding]) -> dict[str, list[AuditFinding]]:
    found: dict[str, list[AuditFinding]] = {}
    for each in findings:
        found.setdefault(each.case, []).append(each)
    return found


def _differing(findings: Iterable[AuditFinding]) -> tuple[str, ...]:
    """Save points at which one differs, each once."""
    return tuple(dict.fromkeys(each.point for each in findings if not each.gap.exact))


def _missing(name: str, findings: Sequence[AuditFinding]) -> Missing:
    itself = _differing(each for each in findings if each.into == ITSELF)
    return Missing(name, _differing(findings), itself, worst([each.gap for each in findings]))


def _forgotten(findings: Iterable[AuditFinding]) -> dict[str, tuple[str, ...]]:
    found: dict[str, dict[str, None]] = {}
    for each in findings:
        if each.experiment == FORGETS and each.into != NOT_RESTORED:
            of = found.setdefault(each.into, {})
            if not each.gap.exact:
                of[each.case] = None
    return {way: tuple(of) for way, of in found.items()}


def _touching(findings: Sequence[AuditFinding]) -> dict[str, tuple[FutureGap, FutureGap]]:
    found = {}
    for off in findings:
        if off.experiment == NO_CONTACTS:
            (standing,) = (
                each.gap
                for each in findings
                if each.experiment == RESTORE
                and (each.case, each.into, each.point) == (off.case, off.into, off.point)
            )
            found[off.point] = (standing, off.gap)
    return found
