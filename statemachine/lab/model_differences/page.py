"""Two descriptions of a robot, side by side, as a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from ...measures.text import capital, display_unit, grouped, rounded, sentence, unit_suffix
from ...measures.text import versions_of as versions_text
from ...show.blocks import Page, Table
from ...show.first_screen import MOST_ROWS, first_that_fits, with_answer
from ...show.templates import PageContent, render
from ..compare.matched import RenamedPair
from .changes_page import (
    ElementChange,
    UnwrittenGroup,
    element_changes,
    refused_groups,
    unwritten_groups,
)
from .faults_page import faults_table, reasons_of
from .next_question import next_command_of
from .records import FileSide, ListedDifference, ModelsComparison, QuantityAgreement
from .subject_page import (
    DIFFERENCE_TEXTS,
    LINK_INERTIA,
    AlikeDifferences,
    LackOfArmature,
    group_alike,
    heading,
    lack_of_armature,
    record_table,
    subject_table,
    worst_table,
)
from .supplied import not_supplied
from .visuals import gross_visuals

_SIDE_COLUMNS = (
    "file",
    "read",
    "links",
    "joints",
    "touching",
    "drawn",
    "mass",
)  # rows of the sides
_POSITION_TOLERANCE = 1e-5  # [m] within which links are at one place

ModelsState = Literal["differs", "not all compared", "equal"]
Hint = Literal["differences", "figures", ""]


@dataclass(frozen=True)
class ModelsPage(PageContent):
    """What the page of two descriptions shows.

    Attributes:
        result: Every difference.
        worst: Table of the weightiest differences that act on a motion.
        more: How many of these it does not show.
        tables: With details, a table for each subject.
        next_command: What to type next; "" for nothing.
        details: Whether everything is shown.
    """

    template = "models.md.j2"
    result: ModelsComparison
    worst: Table
    more: int
    tables: Sequence[Table]
    next_command: str
    details: bool

    @property
    def left_name(self) -> str:
        """Return the left file, and its engine if that has read it."""
        return _name(self.result.left)

    @property
    def right_name(self) -> str:
        """Return the right file, and its engine if that has read it."""
        return _name(self.result.right)

    @property
    def state(self) -> ModelsState:
        """Return whether anything differs that acts on a motion."""
        if self.acting:
            return "differs"
        return "not all compared" if self.result.skipped else "equal"

    @property
    def acting(self) -> list[ListedDifference]:
        """Return the differences that act on a motion."""
        return [row for row in self.result.differences if row.matters]

    @property
    def subjects(self) -> list[str]:
        """Return the subjects of these, each with its number of differences."""
        return _counts(self.acting)

    @property
    def record(self) -> list[str]:
        """Return the subjects of what does not act, each with its number of differences."""
        return _counts([row for row in not_supplied(self.result) if not row.matters])

    @property
    def supplied(self) -> list[str]:
        """Return the subjects of what a backend supplies in a run, each with its number."""
        return _counts([row for row in self.result.differences if row.supplied])

    @property
    def largest(self) -> AlikeDifferences | None:
        """Return the weightiest difference; None where there is none."""
        groups = weightiest(self.result)
        return groups[0] if groups else None

    @property
    def gross(self) -> list[str]:
        """Return what is drawn far too large or too small, in words."""
        return [f"{row.element}, {row.effect}" for row in gross_visuals(self.result)]

    @property
    def paired(self) -> Sequence[RenamedPair]:
        """Return the elements that are paired although their names differ."""
        return self.result.renamed

    @property
    def hint(self) -> Hint:
        """Return what the details would show; "" where they are shown."""
        if self.details:
            return ""
        return "differences" if self.result.differences else "figures"

    @property
    def joints(self) -> int:
        """Return the number of joints that were moved to compare poses."""
        return self.result.posed.joints

    @property
    def distance(self) -> str:
        """Return the largest distance of a link where joints have the same positions."""
        return _tiny(self.result.posed.distance, "m")

    @property
    def angle(self) -> str:
        """Return the largest rotation of a link where joints have the same positions."""
        return _tiny(self.result.posed.angle, "rad")

    @property
    def furthest(self) -> str:
        """Return the link that is furthest off; "" where none is."""
        posed = self.result.posed
        return posed.link if posed.joints and posed.distance > _POSITION_TOLERANCE else ""

    @property
    def sides(self) -> Table:
        """Return how both sides were read, and what they have."""
        rows = zip(
            _SIDE_COLUMNS, _column(self.result.left), _column(self.result.right), strict=True
        )
        return Table(("", "left", "right"), list(rows))

    @property
    def emulated(self) -> str:
        """Return the engine that read a file and emulates the contract in a run; "" without."""
        return self._engine_that_reads().emulated

    @property
    def written(self) -> str:
        """Return that engine where the file reaches it as a URDF that is written; "" else."""
        side = self._engine_that_reads()
        return side.emulated if side.is_mjcf else ""

    @property
    def unlike(self) -> str:
        """Return what a run has that the engine's own users do not have; "" for nothing."""
        left, right = self.result.left.unlike_its_users, self.result.right.unlike_its_users
        return capital(left if left else right)

    def _engine_that_reads(self) -> FileSide:
        """Return the side that an emulated engine read; of two, or of none, the left."""
        left, right = self.result.left, self.result.right
        return right if right.emulated and not left.emulated else left

    @property
    def faults(self) -> Table:
        """Return what is wrong in a file, and what a run has instead."""
        return faults_table(self.result.faults)

    @property
    def reasons(self) -> list[str]:
        """Return the reasons for these, as MuJoCo gives them."""
        return reasons_of(self.result.faults)

    @property
    def lack(self) -> LackOfArmature | None:
        """Return what the lack of armature on one side does to a joint, if it lacks there."""
        return lack_of_armature(not_supplied(self.result))

    @property
    def records(self) -> Table:
        """Return what does not act on a motion: the number of differences of each subject."""
        idle = [row for row in self.result.differences if not row.matters]
        return record_table(idle, _files(self.result))

    @property
    def elements(self) -> list[ElementChange]:
        """Return the elements of the right's file whose attributes undo differences."""
        return element_changes(self.result.changes)

    @property
    def unwritten(self) -> list[UnwrittenGroup]:
        """Return what no attribute undoes; without a file to change, what cannot be equalized."""
        if self.result.changes:
            return unwritten_groups(self.result.changes)
        return refused_groups(not_supplied(self.result))

    @property
    def pairs(self) -> Table:
        """Return the elements that are paired although their names differ, a row for each pair."""
        rows: list[tuple[str, ...]] = []
        for pair in self.result.renamed:
            rows.append((pair.kind, pair.left, pair.right, pair.suggestion))
        title = "Taken for one by their place; an actuator by its joint"
        headers = ("kind", "left", "right", "says otherwise")
        return Table(headers, rows, title, words=frozenset(range(4)))

    @property
    def equal(self) -> Table:
        """Return how well both sides agree, a row for each subject."""
        return _equal(self.result.agreements)

    @property
    def notes(self) -> list[str]:
        """Return what a reader should know, in sentences."""
        result = self.result
        notes = [f"left: {note}" for note in result.left.notes]
        notes += [f"right: {note}" for note in result.right.notes]
        return [sentence(note) for note in (*notes, *result.notes, *result.skipped)]

    @property
    def versions(self) -> str:
        """Return the versions of the programs that computed it."""
        return versions_text(self.result.versions)


