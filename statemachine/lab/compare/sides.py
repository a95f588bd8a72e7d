"""What to compare, as it was asked for: what is run, and the sides that it is run on.

A side is a file, an engine, its defaults, and options.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Literal, NoReturn

import numpy as np

from ...backends import BackendChoice, backend_names, load_to_run, parse_backend
from ...engines import room
from ...errors import BadInputError, StateMachineError, check_name, shown, unknown_name
from ...installed import DEFAULT, PAIR
from ...interface import OPTIONS, Model
from ...interface.checks import as_count
from ...interface.options import OptionValue
from ...interface.records import READ_OPTIONS
from ...measures.text import command, listed
from ...models import SUFFIXES as MODELS
from ...models import resolve
from ...typed_numbers import typed_float
from ..recordings.files import SUFFIXES
from ..runs.controllers import function_scenario, is_function
from ..runs.scenarios import SCENARIOS, Scenario, scenario
from .labels import typed_option
from .matching import match_models

_OPTION = re.compile(r"[A-Za-z_]+=\S*")
_LAST_OPTION = re.compile(rf"\s+({_OPTION.pattern})\s*$")
_ENGINE = re.compile(r"[\w-]+(==[\w.]+)?(:\w*)?")
_SWITCHES = {"on": True, "off": False, "true": True, "false": False}


@dataclass(frozen=True)
class Side:
    """What one side of a comparison is.

    Attributes:
        file: A name or a file, as `load` takes it.
        engine: The backend to run it on.
        defaults: "model", or "engine" for the engine as its own users meet it.
        options: As `load` takes them: those of `Model.replace`, balance_inertia, meshes.
        menagerie: A menagerie folder to look the name up in.
        taken: Parts of another side's file that stand in place of its own.
    """

    file: str
    engine: str = DEFAULT
    defaults: Literal["model", "engine"] = "model"
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    menagerie: str | None = None
    taken: TakenParts | None = None

    def chosen_backend(self) -> BackendChoice:
        """Return the engine and its defaults, as one types them behind --backend."""
        return BackendChoice(self.engine, self.defaults)

    @property
    def path(self) -> Path:
        """Its file; raises as `models.resolve` does."""
        return resolve(self.file, self.menagerie)

    @property
    def label(self) -> str:
        """As one types it, without folders: "so101@mujoco timestep=0.002"."""
        options = (typed_option(name, value) for name, value in self.options.items())
        return " ".join([f"{_typed(self.file)}@{self.chosen_backend()}", *options])

    def load(self, **options: OptionValue) -> Model:
        """The Model; `options` are those of an experiment, over which its own win.

        Raises:
            StateMachineError: As `load` does.
        """
        options |= self.options
        load_it = partial(self.chosen_backend().load_to_run, self.file, menagerie=self.menagerie)
        if self.taken is None:
            return load_it(**options)
        read = {name: options[name] for name in READ_OPTIONS if name in options}
        model = self.taken.given_to(load_it(**read))
        return model.replace(**options) if options else model

    def taking(self, parts: Sequence[str], of: Side, names: Mapping[str, str]) -> Side:
        """Itself with some parts of another side's file; `names` as of `TakenParts`."""
        return replace(self, taken=TakenParts(tuple(parts), of, names)) if parts else self


@dataclass(frozen=True)
class TakenParts:
    """Parts of a file that another file gets instead of its own.

    Attributes:
        parts: "actuators", "floor": the planes that are fixed to the world.
        of: The side whose file has them.
        names: Joints, bodies and sites of `of` that go by other names in the file that gets them.
    """

    parts: tuple[str, ...]
    of: Side
    names: Mapping[str, str] = field(default_factory=dict)

    def given_to(self, model: Model) -> Model:
        """A Model of the same engine and file that has them.

        Raises:
            StateMachineError: It cannot be made.
        """
        giver = load_to_run(self.of.file, menagerie=self.of.menagerie)
        matched = match_models(giver, model, self.names)
        names = {
            "joint": _renamed(giver.joint_names, model.joint_names, matched.joints),
            "body": _renamed(giver.body_names, model.body_names, matched.bodies),
            "site": _renamed(giver.site_names, model.site_names, matched.sites),
        }
        return model.with_compiled(
            room(DEFAULT).with_parts(model.path, giver.path, self.parts, names, model.read_options)
        )


