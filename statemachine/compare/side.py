"""One side of a comparison, as it is typed: a file, an engine, its defaults, options."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from ..backends import backend_names, load
from ..errors import BadInputError, shown, unknown_name
from ..installed import DEFAULT
from ..interface import OPTIONS, Model
from ..models import resolve
from .labels import typed_option

_OPTION = re.compile(r"[A-Za-z_]+=\S*")
_LAST_OPTION = re.compile(rf"\s+({_OPTION.pattern})\s*$")
_ENGINE = re.compile(r"[\w-]+(:\w*)?")
_SWITCHES = {"on": True, "off": False, "true": True, "false": False}


@dataclass(frozen=True)
class Side:
    """What one side of a comparison is.

    Attributes:
        file: A name or a file, as `load` takes it.
        engine: The backend to run it on.
        defaults: "model", or "engine" for the engine as its own users meet it.
        options: As `Model.replace` takes them.
        menagerie: A menagerie folder to look the name up in.
    """

    file: str
    engine: str = DEFAULT
    defaults: Literal["model", "engine"] = "model"
    options: Mapping[str, Any] = field(default_factory=dict)
    menagerie: str | None = None

    @property
    def path(self) -> Path:
        """Its file; raises as `models.resolve` does."""
        return resolve(self.file, self.menagerie)

    @property
    def label(self) -> str:
        """As one types it, without folders: "so101@mujoco timestep=0.002"."""
        file = Path(self.file).name if Path(self.file).is_file() else self.file
        way = ":engine" if self.defaults == "engine" else ""
        options = (typed_option(name, value) for name, value in self.options.items())
        return " ".join([f"{file}@{self.engine}{way}", *options])

    def load(self, **options: Any) -> Model:
        """The Model; `options` are those of an experiment, over which its own win.

        Raises:
            StateMachineError: As `load` does.
        """
        return load(
            self.file,
            backend=self.engine,
            defaults=self.defaults,
            menagerie=self.menagerie,
            **{**options, **self.options},
        )


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
            raise BadInputError(f"{word} stands before any side: type FILE@ENGINE {word}")
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
    while not Path(word).exists() and (found := _LAST_OPTION.search(word)):
        texts.insert(0, found[1])
        word = word[: found.start()]
    return word.strip(), texts


def _side(word: str, menagerie: str | None) -> Side:
    file, engine, defaults = word, DEFAULT, "model"
    before, sign, after = word.rpartition("@")
    if sign and before and _ENGINE.fullmatch(after) and not Path(word).exists():
        file = before
        engine, colon, defaults = after.partition(":")
        if engine not in backend_names():
            raise unknown_name("engine", engine, backend_names())
        if colon and defaults != "engine":
            raise unknown_name(f"way to load a file on {engine}", defaults, ("engine",))
    elif not Path(word).exists():
        _refuse_mistyped(word)
    side = Side(file, engine, "engine" if defaults == "engine" else "model", {}, menagerie)
    side.path  # noqa: B018  (raises for what is no file)
    return side


def _refuse_mistyped(word: str) -> None:
    """Refuse a word of which it is plain what was meant.

    Raises:
        BadInputError: It reads as FILE@, FILE:ENGINE, FILE,FILE or the name of an option.
    """
    parts = word.split(",")
    if word.endswith("@") and len(word) > 1:
        raise BadInputError(f"{word} names no engine: type {word}{DEFAULT}, or {word[:-1]}")
    before, _, after = word.rpartition(":")
    if before and after in backend_names():
        raise BadInputError(f"an engine stands behind an @: type {before}@{after}")
    if len(parts) == 2 and all(parts) and not word.endswith(("/", "\\")):
        raise BadInputError(f"two sides are two words: type {' '.join(parts)}")
    if word in OPTIONS:
        raise BadInputError(f"{word} is an option of a side: type {word}=VALUE")


def _option(text: str) -> tuple[str, Any]:
    name, _, given = text.partition("=")
    if name not in OPTIONS:
        raise unknown_name("option", name, OPTIONS)
    if not given:
        raise BadInputError(f"{name}= has no value")
    if given.lower() in _SWITCHES:
        return name, _SWITCHES[given.lower()]
    if name == "integrator":
        return name, given
    try:
        numbers = [float(number) for number in given.split(",")]
    except ValueError:
        raise BadInputError(
            f"{name}={shown(given)[1:-1]} is no value: numbers, with commas between, or on or off"
        ) from None
    if len(numbers) > 1:
        return name, numbers
    number = numbers[0]
    return name, int(number) if name == "substeps" and number.is_integer() else number