def page(result: ModelsComparison, details: bool = False) -> Page:
    """Return the page of two descriptions: what differs, the weightiest first.

    Args:
        result: Every difference.
        details: Whether every difference has a row, and what is equal is shown, too.
    """
    if details:
        return with_answer(whole_page(result))
    return first_that_fits(ever_shorter(result))


def ever_shorter(result: ModelsComparison) -> Iterator[Page]:
    """Yield the page with ever fewer of the weightiest differences, at least one if there are."""
    groups = weightiest(result)
    most = min(len(groups), MOST_ROWS)
    for rows in range(most, min(most, 1) - 1, -1):
        yield with_answer(_page(result, groups[:rows]))


def whole_page(result: ModelsComparison) -> Page:
    """Return the page with everything on it, for a place on a page of something else."""
    return _page(result, (), details=True)


def _page(
    result: ModelsComparison, worst: Sequence[AlikeDifferences], details: bool = False
) -> Page:
    """Return the page with some of the weightiest differences; with details tables have all."""
    files = _files(result)
    acting = [row for row in result.differences if row.matters]
    more = 0 if details else len(acting) - sum(len(group.rows) for group in worst)
    by_subject = grouped((row.subject, row) for row in acting) if details else {}
    tables = [subject_table(subject, rows, files) for subject, rows in by_subject.items()]
    content = ModelsPage(
        result=result,
        worst=worst_table(worst, files),
        more=more,
        tables=tables,
        next_command=next_command_of(result),
        details=details,
    )
    return render(content)