def _renamed(
    names: Sequence[str], others: Sequence[str], pairs: Iterable[tuple[int, int]]
) -> dict[str, str]:
    """Return by what other name each thing goes that has a counterpart."""
    return {names[here]: others[there] for here, there in pairs}


def with_options(
    sides: Sequence[Side], options: Mapping[str, OptionValue]
) -> tuple[list[Side], dict[str, OptionValue]]:
    """Sides with what only they are given, and the options that both have.

    Args:
        sides: Two.
        options: Of what is run; those of a side win.
    """
    left, right = ({**options, **side.options} for side in sides)
    both = {
        name: left[name]
        for name in left
        if name in right and np.array_equal(left[name], right[name])
    }
    return [_without(sides[0], left, both), _without(sides[1], right, both)], both


def _without(
    side: Side, options: Mapping[str, OptionValue], common: Mapping[str, OptionValue]
) -> Side:
    """Return a side with those of some options that are not among the common ones."""
    own = {name: value for name, value in options.items() if name not in common}
    return replace(side, options=own)


def parse_sides(words: Iterable[str], menagerie: str | None = None) -> list[Side]:
    """Sides from words: FILE, FILE@ENGINE, FILE@ENGINE:engine, each with options behind it.

    An option, such as timestep=0.002, stands in the word of its side or in one of its own
    after it.

    Args:
        words: As typed.
        menagerie: A menagerie folder to look names up in.

    Raises:
        UnknownNameError: No such model, engine or option.
        ModelFileError: A file is not there.
        BadInputError: An option stands before any side, or has no value.
    """
    sides: list[Side] = []
    for word in words:
        texts = [word]
        if Path(word).exists() or not _OPTION.fullmatch(word):
            name, texts = _split_options(word)
            sides.append(_side(name, menagerie))
        if not sides:
            raise BadInputError(f"{word} stands before any side: type FILE {word}")
        options = dict(sides[-1].options)
        for text in texts:
            name, value = _option(text)
            if name in options:
                raise BadInputError(f"{name} is given twice for {sides[-1].file}")
            options[name] = value
        sides[-1] = replace(sides[-1], options=options)
    return sides


def _split_options(word: str) -> tuple[str, list[str]]:
    """A side's word, and the options behind it; a file's name may have spaces."""
    texts: list[str] = []
    option = _LAST_OPTION.search(word)
    while option is not None and not Path(word).exists():
        texts.insert(0, option[1])
        word = word[: option.start()]
        option = _LAST_OPTION.search(word)
    return word.strip(), texts


def _side(word: str, menagerie: str | None) -> Side:
    file, backend = word, BackendChoice(DEFAULT)
    before, sign, after = word.rpartition("@")
    if sign and before and _ENGINE.fullmatch(after) and not Path(word).exists():
        file, backend = before, parse_backend(after)
    elif not Path(word).exists():
        _refuse_mistyped(word)
    side = Side(file, backend.name, backend.defaults, {}, menagerie)
    side.path  # noqa: B018  (raises for what is not a file)
    return side


def _refuse_mistyped(word: str) -> None:
    """Refuse a word of which it is plain what was meant.

    Raises:
        BadInputError: It reads as FILE@, FILE:ENGINE, FILE,FILE or the name of an option.
    """
    if word.endswith("@") and len(word) > 1:
        raise BadInputError(f"{word} names no engine: type {word}{DEFAULT}, or {word[:-1]}")
    before, _, after = word.rpartition(":")
    if before and after in backend_names():
        raise BadInputError(f"an engine stands behind an @: type {before}@{after}")
    parts = word.split(",")
    if len(parts) == 2 and all(parts) and not word.endswith(("/", "\\")):
        raise BadInputError(f"two sides are two words: type {' '.join(parts)}")
    if word in (*OPTIONS, *READ_OPTIONS):
        raise BadInputError(f"{word} is an option of a side: type {word}=VALUE")


