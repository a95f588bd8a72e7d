"""Sides as they are typed: words into what is run and what it is run on."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import NoReturn

from ...backends import BackendChoice, backend_names, parse_backend
from ...errors import BadInputError, StateMachineError, check_name, shown, unknown_name
from ...installed import DEFAULT, PAIR
from ...interface import OPTIONS
from ...interface.options import OptionValue
from ...interface.read_options import BASES
from ...interface.records import READ_OPTIONS
from ...measures.text import command
from ...models import SUFFIXES as MODELS
from ...typed_numbers import typed_float
from ..recordings.arm_recording import check_prefix
from ..runs.controllers import is_controller, is_policy
from ..runs.scenarios import SCENARIOS
from .sides import Side
from .what import is_trace

_OPTION = re.compile(r"[A-Za-z_]+=\S*")
_LAST_OPTION = re.compile(rf"\s+({_OPTION.pattern})\s*$")
_ENGINE = re.compile(r"[\w-]+(==[\w.]+)?(:\w*)?")
_SWITCHES = {"on": True, "off": False, "true": True, "false": False}


def parse_sides(words: Iterable[str], menagerie: str | None = None) -> list[Side]:
    """Return the sides of words: FILE, FILE@ENGINE, FILE@ENGINE:engine, with options behind.

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
            first, texts = _split_options(word)
            sides.append(_side(first, menagerie))
        if not sides:
            raise BadInputError(f"{word} stands before any side: type FILE {word}")
        options = dict(sides[-1].options)
        for text in texts:
            name, value = _option(text)
            if name in options:
                raise BadInputError(f"{name} is given twice for {sides[-1].model}")
            options[name] = value
        sides[-1] = replace(sides[-1], options=options)
    return sides


def _split_options(word: str) -> tuple[str, list[str]]:
    """Return a side's word and the options behind it; a file's name may have spaces."""
    texts: list[str] = []
    option = _LAST_OPTION.search(word)
    while option is not None and not Path(word).exists():
        texts.insert(0, option[1])
        word = word[: option.start()]
        option = _LAST_OPTION.search(word)
    return word.strip(), texts


def _side(word: str, menagerie: str | None) -> Side:
    model, backend = word, BackendChoice(DEFAULT)
    before, sign, after = word.rpartition("@")
    if sign and before and _ENGINE.fullmatch(after) and not Path(word).exists():
        model, backend = before, parse_backend(after)
    elif not Path(word).exists():
        _refuse_mistyped(word)
    side = Side(model, backend.name, backend.defaults, {}, menagerie)
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
    name, _, value = text.partition("=")
    check_name("option", name, (*OPTIONS, *READ_OPTIONS))
    if not value:
        raise BadInputError(f"{name}= has no value")
    if value.lower() in _SWITCHES:
        return name, _SWITCHES[value.lower()]
    if name == "integrator":
        return name, value
    if name == "base":
        check_name("base", value, BASES)
        return name, value
    try:
        numbers = [typed_float(number) for number in value.split(",")]
    except ValueError:
        raise BadInputError(
            f"{name}={shown(value)[1:-1]} is not a value: give numbers, with commas between, on or "
            "off"
        ) from None
    if len(numbers) > 1:
        return name, numbers
    number = numbers[0]
    return name, int(number) if name == "substeps" and number.is_integer() else number


def split_words(
    words: Sequence[str], menagerie: str | None = None
) -> tuple[tuple[str, ...], tuple[Side, ...]]:
    """Return what is to be run, and the sides: two or more, or one of a model without an engine, or
    none.

    Args:
        words: As typed behind `compare`, at least one.
        menagerie: A menagerie folder to look names up in.

    Raises:
        BadInputError: Sides without an experiment, or one side of an engine, or a recording of a
            real arm without its prefix.
        StateMachineError: As `parse_sides` does.
    """
    size = len(list(takewhile(is_trace, words)))
    if size == 0:
        size = 1
    what, rest = tuple(words[:size]), words[size:]
    is_run = what[0] in SCENARIOS or is_trace(what[0]) or is_controller(what[0])
    is_side = not is_run and _is_side(what[0], menagerie)
    for word in rest:
        if is_trace(word):
            raise BadInputError(f"{word} is a recorded run: type statemachine compare {word} FILE")
    if not (is_run or is_side):
        check_prefix(what[0])
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
    run, models = ["hold", *words], [*words]
    if len(sides) == 1:
        models.append(_on_other_engine(sides[0]))
        if not _is_model_alone(words, sides):
            run.append(_on_other_engine(sides[0]))
    typed = command(["statemachine", "compare", *run])
    named = command(word for word in models if not _OPTION.fullmatch(word))
    raise BadInputError(
        f"compare what? {typed} runs an experiment ({', '.join(SCENARIOS)}) or "
        f"FILE.py:FUNCTION or POLICY.onnx; statemachine compare --models {named} lists what the "
        "files differ in"
    )


def _check_number_of_sides(
    what: Sequence[str], words: Sequence[str], sides: Sequence[Side]
) -> None:
    """Check that there are sides, or a model for all engines, or none where none is needed.

    Args:
        what: What is to be run.
        words: Those of the sides, as typed.
        sides: What these say.

    Raises:
        BadInputError: There are too few, or traces have sides of their own.
    """
    is_model_alone = _is_model_alone(words, sides)
    if len(what) > 1 and sides and not is_model_alone:
        raise BadInputError("two traces have their own sides; a model is one FILE")
    if len(sides) == 1 and not is_model_alone:
        typed = command(["statemachine", "compare", what[0], *words, _on_other_engine(sides[0])])
        raise BadInputError(f"one side only: name the other, as in: {typed}")
    if not sides and is_controller(what[0]):
        typed = command(["statemachine", "compare", what[0], *words])
        model = "ROBOT.xml" if is_policy(what[0]) else "so101"
        raise BadInputError(f"{what[0]} runs on a model, as in: {typed} {model}")


def _is_model_alone(words: Sequence[str], sides: Sequence[Side]) -> bool:
    """Tell whether the only side is a model without an engine, for all engines."""
    return len(sides) == 1 and sides[0].model == _split_options(words[0])[0]


def _on_other_engine(side: Side) -> str:
    """Return what to type for the file of a side on the last engine of the pair that is not its."""
    other = next(name for name in reversed(PAIR) if name != side.engine)
    return f"{side.model}@{other}"


def _names_file(word: str) -> bool:
    """Tell whether a word names a model's file, by its suffix."""
    return Path(word.split("@", maxsplit=1)[0]).suffix.lower() in MODELS


def _is_side(word: str, menagerie: str | None) -> bool:
    """Tell whether a word is meant as a side: it names a model, or reads as if it did."""
    if _names_file(word):
        return True
    try:
        return bool(parse_sides([word], menagerie))
    except StateMachineError:
        return False
