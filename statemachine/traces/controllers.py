"""A controller of the user's own, from a Python file."""

from __future__ import annotations

import difflib
import importlib.util
import sys
import traceback
from pathlib import Path
from typing import Any

from ..errors import BadInputError, StateMachineError
from ..interface import Data
from ..scenarios import Controller


def controller_from(spec: str) -> Controller:
    """The function that "FILE.py:NAME" says; without a name, `controller`.

    The file is run, as Python would run it. A mistake in it, then or later, becomes one
    line that says where.

    Raises:
        BadInputError: There is no such file or function, or the file fails.
    """
    file, colon, name = spec.rpartition(":")
    if not colon or name.endswith(".py") or "/" in name or "\\" in name:
        file, name = spec, "controller"
    path = Path(file)
    if path.suffix != ".py" or not path.is_file():
        raise _missing(path, spec)
    module_spec = importlib.util.spec_from_file_location(f"controller_{path.stem}", path)
    if module_spec is None or module_spec.loader is None:
        raise BadInputError(f"{path.name} cannot be loaded as Python")
    module = importlib.util.module_from_spec(module_spec)
    sys.modules[module_spec.name] = module  # dataclasses look themselves up there
    try:
        module_spec.loader.exec_module(module)
    except Exception as error:
        raise _failed(error, path) from error
    function = getattr(module, name, None)
    if not callable(function):
        raise BadInputError(f"{path.name} has no function {name}(time, data)")

    def controller(time: float, data: Data) -> Any:
        try:
            return function(time, data)
        except StateMachineError:
            raise
        except Exception as error:
            raise _failed(error, path, time) from error

    return controller


def _missing(path: Path, spec: str) -> BadInputError:
    if path.suffix != ".py":
        return BadInputError(f"a controller is given as FILE.py or FILE.py:NAME; got {spec!r}")
    beside = [f.name for f in path.parent.glob("*.py")] if path.parent.is_dir() else []
    close = difflib.get_close_matches(path.name, beside, n=1, cutoff=0.6)
    hint = f". Did you mean {close[0]}?" if close else ""
    return BadInputError(f"there is no controller file {path}{hint}")


def _failed(error: Exception, path: Path, time: float | None = None) -> BadInputError:
    """What went wrong in the file, and at which of its lines."""
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename) == path or Path(frame.filename).name == path.name
    ]
    if isinstance(error, SyntaxError):
        lines = [error.lineno]
    where = path.name + (f", line {lines[-1]}" if lines else "")
    when = "" if time is None else f", at {time:.3f} s"
    # A SyntaxError's text names file and line once more.
    said = error.msg if isinstance(error, SyntaxError) else str(error)
    return BadInputError(f"{where}{when}: {type(error).__name__}: {said}")
