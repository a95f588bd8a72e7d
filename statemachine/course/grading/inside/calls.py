"""Load a student's file and call a function of it; what goes wrong is one line about that file."""

from __future__ import annotations

import codecs
import importlib.util
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....engines import raw_engine_of
from ....errors import UnsupportedError
from ....interface import Model
from ....lab.runs.user_files import error_text, last_user_line, load_module, signature_mismatch
from ....measures.text import count
from .answers import answer_of, encode
from .error_hints import hint_of
from .watch import engine_watched, watching
from .worlds import FUNCTIONS, AnyWorld

Function = Callable[..., Any]
_MODULE = "the_students_file"


class FaultError(Exception):
    """A fault after which there is nothing more to look at; the text is the remark.

    Attributes:
        written: False if the function is still to be written.
    """

    def __init__(self, text: str, is_written: bool = True) -> None:
        super().__init__(text)
        self.written = is_written


def load_file(path: Path) -> dict[str, Any]:
    """Return the names that a student's file defines.

    Raises:
        FaultError: It does not compile, ends with an error, or has none of the functions.
    """
    content = path.read_bytes()
    try:
        importlib.util.decode_source(content)  # which compiling bytes does not ask of comments
    except (UnicodeDecodeError, SyntaxError):
        if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            raise FaultError(
                "the file cannot be loaded: it is saved as UTF-16, and Python refuses the file. "
                "Save it as UTF-8"
            ) from None
        lines = enumerate(content.split(b"\n"), start=1)
        line = next((k for k, text in lines if text.decode(errors="ignore").encode() != text), 1)
        raise FaultError(
            f"the file cannot be loaded: line {line}: this is not UTF-8, and Python refuses the "
            "file. Save it as UTF-8"
        ) from None
    if not content.strip():
        raise FaultError("the file is empty")
    try:
        names = vars(load_module(_MODULE, path))
    except SystemExit as error:
        raise FaultError(
            f"the file cannot be loaded: {_remark(error, path)}. What runs the program belongs "
            'below `if __name__ == "__main__":`'
        ) from error
    except BaseException as error:
        raise FaultError(f"the file cannot be loaded: {_remark(error, path)}") from error
    if names.keys().isdisjoint(FUNCTIONS):
        raise FaultError(f"the file has none of the functions {', '.join(FUNCTIONS)}")
    return names


def find(names: dict[str, Any], name: str, arguments: Sequence[Any]) -> Function:
    """Return a function of the file that takes a model and these arguments.

    Raises:
        FaultError: There is none, or it takes others.
    """
    function: Any = names.get(name)
    if function is None:
        raise FaultError(f"the file has no function {name}")
    if not callable(function):
        raise FaultError(f"{name} is not a function: {type(function).__name__}")
    takes, why = signature_mismatch(function, None, *arguments)
    if takes:
        raise FaultError(
            f"it is called with a model and {count(len(arguments), 'argument')} more, and takes "
            f"{takes}: {why}"
        )
    return function


def answers_of_file(
    path: Path, name: str, worlds: Sequence[AnyWorld]
) -> Iterator[Any | FaultError]:
    """Yield what comes of a function of a file, which is loaded here, on world after world.

    Args:
        path: The student's file, absolute.
        name: Of the function.
        worlds: The first is the course's own.
    """
    try:
        with engine_watched(worlds[0].model.backend):
            yield from answers_of(find(load_file(path), name, worlds[0].arguments), worlds)
    except FaultError as fault:  # nobody is watched while whoever asked has the fault
        yield fault


def answers_of(function: Function, worlds: Sequence[AnyWorld]) -> Iterator[Any | FaultError]:
    """Yield what comes of a function on each world, as `encode` has it, until it fails on one."""
    try:
        for world in worlds:
            yield call(function, world)
    except FaultError as fault:
        yield fault


def call(function: Function, world: AnyWorld) -> Any:
    """Return what came of a function on a world, as `answers.encode` has it.

    Raises:
        FaultError: It raised, tried to end the program, is not written, or returned nothing.
    """
    file = Path(getattr(getattr(function, "__code__", None), "co_filename", ""))
    arguments = [
        np.array(value) if isinstance(value, np.ndarray) else value for value in world.arguments
    ]
    settings = raw_engine_of(
        world.model.backend
    ).settings  # what of the engine's own model is reached
    before = settings(world.model.raw)
    try:
        with watching(world.model, world.nudge) as watch:
            result = function(world.model, *arguments)
            now = settings(world.model.raw)
            changed = {name: (old, now[name]) for name, old in before.items() if old != now[name]}
            answer = encode(answer_of(result, watch, changed))
    except BaseException as error:
        if isinstance(error, NotImplementedError) and not isinstance(error, UnsupportedError):
            raise FaultError(f"not written yet. {error}".strip(), is_written=False) from None
        raise FaultError(_remark(error, file, world.model)) from error
    if result is None:
        raise FaultError("it returns nothing: print shows a result, `return` hands it over")
    return answer


def _remark(error: BaseException, file: Path, model: Model | None = None) -> str:
    """Return an error in one line, with the line of the file, or of one beside it, it came from.

    Args:
        error: That the file or a function of it raised.
        file: The student's.
        model: What the function got; None where the file is only loaded.
    """
    place, line, code = last_user_line(error, file)
    text = ""
    if model is not None:
        text = hint_of(error, code, model)
    if not text:
        text = error_text(error)
    if line:
        text = f"line {line}: {text}"
        if place != file:
            text = f"{place.name}, {text}"
    if code:
        text += f" (in `{code}`)"
    return text
