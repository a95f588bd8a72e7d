"""What of a gap the import of the files made, what joint dynamics, and what contact.

Import is the gap on one engine, the installed MuJoCo: as it runs the figures that either side's
import read. Joint dynamics is the gap between the engines with the same figures, where nothing
touches: those of the side that does not run on the installed MuJoCo, or where neither does those of
the left. Contact is the rest. So the three add up to the gap, and none of them is clipped: without
contact two sides may be farther apart than with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ...installed import DEFAULT
from ...interface import Model
from ..runs.provenance import model_digest
from .causes import Cause
from .explained_gap import ExplainedGap
from .gap import size_of
from .imported import are_compiled_as_read, have_same_options, reader_of
from .request import is_one_engine
from .settings import CONTACT, TITLES
from .setup import RunKey
from .trials import Trials

PartName = Literal["import", "joint dynamics", "contact"]
SideName = Literal["left", "right"]
Obstacle = Literal["", "start or commands", "not run", "contacts", "figures"]

_OF_NO_FILE = ("run", "engine")  # kinds of causes


@dataclass(frozen=True)
class SplitPart:
    """A part of a gap by where it arises.

    Attributes:
        name: "import": what reading the files made; "joint dynamics": what servo, friction and
            integration make without contact; "contact": the rest.
        share: The part of the gap; None where it cannot be separated.
    """

    name: PartName
    share: float | None


@dataclass(frozen=True)
class GapSplit:
    """A gap, divided by where it arises.

    Attributes:
        readers: What read the file of each side, with its version: "mujoco 4.0.0".
        reads_alike: Whether there is nothing to separate, since one reader read one file for both
            sides, or two read the same figures.
        parts: Import, joint dynamics and contact. Where all shares are known they add up to 1.
        figures_of: The side whose figures both engines have where joint dynamics is measured; None
            where they have the same in any case, or where it cannot be separated.
        touches: Whether something touches in the runs as they come. Where nothing does, the part of
            contact is what import and joint dynamics make together.
        obstacle: Why a part cannot be separated; "" where all can.

            - "start or commands": the sides also differ in what is none of the three;
            - "not run": a run that it takes could not be made, or did not reach the end;
            - "contacts": contacts cannot be left out on a side;
            - "figures": the sides have other figures that cannot be made the same, and neither runs
              on the installed MuJoCo, which would run those of the other.
        detail: Of the obstacle: what differs, the reason of the run, or the engines; "" for none.
    """

    readers: tuple[str, str]
    reads_alike: bool
    parts: tuple[SplitPart, ...]
    figures_of: SideName | None = None
    touches: bool = True
    obstacle: Obstacle = ""
    detail: str = ""

    @property
    def together(self) -> float:
        """Return the part of the gap that cannot be separated."""
        known = [part.share for part in self.parts if part.share is not None]
        return 1.0 - sum(known) if len(known) < len(self.parts) else 0.0


@dataclass(frozen=True)
class _Route:
    """Between which runs the parts of a gap are measured.

    Attributes:
        imported: The two runs that differ by what was read; None where they read alike.
        moved: The two runs that differ by the engine; None where there are none with the same
            figures.
        figures_of: Whose these are; None where both sides have them as they come.
    """

    imported: tuple[RunKey, RunKey] | None
    moved: tuple[RunKey, RunKey] | None
    figures_of: SideName | None = None


def split_of(trials: Trials, gap: ExplainedGap, causes: tuple[Cause, ...]) -> GapSplit | None:
    """Divide a gap by where it arises; None where one engine runs one file on both sides.

    The gap is then of options or of what was edited, which the causes tell.

    Args:
        trials: The runs.
        gap: That is divided.
        causes: What the sides differ in.

    Raises:
        TimeIsUp: No time is left.
    """
    if is_one_engine(*trials.setup.models) and _have_one_file(*trials.setup.models):
        return None
    return _Splitting(trials, gap, causes).split()


class _Splitting:
    """The division of one gap."""

    def __init__(self, trials: Trials, gap: ExplainedGap, causes: tuple[Cause, ...]) -> None:
        self._trials, self._gap, self._causes = trials, gap, causes
        self._left, self._right = trials.setup.models
        self._readers = reader_of(self._left), reader_of(self._right)
        self._reads_alike = self._read_alike()
        self._obstacle: Obstacle = ""
        self._detail = ""
        self._figures_of: SideName | None = None

    def split(self) -> GapSplit:
        """Return the parts, as far as they can be separated."""
        imported, moved, contact = self._shares()
        touch = self._trials.touch(self._gap.quantity)
        return GapSplit(
            readers=self._readers,
            reads_alike=self._reads_alike,
            parts=(
                SplitPart("import", imported),
                SplitPart("joint dynamics", moved),
                SplitPart("contact", contact),
            ),
            figures_of=self._figures_of,
            touches=touch is not None,
            obstacle=self._obstacle,
            detail=self._detail,
        )

    def _shares(self) -> tuple[float | None, float | None, float | None]:
        """Return the shares of import, joint dynamics and contact."""
        others = [cause.name for cause in self._causes if cause.kind == "run"]
        if others:
            self._hinder("start or commands", ", ".join(others))
            return None, None, None
        if not self._reads_alike and self._differ_in_files_alone():
            return 1.0, 0.0, 0.0
        route = self._route()
        imported = 0.0
        if route.imported is not None:
            share = self._share(*route.imported)
            if share is None:
                return None, None, self._contact_of_all()
            imported = share
        if route.moved is None:
            self._hinder("figures", ", ".join(self._refused()))
            return imported, None, None
        moved = self._share_without_contact(*route.moved)
        if moved is None:
            return imported, None, None
        self._figures_of = route.figures_of
        return imported, moved, self._without_rounding(1.0 - imported - moved)

    def _contact_of_all(self) -> float | None:
        """Return the share of contact where import and joint dynamics are one part."""
        free = self._share_without_contact(RunKey(0), RunKey(1))
        return None if free is None else 1.0 - free

    def _read_alike(self) -> bool:
        """Tell whether both sides have the same figures of their files."""
        if self._readers[0] == self._readers[1] and _have_one_file(self._left, self._right):
            return True
        if not (are_compiled_as_read(self._left) and are_compiled_as_read(self._right)):
            return False
        return not any(map(_is_of_a_file, self._causes))

    def _differ_in_files_alone(self) -> bool:
        """Tell whether both sides compute the same, but for what was read."""
        left, right = self._left, self._right
        return is_one_engine(left, right) and have_same_options(left, right)

    def _route(self) -> _Route:
        """Return between which runs the parts are measured."""
        left, right = RunKey(0), RunKey(1)
        if self._reads_alike:
            return _Route(None, (left, right))
        of_left, of_right = RunKey(0, imported=True), RunKey(1, imported=True)
        if self._left.backend == DEFAULT:
            return _Route((left, of_right), (of_right, right), "right")
        if self._right.backend == DEFAULT:
            return _Route((of_left, right), (left, of_left), "left")
        if self._refused():
            return _Route((of_left, of_right), None)
        names = frozenset(cause.name for cause in self._causes if _is_of_a_file(cause))
        return _Route((of_left, of_right), self._trials.setup.runs_of(names), "left")

    def _refused(self) -> list[str]:
        """Return the names of what was read otherwise and cannot be made the same."""
        return [cause.name for cause in self._causes if cause.refused and _is_of_a_file(cause)]

    def _share_without_contact(self, one: RunKey, other: RunKey) -> float | None:
        """Return the gap between two runs in which nothing touches, as a part of the whole."""
        setup = self._trials.setup
        if setup.scenario.options.get("contacts") is False:
            return self._share(one, other)
        if not setup.can_be_without(CONTACT):
            backends = dict.fromkeys(model.backend for model in setup.models)
            self._hinder("contacts", " or ".join(backends))
            return None
        without = frozenset({CONTACT.name})
        return self._share(replace(one, without=without), replace(other, without=without))

    def _share(self, one: RunKey, other: RunKey) -> float | None:
        """Return the gap between two runs as a part of the whole; None if one could not be made."""
        between = self._trials.gap_between(one, other, self._gap.quantity)
        if between is None:
            self._hinder("not run", self._trials.ended)
            return None
        return self._without_rounding(size_of(between, self._gap.measure) / self._gap.size)

    def _without_rounding(self, share: float) -> float:
        """Return a share; 0 where it is no more than rounding makes of a run."""
        return share if abs(share) * self._gap.size > self._gap.negligible else 0.0

    def _hinder(self, obstacle: Obstacle, detail: str) -> None:
        """Keep why a part cannot be separated; the first reason counts."""
        if not self._obstacle:
            self._obstacle, self._detail = obstacle, detail


def _have_one_file(left: Model, right: Model) -> bool:
    """Tell whether two Models are of the same files, read with the same options."""
    digests = model_digest(left.path), model_digest(right.path)
    return digests[0] == digests[1] and left.read_options == right.read_options


def _is_of_a_file(cause: Cause) -> bool:
    """Tell whether a cause is of what was read, and acts on a motion."""
    if cause.only_read:
        return False
    return cause.kind not in _OF_NO_FILE or cause.name == TITLES["inertia"]
