"""The kinds of quantities that two runs are compared by: units, words, tolerances."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from ..errors import BadInputError, UnsupportedError, check_name
from ..interface import DERIVED, Array, Contacts, Data, Ints, Model
from ..typed_numbers import typed_float
from .text import few, grouped, milliseconds, rounded

# A 12-bit encoder, as in the SO-101's servos (Feetech STS3215).
COUNT = 2 * np.pi / 4096
_COUNT_SAYS = "1/4096 turn, one count of a 12-bit encoder as small servos have"
_LEVER = 0.065  # m; what is shorter moves by less than 0.1 mm with one count
_ENERGY = 0.01  # of what the energy changes by in the run
_FORCE = 0.05  # of its mean while it acts


@dataclass(frozen=True)
class Quantity:
    """A kind of quantity.

    Attributes:
        name: As in an Agreement and in `--tolerance`.
        unit: SI unit.
        plural: What several of the kind are called.
        moves: Whether it says where something is.
        own: Whether it is a coordinate of its own, and nothing that follows from others.
        tolerance: A difference that does not matter [unit]; None: `tolerance_of` says it of a run.
        reason: Why that much.
    """

    name: str
    unit: str
    plural: str
    moves: bool = False
    own: bool = False
    tolerance: float | None = None
    reason: str = ""


_KINDS = (
    Quantity(
        "joint",
        "rad",
        "joints",
        moves=True,
        own=True,
        tolerance=COUNT,
        reason=_COUNT_SAYS,
    ),
    Quantity(
        "slide",
        "m",
        "slides",
        moves=True,
        own=True,
        tolerance=1e-4,
        reason="a tenth of a millimetre",
    ),
    Quantity("tip", "m", "sites", moves=True),
    Quantity(
        "tip rotation",
        "rad",
        "rotation of sites",
        moves=True,
        tolerance=COUNT,
        reason=_COUNT_SAYS,
    ),
    Quantity(
        "body",
        "m",
        "free bodies",
        moves=True,
        own=True,
        tolerance=1e-3,
        reason="a millimetre: chosen for bodies of centimetres (--tolerance body=5mm for larger "
        "ones)",
    ),
    Quantity(
        "body rotation",
        "rad",
        "rotation of free bodies",
        moves=True,
        own=True,
        tolerance=np.radians(1.0),
        reason="a degree: it moves what is 57 mm from the origin by 1 mm",
    ),
    Quantity("energy", "J", "energy"),
    Quantity("contact", "s", "first touches"),
    Quantity("force", "N", "normal forces"),
)
QUANTITIES = {quantity.name: quantity for quantity in _KINDS}


@dataclass(frozen=True)
class Tolerance:
    """A difference that does not matter: how much [SI], and the reason."""

    value: float
    reason: str


def tolerance_of(
    kind: str, left: Array, right: Array, reach: float, timestep: float,
    given: Mapping[str, float] | None = None,
) -> Tolerance:  # fmt: skip
    """The tolerance of a quantity in two runs.

    Args:
        kind: Which of `QUANTITIES`.
        left: Its values (n,) in one run; right: in the other. Of energies and forces they count.
        right: See left.
        reach: How far a fingertip gets from the foot of its arm [m].
        timestep: The longer of the two [s].
        given: Values by kind that win over ours [SI].
    """
    # A site that has hardly a lever arm goes where its foot goes, as a slide does.
    known = QUANTITIES["slide" if kind == "tip" and reach < _LEVER else kind]
    if given and kind in given:
        return Tolerance(given[kind], "as given")
    if known.tolerance is not None:
        return Tolerance(known.tolerance, known.reason)
    if kind == "tip":
        return Tolerance(
            COUNT * reach,
            f"what one count of a 12-bit encoder moves it, at a reach of {reach:.2f} m",
        )
    if kind == "energy":
        change = max(_change(left), _change(right))
        return Tolerance(
            max(_ENERGY * change, 1e-9),
            f"1 % of {rounded(change, 'J')}, by which the energy changes in the run",
        )
    if kind == "force":
        # Not of its peak: that of an impact is its impulse over the timestep, whatever that is.
        acting = max(_mean_acting(left), _mean_acting(right))
        return Tolerance(
            max(_FORCE * acting, 1e-6),
            "5 % of the mean force while they touch",
        )
    return Tolerance(
        timestep * (1 + 1e-9),
        f"one timestep, {milliseconds(timestep, 3)}: an engine looks at contacts once in a step",
    )


def _change(energies: Array) -> float:
    """Return the difference between the largest and the smallest finite energy (n,) [J]."""
    finite = energies[np.isfinite(energies)]
    return float(np.ptp(finite)) if len(finite) else 0.0


def _mean_acting(forces: Array) -> float:
    """Return the mean of forces (n,) [N] where there is one."""
    acting = forces[forces > 0]
    return float(acting.mean()) if len(acting) else 0.0


# What a size is given in: the suffix, its size in SI, and the SI unit.
_DEGREE = np.pi / 180
_SUFFIXES = (
    ("deg", _DEGREE, "rad"),
    ("rad", 1.0, "rad"),
    ("mm", 1e-3, "m"),
    ("cm", 1e-2, "m"),
    ("ms", 1e-3, "s"),
    ("mJ", 1e-3, "J"),
    ("m", 1.0, "m"),
    ("s", 1.0, "s"),
    ("J", 1.0, "J"),
    ("N", 1.0, "N"),
)


def amount(text: str) -> tuple[float, str]:
    """A size above zero [SI] and its SI unit, of words like "0.5deg"; NaN for other words."""
    for suffix, factor, unit in _SUFFIXES:
        if text.endswith(suffix):
            try:
                value = typed_float(text.removesuffix(suffix)) * factor
            except ValueError:
                break
            return (value if 0 < value < np.inf else np.nan), unit
    return np.nan, ""


def parse_tolerances(words: Iterable[str]) -> dict[str, float]:
    """Tolerances [SI] by kind, from words like "joint=0.5deg", "tip=2mm", "energy=0.01J".

    Raises:
        BadInputError: A word is invalid.
        UnknownNameError: There is no such kind of quantity.
    """
    tolerances = {}
    for word in words:
        kind, _, text = word.partition("=")
        kind = kind.replace("-", " ")
        check_name("kind of quantity", kind, QUANTITIES)
        value, unit = amount(text)
        if unit != QUANTITIES[kind].unit or np.isnan(value):
            units = [suffix for suffix, _, of in _SUFFIXES if of == QUANTITIES[kind].unit]
            raise BadInputError(
                f"{kind} is measured in {', '.join(units)}: a tolerance reads like joint=0.5deg or "
                f"tip=2mm; got {word!r}"
            )
        tolerances[kind] = value
    return tolerances


Readings = Mapping[str, "Array | Contacts"]


def readings(data: Data, copied: bool = False) -> dict[str, Array | Contacts]:
    """Everything derived that the backend of a Data yields: arrays by name, and "contacts".

    Args:
        data: Read, and not touched.
        copied: Whether the arrays stay as they are when the Data goes on.
    """
    derived: dict[str, Array | Contacts] = {}
    for name in DERIVED:
        with suppress(UnsupportedError):
            array = getattr(data, name)
            derived[name] = np.array(array) if copied else array
    derived["contacts"] = data.contacts
    return derived


# What a contact is called: "gripper on floor", the same in every room.

_T = TypeVar("_T")
_LISTED = 8  # pairs in a sentence
_DEEP = 1e-3  # m; what rests on a floor sinks in by less


class ContactNames:
    """Names for the contacts of one model.

    A contact is between two bodies: the one that has more bodies between itself and the world
    comes first; of two with as many, that with the larger id. What is fixed to the world has
    the name of its geom. So a robot is on what it touches, and everything is on the floor.
    """

    def __init__(
        self,
        bodies: Sequence[str],
        geoms: Sequence[str],
        geom_bodyid: Sequence[int],
        body_parentid: Sequence[int],
    ) -> None:
        """Of names by id, "" for none; the body of each geom, and the parent of each body."""
        self._bodies = [name or f"body {k}" for k, name in enumerate(bodies)]
        self._geoms = list(geoms)
        self._body_of = [int(body) for body in geom_bodyid]
        self._parents = [int(parent) for parent in body_parentid]
        self._pairs: dict[tuple[int, int], tuple[str, str]] = {}

    @classmethod
    def of(cls, model: Model) -> ContactNames:
        """The names of a Model, made once."""
        if model not in _OF:
            _OF[model] = cls(
                model.body_names,
                model.geom_names,
                model.geom_bodyid.tolist(),
                model.body_parentid.tolist(),
            )
        return _OF[model]

    def pair(self, left: int, right: int) -> str:
        """The bodies of two geoms that touch: "gripper on floor"."""
        return self._names(left, right)[0]

    def geoms(self, left: int, right: int) -> str:
        """The same, and which of a body's geoms it is: "gripper on floor (fixed_stud_1)"."""
        return self._names(left, right)[1]

    def _names(self, left: int, right: int) -> tuple[str, str]:
        """Both, worked out once: a contact lasts for many steps."""
        if (left, right) not in self._pairs:
            upper, lower = sorted((left, right), key=self._distance, reverse=True)
            pair = f"{self._owner(upper)} on {self._owner(lower)}"
            shapes = [
                self._geoms[geom]
                for geom in (upper, lower)
                if self._geoms[geom] not in ("", self._owner(geom))
            ]
            with_shapes = f"{pair} ({' on '.join(shapes)})" if shapes else pair
            self._pairs[left, right] = pair, with_shapes
        return self._pairs[left, right]

    def _owner(self, geom: int) -> str:
        """Return the body of a geom; the geom itself where that is fixed to the world."""
        body = self._body_of[geom]
        if body == 0 and self._geoms[geom]:
            return self._geoms[geom]
        return self._bodies[body]

    def _distance(self, geom: int) -> tuple[int, int]:
        """Return how many bodies are between a geom and the world, and the number of its own."""
        body = above = self._body_of[geom]
        for count in range(len(self._parents)):
            if not above:
                return count, body
            above = self._parents[above]
        return len(self._parents), body  # a file may say that a body hangs on itself


