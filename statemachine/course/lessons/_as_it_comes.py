"""A joint that nobody commands, on an engine as its own users meet it."""

from __future__ import annotations

from dataclasses import dataclass

from ...engines.records import UncommandedJoint
from ...measures.text import position, signed
from ...show.blocks import Table
from ...show.engine_tables import Results
from ...show.labels import TableLabels
from .gravity import GravityResult


@dataclass(frozen=True)
class OwnMotors:
    """The joint on an engine whose own motors hold it.

    Attributes:
        on: With these motors, as the engine starts.
        undamped: Without them, and without the damping of the file.
    """

    on: UncommandedJoint
    undamped: UncommandedJoint


def own_motors(result: GravityResult) -> OwnMotors | None:
    """Return the joint under the engine's own motors; None where these do not hold it."""
    _, on, limp, undamped = result.alone
    falls = min(abs(limp.position), abs(undamped.position))
    holds = on.motor != 0 and abs(on.position) < falls / 10
    return OwnMotors(on, undamped) if holds else None


def flailing(result: GravityResult) -> UncommandedJoint | None:
    """Return the joint without the engine's motors if it swings to and fro, else None.

    It is of what goes further.
    """
    limp = result.alone[2]
    flails = limp.explicit > 2 and limp.turns > limp.steps / 4
    return limp if flails and result.further else None


def uncommanded_tables(results: Results[GravityResult], say: TableLabels) -> list[Table]:
    """Show the joint on each engine as it comes, where that differs from the contract.

    Args:
        results: By backend.
        say: The labels of the lesson.
    """
    return [_table(name, result, say) for name, result in results.items() if result.alone]


def _table(name: str, result: GravityResult, say: TableLabels) -> Table:
    """Show the joint on an engine as it comes."""
    rows: list[tuple[str, ...]] = []
    for alone in result.alone:
        motor = f"{signed(alone.motor)} {result.unit}"
        rows.append((alone.label, position(alone.position, result.slide), motor))
    time = result.alone[0].time
    return Table(
        (say("itself", engine=name), result.joint, say("own_motor")),
        rows,
        title=say("alone", engine=name, time=f"{time:.3g} s"),
    )
