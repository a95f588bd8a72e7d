"""What a sweep varies, as it is typed, and its points: every combination, times samples.

"timestep=0.001,0.005" is a list, "mass=0.8x:1.2x:5" a grid, "frictionloss=0:0.1" a range.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
import warnings
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ...errors import BadInputError, shown
from ...installed import require_extra
from ...interface import Array, JointType
from ...typed_numbers import typed_float

Kind = Literal["model", "option", "state", "parameter"]
Value = bool | float | str

STATES = ("qpos", "qvel")
MODEL = "model"
# What an option or a start is in, of a hinge and of a slide.
UNITS = {
    "timestep": ("s", "s"),
    "latency": ("s", "s"),
    "gravity": ("m/s²", "m/s²"),
    "mass": ("kg", "kg"),
    "qpos": ("rad", "m"),
    "qvel": ("rad/s", "m/s"),
    "max_qvel": ("rad/s", "m/s"),
    "armature": ("kg·m²", "kg"),
    "damping": ("N·m·s/rad", "N·s/m"),
    "frictionloss": ("N·m", "N"),
    "kp": ("N·m/rad", "N/m"),
    "kv": ("N·m·s/rad", "N·s/m"),
}
_MEANINGS: dict[Kind, str] = {
    "model": "the model, by its name or file",
    "option": "{} of the model",
    "state": "{} where the run starts",
    "parameter": "{}, a keyword argument of the function",
}
_MULTIPLE_OF_MODEL = "{} as a multiple of the model's own value: 0.5 is half of it"
_NAME = re.compile(r"([A-Za-z_]\w*)(?:\[([^\[\]]+)\])?")
_DOTTED = re.compile(r"([A-Za-z_]\w*)\.(\S+)")
_RANGE = re.compile(r"([^:]*):([^:]*)(?::([0-9]+))?")
_SWITCHES = {"on": True, "off": False, "true": True, "false": False}
_DIGEST_DIGITS = 32  # hexadecimal, of a digest
_MAX_DIMENSIONS = 21201  # that SciPy has Sobol directions for
_MULTIPLE_SIGNS = ("x", "×")  # behind a number: times the model's own value
_MAX_VALUES = 10**6  # values of one factor
_GRID_DIGITS = 12  # of the values of a grid, so that 0.6 is not 0.6000000000000001


@dataclass(frozen=True)
class Vary:
    """One thing that a sweep varies.

    Attributes:
        name: As typed, without the place: "damping", "qpos", "model", "gain".
        place: What of it: "elbow_flex" of qpos[elbow_flex]; "" for all.
        kind: Whether it is a variant of the model, an option of `Model.replace`, a coordinate
            of the start, or a parameter of the user's function.
        values: Those of a list or a grid; empty where it is sampled.
        bounds: Between which it is sampled; None for a list or a grid.
        times: Whether the numbers are times the model's own value.
    """

    name: str
    place: str = ""
    kind: Kind = "option"
    values: tuple[Value, ...] = ()
    bounds: tuple[float, float] | None = None
    times: bool = False

    @property
    def label(self) -> str:
        """Name and place: "qpos[elbow_flex]"."""
        return f"{self.name}[{self.place}]" if self.place else self.name

    @property
    def column(self) -> str:
        """Return the name of its column in the dataset."""
        return f"vary.{self.label}"

    def unit_on(self, joints: Collection[int] = (JointType.HINGE, JointType.SLIDE)) -> str:
        """Return its unit on joints of some `JointType`s; "" of what is no number or has none."""
        if self.times or self.kind == "parameter" or self.name not in UNITS:
            return ""
        hinge, slide = UNITS[self.name]
        if hinge == slide or JointType.SLIDE not in joints:
            return hinge
        return f"{hinge} or {slide}" if JointType.HINGE in joints else slide

    @property
    def type(self) -> str:
        """Return the type of its column: "double", "bool" or "string"."""
        if self.numeric:
            return "double"
        return "bool" if isinstance(self.values[0], bool) else "string"

    @property
    def meaning(self) -> str:
        """Return the description of its column."""
        return (_MULTIPLE_OF_MODEL if self.times else _MEANINGS[self.kind]).format(self.label)

    @property
    def numeric(self) -> bool:
        """Tell whether its values are numbers."""
        return self.bounds is not None or is_number(self.values[0])

    @property
    def extremes(self) -> tuple[Value, ...]:
        """Return the values that a check has to look at."""
        return self.values if self.bounds is None else self.bounds


def is_number(value: object) -> bool:
    """Tell whether a value is a number, and no switch."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def parse_vary(words: Iterable[str]) -> tuple[Vary, ...]:
    """Read words NAME=a,b,c, NAME=lo:hi:count and NAME=lo:hi; `resolve_kinds` says what they vary.

    Args:
        words: As typed behind `--vary`.

    Raises:
        BadInputError: A word is invalid, or two of them vary the same.
    """
    factors = tuple(map(_parse_word, words))
    labels = [vary.label for vary in factors]
    for vary in factors:
        if labels.count(vary.label) > 1:
            raise BadInputError(f"{vary.label} is varied twice")
        if vary.place and vary.name in labels:
            raise BadInputError(f"{vary.name} and {vary.label} are both varied: name one of them")
    return factors


