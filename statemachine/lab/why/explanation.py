"""What the gap between two sides comes from, as a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ...engines.description.file_changes import AttributeChange
from ...engines.description.lines import SourceLine
from ...engines.records import DifferingQuantity, KnownChange
from ...measures import Deviation
from ..compare.instead import Instead
from ..compare.matched import RenamedPair
from ..compare.matching import Only
from ..compare.motion import MotionExtent
from ..compare.typed_command import TypedCommand
from ..runs.call_period import CallPeriods
from ..runs.floating import Bases
from ..runs.provenance import Provenance
from .cited_case import CitedCase
from .gap import FirstTouch, Measure
from .locate import Localisation
from .rewriting import RewrittenFile
from .shapley import Method
from .shares import Range
from .split import GapSplit
from .trials import RunFailure
from .verdict import CausePart, Facts, GapVerdict, LocatedPart, gap_state, verdict_of

EndedBy = Literal["", "time limit", "interrupt"]


@dataclass(frozen=True)
class FailedSet:
    """A set of causes that could not be run.

    Attributes:
        equalized: Names of the causes that were equalized, sorted; all others were as they come.
        failure: What became of it: the side, how far that came, and why it ended there.
    """

    equalized: tuple[str, ...]
    failure: RunFailure


@dataclass(frozen=True)
class Share:
    """A cause, and its part of the gap.

    Attributes:
        name: What it is, and of what.
        values: Each quantity that differs; see `WrittenCause`.
        place: The one line of the right's file that says it; None where that was not found, and
            where an option says it.
        kind: Of the elements: "body", "joint", "option"; "run" of what is commanded and of the
            start, "engine" of a setting of an engine as it comes.
        share: Its part of the gap (Shapley value); below zero where it hides others; None where it
            cannot be equalized, where no set of causes with it could be run, and where it is not
            known yet.
        error: Standard error of the share; 0 where it is not an estimate.
        range: Between which parts of the gap the share lies, as far as is known. Of an exact share
            both are that; of an estimate they are two standard errors to either side. Where the
            share is not known yet they are the least and the largest of what the cause takes away
            alone, last, and in the orders that were run whole. None where nothing is known.
        alone: The part that it takes away as the only one; None where that could not be run, or
            was not run yet.
        last: The part that it takes away after all others that can be equalized; None as `alone`.
        note: Why there is no share, and never will be, or what else is to be said.
        failure: Where no set with it could be run, or none with all others: the smallest of these
            sets, and why. Else None.
        chosen: Of an integrator the side that can choose, "left" or "right", and the one to choose;
            else None.
        changes: What of the right's file undoes it, attribute by attribute; empty where that is not
            known.
        not_written: Why no attribute of the right's file undoes it; "" where some do.
        option: The option of the right side that says its value, as it is typed; "" where none
            does.
    """

    name: str
    values: tuple[DifferingQuantity, ...]
    place: SourceLine | None
    kind: str
    share: float | None = None
    error: float = 0.0
    range: Range | None = None
    alone: float | None = None
    last: float | None = None
    note: str = ""
    failure: FailedSet | None = None
    chosen: tuple[Literal["left", "right"], str] | None = None
    changes: tuple[AttributeChange, ...] = ()
    not_written: str = ""
    option: str = ""

    def weight(self) -> float:
        """Return the size that it is ranked by: of its share, or of the middle of its range."""
        if self.share is not None:
            return abs(self.share)
        return 0.0 if self.range is None else abs(sum(self.range)) / 2


@dataclass(frozen=True)
class Effect:
    """What a cause takes away of the gap alone, and last: that is known before any share.

    Attributes:
        name: Of the cause.
        alone: The part that it takes away as the only one; None where that could not be run, or
            was not run yet.
        last: The part that it takes away after all others that can be equalized; None as `alone`.
    """

    name: str
    alone: float | None
    last: float | None

    @property
    def range(self) -> Range | None:
        """Return the least and the largest effect, alone or last; None where neither is known."""
        effects = self._known_effects()
        return (min(effects), max(effects)) if effects else None

    def size(self) -> float:
        """Return the size of the mean of what is known; 0 where nothing is."""
        effects = self._known_effects()
        return abs(sum(effects)) / len(effects) if effects else 0.0

    def _known_effects(self) -> list[float]:
        return [effect for effect in (self.alone, self.last) if effect is not None]


@dataclass(frozen=True)
class Explanation:
    """What the gap between two sides comes from.

    Attributes:
        experiment: What was run.
        description: What happens in it, in a sentence.
        seconds: Simulated time [s].
        labels: What the sides are called; differences are brought from the right to the left.
        quantity: What the gap is measured in.
        unit: Of the quantity.
        measure: Which figure of the gap: the worst at any moment, that of the end, or the rms.
        first: The gap in each quantity, as the sides come.
        gap: The one that is explained, in `unit`.
        shares: The causes in files, options, commands and settings of an engine, the largest share
            first, or the largest `weight` where shares are not known yet. Where all are known they
            add up to `explained`.
        ended_by: What ended the search before it was complete, "time limit" or "interrupt"; "" if
            nothing did. Then every share is exact, or as precise as the sets that are run unless
            a time limit is given make it: `range` says how precise. Where it was ended, what is
            not known yet is None, and `runs`, `took` and `draws` are of what was made.
        method: How the shares were computed; "alone and last" where each cause was equalized alone,
            and last, and no share is known yet; "not ranked" where the search was ended before.
        orders: How many orders were drawn for that.
        equalized_gap: The gap with all causes equalized that can be, in `unit`; None if that could
            not be run, or was not run yet.
        found_in: What the rest is found in by leaving features out on both sides.
        explained: The part of the gap that goes where settings are equalized.
        located: The part that goes only where something is left out on both sides: it says
            where the rest comes from, not why.
        unexplained: The part that stays.
        negligible: Gaps below this are taken for rounding, in `unit`.
        tolerance: A gap that does not matter, in `unit`.
        floor: The chaos floor, in `unit`: how far the two sides are at most from themselves,
            started and commanded anew with rounding, and with what is not known of the start.
        draws: How many such runs were made of each side; 0 if the floor was not looked for.
        one_engine: Whether both sides run on one engine and release, both with its own settings or
            both with the model's.
        redundant: Causes of which each one alone takes away nine tenths of the gap or more, and the
            last of them less than a tenth.
        impossible: Sets of causes that could not be run, each with its reason: the smaller sets
            first. Shares are means over the orders that come by none of them.
        unmatched: What only one side has: joints, actuators, by side.
        missing: What one side has nothing of, and the other has: see `missing_parts`.
        notes: What a reader should know, in sentences.
        unread: What differs, too, and nothing depends on but a function that reads it, where there
            is none, or no gap.
        still: Joints with a difference that the left hardly moves: it cannot show.
        motion: How far both sides move as they come.
        instead: What to run where nothing moves; None where something does.
        touch: The first contact; None without one.
        moments: How many moments the runs are compared at.
        between: Whether rows had to be interpolated there.
        runs: How many runs it took.
        took: What it took by the clock [s].
        provenance: What each side was computed with.
        right_file: Name of the right's file, without its folder.
        renamed: What was taken for one although the names differ, and nobody said so.
        changes: Known changes between two releases that concern the runs as they come; empty where
            there is no gap.
        call_periods: How often a function is called on each side; None where none is run.
        bases: Whether the base of each side floats, and whether their frames are one; None where
            nobody looked.
        command: What asks something of these sides again; None where nothing was typed.
        rewritten: The right's file with the left's values; None where none was to be written.
        split: The gap divided into import, joint dynamics and contact; None where there is no gap
            to divide, one engine runs one file on both sides, or the search was ended before.
        joint: Which joint is farthest apart as the sides come, by `measure`, where `quantity` is of
            several; else "".
        joint_gap: How far that joint alone is apart; None where `joint` is "".
        cited_case: The case of the battery that decides the cause, and which side is nearer to the
            truth in it; None where the cause has none, or where the run that was asked does not
            say the same.
        contradicted_case: The case that would decide the cause, but for the run that was asked,
            in which the same side is not nearer to the truth; None where there is none.
    """

    experiment: str
    description: str
    seconds: float
    labels: tuple[str, str]
    quantity: str
    unit: str
    measure: Measure
    first: Mapping[str, Deviation]
    gap: float
    shares: tuple[Share, ...]
    ended_by: EndedBy
    method: Method
    orders: int
    equalized_gap: float | None
    found_in: tuple[Localisation, ...]
    explained: float
    located: float
    unexplained: float
    negligible: float
    tolerance: float
    floor: float
    draws: int
    one_engine: bool
    redundant: tuple[str, ...]
    impossible: tuple[FailedSet, ...]
    unmatched: tuple[Only, Only]
    missing: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    unread: tuple[str, ...]
    still: tuple[str, ...]
    motion: MotionExtent
    instead: Instead | None
    touch: FirstTouch | None
    moments: int
    between: bool
    runs: int
    took: float
    provenance: tuple[Provenance, Provenance]
    right_file: str = ""
    renamed: tuple[RenamedPair, ...] = ()
    changes: tuple[KnownChange, ...] = ()
    bases: Bases | None = None
    call_periods: CallPeriods | None = None
    command: TypedCommand | None = field(default=None, metadata={"json": False})
    rewritten: RewrittenFile | None = None
    split: GapSplit | None = None
    joint: str = ""
    joint_gap: Deviation | None = None
    cited_case: CitedCase | None = None
    contradicted_case: CitedCase | None = None

    @property
    def is_complete(self) -> bool:
        """Tell whether the search came to its end."""
        return not (self.ended_by or self.method in ("not ranked", "alone and last"))

    @property
    def nothing_written(self) -> bool:
        """Tell whether a file was to close a gap, and nothing could be changed in it."""
        if self.rewritten is None or self.rewritten.written:
            return False
        return self.verdict.divides

    @property
    def ranking(self) -> tuple[Effect, ...]:
        """Return the known effects of each cause, alone and last, the largest first."""
        effects = [Effect(row.name, row.alone, row.last) for row in self.shares]
        known = [effect for effect in effects if effect.range is not None]
        return tuple(sorted(known, key=Effect.size, reverse=True))

    def leading(self) -> Share | None:
        """Return the cause that takes away most by all that is known; None where nothing is."""
        known = [row for row in self.shares if row.range is not None]
        return max(known, key=Share.weight, default=None)

    @property
    def verdict(self) -> GapVerdict:
        """Return what the gap comes from, and whether that answers the question."""
        state = gap_state(self.gap, self.negligible, self.tolerance, self.floor)
        refused = any(row.note for row in self.shares)
        facts = Facts(
            state=state,
            differs=bool(self.shares),
            refused=refused,
            one_engine=self.one_engine,
            explained=self.explained,
            located=self.located,
            unexplained=self.unexplained,
            cause=self._largest_cause(),
            places=self._places(),
            moved=self.motion.moved,
            is_complete=self.is_complete,
            method=self.method,
            unavailable=tuple(row.name for row in self.shares if row.failure is not None),
        )
        return verdict_of(facts)

    def _largest_cause(self) -> CausePart | None:
        """Return the cause with the largest share; None if none takes away anything.

        It comes first.
        """
        for row in self.shares:
            if row.share:
                return CausePart(row.share, row.alone, row.last)
        return None

    def _places(self) -> tuple[LocatedPart, ...]:
        """Return what was left out on both sides, as the verdict takes it."""
        causes = {row.name for row in self.shares}
        return tuple(
            # A feature that is a cause is on on one side, and off on the other.
            LocatedPart(place.share, place.is_still, is_switch=place.name in causes)
            for place in self.found_in
        )


class InterruptedExplanation(KeyboardInterrupt):
    """A Ctrl-C ended a search for causes: `result` is what was known by then.

    Attributes:
        result: The explanation, which is not complete.
    """

    def __init__(self, result: Explanation) -> None:
        """Keep what is known."""
        super().__init__("the search for causes was interrupted: result has what is known")
        self.result = result
