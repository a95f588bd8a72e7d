"""What is found of a model, as records of plain values: they cross processes and fill tables."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from ...engines import ROOMS, raw_engine_of
from ...installed import DEFAULT
from ...show.blocks import only_on_pages

TOLERANCE = 1e-6  # of a gap without contacts [rad or m]
PLACES = 1e-9  # of a gap to the witness [m]
_FAR = 10.0  # times as far as the first engine moves anything
_ONE_RUN = 3.0  # one run tells a chaos floor to about a factor
_STILL = 0.3  # [rad or m]: what moves less than this may be pushed about by a contact
_FIRST_ORDER = 1.5  # by how much a gap shrinks at least with half the timestep
RUNS = "runs"
NOT_READ = "not read"  # of a file

Loading = Literal["with contacts", "without contacts", "never"]
Exactness = Literal["ended", "refused", "differs", "exact", "not asked"]
GapOutcome = Literal["explodes", "stops", "rounding", "vanishes", "measured"]
ComparisonOutcome = GapOutcome | Literal["refused", "not compared", "still"]


@dataclass(frozen=True)
class ModelFile:
    """A file of a model that is to be examined.

    Attributes:
        name: What it is called in the table.
        path: Where it is, from the root of the file system.
        sha256: Digest of it and of what it includes; "" where it cannot be read.
        part_of: The first file found that includes it; "" for none.
    """

    name: str
    path: Path
    sha256: str
    part_of: str


@dataclass(frozen=True)
class RunGap:
    """The distance between two engines over a run under the same commands.

    Attributes:
        steps: How many steps were compared.
        hinge: The largest difference of a hinge [rad]; None where the model has none.
        slide: That of a slide [m].
        position: That of a coordinate of a free body's origin [m].
        turn: That of the orientation of a free body or ball joint [rad].
        moved: How far the first engine moved any of them [rad or m].
        fastest: The largest velocity on the other engine [rad/s or m/s].
        ended: Why a side ended early; "" if none did.
        shrinks: The gap divided by that at half the timestep; None where not measured.
        floor: How far the two engines are at most from their own runs when start and commands are
            changed by rounding [rad or m]; None where not measured.
    """

    steps: int
    hinge: float | None = None
    slide: float | None = None
    position: float | None = None
    turn: float | None = None
    moved: float = 0.0
    fastest: float = 0.0
    ended: str = ""
    shrinks: float | None = None
    floor: float | None = None

    @property
    def largest(self) -> float:
        """Return the largest of them, in SI units; 0 where there is none."""
        return max((self.hinge or 0.0, self.slide or 0.0, self.position or 0.0, self.turn or 0.0))

    @property
    def is_rounding(self) -> bool:
        """Tell whether rounding alone makes about as much: nothing is known of the engines then."""
        return self.floor is not None and self.largest <= _ONE_RUN * self.floor

    @property
    def explodes(self) -> bool:
        """Tell whether the other engine went far beyond where the first one went."""
        return self.largest > _FAR * max(self.moved, _STILL)

    @property
    def first_order(self) -> bool:
        """Tell whether it vanishes with the timestep, as that of two integrators does."""
        return self.shrinks is not None and self.shrinks >= _FIRST_ORDER

    @property
    @only_on_pages
    def outcome(self) -> GapOutcome:
        """Return the first of these that holds; "measured" where the size says it all."""
        if self.explodes:
            return "explodes"
        if self.ended:
            return "stops"
        if self.is_rounding:
            return "rounding"
        if self.first_order:
            return "vanishes"
        return "measured"


@dataclass(frozen=True)
class BackendRow:
    """The behaviour of a model on one backend.

    Attributes:
        refusal: Why it does not load; "" if it does.
        refusal_without: The same with contacts off.
        features: What of the model is refused, each in a few words.
        warnings: What was told when it was loaded, and the default backend did not tell.
        warnings_without: The same with contacts off.
        equals_engine: Whether a run has the bits of the engine without us; None if not
            asked, and where the engine alone cannot open the file.
        restores: Whether two futures of one State are the same bits, and, where the backend
            promises it, those of the run itself; None if not asked.
        without_contacts: Gap to the default backend where nothing touches anything.
        with_contacts: The same with contacts.
        scenarios: By name: "runs", or why it does not.
        cost: Time of a step over that of the engine without us, on this machine.
    """

    refusal: str = ""
    refusal_without: str = ""
    features: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    warnings_without: tuple[str, ...] = ()
    equals_engine: bool | None = None
    restores: bool | None = None
    without_contacts: RunGap | None = None
    with_contacts: RunGap | None = None
    scenarios: dict[str, str] = field(default_factory=dict)
    cost: float | None = None

    @property
    def loads(self) -> bool:
        """Tell whether it loads with contacts."""
        return not self.refusal

    @property
    @only_on_pages
    def loading(self) -> Loading:
        """Return with what it loads."""
        if self.loads:
            return "with contacts"
        if not self.refusal_without:
            return "without contacts"
        return "never"

    @property
    def unexplained(self) -> bool:
        """Tell whether the gap without contacts is one that nothing accounts for.

        What accounts for it: a warning at load that names a difference, or that the gap
        vanishes with the timestep, or that it is rounding.
        """
        gap = self.without_contacts
        if gap is None:
            return False
        if gap.ended:
            return True
        is_accounted_for = gap.first_order or gap.is_rounding or bool(self.warnings_without)
        return gap.largest > TOLERANCE and not is_accounted_for

    def gap(self, contacts: bool) -> RunGap | None:
        """Return the gap to the default backend, with contacts or without; None if not compared."""
        return self.with_contacts if contacts else self.without_contacts


@dataclass(frozen=True)
class WitnessRow:
    """The answer of the witness.

    Attributes:
        grade: "own reading" or "same reading"; "" where it refuses.
        refusal: Why; of a same reading, why it has none of its own.
        frames: How many bodies or sites were compared.
        gap: The largest distance between the engine's and its own [m].
    """

    grade: str = ""
    refusal: str = ""
    frames: int = 0
    gap: float | None = None

    @property
    @only_on_pages
    def refuses(self) -> bool:
        """Tell whether it compares nothing."""
        return self.gap is None

    @property
    @only_on_pages
    def has_no_own_reading(self) -> bool:
        """Tell whether it compares, and says why it does so without a reading of its own."""
        return self.gap is not None and bool(self.refusal)


@dataclass(frozen=True)
class ExaminedModel:
    """A model, and all that was found of it.

    Attributes:
        file: What it is called in the table.
        sha256: Digest of the file and of what it includes.
        made_with: Versions and settings.
        limit: Time that it had [s].
        took: Time that it took [s].
        part_of: The file that includes it; "" for none.
        ended: Why the examination did not come to its end; "" if it did.
        faults: Errors that nobody meant to raise, and in which part of the examination.
        nq, nv, nu, nbody, ngeom: Sizes; None where the default backend cannot read it.
        backends: What was found on each backend that is here.
        witness: What the witness says; None where it is not here.
        inside: What is inside each other at the start, as `measures.overlaps` has it.
    """

    file: str
    sha256: str
    made_with: str
    limit: float = 0.0
    took: float = 0.0
    part_of: str = ""
    ended: str = ""
    faults: tuple[str, ...] = ()
    nq: int | None = None
    nv: int | None = None
    nu: int | None = None
    nbody: int | None = None
    ngeom: int | None = None
    backends: dict[str, BackendRow] = field(default_factory=dict)
    witness: WitnessRow | None = None
    inside: tuple[str, ...] = ()

    @property
    def is_model(self) -> bool:
        """Tell whether it is a model by itself: a part of another file must load, and move."""
        return not self.part_of or bool(self.nv)

    @property
    @only_on_pages
    def ran_experiments(self) -> bool:
        """Tell whether an experiment was tried on a backend."""
        return any(backend.scenarios for backend in self.backends.values())

    def exactness(self, default: str) -> Exactness:
        """Return whether all that has to be the same bits is.

        Args:
            default: The backend that the others are compared with.
        """
        if self.ended:
            return "ended"
        if default not in self.backends or self.backends[default].loading == "never":
            return "refused"
        answers: list[bool | None] = []
        for backend in self.backends.values():
            answers += [backend.equals_engine, backend.restores]
        if False in answers:
            return "differs"
        return "exact" if True in answers else "not asked"

    def comparison(self, backend: str, contacts: bool) -> ComparisonOutcome:
        """Return what became of the comparison of a backend with the default one."""
        if backend not in self.backends:
            return "not compared"
        row = self.backends[backend]
        gap = row.gap(contacts)
        if gap is None:
            refusal = row.refusal if contacts else row.refusal_without
            return "refused" if refusal else "not compared"
        return gap.outcome if self.nv else "still"

    def wrong(self, default: str) -> tuple[str, ...]:
        """Return what must not be, in short sentences.

        Args:
            default: The backend that the others are compared with.
        """
        said = [self.ended] if self.ended else []
        said += self.faults
        for name, row in self.backends.items():
            if row.equals_engine is False:
                said.append(f"{name}: not the bits of the engine without us")
            if row.restores is False:
                said.append(f"{name}: two restores of one State part")
            if name == default or is_as_it_comes(name):
                continue
            if row.unexplained:
                said.append(f"{name}: {_gap_words(row.without_contacts)}")
            gap = row.with_contacts
            if gap is not None and gap.explodes:
                said.append(f"{name}: it explodes with contacts, to {gap.largest:.0e} rad or m")
        witness = self.witness
        if witness is not None and witness.gap is not None and not witness.gap <= PLACES:
            said.append(f"the witness places a frame {witness.gap:.1e} m elsewhere")
        return tuple(said)


def is_as_it_comes(backend: str) -> bool:
    """Tell whether a backend computes nothing itself: a gap or an explosion is its engine's then.

    The others are held against the default one. Of a backend of another package it is not known.
    """
    return backend in ROOMS and backend != DEFAULT and not raw_engine_of(backend).emulated


def _gap_words(gap: RunGap | None) -> str:
    assert gap is not None
    if gap.ended:
        return f"without contacts, {gap.ended}"
    return f"a gap of {gap.largest:.1e} without contacts that nothing accounts for"
