"""What an audit finds: one experiment, and how far apart two futures are."""

from __future__ import annotations

from dataclasses import dataclass

from ..engines.auditing import Driver, Layer, ReferenceRun
from ..engines.futures import FutureGap

EACH_OTHER = "each other"  # the futures of several restores, instead of one and the reference


@dataclass(frozen=True)
class AuditFinding:
    """One experiment and what came of it.

    Attributes:
        experiment: A question of `audit.QUESTIONS`.
        layer: Who was asked: the engine itself, or our interface to it.
        point: The save point.
        case: What was tried: a candidate for the state, a call, a way to run.
        into: What the state was put into, or what else the future was compared with.
        promised: Whether somebody promises that the futures are the same, so that a
            difference is a fault and not a fact.
        gap: How far the future is from the one that it was compared with.
    """

    experiment: str
    layer: Layer
    point: str
    case: str
    into: str
    promised: bool
    gap: FutureGap

    @property
    def verdict(self) -> str:
        """Whether the bytes are the same."""
        return "exact" if self.gap.exact else "differs"

    @property
    def holds(self) -> bool:
        """Whether nothing that is promised is broken by this."""
        return self.gap.exact or not self.promised


def finding_of(
    driver: Driver,
    experiment: str,
    run: ReferenceRun,
    case: str,
    into: str,
    gap: FutureGap,
    promised: bool = True,
) -> AuditFinding:
    """What came of an experiment on a driver; see `AuditFinding`."""
    return AuditFinding(experiment, driver.layer, run.point.name, case, into, promised, gap)