_OF: WeakKeyDictionary[Model, ContactNames] = WeakKeyDictionary()


def together(contacts: Iterable[str]) -> str:
    """Contacts in a list, the geoms of one pair of bodies behind it: "a on b (c, d), e on f"."""
    parts = (contact.partition(" (") for contact in contacts)
    geoms = grouped((pair, shapes.removesuffix(")")) for pair, _, shapes in parts)
    pairs = []
    for pair, shapes in geoms.items():
        named = [shape for shape in shapes if shape]
        pairs.append(f"{pair} ({', '.join(named)})" if named else pair)
    return few(pairs, _LISTED)


def overlaps(names: ContactNames, geoms: Ints, distances: Array) -> list[str]:
    """Shapes inside each other by more than 1 mm, the deepest first: "gripper on box by 151 mm".

    Args:
        names: What contacts are called.
        geoms: (n, 2) of each contact; negative where it is of no geom, which is left out.
        distances: (n,) [m], negative where shapes overlap.
    """
    nearest: dict[str, float] = {}
    for pair, distance in zip(geoms.tolist(), distances.tolist(), strict=True):
        if distance < -_DEEP and min(pair) >= 0:
            name = names.pair(*pair)
            nearest[name] = min(distance, nearest.get(name, 0.0))
    deepest = sorted(nearest.items(), key=lambda item: item[1])
    return [f"{pair} by {rounded(-distance, 'm')}" for pair, distance in deepest]


def same_pairs(left: Mapping[str, _T], right: Mapping[str, _T]) -> dict[str, _T]:
    """What `right` has by pair of bodies, the pairs called as in `left`.

    Two models may number the same bodies in another order.
    """
    renamed = {}
    for pair, value in right.items():
        turned = " on ".join(reversed(pair.split(" on ")))
        renamed[turned if turned in left and pair not in left else pair] = value
    return renamed