def _option(text: str) -> tuple[str, OptionValue]:
    """Return the name and the value of an option, as typed.

    Raises:
        UnknownNameError: There is no such option.
        BadInputError: It has no value, or an invalid one.
    """
    name, _, given = text.partition("=")
    check_name("option", name, (*OPTIONS, *READ_OPTIONS))
    if not given:
        raise BadInputError(f"{name}= has no value")
    if given.lower() in _SWITCHES:
        return name, _SWITCHES[given.lower()]
    if name == "integrator":
        return name, given
    try:
        numbers = [typed_float(number) for number in given.split(",")]
    except ValueError:
        raise BadInputError(
            f"{name}={shown(given)[1:-1]} is not a value: give numbers, with commas between, on or "
            "off"
        ) from None
    if len(numbers) > 1:
        return name, numbers
    number = numbers[0]
    return name, int(number) if name == "substeps" and number.is_integer() else number


@dataclass(frozen=True)
class Request:
    """What to compare.

    Attributes:
        what: Name of an experiment, FILE.py:FUNCTION, or one or two files of traces.
        backends: The two backends, as `parse_backend` reads them; of one trace the one that is
            not its own is taken.
        model: Instead of the experiment's own, or a trace's.
        menagerie: Where its name is looked up.
        seconds: Instead of the experiment's own time [s].
        seed: Of an experiment that draws something.
        options: For `Model.replace`, on both sides.
        sides: The two sides, instead of backends and model; empty for those.
        names: Joints, bodies, sites and actuators of the left that go by other names on the
            right.
        every: Steps for which what a FUNCTION returns holds.
        keyframe: Where it starts; None for the experiment's own, and a FUNCTION's default state.
    """

    what: Sequence[str]
    backends: tuple[str, str] = PAIR
    model: str | None = None
    menagerie: str | None = None
    seconds: float | None = None
    seed: int = 0
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    sides: tuple[Side, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    every: int = 1
    keyframe: str | None = None

    def __post_init__(self) -> None:
        if len(self.backends) != 2:
            raise BadInputError(f"two backends are compared; got {shown(self.backends)}")
        as_count(self.every, "every")

    @property
    def is_traces(self) -> bool:
        """Whether files were named, not an experiment."""
        return any(is_trace(word) for word in self.what)

    @property
    def words(self) -> list[str]:
        """What is run, and the model if one is said, as one types them, without folders."""
        words = [Path(word).name for word in self.what]
        if self.model:
            words.append(_typed(self.model))
        return words

    @property
    def taken(self) -> tuple[str, ...]:
        """A line for each side that has parts of the other's file."""
        others = (("left", "right"), ("right", "left"))
        return tuple(
            f"the {here} has the {listed(side.taken.parts)} of the {there}, not its own"
            for side, (here, there) in zip(self.sides, others, strict=False)
            if side.taken
        )

    def both_sides(self, model: str) -> Sequence[Side]:
        """The two sides; where none were said, one model on the two backends.

        Args:
            model: The experiment's own, where none was said either.
        """
        if self.sides:
            return self.sides
        backends = [parse_backend(word) for word in self.backends]
        return [
            Side(self.model or model, backend.name, backend.defaults, {}, self.menagerie)
            for backend in backends
        ]

    def scenario(self) -> Scenario:
        """What is run: an experiment of ours, or the function of the user's.

        Raises:
            UnknownNameError: There is no such experiment.
            BadInputError: There is no such function, or its file fails; or two things are named.
        """
        if len(self.what) != 1:
            raise BadInputError(
                "compare takes one experiment: it runs on both engines; two traces are files"
            )
        (what,) = self.what
        if not is_function(what):
            known = scenario(what)
            return replace(known, keyframe=self.keyframe or known.keyframe)
        return function_scenario(what, self.every, self.keyframe)


def _typed(file: str) -> str:
    """A model as one types it, without folders."""
    return Path(file).name if Path(file).is_file() else file


def is_trace(word: str) -> bool:
    """Whether a word names a trace, by its suffix."""
    return Path(word).suffix.lower() in SUFFIXES


def split_words(
    words: Sequence[str], menagerie: str | None = None
) -> tuple[tuple[str, ...], tuple[Side, ...]]:
    """What is to be run, and the sides: two, or one of a model without an engine, or none.

    Args:
        words: As typed behind `compare`, at least one.
        menagerie: A menagerie folder to look names up in.

    Raises:
        BadInputError: Sides without an experiment, one side of an engine, or more than two.
        StateMachineError: As `parse_sides` does.
    """
    size = len(list(takewhile(is_trace, words)))
    if size == 0:
        size = 1
    what, rest = tuple(words[:size]), words[size:]
    is_run = what[0] in SCENARIOS or is_trace(what[0]) or is_function(what[0])
    is_side = not is_run and _is_side(what[0], menagerie)
    for word in rest:
        if is_trace(word):
            raise BadInputError(f"{word} is a recorded run: type statemachine compare {word} FILE")
    if rest and not (is_run or is_side):
        raise unknown_name("experiment", what[0], SCENARIOS)
    if any(word in SCENARIOS for word in rest) or not (is_run or is_side):
        return tuple(words), ()  # nothing that can be compared
    if is_side:
        _refuse_sides_alone(words, parse_sides(words, menagerie))
    sides = parse_sides(rest, menagerie)
    _check_number_of_sides(what, rest, sides)
    return what, tuple(sides)


def _refuse_sides_alone(words: Sequence[str], sides: Sequence[Side]) -> NoReturn:
    """Refuse sides without anything to run on them, and say what can be typed.

    Raises:
        BadInputError: Always.
    """
    run, files = ["hold", *words], [*words]
    if len(sides) == 1:
        files.append(_on_other_engine(sides[0]))
        if not _is_model_alone(words, sides):
            run.append(_on_other_engine(sides[0]))
    typed = command(["statemachine", "compare", *run])
    named = command(word for word in files if not _OPTION.fullmatch(word))
    raise BadInputError(
        f"compare what? {typed} runs an experiment ({', '.join(SCENARIOS)}) or "
        f"FILE.py:FUNCTION; statemachine compare --models {named} lists what the files differ in"
    )


def _check_number_of_sides(
    what: Sequence[str], words: Sequence[str], sides: Sequence[Side]
) -> None:
    """Check that there are two sides, or a model for both engines, or none where none is needed.

    Args:
        what: What is to be run.
        words: Those of the sides, as typed.
        sides: What these say.

    Raises:
        BadInputError: There are too many, or too few.
    """
    alone = _is_model_alone(words, sides)
    if len(what) > 1 and sides and not alone:
        raise BadInputError("two traces have their own sides; a model is one FILE")
    if len(sides) > 2:
        labels = listed([side.label for side in sides])
        raise BadInputError(f"{len(sides)} sides, {labels}: compare takes two")
    if len(sides) == 1 and not alone:
        typed = command(["statemachine", "compare", what[0], *words, _on_other_engine(sides[0])])
        raise BadInputError(f"one side only: name the other, as in: {typed}")
    if not sides and is_function(what[0]):
        typed = command(["statemachine", "compare", what[0], *words])
        raise BadInputError(f"{what[0]} runs on a model, as in: {typed} so101")


def _is_model_alone(words: Sequence[str], sides: Sequence[Side]) -> bool:
    """Tell whether the only side is a model without an engine, for both engines."""
    return len(sides) == 1 and sides[0].file == _split_options(words[0])[0]


def _on_other_engine(side: Side) -> str:
    """Return what to type for the file of a side on the last engine of the pair that is not its."""
    other = next(name for name in reversed(PAIR) if name != side.engine)
    return f"{side.file}@{other}"


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
