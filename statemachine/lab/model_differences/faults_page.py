"""What is wrong in a file, as a table: what it states, and what a run has instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import capital, grouped
from ...show.blocks import Table
from .records import FileFault, Value
from .subject_page import LINK_INERTIA, value_text


@dataclass(frozen=True)
class AlikeFaults:
    """Faults of one side that are the same of several elements.

    Attributes:
        faults: At least one.
    """

    faults: Sequence[FileFault]

    def label(self) -> str:
        """Return what it is of: the first element, and how many more there are."""
        first, more = self.faults[0], len(self.faults) - 1
        label = f"{first.side}: {first.quantity} of {first.kind} {first.element}"
        return f"{label} + {more} more" if more else label

    def line(self) -> str:
        """Return where the first element stands."""
        line = self.faults[0].line
        return "" if line is None else str(line.line)

    def stated(self) -> str:
        """Return what the file states."""
        return _value_of_fault(self.faults[0], self.faults[0].stated, "nothing")

    def used(self) -> str:
        """Return what a run has instead."""
        return _value_of_fault(self.faults[0], self.faults[0].used, "left out")

    def changed(self) -> str:
        """Return by how much it is changed."""
        factor = self.faults[0].factor
        return "" if factor is None else f"up to {factor:.3g} times"


def faults_table(faults: Sequence[FileFault]) -> Table:
    """Return a row for each fault; one for several elements of which the same is wrong."""
    by_kind = grouped(
        ((fault.side, fault.kind, fault.quantity, fault.stated, fault.used, fault.reason), fault)
        for fault in faults
    )
    rows = [AlikeFaults(alike) for alike in by_kind.values()]
    columns = {
        "fault": AlikeFaults.label,
        "stated": AlikeFaults.stated,
        "used": AlikeFaults.used,
        "changed": AlikeFaults.changed,
        "line": AlikeFaults.line,
    }
    title = "What is wrong in a file, and what a run has instead"
    return Table.of(rows, columns, title, words=columns)


def reasons_of(faults: Sequence[FileFault]) -> list[str]:
    """Return MuJoCo's reasons, each once."""
    reasons: dict[str, None] = {}
    for fault in faults:
        reasons[capital(fault.reason)] = None
    return list(reasons)


def _value_of_fault(fault: FileFault, value: Value, none: str) -> str:
    """Return a value of a fault as text."""
    if value is None:
        return none
    if fault.unit == "kg m²":
        return f"{value_text(value, LINK_INERTIA)} kg mm²"
    return value_text(value, fault.unit)
