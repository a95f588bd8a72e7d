"""What to compare, as it was asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from ..errors import BadInputError, StateMachineError, unknown_name
from ..installed import PAIR
from ..measures.text import command, listed
from ..models import SUFFIXES as MODELS
from ..runs.controllers import function_scenario, is_function
from ..runs.files import SUFFIXES
from ..runs.scenarios import SCENARIOS, Scenario, scenario
from .side import Side, parse_sides


@dataclass(frozen=True)
class Request:
    """What to compare.

    Attributes:
        what: Name of an experiment, FILE.py:FUNCTION, or one or two files of traces.
        backends: The two engines; of one trace the second that is not its own.
        defaults: What `load` is given.
        model: Instead of the experiment's own; menagerie: where its name is looked up.
        seconds: Instead of the experiment's own time [s].
        seed: Of an experiment that draws something.
        options: For `Model.replace`, on both sides.
        sides: The two sides, instead of backends, defaults and model; empty for those.
        names: Joints, bodies, sites and actuators of the left that go by other names on the
            right.
        every: Steps for which what a FUNCTION returns holds.
        keyframe: Where a FUNCTION starts; None for the default state.
    """

    what: Sequence[str]
    backends: tuple[str, str] = PAIR
    defaults: Literal["model", "engine"] = "model"
    model: str | None = None
    menagerie: str | None = None
    seconds: float | None = None
    seed: int = 0
    options: dict[str, Any] = field(default_factory=dict)
    sides: tuple[Side, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    every: int = 1
    keyframe: str | None = None

    @property
    def is_traces(self) -> bool:
        """Whether files were named, not an experiment."""
        return any(map(is_trace, self.what))

    @property
    def plain(self) -> bool:
        """Whether it is what the recorded traces of the package are of."""
        return (
            self.model is None
            and self.menagerie is None
            and self.seconds is None
            and self.seed == 0
            and not self.options
        )

    def typed(self, backend: str) -> str:
        """The command that records one side."""
        return command(
            ["statemachine", "trace", "record", *self.what, "--backend", backend],
            ("--defaults", self.defaults, "model"),
            ("--model", self.model, None),
            ("--menagerie", self.menagerie and "DIR", None),
            ("--seconds", self.seconds, None),
            ("--seed", self.seed, 0),
            ("--timestep", self.options.get("timestep"), None),
        )

    def scenario(self) -> Scenario:
        """What is run: an experiment of ours, or the function of the user's.

        Raises:
            UnknownNameError: There is no such experiment.
            BadInputError: There is no such function, or its file fails.
        """
        (what,) = self.what
        if not is_function(what):
            return scenario(what)
        return function_scenario(what, self.every, self.keyframe)


def is_trace(word: str) -> bool:
    """Whether a word names a trace, by its suffix."""
    return Path(word).suffix.lower() in SUFFIXES


def split_words(
    words: Sequence[str], menagerie: str | None = None
) -> tuple[tuple[str, ...], tuple[Side, ...]]:
    """What is to be run, and the two sides; no sides where only the first was said.

    Args:
        words: As typed behind `compare`.
        menagerie: A menagerie folder to look names up in.

    Raises:
        BadInputError: Sides without an experiment, one side, or more than two.
        StateMachineError: As `parse_sides` does.
    """
    what, rest = tuple(words[:1]), words[1:]
    _check_rest(what, rest, menagerie)
    if not what or any(word in SCENARIOS or is_trace(word) for word in rest):
        return tuple(words), ()  # two traces, or nothing that can be compared
    if not (what[0] in SCENARIOS or is_trace(what[0]) or is_function(what[0])):
        if _is_side(what[0], menagerie):
            raise _no_experiment(words)
        return tuple(words), ()
    sides = tuple(parse_sides(rest, menagerie))
    if len(sides) == 2 or not (sides or is_function(what[0])):
        return what, sides
    typed = f"statemachine compare {what[0]} {sides[0].label if sides else 'so101@mujoco'}"
    if len(sides) > 2:
        raise BadInputError(
            f"{len(sides)} sides, {listed([side.label for side in sides])}: compare takes two"
        )
    said = "one side only: name the other" if sides else f"{what[0]} runs on two sides"
    raise BadInputError(f"{said}, as in: {typed} {_another(sides)}")


def _check_rest(what: Sequence[str], rest: Sequence[str], menagerie: str | None) -> None:
    """Refuse a trace among sides, and an experiment that there is not before them."""
    sides = [word for word in rest if _is_file(word)]
    traces = [word for word in rest if is_trace(word)]
    if sides and traces:
        raise BadInputError(
            f"{traces[0]} is a recorded run, not a side; it is played on two sides as in: "
            f"statemachine compare {traces[0]} {sides[0]} {_another([Side(sides[0])])}"
        )
    known = what and (what[0] in SCENARIOS or is_trace(what[0]) or is_function(what[0]))
    if sides and not known and not _is_side(what[0], menagerie):
        raise unknown_name("experiment", what[0], SCENARIOS)


def _is_file(word: str) -> bool:
    """Whether a word names a model's file, by its suffix."""
    return Path(word.split("@", maxsplit=1)[0]).suffix.lower() in MODELS


def _is_side(word: str, menagerie: str | None) -> bool:
    """Whether a word is meant as a side: it names a model, or reads as if it did."""
    if _is_file(word):
        return True
    try:
        return bool(parse_sides([word], menagerie))
    except StateMachineError:
        return False


def _no_experiment(words: Sequence[str]) -> BadInputError:
    typed = " ".join(f"'{word}'" if " " in word else word for word in words)
    files = " ".join(word for word in words if "=" not in word)
    return BadInputError(
        f"two sides need something to do first: statemachine compare hold {typed} runs an "
        f"experiment ({', '.join(SCENARIOS)}) or FILE.py:FUNCTION on both; "
        f"statemachine compare --models {files} lists what the files differ in"
    )


def _another(sides: Sequence[Side]) -> str:
    """An example of the side that is missing."""
    if not sides:
        return "so101@pybullet"
    side = sides[0]
    other = next(name for name in reversed(PAIR) if name != side.engine)
    return f"{Path(side.file).name}@{other}"
