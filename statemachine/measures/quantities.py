"""The kinds of quantities that two runs are compared by: units, words, tolerances."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ..errors import BadInputError, UnsupportedError, check_name
from ..interface import DERIVED, Array, Contacts, Data
from ..typed_numbers import typed_float
from .floors import RobotScale, energy_floor, force_floor
from .text import milliseconds, rounded

# A 12-bit encoder, as in the SO-101's servos (Feetech STS3215).
ENCODER_COUNT = 2 * np.pi / 4096
_ENCODER_COUNT_REASON = "1/4096 turn, one count of a 12-bit encoder as small servos have"
_MIN_LEVER_ARM = 0.065  # m; what is shorter moves by less than 0.1 mm with one count
_ENERGY_SHARE = 0.01  # of what the energy changes by in the run
_WORK_SHARE, _MIN_WORK = 0.01, 1e-3  # of the larger work; J, what is less is nothing
_FORCE_SHARE = 0.05  # of its mean while it acts
_DISTANCE_SHARE, _MIN_DISTANCE = (
    0.01,
    1e-3,
)  # of the distance that a base travels; m, what is less is nothing


@dataclass(frozen=True)
class Quantity:
    """A kind of quantity.

    Attributes:
        name: As in an Agreement and in `--tolerance`.
        unit: SI unit.
        plural: What several of the kind are called.
        moves: Whether it says where something is.
        is_coordinate: Whether it is a coordinate of its own, and nothing that follows from others.
        of_base: Whether it is a coordinate of the floating base of the robot.
        is_outcome: Whether it is one number of a whole run, without a curve over time.
        tolerance: A difference that does not matter [unit]; None: `tolerance_of` says it of a run.
        reason: Why that much.
    """

    name: str
    unit: str
    plural: str
    moves: bool = False
    is_coordinate: bool = False
    of_base: bool = False
    is_outcome: bool = False
    tolerance: float | None = None
    reason: str = ""


_KINDS = (
    Quantity(
        "joint",
        "rad",
        "joints",
        moves=True,
        is_coordinate=True,
        tolerance=ENCODER_COUNT,
        reason=_ENCODER_COUNT_REASON,
    ),
    Quantity(
        "slide",
        "m",
        "slides",
        moves=True,
        is_coordinate=True,
        tolerance=1e-4,
        reason="a tenth of a millimetre",
    ),
    Quantity("tip", "m", "sites", moves=True),
    Quantity(
        "tip rotation",
        "rad",
        "rotation of sites",
        moves=True,
        tolerance=ENCODER_COUNT,
        reason=_ENCODER_COUNT_REASON,
    ),
    Quantity(
        "body",
        "m",
        "free bodies",
        moves=True,
        is_coordinate=True,
        tolerance=1e-3,
        reason="a millimetre: chosen for bodies of centimetres (--tolerance body=5mm for larger "
        "ones)",
    ),
    Quantity(
        "body rotation",
        "rad",
        "rotation of free bodies",
        moves=True,
        is_coordinate=True,
        tolerance=np.radians(1.0),
        reason="a degree: it moves what is 57 mm from the origin by 1 mm",
    ),
    Quantity(
        "base",
        "m",
        "position of the base",
        moves=True,
        is_coordinate=True,
        of_base=True,
        tolerance=1e-3,
        reason="a millimetre",
    ),
    Quantity(
        "base rotation",
        "rad",
        "rotation of the base",
        moves=True,
        is_coordinate=True,
        of_base=True,
        tolerance=np.radians(0.1),
        reason="0.1°: it moves what is 0.57 m from the origin of the base by 1 mm",
    ),
    Quantity(
        "fall",
        "s",
        "falls",
        is_outcome=True,
        tolerance=0.02,
        reason="20 ms: one period of a controller at 50 Hz",
    ),
    Quantity("distance", "m", "distances travelled", is_outcome=True),
    Quantity(
        "forward speed",
        "m/s",
        "forward speeds",
        is_outcome=True,
        tolerance=0.01,
        reason="1 cm/s: what a tape on the floor and a stopwatch can tell",
    ),
    Quantity(
        "lateral way",
        "m",
        "lateral ways",
        is_outcome=True,
        tolerance=0.01,
        reason="a centimetre: what a tape on the floor can tell",
    ),
    Quantity("work", "J", "work of actuators", is_outcome=True),
    Quantity(
        "tracking",
        "rad",
        "tracking errors",
        is_outcome=True,
        tolerance=ENCODER_COUNT,
        reason=_ENCODER_COUNT_REASON,
    ),
    Quantity(
        "slide tracking",
        "m",
        "tracking errors of slides",
        is_outcome=True,
        tolerance=1e-4,
        reason="a tenth of a millimetre",
    ),
    Quantity("energy", "J", "energy"),
    Quantity("contact", "s", "first touches", is_outcome=True),
    Quantity("force", "N", "normal forces"),
)
QUANTITIES = {quantity.name: quantity for quantity in _KINDS}


@dataclass(frozen=True)
class Tolerance:
    """A difference that does not matter.

    Attributes:
        value: How much [SI].
        reason: Why that much.
    """

    value: float
    reason: str


def tolerance_of(
    kind: str,
    left: Array,
    right: Array,
    reach: float,
    timestep: float,
    given: Mapping[str, float] | None = None,
    scale: RobotScale | None = None,
) -> Tolerance:
    """Return the tolerance of a quantity in two runs.

    Args:
        kind: Which of `QUANTITIES`.
        left: (n,) its values in one run, which count for energies and forces.
        right: (n,) those in the other.
        reach: How far a fingertip gets from the foot of its arm [m].
        timestep: The longer of the two [s].
        given: Values by kind that win over ours [SI].
        scale: Of the robot, below whose floors no energy and no force differs; None where that is
            not known.
    """
    # A site that has hardly a lever arm goes where its foot goes, as a slide does.
    known = QUANTITIES["slide" if kind == "tip" and reach < _MIN_LEVER_ARM else kind]
    if given and kind in given:
        return Tolerance(given[kind], "as given")
    if known.tolerance is not None:
        return Tolerance(known.tolerance, known.reason)
    if kind == "tip":
        return Tolerance(
            ENCODER_COUNT * reach,
            f"what one count of a 12-bit encoder moves it, at a reach of {reach:.2f} m",
        )
    if kind == "distance":
        farthest = float(np.max([left, right], initial=0.0))
        share = _DISTANCE_SHARE * farthest
        if share >= _MIN_DISTANCE:
            return Tolerance(share, f"1 % of {rounded(farthest, 'm')}, which the base travels")
        return Tolerance(_MIN_DISTANCE, "a millimetre")
    if kind == "work":
        most = float(np.max([left, right], initial=0.0))
        if _WORK_SHARE * most < _MIN_WORK:
            return Tolerance(_MIN_WORK, "a millijoule")
        return Tolerance(_WORK_SHARE * most, f"1 % of {rounded(most, 'J')}, the larger work")
    if kind == "energy":
        return _energy_tolerance(max(_change(left), _change(right)), scale)
    if kind == "force":
        # Not of its peak: that of an impact is its impulse over the timestep, whatever that is.
        return _force_tolerance(max(_mean_acting(left), _mean_acting(right)), scale)
    return Tolerance(
        timestep * (1 + 1e-9),
        f"one timestep, {milliseconds(timestep, 3)}: an engine looks at contacts once in a step",
    )


def _energy_tolerance(change: float, scale: RobotScale | None) -> Tolerance:
    """Return the tolerance of an energy that changes by so much in a run [J]."""
    share = Tolerance(
        _ENERGY_SHARE * change,
        f"1 % of {rounded(change, 'J')}, by which the energy changes in the run",
    )
    return _at_least_floor(energy_floor(scale), share, "times its size", scale)


def _force_tolerance(acting: float, scale: RobotScale | None) -> Tolerance:
    """Return the tolerance of a normal force that is so much on average while it acts [N]."""
    share = Tolerance(_FORCE_SHARE * acting, "5 % of the mean force while they touch")
    return _at_least_floor(force_floor(scale), share, "", scale)


def _at_least_floor(
    floor: float, share: Tolerance, times: str, scale: RobotScale | None
) -> Tolerance:
    """Return a tolerance that is a share of a quantity, or the floor where that is higher.

    Args:
        floor: In the unit of the tolerance.
        share: The tolerance.
        times: What the weight is multiplied by in the floor, in words; "" for nothing.
        scale: The robot; None where its weight is not known.
    """
    if share.value >= floor:
        return share
    if scale is None:
        return Tolerance(floor, "rounding, whatever the robot weighs, which is not known")
    of = f"the robot's weight, {rounded(scale.weight, 'N')}"
    if times:
        of += f", {times}, {rounded(scale.size, 'm')}"
    return Tolerance(floor, f"a ten-millionth (2^-23) of {of}: less moves nothing")


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
    ("m/s", 1.0, "m/s"),  # before "s", which it ends in
    ("mm", 1e-3, "m"),
    ("cm", 1e-2, "m"),
    ("ms", 1e-3, "s"),
    ("mJ", 1e-3, "J"),
    ("m", 1.0, "m"),
    ("s", 1.0, "s"),
    ("J", 1.0, "J"),
    ("N", 1.0, "N"),
)


def parse_amount(text: str) -> tuple[float, str]:
    """Parse a size above zero like "0.5deg": value [SI] and SI unit; NaN for other words."""
    for suffix, factor, unit in _SUFFIXES:
        if text.endswith(suffix):
            try:
                value = typed_float(text.removesuffix(suffix)) * factor
            except ValueError:
                break
            return (value if 0 < value < np.inf else np.nan), unit
    return np.nan, ""


def parse_tolerances(words: Iterable[str]) -> dict[str, float]:
    """Parse tolerances like "joint=0.5deg", "tip=2mm", "energy=0.01J": [SI] by kind.

    Raises:
        BadInputError: A word is invalid.
        UnknownNameError: There is no such kind of quantity.
    """
    tolerances = {}
    for word in words:
        kind, _, text = word.partition("=")
        kind = kind.replace("-", " ")
        check_name("kind of quantity", kind, QUANTITIES)
        value, unit = parse_amount(text)
        if unit != QUANTITIES[kind].unit or np.isnan(value):
            units = [suffix for suffix, _, of in _SUFFIXES if of == QUANTITIES[kind].unit]
            raise BadInputError(
                f"{kind} is measured in {', '.join(units)}: a tolerance reads like joint=0.5deg or "
                f"tip=2mm; got {word!r}"
            )
        tolerances[kind] = value
    return tolerances


Readings = Mapping[str, "Array | Contacts"]


def derived_arrays(data: Data, copied: bool = False) -> dict[str, Array | Contacts]:
    """Return all derived arrays that the backend of a Data can compute, by name, and "contacts".

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