def _parse_word(word: str) -> Vary:
    label, sign, text = word.partition("=")
    match = _NAME.fullmatch(label.strip())
    dotted = _DOTTED.fullmatch(label.strip())
    if sign and dotted:
        raise BadInputError(
            f"{label.strip()}: the name of an element stands in brackets, as in --vary "
            f"'{dotted[1]}[{dotted[2]}]={text}'"
        )
    if not (sign and match):
        raise BadInputError(
            "--vary wants NAME=a,b,c, NAME=from:to:count or, with --samples, NAME=from:to; got "
            f"{shown(word)}"
        )
    name, place = match[1], match[2] or ""
    if name == MODEL or ":" not in text:
        values, times = _parse_values(label, text.split(","), name == MODEL)
        return Vary(name, place, values=values, times=times)
    low, high, count, times = math.nan, math.nan, None, False
    if match := _RANGE.fullmatch(text):
        ends, times = _parse_values(label, [match[1], match[2]])
        low, high = (float(end) if is_number(end) else math.nan for end in ends)
        count = int(match[3]) if match[3] else None
    if not low < high or (count is not None and not 2 <= count <= _MAX_VALUES):
        raise BadInputError(
            f"{label}={text} wants from:to or from:to:count, two numbers, the smaller number "
            f"first, with a count from 2 to {_MAX_VALUES:,}"
        )
    if count is None:
        return Vary(name, place, bounds=(low, high), times=times)
    grid = np.linspace(low, high, count)
    values = tuple(float(f"{x:.{_GRID_DIGITS}g}") for x in grid)
    return Vary(name, place, values=values, times=times)


def _parse_values(
    label: str, words: Sequence[str], names: bool = False
) -> tuple[tuple[Value, ...], bool]:
    """Return the values of words, and whether they are times the model's own."""
    words = [word.strip() for word in words]
    if "" in words:
        raise BadInputError(f"--vary {label} has an empty value")
    pairs = [(word, False) if names else _parse_value(word) for word in words]
    values = tuple(value for value, _ in pairs)
    kinds = {(type(value), times) for value, times in pairs}
    if len(kinds) > 1:
        raise BadInputError(
            f"{label} mixes values of different kinds: {', '.join(words)}; numbers, numbers with "
            "an x behind (times the model's own), on and off, or names"
        )
    if len(set(values)) < len(values):
        raise BadInputError(f"{label} has a value twice: {', '.join(words)}")
    return values, pairs[0][1]


def _parse_value(word: str) -> tuple[Value, bool]:
    if word.lower() in _SWITCHES:
        return _SWITCHES[word.lower()], False
    times = word.endswith(_MULTIPLE_SIGNS)
    try:
        number = typed_float(word[:-1] if times else word)
    except ValueError:
        return word, False
    if not math.isfinite(number):
        raise BadInputError(f"{word} is not a finite number")
    return number + 0.0, times  # no negative zero


@dataclass(frozen=True)
class DesignPoint:
    """One combination of values of what a sweep varies.

    Attributes:
        id: A digest of the values.
        values: One for each `Vary`, in their order.
    """

    id: str
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Design:
    """The points of a sweep.

    Attributes:
        factors: What is varied; none for the experiment as it is.
        samples: How many points of the ranges are drawn.
        seed: Of the scrambling of the Sobol sequence.
    """

    factors: tuple[Vary, ...] = ()
    samples: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        ranges = [vary.label for vary in self.sampled]
        if ranges and not self.samples:
            raise BadInputError(f"{ranges[0]} has a range: say --samples N, or a count behind it")
        if self.samples and not ranges:
            raise BadInputError("--samples is of ranges, NAME=from:to, and none is varied")
        if len(ranges) > _MAX_DIMENSIONS:
            raise BadInputError(f"{len(ranges)} ranges are more than can be sampled")

    @property
    def sampled(self) -> tuple[Vary, ...]:
        """Return the factors with a range."""
        return tuple(vary for vary in self.factors if vary.bounds is not None)

    @property
    def listed(self) -> tuple[Vary, ...]:
        """Return the factors with a list or a grid."""
        return tuple(vary for vary in self.factors if vary.bounds is None)

    @property
    def size(self) -> int:
        """Return the number of points; it may be too large for `len`."""
        count = self.samples if self.sampled else 1
        return count * math.prod(len(vary.values) for vary in self.listed)

    def points(self) -> Iterator[DesignPoint]:
        """Yield every point; the samples change slowest."""
        names = [vary.label for vary in self.factors]
        for sample in self.sample_values().tolist():
            drawn = iter(sample)
            choices = [vary.values or (next(drawn),) for vary in self.factors]
            for values in itertools.product(*choices):
                settings = dict(zip(names, values, strict=True))
                yield DesignPoint(digest(settings), values)

    def sample_values(self) -> Array:
        """Return the values (n, r) of n samples of the r ranges; (1, 0) where there is no range."""
        if not self.sampled:
            return np.empty((1, 0))
        low, high = np.array([vary.bounds for vary in self.sampled]).T
        return low + (high - low) * _sobol(len(self.sampled), self.samples, self.seed)


def _sobol(width: int, count: int, seed: int) -> Array:
    """Return (count, width) points in the unit cube, of a scrambled Sobol sequence."""
    engine = require_qmc().Sobol(width, scramble=True, rng=np.random.default_rng(seed))
    with warnings.catch_warnings():  # of a number that is not a power of two: said when it is asked
        warnings.simplefilter("ignore")
        return engine.random(count)


def require_qmc() -> Any:
    """Return SciPy's module of quasi-Monte-Carlo designs.

    Raises:
        MissingEngineError: SciPy is not installed; the message names the extra.
    """
    return require_extra("scipy.stats.qmc", "sampling a range", "SciPy", "sweep")


def digest(content: object) -> str:
    """Return the digest of plain values; 1 and 1.0 are the same."""
    plain = json.loads(json.dumps(content, allow_nan=False), parse_int=float)
    text = json.dumps(plain, sort_keys=True, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_DIGITS]