def weightiest(result: ModelsComparison) -> list[AlikeDifferences]:
    """Return the differences that act on a motion, the weightiest first, whatever their subject."""
    groups = group_alike([row for row in result.differences if row.matters])
    return sorted(groups, key=lambda group: -round(group.first.share, 6))


def _files(result: ModelsComparison) -> tuple[str, str]:
    return result.left.file, result.right.file


def _counts(differences: Sequence[ListedDifference]) -> list[str]:
    """Return the subjects of some differences, each with how many there are."""
    by_subject = grouped((row.subject, row) for row in differences)
    return [f"{subject} {len(rows)}" for subject, rows in by_subject.items()]


def _name(side: FileSide) -> str:
    """Return a file, and of one that an engine has read the engine."""
    return f"{side.file} on {side.reader.split()[0]}" if side.format == "engine" else side.file


def _column(side: FileSide) -> list[str]:
    """Return how a side was read, and what it has."""
    read = f"{side.format}, by {side.reader}"
    if side.format == "engine":
        read = f"loaded into {side.reader}"
    return [
        side.file,
        read,
        str(side.links),
        str(side.joints),
        str(side.shapes),
        str(side.visuals),
        rounded(side.mass, "kg", 4),
    ]


@dataclass(frozen=True)
class _SubjectAgreement:
    """How well both sides agree in a subject.

    Attributes:
        subject: A key of `SUBJECTS`.
        agreements: In each unit.
    """

    subject: str
    agreements: Sequence[QuantityAgreement]

    def heading(self) -> str:
        return heading(self.subject)

    def counts(self) -> str:
        """Return how many figures are equal, of how many."""
        equal = sum(agreement.count for agreement in self.agreements)
        return f"{equal} of {sum(agreement.compared for agreement in self.agreements)}"

    def apart(self) -> str:
        """Return how far the figures are apart at the worst, in each unit."""
        gaps = [_worst(agreement) for agreement in self.agreements if agreement.worst]
        return ", ".join(gaps) if gaps else "0"

    def digits(self) -> str:
        """Return to how many digits the figures agree."""
        digits = min(agreement.digits for agreement in self.agreements)
        return "all" if digits == 17 else str(digits)


def _equal(agreements: Sequence[QuantityAgreement]) -> Table:
    """Return a row for each subject: how well both sides agree in it, at the worst in each unit."""
    by_subject = grouped((row.subject, row) for row in agreements)
    rows = [_SubjectAgreement(subject, group) for subject, group in by_subject.items()]
    columns = {
        "subject": _SubjectAgreement.heading,
        "equal": _SubjectAgreement.counts,
        "apart, at most": _SubjectAgreement.apart,
        "to digits": _SubjectAgreement.digits,
    }
    return Table.of(rows, columns, "Figures that are equal")


def _worst(agreement: QuantityAgreement) -> str:
    """Return the largest difference of those that agree."""
    unit = LINK_INERTIA if agreement.subject == "inertia" else agreement.unit
    factor, shown = DIFFERENCE_TEXTS.get(unit, (1.0, unit_suffix(unit)))
    return f"{agreement.worst * factor:.1e}{shown}"


def _tiny(value: float, unit: str) -> str:
    """Return a size with one digit where it is rounding."""
    is_large = value * display_unit(unit)[0] > 1e-2
    return rounded(value, unit, 4 if is_large else 1)
