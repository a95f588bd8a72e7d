"""What a sweep varies, as it is typed: "timestep=0.001,0.005", "mass=0.8x:1.2x:5"."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..errors import BadInputError, shown, unknown_name
from ..interface import JointType

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
_OWN = "{} as a multiple of the model's own value: 0.5 is half of it"
_NAME = re.compile(r"([A-Za-z_]\w*)(?:\[([^\[\]]+)\])?")
_SWITCHES = {"on": True, "off": False, "true": True, "false": False}
_TIMES = ("x", "×")  # behind a number: times the model's own value
_MOST = 10**6  # values of one factor
_DIGITS = 12  # of the values of a grid, so that 0.6 is not 0.6000000000000001


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
        """Its column in the dataset."""
        return f"vary.{self.label}"

    def unit_on(self, joints: Collection[int] = (JointType.HINGE, JointType.SLIDE)) -> str:
        """What it is in on joints of some `JointType`s; "" of what is no number or has none."""
        if self.times or self.kind == "parameter" or self.name not in UNITS:
            return ""
        hinge, slide = UNITS[self.name]
        if hinge == slide or JointType.SLIDE not in joints:
            return hinge
        return f"{hinge} or {slide}" if JointType.HINGE in joints else slide

    @property
    def type(self) -> str:
        """Of its column."""
        if self.numeric:
            return "double"
        return "bool" if isinstance(self.values[0], bool) else "string"

    @property
    def meaning(self) -> str:
        """What its column says."""
        return (_OWN if self.times else _MEANINGS[self.kind]).format(self.label)

    @property
    def numeric(self) -> bool:
        """Whether its values are numbers."""
        return self.bounds is not None or is_number(self.values[0])

    @property
    def extremes(self) -> tuple[Value, ...]:
        """The values that a check has to look at."""
        return self.values if self.bounds is None else self.bounds


def is_number(value: object) -> bool:
    """Whether it is a number, and no switch."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def parse_vary(words: Iterable[str]) -> tuple[Vary, ...]:
    """What words NAME=a,b,c, NAME=lo:hi:count and NAME=lo:hi say; `with_kinds` says what they vary.

    Args:
        words: As typed behind `--vary`.

    Raises:
        BadInputError: A word is none, or two of them vary the same.
    """
    factors = tuple(map(_parsed, words))
    labels = [vary.label for vary in factors]
    for vary in factors:
        if labels.count(vary.label) > 1:
            raise BadInputError(f"{vary.label} is varied twice")
        if vary.place and vary.name in labels:
            raise BadInputError(f"{vary.name} and {vary.label} are both varied: name one of them")
    return factors


def with_kinds(
    factors: Iterable[Vary], options: Collection[str], parameters: Collection[str] = ()
) -> tuple[Vary, ...]:
    """The same factors, each with its kind.

    Args:
        factors: As parsed.
        options: Names that `Model.replace` takes on the backends of the sweep.
        parameters: Of the user's function.

    Raises:
        UnknownNameError: There is nothing of this name.
        BadInputError: What is typed is none for what it is.
    """
    return tuple(replace(vary, kind=_kind(vary, options, parameters)) for vary in factors)


def _parsed(word: str) -> Vary:
    label, sign, text = word.partition("=")
    match = _NAME.fullmatch(label.strip())
    if not (sign and match):
        raise BadInputError(
            "--vary wants NAME=a,b,c, NAME=from:to:count or, with --samples, NAME=from:to; got "
            f"{shown(word)}"
        )
    name, place = match[1], match[2] or ""
    if name == MODEL or ":" not in text:
        words = [each.strip() for each in text.split(",")]
        values, times = _values(label, words, name == MODEL)
        return Vary(name, place, values=values, times=times)
    *ends, count = text.split(":") if text.count(":") > 1 else (*text.split(":"), "")
    bounds, times = _values(label, ends)
    if not (
        len(bounds) == 2
        and all(map(is_number, bounds))
        and float(bounds[0]) < float(bounds[1])
        and (not count or (count.isdigit() and 2 <= int(count) <= _MOST))
    ):
        raise BadInputError(
            f"{label}={text} wants from:to or from:to:count, two numbers, the smaller number "
            f"first, with a count from 2 to {_MOST:,}"
        )
    low, high = map(float, bounds)
    if not count:
        return Vary(name, place, bounds=(low, high), times=times)
    grid = np.linspace(low, high, int(count))
    return Vary(name, place, values=tuple(float(f"{x:.{_DIGITS}g}") for x in grid), times=times)


def _kind(vary: Vary, options: Collection[str], parameters: Collection[str]) -> Kind:
    name = vary.name
    kind: Kind = "option"
    if name == MODEL or name in STATES:
        if (name == MODEL) == bool(vary.place):
            raise BadInputError(
                "model is varied as a whole: model=so101/scene,so101/scene_box"
                if vary.place
                else f"{name} is varied one coordinate at a time: {name}[JOINT]=…"
            )
        kind = MODEL if name == MODEL else "state"
    elif name in options and name in parameters:
        raise BadInputError(
            f"{name} is an option of the model and a parameter of the function: give the "
            "parameter another name"
        )
    elif name in parameters and not vary.place:
        kind = "parameter"
    elif name not in options:
        raise unknown_name("thing to vary", name, [*options, MODEL, *STATES, *parameters])
    if vary.times and kind != "option":
        raise BadInputError(f"{vary.label} has no value of the model's own: leave the x out")
    return kind


def _values(label: str, words: list[str], names: bool = False) -> tuple[tuple[Value, ...], bool]:
    """The values of words, and whether they are times the model's own."""
    if "" in words:
        raise BadInputError(f"--vary {label} has an empty value")
    pairs = [(word, False) if names else _value(word) for word in words]
    values = tuple(value for value, _ in pairs)
    if len({(type(value), times) for value, times in pairs}) > 1:
        raise BadInputError(
            f"{label} mixes values of different kinds: {', '.join(words)}; numbers, numbers with "
            "an x behind (times the model's own), on and off, or names"
        )
    if len(set(values)) < len(values):
        raise BadInputError(f"{label} has a value twice: {', '.join(words)}")
    return values, pairs[0][1]


def _value(word: str) -> tuple[Value, bool]:
    if word.lower() in _SWITCHES:
        return _SWITCHES[word.lower()], False
    times = word.endswith(_TIMES)
    try:
        number = float(word[:-1] if times else word)
    except ValueError:
        return word, False
    if not np.isfinite(number):
        raise BadInputError(f"{word} is no finite number")
    return number + 0.0, times  # no negative zero
